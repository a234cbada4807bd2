//! One row of a log: a detection, or the word that a sensor saw nothing.

use crate::data::csv_table::{CsvError, CsvTable, Row};
use std::io::Read;
use v2x_common::class::Class;
use v2x_common::conventions::{CoordinateFrame, OffOrigin, UnfitPose};
use v2x_common::covariance::{Covariance2, Velocity};
use v2x_common::detection::{Detection, InvalidValue, MAX_COORDINATE_M};
use v2x_common::geometry::Pose;
use v2x_common::heading::HeadingKind;
use v2x_common::id::AgentId;
use v2x_common::reported::Reported;
use v2x_common::time::Timestamp;
use v2x_common::wire::json::{PartialDetection, PartialSigma};
use v2x_fusion_hub::hub::{AgentSettings, HubSettings};

/// Position of the sensor.
pub(crate) const SENSOR_COLUMNS: [&str; 2] = ["sensor_x", "sensor_y"];
/// Its heading.
const SENSOR_YAW_COLUMN: &str = "sensor_yaw";
/// Measured velocity and its standard deviations.
const VELOCITY_COLUMNS: [&str; 4] = ["vx", "vy", "svx", "svy"];
/// The detector's confidence, 0 to 1.
const SCORE_COLUMN: &str = "score";
/// What is known of the heading.
const HEADING_COLUMN: &str = "heading";
/// The sender's track.
const TRACK_COLUMN: &str = "source_track";
/// Columns that a log may have.
pub(super) const OPTIONAL_COLUMNS: [&str; 10] = [
    SENSOR_COLUMNS[0],
    SENSOR_COLUMNS[1],
    SENSOR_YAW_COLUMN,
    SCORE_COLUMN,
    VELOCITY_COLUMNS[0],
    VELOCITY_COLUMNS[1],
    VELOCITY_COLUMNS[2],
    VELOCITY_COLUMNS[3],
    TRACK_COLUMN,
    HEADING_COLUMN,
];
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

/// One row, in our own conventions.
#[derive(Clone, Debug)]
pub(super) struct Report {
    pub line: u64,
    pub received_at: Timestamp,
    pub captured_at: Timestamp,
    pub sensor: AgentId,
    pub pose: Option<Pose>,
    pub content: Content,
    /// How it was written.
    pub reported: Reported,
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
                hint: String::new(),
            })
        };
        Ok(Self { poses: has(&SENSOR_COLUMNS)?, velocities: has(&VELOCITY_COLUMNS)? })
    }
}

impl Report {
    /// Reads a row by the conventions of its sensor. Text where a number should be is an error; a number that cannot be is
    /// [`Content::Impossible`].
    pub(super) fn of(row: &Row<'_>, optional: Optional, settings: &HubSettings) -> Result<Self, CsvError> {
        let (captured_at, sensor) = (row.seconds("t")?, sensor(row)?);
        let AgentSettings { report_defaults, conventions, says_sigma, .. } = settings.of_agent(&sensor);
        let pose = if optional.poses { pose(row)? } else { None };
        if conventions.frame == CoordinateFrame::Ego {
            own_pose(row, &sensor)?;
        }
        let conversion =
            conventions.conversion(pose).map_err(|error| row.wrong(SENSOR_COLUMNS[0], expected(&error)))?;
        let mut report = Self {
            line: row.line(),
            received_at: row.seconds("t_arr")?,
            captured_at: captured_at + conventions.time_offset,
            sensor,
            pose: conversion.sensor_pose(),
            content: Content::Nothing,
            reported: Reported {
                sigma_is_set: *says_sigma,
                pose_yaw: pose.map_or(0.0, |pose| conversion.heading(pose.yaw)),
                ..Reported::by(conventions, false)
            },
            unmapped: None,
        };
        let name = row.text("class");
        if name.is_empty() {
            return Ok(report);
        }
        let class = conventions.class(name);
        report.unmapped = class.is_none().then(|| name.to_owned());
        let partial = detection(row, class.unwrap_or(Class::Unknown), optional)?;
        partial.yaw.iter().for_each(|yaw| report.reported.headings.note(conversion.heading(*yaw)));
        report.reported.without_sigma = u64::from(partial.sigma.x.is_none());
        let off = conventions.frame.off_origin([partial.x, partial.y]);
        off.into_iter().for_each(|off| report.reported.off_origin.note(off));
        let detection = partial.completed(report_defaults, &conversion);
        report.content = match detection.validate(report.pose.as_ref()) {
            Ok(()) => {
                let yaw = partial.yaw.unwrap_or(f64::NAN);
                report.reported.in_other_unit = vec![conversion.heading_in_other_unit(yaw)];
                Content::Detection(detection)
            }
            Err(invalid) => Content::Impossible(invalid),
        };
        Ok(report)
    }
}

