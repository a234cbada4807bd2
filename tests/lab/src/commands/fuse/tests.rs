//! The command, from input files to output files.

use super::*;
use crate::commands::fuse::args::{FuseArgs, RuleArgs, SensorArgs};
use std::fmt::Write as _;
use std::path::PathBuf;

/// A temporary folder. It is deleted at the end of the test.
pub(super) struct Folder(pub(super) PathBuf);

impl Folder {
    pub(super) fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("lab-fuse-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    pub(super) fn args(&self, log: &str, truth: Option<&str>) -> FuseArgs {
        let path = |name: &str| self.0.join(name);
        std::fs::write(path("log.csv"), log).unwrap();
        let truth = truth.map(|text| {
            std::fs::write(path("truth.csv"), text).unwrap();
            path("truth.csv")
        });
        FuseArgs {
            detections: path("log.csv"),
            out: path("fused.csv"),
            lagged_out: None,
            truth,
            truth_region: None,
            rules: RuleArgs::default(),
            sensor: SensorArgs::default(),
            late: LateArgs::default(),
            report: None,
            json: false,
        }
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).unwrap();
    }
}

/// A car that drives east at 10 m/s from a Unix time on. Two cameras report it without error at 10 Hz, 30 ms late.
/// Its ground truth has 2 Hz.
pub(super) fn drive() -> (String, String) {
    let mut log = "t_arr,t,sensor_id,class,x,y,w,d,yaw,sx,sy,sw,sd,st,note\n".to_owned();
    let mut truth = "t,object_id,class,x,y,vx,vy,w,d,yaw\n".to_owned();
    for tenth in 0..30 {
        let x = f64::from(tenth);
        let second = 1_700_000_000 + tenth / 10;
        for camera in ["left", "right"] {
            let t = format!("{second}.{}", tenth % 10);
            writeln!(log, "{t}3,{t},{camera},car,{x},5,1.8,4.5,0,0.3,0.3,0.1,0.1,0.05,nothing").unwrap();
        }
        if tenth % 5 == 0 {
            writeln!(truth, "{second}.{},7,vehicle.car,{x},5,10,0,1.8,4.5,0", tenth % 10).unwrap();
        }
    }
    (log, truth)
}

#[test]
fn a_moving_car_is_scored_between_the_rows_of_the_truth_too() {
    let folder = Folder::new("drive");
    let (log, truth) = drive();
    let report = run(&folder.args(&log, Some(&truth))).unwrap();
    assert_eq!((report.sensors, report.frames, report.detections), (2, 60, 60));
    assert_eq!((report.ticks, report.fused_rows, report.unknown_classes), (29, 29, 0));
    assert!(report.refused.is_empty() && report.refused_frames == 0);
    let score = report.truth.unwrap();
    // The truth ends at 2.5 s, the first tick is at 0.1 s.
    assert_eq!((score.metrics.frames, score.metrics.true_positives), (25, 25));
    assert_eq!((score.metrics.precision, score.metrics.recall), (Some(1.0), Some(1.0)));
    assert!(score.metrics.ate_m.unwrap() < 0.5, "{score:?}");
    assert_eq!(score.id_switches, 0);
    let fused = std::fs::read_to_string(folder.0.join("fused.csv")).unwrap();
    let mut lines = fused.lines();
    assert_eq!(
        lines.next().unwrap(),
        "t,track_id,class,x,y,vx,vy,w,d,yaw,existence,sx,sy,svx,svy,sw,sd,st,heading,classes,conflict"
    );
    assert!(lines.next().unwrap().starts_with("1700000000.1,0,vehicle.car,"), "{fused}");
    assert!(report.text().contains("60 detections in 60 frames of 2 sensors"));
}

