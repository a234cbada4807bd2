use super::*;
use std::f64::consts::{FRAC_PI_2, PI};
use v2x_common::class::Class;
use v2x_common::time::Span;

fn traffic(text: &str) -> Traffic {
    read(text.as_bytes(), &ReadOptions::default()).unwrap()
}

fn refusal(text: &str) -> String {
    read(text.as_bytes(), &ReadOptions::default()).unwrap_err().to_string()
}

fn object<'a>(traffic: &'a Traffic, name: &str) -> &'a RecordedObject {
    &traffic.objects[traffic.object_index(name).unwrap()]
}

fn assert_near(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-6, "{found} is not {expected}");
}

const TWO: &str = "t,id,class,x,y,yaw\n0,a,car,0,0,0\n1,a,car,10,0,0\n";

#[test]
fn a_row_in_any_order_of_columns_is_a_place_of_an_object() {
    let text = "speed,yaw,y,x,class,id,t,w,d\n9,0.5,2,1,Pedestrian,p 1,10.5,0.8,0.9\n9,0.5,2,3,Pedestrian,p 1,11,0.8,0.9\n";
    let traffic = traffic(text);
    let RecordedObject { name, class, w, d, trajectory } = &traffic.objects[0];
    assert_eq!((name.as_str(), *class, *w, *d), ("p 1", Class::Adult, 0.8, 0.9));
    assert_eq!(trajectory.at(Span::ZERO).unwrap().velocity, (4.0, 0.0));
    assert_eq!(
        (traffic.format, traffic.first_s, traffic.length),
        (Format::Csv, 10.5, Span::from_millis(500))
    );
    assert_eq!(traffic.remarks.notes, ["columns that are not used: speed"]);
}

#[test]
fn a_direction_whose_convention_is_open_is_told_the_names_that_say_it() {
    let traffic = traffic("t,id,class,x,y,Heading\n0,a,car,0,0,90\n1,a,car,10,0,90\n");
    let note = &traffic.remarks.notes[0];
    assert!(note.starts_with("columns that are not used: Heading. For Heading to be read"), "{note}");
    for name in ["yaw (radians)", "yaw_deg (degrees)", "heading_deg (degrees, clockwise from north)"] {
        assert!(note.contains(name), "{note}");
    }
}

#[test]
fn byte_order_marks_carriage_returns_semicolons_quotes_and_decimal_commas_are_read() {
    for text in [
        TWO.replace('\n', "\r\n"),
        format!("\u{feff}{TWO}"),
        TWO.replace(',', "\t"),
        TWO.replace("a,car", "\"a\",\"car\""),
        TWO.replace(',', " ; "),
        TWO.replace('\n', ",\n"),
        "t;id;class;x;y;yaw\n0,0;a;car;0,0;0;0\n1;a;car;10,0;0;0\n".to_owned(),
        format!("{TWO}\n"),
    ] {
        let found = traffic(&text);
        assert_eq!(found.objects, traffic(TWO).objects, "{text:?}");
    }
}

#[test]
fn text_in_another_encoding_is_refused_once_with_what_to_save_it_as() {
    let latin = TWO.replace("car", "Fu\u{df}g\u{e4}nger").chars().map(|c| c as u8).collect::<Vec<_>>();
    let words = read(&latin[..], &ReadOptions::default()).unwrap_err().to_string();
    assert!(words.contains("no text in UTF-8") && words.contains("save it as UTF-8"), "{words}");
    assert!(!words.contains("CSV parse error"), "the cause says that: {words}");
}