/// An agent whose positions are relative to its own pose must have one, with a heading.
fn own_pose(row: &Row<'_>, sensor: &AgentId) -> Result<(), CsvError> {
    let columns = [SENSOR_COLUMNS[0], SENSOR_COLUMNS[1], SENSOR_YAW_COLUMN];
    let is_number =
        |column: &&'static str| row.number_if_any(column, "a number").is_ok_and(|number| number.is_some());
    match columns.into_iter().find(|column| !is_number(column)) {
        None => Ok(()),
        Some(column) => Err(row.wrong(
            column,
            format!(
                "a number: by [hub.agents.{sensor}] (frame = \"ego\") positions are relative to the agent's own pose, \
                 in the columns sensor_x, sensor_y and sensor_yaw"
            ),
        )),
    }
}

/// What is expected of a pose that cannot be converted.
fn expected(unfit: &UnfitPose) -> String {
    match unfit {
        UnfitPose::OffOrigin(OffOrigin { is_exchanged, .. }) => format!(
            "a longitude, and as sensor_y a latitude, within 200 km of the origin in [hub.agents]{}",
            if *is_exchanged {
                " (they are exchanged; frame = \"wgs84-lat-lon\" reads the latitude first)"
            } else {
                ""
            }
        ),
        UnfitPose::Missing => unfit.to_string(),
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
        (Some(x), Some(y)) => {
            let yaw = row.number_if_any(SENSOR_YAW_COLUMN, "a heading, or nothing")?;
            Ok(Some(Pose { x, y, yaw: yaw.unwrap_or(0.0) }))
        }
        (None, None) => Ok(None),
        (None, Some(_)) => Err(row.wrong(x, "a coordinate, as sensor_y is one")),
        (Some(_), None) => Err(row.wrong(y, "a coordinate, as sensor_x is one")),
    }
}

/// The detection as it is written; an empty cell is a value that the sensor does not give.
fn detection(row: &Row<'_>, class: Class, optional: Optional) -> Result<PartialDetection, CsvError> {
    let given = |column, expected: &str| row.any_number_if_given(column, expected);
    let metres = |column| given(column, "a length in m, or nothing");
    let sigma = |column| given(column, "a standard deviation, or nothing");
    let score = match row.text(SCORE_COLUMN) {
        "" => None,
        _ => Some(row.any_number(SCORE_COLUMN, "a score of 0 to 1, or nothing")?),
    };
    let source_track = match row.text(TRACK_COLUMN) {
        "" => None,
        text => Some(text.parse().map_err(|_| row.wrong(TRACK_COLUMN, "the number of a track, or nothing"))?),
    };
    Ok(PartialDetection {
        class,
        x: row.any_number("x", "a coordinate in m, or as its conventions say")?,
        y: row.any_number("y", "a coordinate in m, or as its conventions say")?,
        w: metres("w")?,
        d: metres("d")?,
        yaw: given("yaw", "a heading, or nothing")?,
        score,
        heading: heading(row)?,
        sigma: PartialSigma {
            x: sigma("sx")?,
            y: sigma("sy")?,
            rho: 0.0,
            w: sigma("sw")?,
            d: sigma("sd")?,
            yaw: sigma("st")?,
        },
        velocity: if optional.velocities { velocity(row)? } else { None },
        source_track,
    })
}

/// What is known of the heading; `None` for an empty cell.
fn heading(row: &Row<'_>) -> Result<Option<HeadingKind>, CsvError> {
    let kinds = [HeadingKind::Known, HeadingKind::Axis, HeadingKind::Unknown];
    match row.text(HEADING_COLUMN) {
        "" => Ok(None),
        name => match kinds.into_iter().find(|kind| kind.name() == name) {
            Some(kind) => Ok(Some(kind)),
            None => Err(row.wrong(HEADING_COLUMN, "known, axis or unknown, or nothing")),
        },
    }
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