#[test]
fn a_page_of_a_log_has_pictures_its_sensors_and_what_looks_wrong_by_the_frames_as_they_were_written() {
    let folder = Folder::new("page");
    let (log, _) = drive();
    let log = log.replace(",left,car", ",left,flivver").replace("1.8,4.5,0,", "4.5,1.8,225,");
    let path = folder.0.join("hub.toml");
    std::fs::write(&path, "[hub.agents.right]\nsizes = \"w-along\"\n").unwrap();
    let rules = RuleArgs { hub_config: Some(path), ..RuleArgs::default() };
    let page = folder.0.join("page.html");
    let args = FuseArgs { report: Some(page.clone()), rules, ..folder.args(&log, None) };
    assert!(run(&args).unwrap().text().contains("page.html"));
    let html = std::fs::read_to_string(&page).unwrap();
    for expected in
        ["<svg", "a typical moment", "are degrees, and are read as radians", "flivver", "left", "right"]
    {
        assert!(html.contains(expected), "{expected}");
    }
    assert!(html.contains("Not scored"));
    // Sizes that the settings convert are converted once.
    assert!(!html.contains("right: 30 of 30"));
    let message = run(&FuseArgs { report: Some(args.out.clone()), ..args.clone() }).unwrap_err().to_string();
    assert!(message.contains("--report would overwrite"), "{message}");
    let message = run(&FuseArgs { report: Some(args.detections.clone()), ..args }).unwrap_err().to_string();
    assert!(message.contains("--report would overwrite the detections"), "{message}");
}

#[test]
fn a_page_of_a_log_with_a_truth_has_the_score_that_is_printed() {
    let folder = Folder::new("scored-page");
    let (log, truth) = drive();
    let page = folder.0.join("page.html");
    let args = FuseArgs { report: Some(page.clone()), ..folder.args(&log, Some(&truth)) };
    let text = run(&args).unwrap().text();
    let html = std::fs::read_to_string(&page).unwrap();
    let score = text.lines().find(|line| line.contains("ATE")).unwrap().trim();
    assert!(html.contains(score) && !html.contains("Not scored"), "{score}");
}

#[test]
fn every_method_of_the_hub_fuses_a_log() {
    let folder = Folder::new("methods");
    let (log, _) = drive();
    for method in ["ours", "unikf-paper", "unikf-literal", "single-1", "csba-wls", "wbf"] {
        let rules = RuleArgs { method: Some(method.to_owned()), ..RuleArgs::default() };
        let report = run(&FuseArgs { rules, ..folder.args(&log, None) }).unwrap();
        assert_eq!((report.method.as_str(), report.fused_rows), (method, 29));
        assert!(report.truth.is_none());
    }
}

#[test]
fn objects_that_a_described_sensor_misses_are_deleted_soon() {
    let folder = Folder::new("view");
    let header = "t_arr,t,sensor_id,class,x,y,w,d,yaw,sx,sy,sw,sd,st,sensor_x,sensor_y\n";
    let mut log = header.to_owned();
    for tenth in 0..10 {
        let t = format!("0.{tenth}");
        writeln!(log, "{t},{t},a,car,20,0,2,4,0,0.3,0.3,0.1,0.1,0.1,0,0").unwrap();
        if tenth < 2 {
            writeln!(log, "{t},{t},a,car,-20,0,2,4,0,0.3,0.3,0.1,0.1,0.1,0,0").unwrap();
        }
    }
    let rows = |sensor: SensorArgs| run(&FuseArgs { sensor, ..folder.args(&log, None) }).unwrap().fused_rows;
    let described =
        SensorArgs { range: Some(50.0), detection_probability: Some(0.99), ..SensorArgs::default() };
    // Without a sensor description the first report of each is a candidate, and the second car coasts.
    assert_eq!(rows(SensorArgs::default()), 18);
    assert!(rows(described.clone()) < 16, "{}", rows(described));
}

#[test]
fn an_invalid_log_leaves_no_output_file() {
    let folder = Folder::new("broken");
    let (log, _) = drive();
    let args = folder.args(&(log + "1700000009,1700000009,left,car,x,5,1.8,4.5,0,1,1,1,1,1,\n"), None);
    let message = format!("{:#}", run(&args).unwrap_err());
    assert!(message.contains("log.csv, line 62, column x: \"x\", expected a coordinate in m"), "{message}");
    let mut left: Vec<_> =
        std::fs::read_dir(&folder.0).unwrap().map(|one| one.unwrap().file_name()).collect();
    left.sort();
    assert_eq!(left, ["log.csv"]);
}