#[test]
fn every_mistake_names_its_line_and_column() {
    let cases = [
        ("", "is empty"),
        ("  \n", "is empty"),
        ("t,id,class,x,y\n", "has no rows"),
        ("t,id,class,x,y\n0,a,car,1,1\n", "one time only"),
        (
            "t,id,x\n",
            "line 1: no column class, y; needed are t, id, class, x, y (optional yaw, w, d); found are t, id, x",
        ),
        (&TWO.replace("10,0,0", "NaN,0,0"), "line 3, column x: \"NaN\", expected a coordinate in m"),
        (&TWO.replace("10,0,0", "inf,0,0"), "line 3, column x: \"inf\""),
        (&TWO.replace("1,a,car", "soon,a,car"), "line 3, column t: \"soon\", expected a time in s"),
        (&TWO.replace("0,a,car", "soon,a,car").replace('\n', "\r\n"), "line 2, column t: \"soon\""),
        (&TWO.replace("0,a,car", "\n\nsoon,a,car"), "line 4, column t: \"soon\""),
        (&format!("\n\n{}", TWO.replace("class", "clas")), "line 3: no column class"),
        (&TWO.replace("class", "clas"), "Is clas the column class?"),
        (&TWO.replace("t,id", "Timestamp,id"), "Name the column Timestamp t_s where it is in seconds"),
        (&TWO.replace("t,id", "frame,id"), "Numbers of frames are no times: write a column t in seconds"),
        (
            &TWO.replace("x,y", "lon,Lat"),
            "lon and Lat are degrees, and x and y are metres: write metres, x east",
        ),
        (
            &TWO.replace("1,a,car", "1700000000000,a,car"),
            "column t: \"1700000000000\", expected a time in s (a column t_ms",
        ),
        (&TWO.replace("1,a,car", "1,,car"), "line 3, column id: \"\", expected an id"),
        (&TWO.replace("1,a,car", "1,a,"), "line 3, column class: \"\", expected a class such as car"),
        (
            &TWO.replace("10,0,0", "10,0,east"),
            "line 3, column yaw: \"east\", expected an angle in rad, or nothing",
        ),
        (&TWO.replace("10,0,0", "10,0,0,7"), "line 3: 7 cells under 6 columns"),
        (&TWO.replace("1,a,car", "0,a,car"), "lines 2 and 3: object a has two rows at 0 s"),
        (
            "t,id,class,x,y,w\n0,a,car,0,0,70\n1,a,car,0,0,2\n",
            "line 2, column w: \"70\", expected a size of 0.001 to 65 m",
        ),
        ("{}", "is JSON"),
        (
            "<scenario>\n</scenario>",
            "line 1: the root is <scenario>, expected <fcd-export> (of sumo --fcd-output FILE) or <commonRoad>",
        ),
        (
            "<fcd-export>\n<timestep time=\"0\">\n<vehicle id=\"v\" x=\"1\" y=\"?\" angle=\"0\"/>",
            "line 3, attribute y of <vehicle>: \"?\"",
        ),
        (
            "<configuration>\n</configuration>",
            "of a configuration of SUMO: name it with the prefix sumo:, as in  v2x scenario init --world sumo:FILE",
        ),
        ("<fcd-export>\n<timestep time=\"00:00:01\">", "line 2, attribute time of <timestep>: \"00:00:01\""),
        ("<fcd-export><vehicle id=\"v\"/></fcd-export>", "<vehicle> outside of a <timestep>"),
        ("<fcd-export>\n</wrong>", "line 2: "),
    ];
    for (text, expected) in cases {
        let message = refusal(text);
        assert!(message.contains(expected), "{expected:?} is not in {message:?}");
    }
    let message = read(&[0x1f, 0x8b, 8][..], &ReadOptions::default()).unwrap_err().to_string();
    assert!(message.contains("gunzip"), "{message}");
    let message = read(&b"\xff\xfet\0"[..], &ReadOptions::default()).unwrap_err().to_string();
    assert!(message.contains("UTF-8"), "{message}");
}

