//! A log of detections, read frame by frame in order of arrival.

use crate::data::csv_table::{CsvError, CsvTable, Row};
use std::collections::{BTreeMap, VecDeque};
use std::io::Read;
use std::path::Path;
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame, MAX_DETECTIONS, MAX_SIGMA_M, MAX_SIGMA_YAW_RAD};
use v2x_common::detection::{MAX_COORDINATE_M, MAX_RANGE_M, MIN_VARIANCE};
use v2x_common::geometry::Pose;
use v2x_common::id::{AgentId, FrameId};
use v2x_common::time::Timestamp;

/// Required columns.
pub(crate) const COLUMNS: [&str; 14] =
    ["t_arr", "t", "sensor_id", "class", "x", "y", "w", "d", "yaw", "sx", "sy", "sw", "sd", "st"];
/// Position of the sensor.
pub(crate) const SENSOR_COLUMNS: [&str; 2] = ["sensor_x", "sensor_y"];

/// A log has no boot epochs.
const EPOCH: u64 = 1;
/// A log has no confidence scores.
const SCORE: f64 = 1.0;

/// A frame with its time of arrival.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Arrival {
    /// By the clock of the log.
    pub received_at: Timestamp,
    /// The frame.
    pub frame: DetectionFrame,
}

/// A log that is read frame by frame. It holds the frames of one time of arrival.
#[derive(Debug)]
pub(crate) struct DetectionLog<R> {
    table: CsvTable<R>,
    has_poses: bool,
    /// The frames of one time of arrival, in order.
    ready: VecDeque<Arrival>,
    /// The first row of the next time of arrival.
    ahead: Option<Report>,
    /// Number of each sensor's next frame.
    sequences: BTreeMap<AgentId, u64>,
    unknown_classes: u64,
}

/// One row.
#[derive(Debug)]
struct Report {
    received_at: Timestamp,
    captured_at: Timestamp,
    sensor: AgentId,
    pose: Option<Pose>,
    detection: Detection,
}

impl<R: Read> DetectionLog<R> {
    /// A log in this table; `path` is for errors.
    pub(crate) fn new(table: R, path: &Path) -> Result<Self, CsvError> {
        let mut needed = COLUMNS.to_vec();
        let table = CsvTable::new(table, path, (&COLUMNS, &SENSOR_COLUMNS))?;
        let has_poses = SENSOR_COLUMNS.iter().any(|column| table.has(column));
        if has_poses && !SENSOR_COLUMNS.iter().all(|column| table.has(column)) {
            needed.extend(SENSOR_COLUMNS.iter().filter(|column| !table.has(column)));
            let missing = needed.split_off(COLUMNS.len()).join(", ");
            let needed = "sensor_x and sensor_y, or none of them".to_owned();
            return Err(CsvError::MissingColumns { path: path.to_owned(), missing, needed });
        }
        Ok(Self {
            table,
            has_poses,
            ready: VecDeque::new(),
            ahead: None,
            sequences: BTreeMap::new(),
            unknown_classes: 0,
        })
    }

    /// Whether it has the positions of sensors.
    pub(crate) const fn has_poses(&self) -> bool {
        self.has_poses
    }

    /// Number of bytes read.
    pub(crate) fn n_bytes(&self) -> u64 {
        self.table.n_bytes()
    }

    /// Detections so far with an unknown class name.
    pub(crate) const fn unknown_classes(&self) -> u64 {
        self.unknown_classes
    }

    /// Number of sensors so far.
    pub(crate) fn n_sensors(&self) -> usize {
        self.sequences.len()
    }

    /// The next frame; `None` at the end.
    pub(crate) fn next_arrival(&mut self) -> Result<Option<Arrival>, CsvError> {
        if self.ready.is_empty() {
            self.read_one_time()?;
        }
        Ok(self.ready.pop_front())
    }