#[test]
fn a_log_with_an_impossible_row_is_fused_and_the_row_is_named() {
    let folder = Folder::new("impossible");
    let (log, truth) = drive();
    let flat = "1700000002.93,1700000002.9,right,motorcycle,3,5,0,0,0,0.3,0.3,0.1,0.1,0.05,\n";
    let report = run(&folder.args(&(log + flat), Some(&truth))).unwrap();
    assert_eq!((report.detections, report.fused_rows), (60, 29));
    let text = report.text();
    assert!(text.contains("1 detections of right: w out of range; the first in line 62: w is 0"), "{text}");
    assert!(report.warnings.is_empty(), "{:?}", report.warnings);
}

#[test]
fn an_object_that_leaves_is_gone_soon_where_frames_say_that_nothing_is_seen() {
    let folder = Folder::new("gone");
    let header = "t_arr,t,sensor_id,class,x,y,w,d,yaw,sx,sy,sw,sd,st,sensor_x,sensor_y\n";
    let log = |empty: &str| {
        let row = |k: u32| match k {
            0..10 => format!("{0:.1},{0:.1},a,car,20,0,2,4,0,0.3,0.3,0.1,0.1,0.1,0,0\n", f64::from(k) / 10.0),
            _ => format!("{0:.1},{0:.1},{empty}\n", f64::from(k) / 10.0),
        };
        header.to_owned() + &(0..20).map(row).collect::<String>()
    };
    let sensor = SensorArgs { range: Some(50.0), detection_probability: Some(0.95), ..SensorArgs::default() };
    let rows =
        |log: &str| run(&FuseArgs { sensor: sensor.clone(), ..folder.args(log, None) }).unwrap().fused_rows;
    let (goes_on, elsewhere) = (log("a,,,,,,,,,,,,0,0"), log("b,,,,,,,,,,,,500,500"));
    assert!(rows(&goes_on) < 16 && rows(&elsewhere) >= 16, "{} {}", rows(&goes_on), rows(&elsewhere));
}

#[test]
fn a_sensor_in_degrees_with_swapped_sizes_and_an_unknown_class_is_named() {
    let folder = Folder::new("faults");
    let (log, _) = drive();
    let log = log.replace(",left,car", ",left,flivver").replace("1.8,4.5,0,", "4.5,1.8,225,");
    let report = run(&folder.args(&log, None)).unwrap();
    let text = report.text();
    assert!(text.contains("unknown classes     30 detections: flivver 30"), "{text}");
    for expected in [
        "left: its headings",
        "right: its headings",
        "right: 30 of 30 detections of vehicles are wider",
        "left: 30 of 30 detections of vehicles are wider",
        "left: 30 detections of unknown classes",
    ] {
        assert!(report.warnings.iter().any(|one| one.starts_with(expected)), "{:?}", report.warnings);
    }
    for setting in [
        "`classes = { \"flivver\" = \"CLASS\" }` under `[hub.agents.left]` in the file of --hub-config",
        "`yaw = { unit = \"deg\" }` under `[hub.agents.right]` in the file of --hub-config",
        "`sizes = \"w-along\"` under `[hub.agents.right]` in the file of --hub-config",
        "add `--hub-config settings.toml`",
    ] {
        assert!(text.contains(setting), "{setting} is not in {text}");
    }
    assert!(!text.contains("Send"), "nothing is sent in a log: {text}");
    assert_eq!(report.by_sensor.len(), 2);
    assert!((report.by_sensor[0].rate_hz.unwrap() - 10.0).abs() < 1e-9);
}

