//! From rows to frames.

use super::*;
use v2x_common::class::Class;
use v2x_common::time::Span;

const HEADER: &str = "t_arr,t,sensor_id,class,x,y,w,d,yaw,sx,sy,sw,sd,st,sensor_x,sensor_y,det_id\n";
const CAR: &str = "car,10,2,1.8,4.5,0.3,0.5,0.4,0.2,0.3,0.1,0,0,7";

fn frames(rows: &str) -> Result<(Vec<Arrival>, Remarks), CsvError> {
    let text = format!("{HEADER}{rows}");
    let mut log = DetectionLog::new(text.as_bytes(), Path::new("log.csv"))?;
    let mut arrivals = Vec::new();
    while let Some(arrival) = log.next_arrival()? {
        arrivals.push(arrival);
    }
    Ok((arrivals, log.remarks().clone()))
}

#[test]
fn rows_of_one_arrival_capture_and_sensor_are_a_frame() {
    let (arrivals, _) = frames(&format!(
        "-1.5,-1.6,cam,{CAR}\n-1.5,-1.6,7,{CAR}\n-1.50,-1.6,cam,{CAR}\n-1.5,-1.7,cam,{CAR}\n0,-1.6,cam,{CAR}\n"
    ))
    .unwrap();
    let frames: Vec<_> = arrivals
        .iter()
        .map(|one| (one.frame.id.agent.to_string(), one.frame.id.sequence, one.frame.detections.len()))
        .collect();
    let expected = [("cam", 0, 2), ("7", 0, 1), ("cam", 1, 1), ("cam", 2, 1)];
    assert_eq!(frames, expected.map(|(name, sequence, n)| (name.to_owned(), sequence, n)));
    assert_eq!(arrivals[2].frame.captured_at, Timestamp::from_nanos(-1_700_000_000));
    assert_eq!(arrivals[3].received_at, Timestamp::EPOCH);
    assert!(arrivals.iter().all(|one| one.frame.validate().is_ok()));
}

#[test]
fn class_names_of_other_data_sets_are_mapped_and_unknown_ones_are_counted() {
    let (arrivals, remarks) =
        frames(&format!("0,0,a,{CAR}\n0,0,a,{}\n", CAR.replace("car", "spaceship"))).unwrap();
    let classes: Vec<_> = arrivals[0].frame.detections.iter().map(|one| one.class).collect();
    assert_eq!(classes, [Class::Car, Class::Unknown]);
    assert!(remarks.unmapped.names().eq([("spaceship", 1)]));
}

#[test]
fn errors_name_line_column_and_value() {
    let cases = [
        (
            "0,soon,a,car,10,2,1.8,4.5,0.3,0.5,0.4,0.2,0.3,0.1,0,0,7",
            "column t: \"soon\", expected a time in s",
        ),
        (
            "-1,0,a,car,10,2,1.8,4.5,0.3,0.5,0.4,0.2,0.3,0.1,0,0,7",
            "column t_arr: \"-1\", expected no earlier",
        ),
        (
            "0,0,a/b,car,10,2,1.8,4.5,0.3,0.5,0.4,0.2,0.3,0.1,0,0,7",
            "column sensor_id: \"a/b\", expected at most",
        ),
        ("0,0,,car,10,2,1.8,4.5,0.3,0.5,0.4,0.2,0.3,0.1,0,0,7", "column sensor_id: \"\", expected at most"),
        ("0,0,a,car,ten,2,1.8,4.5,0.3,0.5,0.4,0.2,0.3,0.1,0,0,7", "column x: \"ten\", expected a coordinate"),
        (
            "0,0,a,car,10,2,1.8,4.5,0.3,0.5,0.4,0.2,0.3,0.1,0,,7",
            "column sensor_y: \"\", expected a coordinate",
        ),
        (
            "0,0,a,car,10,2,1.8,4.5,0.3,0.5,0.4,0.2,0.3,0.1,1,0,7",
            "column sensor_x: \"1\", expected with sensor_y",
        ),
        ("0,0,a,car,10,2,1.8,4.5,0.3,0.5,0.4,0.2,0.3", "column st: \"\", expected"),
    ];
    for (row, expected) in cases {
        let message = frames(&format!("0,0,a,{CAR}\n{row}\n")).unwrap_err().to_string();
        assert!(message.starts_with(&format!("log.csv, line 3, {expected}")), "{message}");
    }
}