    /// Reads the frames of the next time of arrival.
    fn read_one_time(&mut self) -> Result<(), CsvError> {
        let first = match self.ahead.take() {
            Some(first) => first,
            None => match self.read(Timestamp::MIN)? {
                Some(first) => first,
                None => return Ok(()),
            },
        };
        let received_at = first.received_at;
        self.sort_in(&first);
        while let Some(report) = self.read(received_at)? {
            if report.received_at > received_at {
                self.ahead = Some(report);
                break;
            }
            self.sort_in(&report);
        }
        Ok(())
    }

    fn sort_in(&mut self, report: &Report) {
        let Report { received_at, captured_at, sensor, pose, detection } = *report;
        let is_its = |arrival: &&mut Arrival| {
            arrival.frame.id.agent == sensor && arrival.frame.captured_at == captured_at
        };
        if let Some(arrival) = self.ready.iter_mut().rev().find(is_its) {
            arrival.frame.detections.push(detection);
            return;
        }
        let next = self.sequences.entry(sensor).or_default();
        let id = FrameId { agent: sensor, epoch: EPOCH, sequence: *next };
        *next += 1;
        let empty = DetectionFrame::empty(id, captured_at);
        let frame = DetectionFrame { sensor_pose: pose, detections: vec![detection], ..empty };
        self.ready.push_back(Arrival { received_at, frame });
    }

    /// The next row. It is an error if it arrived before the previous one.
    fn read(&mut self, not_before: Timestamp) -> Result<Option<Report>, CsvError> {
        let Some(row) = self.table.next_row()? else { return Ok(None) };
        let received_at = row.seconds("t_arr")?;
        if received_at < not_before {
            return Err(row.wrong("t_arr", "no earlier time than the row's before: rows in order of arrival"));
        }
        let (captured_at, sensor) = (row.seconds("t")?, sensor(&row)?);
        let pose = if self.has_poses { pose(&row)? } else { None };
        let (detection, is_known) = detection(&row, pose.as_ref())?;
        self.unknown_classes += u64::from(!is_known);
        let of_frame = |arrival: &&Arrival| {
            arrival.frame.id.agent == sensor
                && arrival.frame.captured_at == captured_at
                && arrival.received_at == received_at
        };
        if let Some(arrival) = self.ready.iter().rev().find(of_frame) {
            if arrival.frame.sensor_pose != pose {
                return Err(row.wrong("sensor_x", "with sensor_y the place in the frame's other rows"));
            }
            if arrival.frame.detections.len() >= MAX_DETECTIONS {
                return Err(row.wrong("t", "at most 4096 detections in a frame"));
            }
        }
        Ok(Some(Report { received_at, captured_at, sensor, pose, detection }))
    }
}

fn sensor(row: &Row<'_>) -> Result<AgentId, CsvError> {
    AgentId::new(row.text("sensor_id")).map_err(|error| {
        row.wrong("sensor_id", format!("at most 32 letters, digits, '-', '_', '.' or ':' ({error})"))
    })
}

fn pose(row: &Row<'_>) -> Result<Option<Pose>, CsvError> {
    let [x, y] = SENSOR_COLUMNS;
    let coordinate = |column| {
        let place = row.number_if_any(column, "a coordinate in m, or nothing")?;
        match place {
            Some(m) if m.abs() > MAX_COORDINATE_M => Err(row.wrong(column, "a coordinate in m, at most 1e8")),
            place => Ok(place),
        }
    };
    match (coordinate(x)?, coordinate(y)?) {
        (Some(x), Some(y)) => Ok(Some(Pose { x, y, yaw: 0.0 })),
        (None, None) => Ok(None),
        (None, Some(_)) => Err(row.wrong(x, "a coordinate, as sensor_y is one")),
        (Some(_), None) => Err(row.wrong(y, "a coordinate, as sensor_x is one")),
    }
}

