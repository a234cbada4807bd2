//! Columns, second lists and warnings of the command.

use super::args::RuleArgs;
use super::tests::{Folder, drive, fused_by, van};
use super::*;
use std::fmt::Write as _;

const HEADER: &str = "t_arr,t,sensor_id,class,x,y,w,d,yaw,sx,sy,sw,sd,st";

/// A cell of the last row of a table.
fn last<'a>(table: &'a str, column: &str) -> &'a str {
    let place = table.lines().next().unwrap().split(',').position(|name| name == column).unwrap();
    table.lines().last().unwrap().split(',').nth(place).unwrap()
}

#[test]
fn what_is_known_of_headings_goes_through_from_the_log_to_the_fused_table() {
    let folder = Folder::new("heading");
    let fused = |heading: &str| {
        let header = format!("{HEADER},heading");
        let log = van(&header, |_| format!("van,5,5,2,5,0.7,0.2,0.2,0.2,0.3,0.05,{heading}"), 0.0);
        fused_by(&folder, &log, "[hub]\n").unwrap().1
    };
    let sigma = |table: &str| last(table, "st").parse::<f64>().unwrap();
    let [known, axis, unknown] = ["known", "axis", "unknown"].map(fused);
    assert_eq!((last(&known, "heading"), last(&axis, "heading")), ("known", "axis"));
    assert_ne!(last(&unknown, "heading"), "known");
    assert!(sigma(&known) < 0.1 && sigma(&axis) > 1.0 && sigma(&unknown) > 1.0, "{known}{axis}{unknown}");
    assert_eq!(fused(""), known);
}

#[test]
fn classes_that_sensors_disagree_about_are_probabilities_with_their_conflict() {
    let folder = Folder::new("classes");
    let mut log = format!("{HEADER}\n");
    for k in 0..30 {
        let t = 0.1 * f64::from(k);
        for (sensor, class) in [("a", "car"), ("b", "truck")] {
            writeln!(log, "{0:.2},{t:.2},{sensor},{class},5,5,2,5,0,0.2,0.2,0.2,0.3,0.05", t + 0.02).unwrap();
        }
    }
    let (_, fused) = fused_by(&folder, &log, "[hub]\n").unwrap();
    let classes = last(&fused, "classes").split(';').map(|one| one.split_once(':').unwrap());
    let classes: Vec<(&str, f64)> = classes.map(|(name, p)| (name, p.parse().unwrap())).collect();
    let sum: f64 = classes.iter().map(|(_, p)| p).sum();
    for name in ["vehicle.car", "vehicle.truck", "unknown"] {
        assert!(classes.iter().any(|(one, _)| *one == name), "{classes:?}");
    }
    assert!((sum - 1.0).abs() < 2e-3 && classes[0].0 == last(&fused, "class"), "{classes:?}");
    assert!(last(&fused, "conflict").parse::<f64>().unwrap() > 0.01, "{fused}");
}

#[test]
fn a_second_list_that_is_asked_for_is_written_and_scored_at_the_ticks_of_the_first() {
    let folder = Folder::new("lagged");
    let (log, truth) = drive();
    let args = folder.args(&log, Some(&truth));
    let plain = run(&args).unwrap();
    assert!(plain.lagged.is_none() && !folder.0.join("fused.lagged.csv").exists());
    let live = std::fs::read_to_string(&args.out).unwrap();

    let other = folder.0.join("smoothed.csv");
    let report = run(&FuseArgs { lagged_out: Some(other.clone()), ..args.clone() }).unwrap();
    assert_eq!(std::fs::read_to_string(&args.out).unwrap(), live, "the live list is what it is without");
    let lagged = report.lagged.as_ref().unwrap();
    assert_eq!((lagged.lag_ms, lagged.out.as_deref()), (500.0, other.to_str()));
    let table = std::fs::read_to_string(&other).unwrap();
    let times = |table: &str| -> Vec<String> {
        table.lines().skip(1).map(|row| row.split(',').next().unwrap().to_owned()).collect()
    };
    assert_eq!(table.lines().next(), live.lines().next());
    assert_eq!(times(&table).last(), times(&live).last(), "it ends where the live list does");
    assert_eq!(lagged.fused_rows, times(&table).len() as u64);
    let (first, second) = (report.truth.unwrap(), lagged.truth.unwrap());
    assert_eq!(second.metrics.frames, first.metrics.frames);
    assert!(second.velocity_error_mps < first.velocity_error_mps, "{second:?} {first:?}");
    let text = report.text();
    assert!(text.contains("the second list, 500 ms behind: ") && text.contains("smoothed.csv"), "{text}");
    assert_eq!(text.matches("against the truth").count(), 2);
    let json = serde_json::to_value(&report).unwrap();
    assert!(json.pointer("/lagged/truth/ate_m").is_some_and(serde_json::Value::is_number), "{json:#}");
}

