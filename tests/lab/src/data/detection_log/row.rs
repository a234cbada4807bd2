//! One row of a log: a detection, or the word that a sensor saw nothing.

use crate::data::csv_table::{CsvError, CsvTable, Row};
use std::io::Read;
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2, Velocity};
use v2x_common::detection::{Detection, HeadingKind, InvalidValue, MAX_COORDINATE_M};
use v2x_common::geometry::{BevBox, Pose, wrap_angle};
use v2x_common::id::AgentId;
use v2x_common::time::Timestamp;

/// Position of the sensor.
pub(crate) const SENSOR_COLUMNS: [&str; 2] = ["sensor_x", "sensor_y"];
/// Measured velocity and its standard deviations.
const VELOCITY_COLUMNS: [&str; 4] = ["vx", "vy", "svx", "svy"];
/// The detector's confidence, 0 to 1.
const SCORE_COLUMN: &str = "score";
/// The sender's track.
const TRACK_COLUMN: &str = "source_track";
/// Columns that a log may have.
pub(super) const OPTIONAL_COLUMNS: [&str; 8] = [
    SENSOR_COLUMNS[0],
    SENSOR_COLUMNS[1],
    SCORE_COLUMN,
    VELOCITY_COLUMNS[0],
    VELOCITY_COLUMNS[1],
    VELOCITY_COLUMNS[2],
    VELOCITY_COLUMNS[3],
    TRACK_COLUMN,
];
/// Score of a detection without one.
const CERTAIN: f64 = 1.0;

/// Which groups of optional columns a table has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Optional {
    pub poses: bool,
    pub velocities: bool,
}

/// What one row says.
#[derive(Clone, Debug)]
pub(super) enum Content {
    /// A detection.
    Detection(Detection),
    /// A detection with a value that cannot be.
    Impossible(InvalidValue),
    /// Nothing (more) was seen.
    Nothing,
}

/// One row.
#[derive(Clone, Debug)]
pub(super) struct Report {
    pub line: u64,
    pub received_at: Timestamp,
    pub captured_at: Timestamp,
    pub sensor: AgentId,
    pub pose: Option<Pose>,
    pub content: Content,
    /// The heading as it is written, rad, where the row has one.
    pub raw_yaw: Option<f64>,
    /// A class name that no table knows.
    pub unmapped: Option<String>,
}

impl Optional {
    /// The groups of a table; an error where a group is there in part.
    pub(super) fn of<R: Read>(table: &CsvTable<R>) -> Result<Self, CsvError> {
        let has = |group: &[&str]| {
            let missing: Vec<&str> = group.iter().filter(|column| !table.has(column)).copied().collect();
            if missing.is_empty() || missing.len() == group.len() {
                return Ok(missing.is_empty());
            }
            let needed = format!("{}, or none of them", group.join(", "));
            Err(CsvError::MissingColumns {
                path: table.path().to_owned(),
                missing: missing.join(", "),
                needed,
            })
        };
        Ok(Self { poses: has(&SENSOR_COLUMNS)?, velocities: has(&VELOCITY_COLUMNS)? })
    }
}

impl Report {
    /// Reads a row. Text where a number should be is an error; a number that cannot be is [`Content::Impossible`].
    pub(super) fn of(row: &Row<'_>, optional: Optional) -> Result<Self, CsvError> {
        let (captured_at, sensor) = (row.seconds("t")?, sensor(row)?);
        let pose = if optional.poses { pose(row)? } else { None };
        let mut report = Self {
            line: row.line(),
            received_at: row.seconds("t_arr")?,
            captured_at,
            sensor,
            pose,
            content: Content::Nothing,
            raw_yaw: None,
            unmapped: None,
        };
        let name = row.text("class");
        if name.is_empty() {
            return Ok(report);
        }
        let class = Class::from_name(name);
        report.unmapped = class.is_none().then(|| name.to_owned());
        report.raw_yaw = Some(row.any_number("yaw", "an angle in rad")?);
        let detection = detection(row, class.unwrap_or(Class::Unknown), optional)?;
        report.content = match detection.validate(report.pose.as_ref()) {
            Ok(()) => Content::Detection(detection),
            Err(invalid) => Content::Impossible(invalid),
        };
        Ok(report)
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

fn detection(row: &Row<'_>, class: Class, optional: Optional) -> Result<Detection, CsvError> {
    let metres = |column| row.any_number(column, "a length in m");
    let variance = |column| {
        let sigma = row.any_number(column, "a standard deviation")?;
        // A negative one stays negative, for validation to find.
        Ok::<_, CsvError>(sigma * sigma.abs())
    };
    let bev = BevBox {
        x: row.any_number("x", "a coordinate in m")?,
        y: row.any_number("y", "a coordinate in m")?,
        w: metres("w")?,
        d: metres("d")?,
        yaw: wrap_angle(row.any_number("yaw", "an angle in rad")?),
    };
    let covariance = BoxCovariance {
        position: Covariance2 { xx: variance("sx")?, xy: 0.0, yy: variance("sy")? },
        ww: variance("sw")?,
        dd: variance("sd")?,
        yaw: variance("st")?,
    };
    let score = match row.text(SCORE_COLUMN) {
        "" => CERTAIN,
        _ => row.any_number(SCORE_COLUMN, "a score of 0 to 1, or nothing")?,
    };
    let source_track = match row.text(TRACK_COLUMN) {
        "" => None,
        text => Some(text.parse().map_err(|_| row.wrong(TRACK_COLUMN, "the number of a track, or nothing"))?),
    };
    let velocity = if optional.velocities { velocity(row)? } else { None };
    let heading = HeadingKind::Known;
    Ok(Detection { class, score, bev, covariance, velocity, heading, source_track })
}

/// The measured velocity; `None` where all of its cells are empty.
fn velocity(row: &Row<'_>) -> Result<Option<Velocity>, CsvError> {
    if VELOCITY_COLUMNS.iter().all(|column| row.text(column).is_empty()) {
        return Ok(None);
    }
    let [vx, vy, svx, svy] = VELOCITY_COLUMNS;
    let number = |column| row.any_number(column, "a speed in m/s, or nothing in all four of vx,vy,svx,svy");
    let variance = |column| Ok::<_, CsvError>(number(column)? * number(column)?.abs());
    let covariance = Covariance2 { xx: variance(svx)?, xy: 0.0, yy: variance(svy)? };
    Ok(Some(Velocity { x: number(vx)?, y: number(vy)?, covariance }))
}