#[test]
fn rows_out_of_order_are_sorted_with_a_word() {
    let text = "t,id,class,x,y\n2,a,car,2,0\n0,a,car,0,0\n1,a,car,1,0\n";
    let traffic = traffic(text);
    assert_eq!((traffic.first_s, traffic.length), (0.0, Span::from_millis(2000)));
    assert_eq!(traffic.objects[0].trajectory.at(Span::from_millis(500)).unwrap().pose.x, 0.5);
    assert!(traffic.remarks.notes[0].contains("not in order of time"), "{:?}", traffic.remarks);
}

#[test]
fn the_laboratorys_table_has_its_ego_as_an_object_and_one_scene_is_read() {
    let text = "scene,frame,t_s,object_id,class,x,y,width,length,yaw,ego_x,ego_y,ego_yaw\n\
                one,0,0,7,vehicle.car,1,2,1.9,4.6,0.1,5,6,0.2\n\
                one,0,0,8,vehicle.car,9,2,1.9,4.6,0.1,5,6,0.2\n\
                one,1,0.5,7,vehicle.car,2,2,1.9,4.6,0.1,6,6,0.2\n\
                two,0,0,7,vehicle.car,1,2,1.9,4.6,0.1,nan,nan,nan\n";
    let first = traffic(text);
    assert_eq!((first.format, first.scene.as_deref()), (Format::Laboratory, Some("one")));
    let ego = object(&first, "ego");
    assert_eq!((ego.class, ego.trajectory.samples().len()), (Class::Car, 2));
    assert_eq!(ego.trajectory.samples()[1].pose.x, 6.0);
    assert_eq!((object(&first, "7").w, object(&first, "7").d), (1.9, 4.6));
    let options = |scene: &str| ReadOptions { scene: Some(scene.to_owned()), ..ReadOptions::default() };
    let message = read(text.as_bytes(), &options("three")).unwrap_err().to_string();
    assert_eq!(message, "has no scene \"three\"; it has one, two");
    assert!(read(text.as_bytes(), &options("two")).unwrap_err().to_string().contains("one time only"));
}

#[test]
fn interaction_is_read_and_its_pedestrians_have_the_heading_of_their_motion() {
    let vehicles = "track_id,frame_id,timestamp_ms,agent_type,x,y,vx,vy,psi_rad,length,width\n\
                    1,1,100,car,955.1,1001.2,0,-5,-1.57,4.3,1.8\n\
                    1,2,200,car,955.1,1000.7,0,-5,-1.57,4.3,1.8\n";
    let found = traffic(vehicles);
    let car = object(&found, "1");
    assert_eq!((found.format, car.w, car.d, found.first_s), (Format::Interaction, 1.8, 4.3, 0.1));
    assert_near(car.trajectory.at(Span::from_millis(50)).unwrap().pose.y, 1000.95);
    assert!(found.remarks.notes.is_empty(), "{:?}", found.remarks);
    let people = "track_id,frame_id,timestamp_ms,agent_type,x,y,vx,vy\n\
                  P1,1,100,pedestrian/bicycle,0,0,0,1\nP1,2,1100,pedestrian/bicycle,0,1,0,1\n";
    let found = traffic(people);
    let person = object(&found, "P1");
    assert_eq!(person.class, Class::Adult);
    assert_near(person.trajectory.at(Span::ZERO).unwrap().pose.yaw, FRAC_PI_2);
}

const FCD: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<!-- generated -->
<fcd-export xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance">
    <timestep time="0.00">
        <vehicle id="north&amp;1" x="100.00" y="50.00" angle="0.00" type="DEFAULT_VEHTYPE" speed="10.00"/>
        <vehicle id="east" x="0" y="0" angle="90" type="lorry"/>
        <person id="walker" x="3" y="4" angle="180" type="DEFAULT_PEDTYPE" speed="1"/>
    </timestep>
    <timestep time="1.00">
        <vehicle id="north&amp;1" x="100.00" y="60.00" angle="0.00" type="DEFAULT_VEHTYPE" speed="10.00"/>
        <vehicle id="east" x="10" y="0" angle="90" type="lorry"/>
        <person id="walker" x="3" y="3" angle="180" type="DEFAULT_PEDTYPE" speed="1"/>
    </timestep>