#[test]
fn a_configured_second_list_is_written_beside_the_first_with_its_own_lag() {
    let folder = Folder::new("configured");
    let (log, _) = drive();
    let (report, _) = fused_by(&folder, &log, "[hub]\nlagged = { lag_ms = 750 }\n").unwrap();
    let lagged = report.lagged.unwrap();
    let beside = folder.0.join("fused.lagged.csv");
    assert_eq!((lagged.lag_ms, lagged.out.as_deref()), (750.0, beside.to_str()));
    let table = std::fs::read_to_string(&beside).unwrap();
    assert!(table.lines().count() > 25 && last(&table, "t").ends_with(".85"), "{table}");

    let args = folder.args(&log, None);
    for (path, message) in [
        (&args.detections, "--lagged-out would overwrite the det"),
        (&args.out, "--lagged-out would overwrite --out"),
    ] {
        let error =
            run(&FuseArgs { lagged_out: Some(path.clone()), ..args.clone() }).unwrap_err().to_string();
        assert!(error.starts_with(message), "{error}");
    }
    let rules = RuleArgs { method: Some("nms".to_owned()), ..RuleArgs::default() };
    let wrong = FuseArgs { rules, lagged_out: Some(folder.0.join("x.csv")), ..args };
    assert!(format!("{:#}", run(&wrong).unwrap_err()).contains("methods with memory"));
}

/// A log of sixty frames at 10 Hz whose times are in these multiples of a second.
fn in_units(capture: f64, arrival: f64) -> String {
    let mut log = format!("{HEADER}\n");
    for k in 0..60 {
        let t = 0.1 * f64::from(k);
        let (t_arr, x) = ((t + 0.05) * arrival, 10.0 * t);
        writeln!(log, "{t_arr:.3},{:.3},cam,car,{x},5,1.8,4.5,0,0.3,0.3,0.1,0.1,0.05", t * capture).unwrap();
    }
    log
}

#[test]
fn times_in_another_unit_are_named_with_the_unit_instead_of_a_wrong_clock() {
    let folder = Folder::new("units");
    for (capture, arrival, expected) in [
        (1e3, 1.0, "cam: its times seem to be in milliseconds (`t`) and in seconds (`t_arr`)"),
        (1.0, 1e3, "cam: its times seem to be in seconds (`t`) and in milliseconds (`t_arr`)"),
        (1e3, 1e3, "cam: its times seem to be in milliseconds (`t` and `t_arr`): over 60 frames"),
        (1e6, 1e6, "cam: its times seem to be in microseconds (`t` and `t_arr`): over 60 frames"),
        (1e9, 1e9, "cam: its times seem to be in nanoseconds (`t` and `t_arr`): over 60 frames"),
    ] {
        let page = folder.0.join("page.html");
        let args = FuseArgs { report: Some(page.clone()), ..folder.args(&in_units(capture, arrival), None) };
        let message = format!("{:#}", run(&args).unwrap_err());
        assert!(
            message.contains("log.csv can be fused: ") && message.contains(" of 60 frames are"),
            "{message}"
        );
        let lines: Vec<_> = message.lines().skip(1).collect();
        assert!(lines.len() == 1 && lines[0].trim_start().starts_with(expected), "{message}");
        assert!(message.contains("Write both in seconds: divide `t"), "{message}");
        assert!(!page.exists() && !args.out.exists());
    }
    let report = run(&folder.args(&in_units(1.0, 1.0), None)).unwrap();
    assert!(report.warnings.is_empty(), "{:?}", report.warnings);
    // Since 1970 the size of the number says it.
    let since_1970 = in_units(1.0, 1.0).replace(",0.100,cam", ",1700000000100,cam");
    let message = format!("{:#}", run(&folder.args(&since_1970, None)).unwrap_err());
    assert!(message.contains("column t: \"1700000000100\"") && message.contains("milliseconds"), "{message}");
}

#[test]
fn times_of_two_epochs_are_named() {
    let folder = Folder::new("epochs");
    let log = in_units(1.0, 1.0);
    let far = |row: &str| format!("{}{row}\n", if row.starts_with('t') { "" } else { "170000000" });
    let far: String = log.lines().map(far).collect();
    let message = format!("{:#}", run(&folder.args(&far, None)).unwrap_err());
    assert!(message.contains("seem to count from different times"), "{message}");
}