#[test]
fn an_impossible_row_is_dropped_with_its_line_and_the_rest_of_the_frame_is_kept() {
    let cases = [
        ("car,20000,2,1.8,4.5,0.3,0.5,0.4,0.2,0.3,0.1,0,0,7", "x", "out of range"),
        ("car,10,2,0,4.5,0.3,0.5,0.4,0.2,0.3,0.1,0,0,7", "w", "out of range"),
        ("car,10,2,1.8,4.5,nan,0.5,0.4,0.2,0.3,0.1,0,0,7", "yaw", "not finite"),
        ("car,10,inf,1.8,4.5,0.3,0.5,0.4,0.2,0.3,0.1,0,0,7", "y", "not finite"),
        ("car,10,2,1.8,4.5,0.3,0,0.4,0.2,0.3,0.1,0,0,7", "variance of x", "out of range"),
        ("car,10,2,1.8,4.5,0.3,0.5,-0.4,0.2,0.3,0.1,0,0,7", "variance of y", "out of range"),
        ("car,10,2,1.8,4.5,0.3,0.5,0.4,0.2,71,0.1,0,0,7", "variance of d", "out of range"),
        ("car,10,2,1.8,4.5,0.3,0.5,0.4,0.2,0.3,8,0,0,7", "variance of yaw", "out of range"),
    ];
    for (row, field, cause) in cases {
        let rows = format!("0,0,a,{CAR}\n0,0,a,{row}\n0,0,a,{row}\n0,0,a,{CAR}\n");
        let (arrivals, remarks) = frames(&rows).unwrap();
        assert_eq!((arrivals.len(), arrivals[0].frame.detections.len()), (1, 2), "{row}");
        let dropped: Vec<_> = remarks.dropped().collect();
        assert_eq!(dropped.len(), 1);
        assert_eq!((dropped[0].field, dropped[0].cause, dropped[0].count), (field, cause, 2));
        assert_eq!(dropped[0].first_line, 3);
        assert!(dropped[0].first.starts_with(&format!("{field} is ")), "{}", dropped[0].first);
    }
}

#[test]
fn a_row_without_a_class_is_a_frame_in_which_nothing_more_was_seen() {
    let rows = format!("0,0,a,{CAR}\n0,0,a,,,,,,,,,,,,0,0,\n0.1,0.1,a,,,,,,,,,,,,0,0,\n");
    let (arrivals, remarks) = frames(&rows).unwrap();
    let counts: Vec<_> = arrivals.iter().map(|one| one.frame.detections.len()).collect();
    assert_eq!(counts, [1, 0]);
    assert!(arrivals[1].frame.sensor_pose.is_some());
    assert_eq!((remarks.dropped().count(), remarks.unmapped.total()), (0, 0));
}

#[test]
fn scores_velocities_and_tracks_are_read_where_the_log_has_them() {
    let header = COLUMNS.join(",") + ",score,vx,vy,svx,svy,source_track\n";
    let box_of = "0,0,a,car,10,2,1.8,4.5,0.3,0.5,0.4,0.2,0.3,0.1";
    let text = format!("{header}{box_of},0.25,3,-4,0.5,2,77\n{box_of},,,,,,\n{box_of},1.5,,,,,\n");
    let mut log = DetectionLog::new(text.as_bytes(), Path::new("log.csv")).unwrap();
    let frame = log.next_arrival().unwrap().unwrap().frame;
    let [full, bare] = frame.detections.as_slice() else { panic!("the third score cannot be") };
    let velocity = full.velocity.unwrap();
    assert_eq!((full.score, full.source_track), (0.25, Some(77)));
    assert_eq!(
        (velocity.x, velocity.y, velocity.covariance.xx, velocity.covariance.yy),
        (3.0, -4.0, 0.25, 4.0)
    );
    assert_eq!((bare.score, bare.velocity, bare.source_track), (1.0, None, None));
    assert_eq!(log.remarks().dropped().next().map(|one| one.field), Some("score"));
    let text = header.replace(",svy", "");
    let message = DetectionLog::new(text.as_bytes(), Path::new("log.csv")).unwrap_err().to_string();
    assert_eq!(message, "log.csv has no column svy; needed are vx, vy, svx, svy, or none of them");
}