</fcd-export>
"#;

#[test]
fn sumos_front_bumpers_and_compass_angles_become_centres_and_yaws() {
    let traffic = traffic(FCD);
    assert_eq!((traffic.format, traffic.n_rows), (Format::SumoFcd, 6));
    let north = object(&traffic, "north&1");
    let state = north.trajectory.at(Span::from_millis(500)).unwrap();
    assert_near(state.pose.yaw, FRAC_PI_2);
    // Half of its length behind its front.
    assert_near(state.pose.x, 100.0);
    assert_near(state.pose.y, 55.0 - Class::Car.typical_size().1 / 2.0);
    let east = object(&traffic, "east").trajectory.at(Span::ZERO).unwrap();
    assert_near(east.pose.yaw, 0.0);
    let walker = object(&traffic, "walker");
    assert_eq!(walker.class, Class::Adult);
    assert_near(walker.trajectory.at(Span::ZERO).unwrap().pose.yaw, -FRAC_PI_2);
    assert!(traffic.remarks.warnings.is_empty(), "{:?}", traffic.remarks);
}

#[test]
fn vehicle_types_give_sizes_and_classes() {
    let types = r#"<additional><vType id="lorry" vClass="bus" length="11" width="2.4"/></additional>"#;
    let vehicle_types = read_vehicle_types(types.as_bytes()).unwrap();
    let options = ReadOptions { vehicle_types, ..ReadOptions::default() };
    let traffic = read(FCD.as_bytes(), &options).unwrap();
    let lorry = object(&traffic, "east");
    assert_eq!((lorry.class, lorry.w, lorry.d), (Class::RigidBus, 2.4, 11.0));
    assert_near(lorry.trajectory.at(Span::ZERO).unwrap().pose.x, -5.5);
    let message = read_vehicle_types(&b"<additional/>"[..]).unwrap_err().to_string();
    assert!(message.contains("vType"), "{message}");
}

#[test]
fn a_file_of_sumo_that_was_cut_off_is_used_with_a_warning() {
    for end in [
        "</timestep>\n</fcd-export>",
        "    </timestep>\n</fcd-export>",
        "speed=\"1\"/>\n    </timestep>\n</fcd-export>\n",
    ] {
        let cut = FCD.rsplit_once(end).unwrap().0;
        let traffic = traffic(cut);
        assert!(traffic.remarks.warnings[0].contains("ends in the middle"), "{end:?}: {:?}", traffic.remarks);
    }
}

#[test]
fn coordinates_in_degrees_are_noticed() {
    let mut text = "<fcd-export>".to_owned();
    for second in 0..30 {
        let x = 11.5 + 1e-4 * f64::from(second);
        text += &format!(
            "<timestep time=\"{second}\"><vehicle id=\"v\" x=\"{x}\" y=\"48.1\" angle=\"90\" speed=\"8\"/></timestep>"
        );
    }
    let traffic = traffic(&(text + "</fcd-export>"));
    assert!(traffic.remarks.warnings[0].contains("--fcd-output.geo"), "{:?}", traffic.remarks);
}

#[test]
fn far_coordinates_are_moved_to_a_round_place_and_a_stated_origin_holds() {
    let text = "t,id,class,x,y\n0,a,car,691603.5,5334759.5\n1,a,car,691613.5,5334759.5\n";
    let found = traffic(text);
    assert_eq!(found.origin, (691_600.0, 5_334_800.0));
    assert_eq!(found.objects[0].trajectory.samples()[0].pose.x, 3.5);
    assert!(found.remarks.notes[0].contains("(691600, 5334800)"), "{:?}", found.remarks);
    let options = ReadOptions { origin: Some((691_603.0, 0.0)), ..ReadOptions::default() };
    let stated = read(text.as_bytes(), &options).unwrap();
    assert_eq!(stated.objects[0].trajectory.samples()[0].pose.x, 0.5);
}