/// The detection, and whether its class name is known.
fn detection(row: &Row<'_>, origin: Option<&Pose>) -> Result<(Detection, bool), CsvError> {
    let bev = row.bev(["w", "d"])?;
    if let Some(origin) = origin {
        for (column, place, sensor) in [("x", bev.x, origin.x), ("y", bev.y, origin.y)] {
            if (place - sensor).abs() > MAX_RANGE_M {
                return Err(row.wrong(column, "a place within 10 km of the sensor"));
            }
        }
    }
    let variance = |column, most: f64, expected: &str| {
        let fits = |sigma: f64| sigma > 0.0 && sigma <= most && sigma * sigma >= MIN_VARIANCE;
        row.number(column, fits, expected).map(|sigma| sigma * sigma)
    };
    let metres = |column| variance(column, MAX_SIGMA_M, "a standard deviation of 0.00001 to 70 m");
    let covariance = BoxCovariance {
        position: Covariance2 { xx: metres("sx")?, xy: 0.0, yy: metres("sy")? },
        ww: metres("sw")?,
        dd: metres("sd")?,
        yaw: variance("st", MAX_SIGMA_YAW_RAD, "a standard deviation of 0.00001 to 7 rad")?,
    };
    let class = row.class("class")?;
    let detection = Detection {
        class: class.unwrap_or(Class::Unknown),
        score: SCORE,
        bev,
        covariance,
        velocity: None,
        source_track: None,
    };
    Ok((detection, class.is_some()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "t_arr,t,sensor_id,class,x,y,w,d,yaw,sx,sy,sw,sd,st,sensor_x,sensor_y,det_id\n";
    const CAR: &str = "car,10,2,1.8,4.5,0.3,0.5,0.4,0.2,0.3,0.1,0,0,7";

    fn frames(rows: &str) -> Result<(Vec<Arrival>, u64), CsvError> {
        let text = format!("{HEADER}{rows}");
        let mut log = DetectionLog::new(text.as_bytes(), Path::new("log.csv"))?;
        let mut arrivals = Vec::new();
        while let Some(arrival) = log.next_arrival()? {
            arrivals.push(arrival);
        }
        Ok((arrivals, log.unknown_classes()))
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
        let (arrivals, unknown) =
            frames(&format!("0,0,a,{CAR}\n0,0,a,{}\n", CAR.replace("car", "spaceship"))).unwrap();
        let classes: Vec<_> = arrivals[0].frame.detections.iter().map(|one| one.class).collect();
        assert_eq!((classes, unknown), (vec![Class::Car, Class::Unknown], 1));
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
            (
                "0,0,,car,10,2,1.8,4.5,0.3,0.5,0.4,0.2,0.3,0.1,0,0,7",
                "column sensor_id: \"\", expected at most",
            ),
            ("0,0,a,,10,2,1.8,4.5,0.3,0.5,0.4,0.2,0.3,0.1,0,0,7", "column class: \"\", expected a class"),
            (
                "0,0,a,car,ten,2,1.8,4.5,0.3,0.5,0.4,0.2,0.3,0.1,0,0,7",
                "column x: \"ten\", expected a coordinate",
            ),
            (
                "0,0,a,car,20000,2,1.8,4.5,0.3,0.5,0.4,0.2,0.3,0.1,0,0,7",
                "column x: \"20000\", expected a place within",
            ),
            ("0,0,a,car,10,2,0,4.5,0.3,0.5,0.4,0.2,0.3,0.1,0,0,7", "column w: \"0\", expected 0.001 to 65 m"),
            (
                "0,0,a,car,10,2,1.8,4.5,nan,0.5,0.4,0.2,0.3,0.1,0,0,7",
                "column yaw: \"nan\", expected an angle",
            ),
            (
                "0,0,a,car,10,2,1.8,4.5,0.3,0,0.4,0.2,0.3,0.1,0,0,7",
                "column sx: \"0\", expected a standard deviation of 0.00001 to 70 m",
            ),
            ("0,0,a,car,10,2,1.8,4.5,0.3,0.5,-0.4,0.2,0.3,0.1,0,0,7", "column sy: \"-0.4\", expected"),
            ("0,0,a,car,10,2,1.8,4.5,0.3,0.5,0.4,0.2,71,0.1,0,0,7", "column sd: \"71\", expected"),
            (
                "0,0,a,car,10,2,1.8,4.5,0.3,0.5,0.4,0.2,0.3,8,0,0,7",
                "column st: \"8\", expected a standard deviation of 0.00001 to 7 rad",
            ),
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
}