#[test]
fn a_wrong_clock_is_estimated_offline_where_accuracies_are_declared() {
    let folder = Folder::new("clock");
    let header = "t_arr,t,sensor_id,class,x,y,w,d,yaw,sx,sy,sw,sd,st,sensor_x,sensor_y\n";
    let mut log = header.to_owned();
    // Cars in two directions; the stamps of the second sensor are 100 ms ahead.
    for k in 0..400 {
        let t = f64::from(k) / 10.0;
        let (there, back) = (8.0 * t - 100.0, 100.0 - 9.0 * t);
        for (sensor, stamp) in [("rsu", t), ("car", t + 0.1)] {
            for (x, y, yaw) in [(there, 0.0, 0.0), (back, 4.0, 3.1), (y_of(t), there, 1.5)] {
                let row = format!("{:.3},{stamp:.3},{sensor},car,{x},{y},1.8,4.5,{yaw}", t + 0.12);
                writeln!(log, "{row},0.2,0.2,0.1,0.1,0.05,0,0").unwrap();
            }
        }
    }
    let accuracy = ["rsu=0.01", "car=0.5,1,100"].map(|text| args::accuracy(text).unwrap()).to_vec();
    let sensor = SensorArgs { accuracy, ..SensorArgs::default() };
    let report = run(&FuseArgs { sensor, ..folder.args(&log, None) }).unwrap();
    let car = report.by_sensor.iter().find(|one| one.sensor.as_str() == "car").unwrap();
    let registration = car.registration.unwrap();
    assert!((registration.clock_ms - 100.0).abs() < 30.0, "{registration:?}");
}

/// A lane that crosses the others' ends.
fn y_of(t: f64) -> f64 {
    40.0 + 0.1 * t
}

#[test]
fn inputs_are_not_overwritten_and_an_empty_log_is_an_error() {
    let folder = Folder::new("same");
    let (log, truth) = drive();
    let args = folder.args(&log, Some(&truth));
    for out in [args.detections.clone(), args.truth.clone().unwrap()] {
        let message = run(&FuseArgs { out, ..args.clone() }).unwrap_err().to_string();
        assert!(message.starts_with("--out would overwrite"), "{message}");
    }
    assert_eq!(std::fs::read_to_string(&args.detections).unwrap(), log);
    let header = log.lines().next().unwrap();
    let message = run(&folder.args(header, None)).unwrap_err().to_string();
    assert!(message.ends_with("log.csv holds no detections"), "{message}");
}

#[test]
fn the_report_in_json_is_one_object_with_flat_figures() {
    let folder = Folder::new("json");
    let (log, truth) = drive();
    let json = serde_json::to_value(run(&folder.args(&log, Some(&truth))).unwrap()).unwrap();
    for pointer in
        ["/detections_per_s", "/refused", "/truth/ate_m", "/truth/gospa_m", "/truth/map", "/truth/f1"]
    {
        assert!(json.pointer(pointer).is_some(), "{pointer} in {json:#}");
    }
}

#[test]
fn two_sensors_whose_map_frames_are_shifted_are_named_with_the_shift() {
    let folder = Folder::new("shifted");
    let mut log = "t_arr,t,sensor_id,class,x,y,w,d,yaw,sx,sy,sw,sd,st\n".to_owned();
    for k in 0..60 {
        let t = 0.1 * f64::from(k);
        let error = 0.2 * f64::from(k % 5 - 2);
        for (sensor, y) in [("a", 0.0), ("b", 1.6)] {
            let (x, y) = (8.0 * t + error, y - 0.5 * error);
            writeln!(
                log,
                "{0:.2},{t:.2},{sensor},car,{x:.3},{y:.3},1.8,4.5,0,0.2,0.2,0.1,0.1,0.05",
                t + 0.03
            )
            .unwrap();
        }
    }
    let report = run(&folder.args(&log, None)).unwrap();
    let [one] = &report.warnings[..] else { panic!("{:?}", report.warnings) };
    assert!(one.contains("objects of b lie") && one.contains("+1.6"), "{one}");
}

/// The fused objects of a log by the settings of a hub.
pub(super) fn fused_by(folder: &Folder, log: &str, hub: &str) -> anyhow::Result<(Report, String)> {
    let args = folder.args(log, None);
    let path = folder.0.join("hub.toml");
    std::fs::write(&path, hub).unwrap();
    let report =
        run(&FuseArgs { rules: RuleArgs { hub_config: Some(path), ..RuleArgs::default() }, ..args.clone() })?;
    Ok((report, std::fs::read_to_string(&args.out).unwrap()))
}