#[test]
fn a_window_keeps_its_rows_and_begins_at_zero() {
    let text: String = (0..100).map(|t| format!("{},a,car,{t},0\n", 50 + t)).collect();
    let text = format!("t,id,class,x,y\n{text}");
    let options =
        |from_s, to_s| ReadOptions { from_s: Some(from_s), to_s: Some(to_s), ..ReadOptions::default() };
    let traffic = read(text.as_bytes(), &options(10.0, 20.0)).unwrap();
    assert_eq!((traffic.n_rows, traffic.first_s, traffic.length), (11, 60.0, Span::from_millis(10_000)));
    let message = read(text.as_bytes(), &options(1000.0, 2000.0)).unwrap_err().to_string();
    assert!(message.contains("100 are outside"), "{message}");
    // Whatever the order of the rows: the earliest time, with which it is to be read again, is known at the end.
    let reversed: String =
        text.lines().skip(1).collect::<Vec<_>>().iter().rev().map(|row| format!("{row}\n")).collect();
    let reversed = format!("t,id,class,x,y\n{reversed}");
    let error = read(reversed.as_bytes(), &options(10.0, 20.0)).unwrap_err();
    let TrafficError::EarlierRow { earliest_s } = error else { panic!("{error}") };
    let again = ReadOptions { earliest_s: Some(earliest_s), ..options(10.0, 20.0) };
    let again = read(reversed.as_bytes(), &again).unwrap();
    assert_eq!((again.first_s, again.length, &again.objects), (60.0, traffic.length, &traffic.objects));
}

#[test]
fn an_unknown_class_is_named_and_can_be_given() {
    let text = TWO.replace("car", "velomobile");
    let found = traffic(&text);
    assert_eq!(found.objects[0].class, Class::Unknown);
    assert!(found.remarks.warnings[0].contains("classes = { \"velomobile\" ="), "{:?}", found.remarks);
    // All of them are in one line.
    let two = traffic("t,id,class,x,y\n0,a,Kfz,0,0\n1,a,Kfz,9,0\n0,b,Rad,0,5\n1,b,Rad,3,5\n");
    let [one] = &two.remarks.warnings[..] else { panic!("{:?}", two.remarks) };
    assert!(
        one.contains("\"Kfz\", \"Rad\"")
            && one.contains("classes = { \"Kfz\" = \"CLASS\", \"Rad\" = \"CLASS\" }"),
        "{one}"
    );
    assert!(one.contains("bicycle, pedestrian"), "{one}");
    let classes = [("velomobile".to_owned(), Class::Bicycle)].into_iter().collect();
    let given = read(text.as_bytes(), &ReadOptions { classes, ..ReadOptions::default() }).unwrap();
    assert_eq!((given.objects[0].class, given.remarks.warnings.len()), (Class::Bicycle, 0));
}

/// A car on a circle at 10 m/s, whose heading is written by a rule.
fn circle(column: &str, write: impl Fn(f64) -> f64) -> Remarks {
    let mut text = format!("t,id,class,x,y,{column}\n");
    for step in 0..60 {
        let angle = f64::from(step) * 0.1;
        let (sin, cos) = libm::sincos(angle);
        text += &format!(
            "{},a,car,{},{},{}\n",
            f64::from(step) * 0.5,
            50.0 * cos,
            50.0 * sin,
            write(angle + FRAC_PI_2)
        );
    }
    traffic(&text).remarks
}