#[test]
fn a_log_of_which_nothing_can_be_fused_is_an_error_that_says_why_and_what_to_do() {
    let folder = Folder::new("unusable");
    let refused = |log: &str| format!("{:#}", run(&folder.args(log, None)).unwrap_err());
    let delayed = |by_s: f64| {
        let row = |k: u32| {
            let t = 0.1 * f64::from(k);
            format!("{:.2},{t:.1},cam,car,{t},5,1.8,4.5,0,0.3,0.3,0.1,0.1,0.05\n", t + by_s)
        };
        format!("{HEADER}\n") + &(0..20).map(row).collect::<String>()
    };
    let late = refused(&delayed(3.05));
    assert!(
        late.contains("20 of 20 frames are refused (too_late 20)") && late.contains("--delta-max-ms 305"),
        "{late}"
    );
    let early = refused(&delayed(-2.0));
    assert!(
        early.contains("2.000 s before their capture") && early.contains("columns exchanged?"),
        "{early}"
    );
    let impossible = in_units(1.0, 1.0).replace(",1.8,4.5,", ",0,0,");
    let message = refused(&impossible);
    assert!(
        message.contains("all 60 detections are impossible") && message.contains("in line 2"),
        "{message}"
    );
    let message =
        fused_by(&folder, &in_units(1.0, 1.0), "[hub]\nonly_agents = [\"kam\"]\n").unwrap_err().to_string();
    assert!(message.contains("names kam, and the sensors of the log are cam"), "{message}");
}

#[test]
fn a_page_of_a_sensor_in_milliseconds_has_that_reason_alone_and_counts_what_it_lists() {
    let folder = Folder::new("one-unit");
    let [millis, seconds] = [1e3, 1.0].map(|capture| in_units(capture, 1.0));
    let rows = millis.lines().zip(seconds.lines()).skip(1);
    let rows = rows.flat_map(|(one, other)| [one.replace("cam", "ms"), other.to_owned()]);
    let log = std::iter::once(HEADER.to_owned()).chain(rows).map(|row| row + "\n").collect::<String>();
    let page = folder.0.join("page.html");
    run(&FuseArgs { report: Some(page.clone()), ..folder.args(&log, None) }).unwrap();
    let html = std::fs::read_to_string(&page).unwrap();
    assert!(html.contains("<b>1 thing looks wrong</b>"), "{html}");
    assert!(
        html.contains("ms, 0 to 6 s: its times seem to be in milliseconds") && !html.contains("clock is"),
        "{html}"
    );
}

#[test]
fn empty_frames_of_a_sensor_without_a_place_are_warned_of_once_with_the_columns_to_add() {
    let folder = Folder::new("placeless");
    let log = |place: &str| {
        let header = if place.is_empty() { HEADER.to_owned() } else { format!("{HEADER},sensor_x,sensor_y") };
        let mut log = header + "\n";
        for k in 0..20 {
            let t = 0.1 * f64::from(k);
            for sensor in ["rsu", "other"] {
                let sees = sensor == "other" || k < 10;
                let cells = if sees { "car,20,0,2,4,0,0.3,0.3,0.1,0.1,0.1" } else { ",,,,,,,,,," };
                writeln!(log, "{t:.1},{t:.1},{sensor},{cells}{place}").unwrap();
            }
        }
        log
    };
    let words = |place: &str| {
        let warnings = run(&folder.args(&log(place), None)).unwrap().warnings;
        warnings.into_iter().filter(|one| one.contains("sensor_x and sensor_y")).collect::<Vec<_>>()
    };
    let [one] = &words("")[..] else { panic!("{:?}", words("")) };
    assert!(one.starts_with("rsu: 10 of its 20 frames have no detection"), "{one}");
    assert!(one.contains("none of these counts as a miss") && one.contains("Add the columns"), "{one}");
    assert!(!one.contains("  "), "{one}");
    assert!(words(",,")[0].contains("Fill in the columns"));
    assert!(words(",0,0").is_empty());
    // A rule for single frames has no misses.
    let rules = RuleArgs { method: Some("nms".to_owned()), ..RuleArgs::default() };
    let report = run(&FuseArgs { rules, ..folder.args(&log(""), None) }).unwrap();
    assert!(!report.warnings.iter().any(|one| one.contains("sensor_x")), "{:?}", report.warnings);
}

#[test]
fn a_truth_of_other_times_than_the_log_is_an_error_with_both_and_no_file_is_written() {
    let folder = Folder::new("other-times");
    let (log, truth) = drive();
    let args = folder.args(&log, Some(&truth.replace("\n17000000", "\n")));
    let message = run(&args).unwrap_err().to_string();
    for part in [
        "truth.csv is of 0 to 2.5 s",
        "log.csv of 1700000000 to 1700000002.93 s",
        "in seconds from the same time on",
    ] {
        assert!(message.contains(part), "{part}: {message}");
    }
    assert!(!args.out.exists());
}