/// A van at 10 m/s to the north-east, as a log of twenty frames; `row` writes all but the times.
pub(super) fn van(header: &str, row: impl Fn(f64) -> String, behind_s: f64) -> String {
    let mut log = format!("{header}\n");
    for k in 0..20 {
        let t = 0.1 * f64::from(k);
        writeln!(log, "{:.2},{:.2},cam,{}", t + 0.02, t - behind_s, row(30.0 + 7.0 * t)).unwrap();
    }
    log
}

const HEADER: &str = "t_arr,t,sensor_id,class,x,y,w,d,yaw,sx,sy,sw,sd,st";

#[test]
fn a_log_in_conventions_of_its_own_is_fused_as_one_in_ours() {
    let folder = Folder::new("conventions");
    let with_pose = format!("{HEADER},sensor_x,sensor_y,sensor_yaw");
    let ours = van(
        &with_pose,
        |x| format!("van,{x},{x},2,5,0.785398163397,0.3,0.3,0.2,0.3,0.05,0,0,1.570796326795"),
        0.0,
    );
    let (_, ours) = fused_by(&folder, &ours, "[hub]\n").unwrap();
    let turned = "yaw = { unit = \"deg\", turn = \"cw\" }\nsizes = \"w-along\"\ntime_offset_ms = 300\n\
                  classes = { Bus = \"van\" }\n";
    // From a sensor that looks north; the clock is 300 ms behind.
    let boxes = |x: f64| format!("Bus,{x},-{x},5,2,45,0.3,0.3,0.3,0.2,2.864788975654");
    let sensor = format!(
        "[hub.agents.cam]\nframe = \"sensor\"\npose = {{ x = 0, y = 0, yaw = 1.570796326795 }}\n{turned}"
    );
    let ego = format!("[hub.agents.cam]\nframe = \"ego\"\n{turned}");
    let cases =
        [(sensor, van(HEADER, boxes, 0.3)), (ego, van(&with_pose, |x| format!("{},0,0,-90", boxes(x)), 0.3))];
    for (hub, log) in cases {
        let (report, theirs) = fused_by(&folder, &log, &hub).unwrap();
        assert_eq!(report.unknown_classes, 0);
        assert!(report.warnings.is_empty(), "{:?}", report.warnings);
        assert!(ours.lines().count() > 15 && ours.lines().count() == theirs.lines().count(), "{theirs}");
        for (ours, theirs) in ours.lines().zip(theirs.lines()).skip(1) {
            for (ours, theirs) in ours.split(',').zip(theirs.split(',')) {
                let is_same = match (ours.parse::<f64>(), theirs.parse::<f64>()) {
                    (Ok(ours), Ok(theirs)) => (ours - theirs).abs() < 1e-3,
                    _ => ours == theirs,
                };
                assert!(is_same, "{ours} {theirs} with {hub}");
            }
        }
    }
}

#[test]
fn longitudes_and_latitudes_of_a_log_are_places_on_the_map() {
    let folder = Folder::new("geodetic");
    let hub =
        "[hub.agents.cam]\nframe = \"wgs84\"\norigin = { latitude_deg = 48.137, longitude_deg = 11.575 }\n";
    let log = van(HEADER, |_| "car,11.575,48.138,1.8,4.5,0,0.3,0.3,0.1,0.1,0.05".to_owned(), 0.0);
    let (_, fused) = fused_by(&folder, &log, hub).unwrap();
    let last: Vec<f64> =
        fused.lines().last().unwrap().split(',').filter_map(|one| one.parse().ok()).collect();
    // Time, track, x, y: the class is no number. A thousandth of a degree of latitude at 48° is 111.2 m.
    assert!(last[2].abs() < 0.1 && (last[3] - 111.2).abs() < 0.1, "{fused}");
}