#[test]
fn what_is_known_of_a_heading_is_read_and_an_empty_cell_follows_the_yaw() {
    let header = COLUMNS.join(",") + ",heading\n";
    let row =
        |yaw: &str, heading: &str| format!("0,0,a,car,10,2,1.8,4.5,{yaw},0.5,0.4,0.2,0.3,0.1,{heading}\n");
    let read = |rows: String| {
        let text = header.clone() + &rows;
        let mut log = DetectionLog::new(text.as_bytes(), Path::new("log.csv"))?;
        log.next_arrival().map(|arrival| arrival.unwrap().frame.detections)
    };
    let cells = [("0.3", "known"), ("0.3", "axis"), ("0.3", "unknown"), ("0.3", ""), ("", "")];
    let detections = read(cells.iter().map(|(yaw, heading)| row(yaw, heading)).collect()).unwrap();
    let kinds: Vec<_> = detections.iter().map(|one| one.heading.name()).collect();
    assert_eq!(kinds, ["known", "axis", "unknown", "known", "unknown"]);
    let message = read(row("0.3", "") + &row("0.3", "front")).unwrap_err().to_string();
    assert_eq!(
        message,
        "log.csv, line 3, column heading: \"front\", expected known, axis or unknown, or nothing"
    );
}

#[test]
fn all_missing_columns_are_named_and_sensor_positions_have_two_coordinates() {
    let error = |header: &str| {
        DetectionLog::new(header.as_bytes(), Path::new("log.csv")).map(|_| ()).unwrap_err().to_string()
    };
    let message = error("t,class,x,y,w,d,yaw,sx,sy,sw,sd\n");
    assert!(
        message.starts_with("log.csv has no column t_arr, sensor_id, st; needed are t_arr,t,"),
        "{message}"
    );
    let message = error(&HEADER.replace(",sensor_y", ""));
    assert!(message.starts_with("log.csv has no column sensor_y"), "{message}");
}

#[test]
fn frames_that_arrive_later_overtake_each_other_and_the_same_seed_gives_the_same_times() {
    let row = |tenth: i32, sensor: &str| format!("{0}.{1},{0}.{1},{sensor},{CAR}\n", tenth / 10, tenth % 10);
    let rows: String = (0..50).flat_map(|tenth| ["a", "b"].map(|sensor| row(tenth, sensor))).collect();
    let text = format!("{HEADER}{rows}");
    let read = |delays: &[Delay], seed: u64| {
        let log = DetectionLog::new(text.as_bytes(), Path::new("log.csv")).unwrap();
        let mut log = log.later(delays, seed);
        std::iter::from_fn(|| log.next_arrival().unwrap()).collect::<Vec<_>>()
    };
    let ms = Span::from_millis;
    let of_a = AgentId::new("a").unwrap();
    let delays = [
        Delay { sensor: None, least: ms(200), most: ms(200) },
        Delay { sensor: Some(of_a), least: ms(0), most: ms(450) },
    ];
    let arrivals = read(&delays, 3);
    assert!(arrivals.is_sorted_by_key(|one| one.received_at) && arrivals.len() == 100);
    let age = |one: &Arrival| one.received_at - one.frame.captured_at;
    let (late_a, late_b): (Vec<_>, Vec<_>) = arrivals.iter().partition(|one| one.frame.id.agent == of_a);
    assert!(late_b.iter().all(|one| age(one) == ms(200)));
    let [least, most] = [late_a.iter().map(|one| age(one)).min(), late_a.iter().map(|one| age(one)).max()];
    assert!(least < Some(ms(50)) && most > Some(ms(400)) && most <= Some(ms(450)), "{least:?} {most:?}");
    assert!(!late_a.is_sorted_by_key(|one| one.frame.captured_at), "they overtake each other");
    assert!(read(&delays, 3) == arrivals && read(&delays, 4) != arrivals);
    let as_logged = read(&[], 3);
    assert!(as_logged.iter().all(|one| age(one) == ms(0)));
}