#[test]
fn headings_that_disagree_with_the_motion_are_named_with_what_they_look_like() {
    let warning = |write: fn(f64) -> f64| circle("yaw", write).warnings.join(" ");
    assert!(warning(f64::to_degrees).contains("look like degrees: name the column yaw_deg"));
    assert!(warning(|yaw| 90.0 - yaw.to_degrees()).contains("name the column heading_deg"));
    assert!(warning(|yaw| FRAC_PI_2 - yaw).contains("radians clockwise from north"));
    assert!(warning(|yaw| yaw + PI).contains("of the back"));
    assert!(warning(|yaw| -yaw).contains("clockwise from east"));
    assert!(
        warning(|yaw| yaw + 1.2).contains("disagree with the motion by 67°")
            || warning(|yaw| yaw + 1.2).contains("disagree")
    );
    for (column, write) in [
        ("yaw", (|yaw| yaw) as fn(f64) -> f64),
        ("yaw_deg", f64::to_degrees),
        ("heading_deg", |yaw| 90.0 - yaw.to_degrees()),
    ] {
        assert_eq!(circle(column, write).warnings, [""; 0], "{column}");
    }
}

#[test]
fn jumps_gaps_and_single_rows_are_counted() {
    let text = "t,id,class,x,y\n0,a,car,0,0\n1,a,car,1000,0\n20,a,car,1000,0\n21,a,car,1001,0\n5,b,car,0,0\n";
    let warnings = traffic(text).remarks.warnings.join("\n");
    for expected in [
        "1 jumps: up to 1000 m/s",
        "\"a\" goes 1000.0 m in 1.000 s between lines 2 and 3",
        "1 of 2 objects have one row only",
        "1 gaps in which",
    ] {
        assert!(warnings.contains(expected), "{expected:?} is not in {warnings}");
    }
}

#[test]
fn an_id_of_two_objects_at_once_and_places_that_are_no_metres_are_named_with_their_lines() {
    let rows = |write: &dyn Fn(u32) -> String| {
        let rows: String = (0..40).map(write).collect();
        traffic(&format!("t,id,class,x,y\n{rows}")).remarks.warnings.join("\n")
    };
    // Their rows are one after the other, at times of their own.
    let shared = rows(&|k| {
        let t = 0.1 * f64::from(k);
        let x = if k % 2 == 0 { 8.0 * t } else { 60.0 - 8.0 * t };
        format!("{t},car1,car,{x},0\n")
    });
    assert!(shared.contains("one id seems to be of two objects at once: \"car1\" goes 59"), "{shared}");
    assert!(shared.contains("between lines 2 and 3"), "{shared}");
    // One that is moved once, and one whose places scatter.
    let moved = rows(&|k| {
        format!("{},a,car,{},0\n", 0.1 * f64::from(k), f64::from(k) + if k > 20 { 300.0 } else { 0.0 })
    });
    assert!(moved.contains("1 jumps") && !moved.contains("one id seems"), "{moved}");
    let scatters = rows(&|k| format!("{},a,car,{},0\n", 0.01 * f64::from(k), 1.5 * f64::from(k * 7 % 3)));
    assert!(!scatters.contains("one id seems"), "{scatters}");
    let of = |scale: f64| {
        rows(&|k| {
            let (n, t) = (k % 4, 0.1 * f64::from(k / 4));
            format!(
                "{t},{n},car,{},{}\n",
                scale * (300.0 + 10.0 * t + 20.0 * f64::from(n)),
                scale * f64::from(4 * n)
            )
        })
    };
    let (close, far) = (of(2e-3), of(1e5));
    assert!(close.contains("are these kilometres"), "{close}");
    assert!(far.contains("are these millimetres"), "{far}");
    assert_eq!(of(1.0), "");
}

#[test]
fn a_person_with_the_id_of_a_vehicle_is_an_object_of_its_own() {
    let step = |t: u32| {
        format!(
            r#"<timestep time="{t}"><vehicle id="0" x="{t}" y="0" angle="90"/><person id="0" x="5" y="{t}" angle="0"/></timestep>"#
        )
    };
    let found = traffic(&format!("<fcd-export>{}{}</fcd-export>", step(0), step(1)));
    let names: Vec<_> = found.objects.iter().map(|object| object.name.as_str()).collect();
    assert_eq!(names, ["0", "person:0"]);
    assert_eq!((object(&found, "0").class, object(&found, "person:0").class), (Class::Car, Class::Adult));
}