#[test]
fn what_a_log_leaves_out_is_assumed_by_the_settings_of_the_hub() {
    let folder = Folder::new("assumed");
    let bare = |x: f64| format!("car,{x},0,,,,,,,,,0,0");
    let header = format!("{HEADER},sensor_x,sensor_y");
    let hub = "[hub.agents.cam]\nsigma_position_m = 0.1\nsigma_position_per_m = 0.02\n";
    let (report, assumed) = fused_by(&folder, &van(&header, bare, 0.0), hub).unwrap();
    assert_eq!((report.detections, report.dropped_detections.len()), (20, 0));
    // The noise formula written out: 0.1 m + 0.02 of the distance.
    let written = |x: f64| format!("car,{x},0,,,,{0},{0},,,,0,0", 0.1 + 0.02 * x);
    let (_, stated) = fused_by(&folder, &van(&header, written, 0.0), "[hub]\n").unwrap();
    assert_eq!(assumed, stated);
    let (_, others) = fused_by(&folder, &van(&header, bare, 0.0), "[hub]\n").unwrap();
    assert_ne!(assumed, others);
    // A row that was cut off is no row with empty cells.
    let cut = van(&header, bare, 0.0) + "9,9,cam,car,1,0,2,4,0\n";
    let message = format!("{:#}", fused_by(&folder, &cut, hub).unwrap_err());
    assert!(message.contains("line 22, column sx"), "{message}");
}

#[test]
fn positions_relative_to_an_agent_whose_pose_the_log_lacks_are_an_error_that_names_the_column() {
    let folder = Folder::new("ego");
    let log = van(&format!("{HEADER},sensor_x,sensor_y"), |x| format!("car,{x},0,,,,,,,,,0,0"), 0.0);
    let message =
        format!("{:#}", fused_by(&folder, &log, "[hub.agents.cam]\nframe = \"ego\"\n").unwrap_err());
    for named in
        ["log.csv, line 2, column sensor_yaw", "[hub.agents.cam]", "sensor_x, sensor_y and sensor_yaw"]
    {
        assert!(message.contains(named), "{message}");
    }
}

#[test]
fn a_sensor_that_arrives_later_than_the_log_says_is_fused_and_one_that_arrives_too_late_is_refused() {
    let folder = Folder::new("late");
    let (log, truth) = drive();
    let late = |text: &str| {
        let args = folder.args(&log, Some(&truth));
        let late = ["lab", "--late", text];
        let late = <LateArgs as clap::Args>::augment_args(clap::Command::new("lab"))
            .try_get_matches_from(late)
            .and_then(|matches| clap::FromArgMatches::from_arg_matches(&matches));
        run(&FuseArgs { late: late.unwrap(), ..args }).unwrap()
    };
    let later = late("right=200,300");
    assert!(later.refused.is_empty() && later.frames == 60, "{:?}", later.refused);
    assert!(later.truth.unwrap().metrics.recall > Some(0.9));
    assert_eq!(late("right=600").refused["too_late"], 30);
}

#[test]
fn a_table_of_an_agent_that_the_log_lacks_is_a_warning_with_the_names_that_it_has() {
    let folder = Folder::new("names");
    let (log, _) = drive();
    let hub = "[hub]\nonly_agents = [\"left\", \"rihgt\"]\n[hub.agents.Left]\ntime_offset_ms = 10\n[hub.agents.left]\ntime_offset_ms = 0\n";
    let (report, _) = fused_by(&folder, &log, hub).unwrap();
    let expected =
        "[hub.agents.Left] has no effect: the sensors of the log are left, right. Did you mean left?";
    assert!(report.warnings.iter().any(|one| one == expected), "{:?}", report.warnings);
    assert!(!report.warnings.iter().any(|one| one.starts_with("[hub.agents.left]")), "{:?}", report.warnings);
    let listed = report.warnings.iter().find(|one| one.starts_with("rihgt in `only_agents` has no effect"));
    assert!(listed.is_some_and(|one| one.ends_with("Did you mean right?")), "{:?}", report.warnings);
    assert_eq!(report.refused["not_listened_to"], 30);
}