#[test]
fn accepted_frames_of_which_nothing_is_published_are_warned_of() {
    let folder = Folder::new("unpublished");
    let log = van(HEADER, |x| format!("car,{},0,2,4,0,0.3,0.3,0.2,0.3,0.05", 1000.0 * (x - 30.0)), 0.0);
    let (report, _) = fused_by(&folder, &log, "[hub]\n").unwrap();
    assert_eq!((report.fused_rows, report.refused_frames), (0, 0));
    assert!(
        report.warnings.iter().any(|one| one.starts_with("nothing was published")),
        "{:?}",
        report.warnings
    );
}

#[test]
fn exchanged_longitudes_and_latitudes_are_said_with_the_frame_that_reads_them() {
    let folder = Folder::new("exchanged");
    let hub =
        "[hub.agents.cam]\nframe = \"wgs84\"\norigin = { latitude_deg = 48.137, longitude_deg = 11.575 }\n";
    let log = van(HEADER, |_| "car,48.138,11.575,1.8,4.5,0,0.3,0.3,0.1,0.1,0.05".to_owned(), 0.0);
    let message = fused_by(&folder, &log, hub).unwrap_err().to_string();
    assert!(
        message.contains("is the other way round") && message.contains("frame = \"wgs84-lat-lon\""),
        "{message}"
    );
    assert!(!message.contains("NaN"), "{message}");
}

/// What the command says of a log.
fn said(name: &str, log: &str) -> String {
    let folder = Folder::new(name);
    run(&folder.args(log, None)).unwrap().warnings.join("\n")
}

#[test]
fn a_log_that_a_spreadsheet_wrote_with_semicolons_and_decimal_commas_is_fused_as_the_other_one() {
    let (log, truth) = drive();
    let (plain, german) = (Folder::new("commas"), Folder::new("semicolons"));
    let other = |text: &str| text.replace(',', ";").replace('.', ",");
    let expected = run(&plain.args(&log, Some(&truth))).unwrap();
    let found = run(&german.args(&other(&log), Some(&other(&truth)))).unwrap();
    assert_eq!((found.frames, found.detections, found.fused_rows), (60, 60, expected.fused_rows));
    let fused = |folder: &Folder| std::fs::read_to_string(folder.0.join("fused.csv")).unwrap();
    assert_eq!(fused(&german), fused(&plain));
}

/// A camera over three cars, ten times a second for twelve seconds, without the frames that `is_lost` names; its pose's heading as
/// it is written.
fn camera(sensor_yaw: &str, is_lost: impl Fn(u32) -> bool) -> String {
    let mut log =
        "t_arr,t,sensor_id,class,x,y,w,d,yaw,sx,sy,sw,sd,st,sensor_x,sensor_y,sensor_yaw\n".to_owned();
    for tenth in (0..120).filter(|tenth| !is_lost(*tenth)) {
        let t = 100.0 + 0.1 * f64::from(tenth);
        for car in 0..3 {
            // To and fro by a decimetre, as sensors scatter.
            let x = 0.8 * f64::from(tenth) - 40.0 + 0.1 * f64::from((tenth * 7 + car * 3) % 5);
            let y = 4.0 * f64::from(car) + 0.1 * f64::from((tenth * 3 + car) % 5);
            writeln!(
                log,
                "{},{t},pole,car,{x},{y},1.8,4.5,0,0.2,0.2,0.1,0.1,0.05,0,-10,{sensor_yaw}",
                t + 0.03
            )
            .unwrap();
        }
    }
    log
}

#[test]
fn some_seconds_of_a_log_without_a_frame_are_said_with_their_times_and_lost_frames_are_not() {
    let hole = said("hole", &camera("1.57", |tenth| (40..80).contains(&tenth)));
    assert!(hole.contains("pole: it has no frame for 4.1 s, from t = 103.9 to 108.0 s"), "{hole}");
    assert!(hole.contains("write a row for each frame all the same"), "{hole}");
    let lost = said("lost", &camera("1.57", |tenth| tenth % 5 == 2 || (40..55).contains(&tenth)));
    assert!(!lost.contains("no frame for"), "{lost}");
}

#[test]
fn a_sensors_heading_in_degrees_is_named_with_its_column_and_one_in_radians_is_not() {
    let degrees = said("degrees", &camera("90", |_| false));
    assert!(
        degrees.contains("the yaw of its sensor_yaw is 90.0") && degrees.contains("in degrees"),
        "{degrees}"
    );
    let radians = said("radians", &camera("1.57", |_| false));
    assert!(!radians.contains("sensor_yaw"), "{radians}");
}