#[test]
fn elements_within_each_other_without_end_are_refused() {
    let message = refusal(&format!("<fcd-export>{}", "<a>".repeat(1_000_000)));
    assert!(message.contains("more than 32 elements within each other"), "{message}");
}

/// Three cars at 5 to 15 m/s and one that stands, ten times a second, as a row is written.
fn drive(write: impl Fn(f64, f64, f64) -> (f64, f64, f64)) -> Result<Vec<String>, TrafficError> {
    let mut text = "t,id,class,x,y\n".to_owned();
    for step in 0..200 {
        for (n, speed) in [0.0, 5.0, 10.0, 15.0].into_iter().enumerate() {
            let t = f64::from(step) * 0.1;
            let (t, x, y) = write(t, speed * t - 100.0, 4.0 * n as f64);
            text += &format!("{t},{n},car,{x},{y}\n");
        }
    }
    read(text.as_bytes(), &ReadOptions::default()).map(|traffic| traffic.remarks.warnings)
}

#[test]
fn times_in_another_unit_and_places_in_degrees_are_named_and_nothing_is_said_of_seconds_and_metres() {
    assert_eq!(drive(|t, x, y| (t, x, y)).unwrap(), Vec::<String>::new());
    // A slow recording is no mistake.
    assert_eq!(drive(|t, x, y| (20.0 * t, 20.0 * x, y)).unwrap(), Vec::<String>::new());
    assert_eq!(drive(|t, x, y| (10.3 * t, x, y)).unwrap(), Vec::<String>::new());
    let named = |words: &str, found: Result<Vec<String>, TrafficError>| {
        let said = found.unwrap_or_else(|error| vec![error.to_string()]).join("; ");
        assert!(said.contains(words), "{said}");
    };
    // Cars that creep evenly for minutes, at whole numbers.
    named("t looks like numbers of frames", drive(|t, x, y| (libm::round(10.0 * t), x, y)));
    named("t looks like milliseconds; name the column t_ms", drive(|t, x, y| (1e3 * t, x, y)));
    named("a column t_ms holds milliseconds", drive(|t, x, y| (1.79e12 + 1e3 * t, x, y)));
    named("t looks like microseconds, write seconds (t / 1000000)", drive(|t, x, y| (1e6 * t, x, y)));
    let degrees = |x: f64, y: f64| (11.575 + x / 74_400.0, 48.137 + y / 111_200.0);
    let of = |(x, y): (f64, f64), t: f64| (t, x, y);
    named("look like longitudes and latitudes in degrees", drive(|t, x, y| of(degrees(x, y), t)));
    named(
        "look like longitudes and latitudes in degrees",
        drive(|t, x, y| (t, degrees(x, y).1, degrees(x, y).0)),
    );
    // Which is which cannot be seen of numbers below 90: the place is said, by both.
    let place = "By x as the longitude this is 48.14° north, 11.58° east; if that is not the place, x and y are also exchanged";
    named(place, drive(|t, x, y| of(degrees(x, y), t)));
    named("this is 11.58° north, 48.14° east", drive(|t, x, y| (t, degrees(x, y).1, degrees(x, y).0)));
    named("x and y are also exchanged: x is east", drive(|t, x, y| (t, 40.0 + y / 2e3, -120.0 + x / 1e5)));
    // Over kilometres, and west of the 90th meridian.
    named("longitudes (x) and latitudes (y)", drive(|t, x, y| of((-120.0 + x / 1e5, 40.0 + y / 20.0), t)));
    let both = drive(|t, x, y| of(degrees(x, y), 1e3 * t)).unwrap().join("; ");
    assert!(both.contains("milliseconds") && both.contains("in degrees"), "{both}");
}
