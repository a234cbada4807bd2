//! The columns of tables that are understood, by name.

use super::traffic::Format;
use super::units::PROJECT;
use v2x_common::spelling;

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Column {
    /// Seconds.
    Time,
    /// Milliseconds.
    TimeMillis,
    Id,
    Class,
    X,
    Y,
    /// Radians, counter-clockwise from east.
    Yaw,
    /// Degrees, counter-clockwise from east.
    YawDegrees,
    /// Degrees, clockwise from north.
    Compass,
    Width,
    Depth,
    Scene,
    EgoX,
    EgoY,
    EgoYaw,
    /// Not used, and not worth a word.
    Silent,
}

/// Names in lower case. Of several names of one meaning the first one of the header counts.
const NAMES: &[(&str, Column)] = &[
    ("t", Column::Time),
    ("t_s", Column::Time),
    ("time", Column::Time),
    ("time_s", Column::Time),
    ("timestamp_s", Column::Time),
    ("t_ms", Column::TimeMillis),
    ("time_ms", Column::TimeMillis),
    ("timestamp_ms", Column::TimeMillis),
    ("id", Column::Id),
    ("object_id", Column::Id),
    ("track_id", Column::Id),
    ("class", Column::Class),
    ("type", Column::Class),
    ("agent_type", Column::Class),
    ("object_type", Column::Class),
    ("x", Column::X),
    ("x_m", Column::X),
    ("y", Column::Y),
    ("y_m", Column::Y),
    ("yaw", Column::Yaw),
    ("yaw_rad", Column::Yaw),
    ("psi_rad", Column::Yaw),
    ("yaw_deg", Column::YawDegrees),
    ("heading_deg", Column::Compass),
    ("w", Column::Width),
    ("width", Column::Width),
    ("width_m", Column::Width),
    ("d", Column::Depth),
    ("length", Column::Depth),
    ("length_m", Column::Depth),
    ("scene", Column::Scene),
    ("case_id", Column::Scene),
    ("ego_x", Column::EgoX),
    ("ego_y", Column::EgoY),
    ("ego_yaw", Column::EgoYaw),
    ("frame", Column::Silent),
    ("frame_id", Column::Silent),
    ("vx", Column::Silent),
    ("vy", Column::Silent),
];

/// Names of numbers of frames.
const FRAMES: [&str; 5] = ["frame", "frame_id", "frame_nr", "framenum", "frame_number"];

/// Names of coordinates in degrees.
const DEGREES: [&str; 5] = ["lon", "lng", "longitude", "lat", "latitude"];

/// The columns of a table: for each its place and its name in the header.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Columns {
    places: Vec<(Column, usize, String)>,
    /// Names that mean nothing here.
    pub(super) ignored: Vec<String>,
    pub(super) format: Format,
    pub(super) n: usize,
    /// Rows have the number of their frame.
    has_frame_numbers: bool,
}

impl Columns {
    /// Of a header.
    pub(super) fn of<'a>(header: impl Iterator<Item = &'a str>) -> Self {
        let (mut places, mut ignored, mut n) = (Vec::<(Column, usize, String)>::new(), Vec::new(), 0);
        let mut has_frame_numbers = false;
        for (place, name) in header.enumerate() {
            n = place + 1;
            let folded = name.to_ascii_lowercase();
            has_frame_numbers |= FRAMES.contains(&folded.as_str());
            match NAMES.iter().find(|(known, _)| *known == folded).map(|(_, column)| *column) {
                Some(Column::Silent) => {}
                Some(column) if places.iter().all(|(other, ..)| *other != column) => {
                    places.push((column, place, name.to_owned()));
                }
                _ => ignored.push(name.to_owned()),
            }
        }
        let has = |wanted: &str| places.iter().any(|(.., name)| name.eq_ignore_ascii_case(wanted));
        let format = if has("track_id") && has("timestamp_ms") {
            Format::Interaction
        } else if has("object_id") && has("t_s") {
            Format::Laboratory
        } else {
            Format::Csv
        };
        Self { places, ignored, format, n, has_frame_numbers }
    }

    /// Place and name of a column.
    pub(super) fn find(&self, column: Column) -> Option<(usize, &str)> {
        let found = self.places.iter().find(|(one, ..)| *one == column);
        found.map(|(_, place, name)| (*place, name.as_str()))
    }

    /// Names of the columns that are needed and not there.
    pub(super) fn missing(&self) -> Vec<&'static str> {
        let has = |column| self.find(column).is_some();
        let needed = [
            ("t", has(Column::Time) || has(Column::TimeMillis)),
            ("id", has(Column::Id)),
            ("class", has(Column::Class)),
            ("x", has(Column::X)),
            ("y", has(Column::Y)),
        ];
        needed.iter().filter(|(_, is_there)| !is_there).map(|(name, _)| *name).collect()
    }

    /// What is meant by columns that are not used, where others are missing; empty where nothing is near.
    pub(super) fn hint(&self, missing: &[&'static str]) -> String {
        let named = |name: &str, words: &[&str]| {
            let folded = name.to_ascii_lowercase();
            words.iter().any(|word| folded.strip_prefix(word).is_some_and(|rest| matches!(rest, "" | "_deg")))
        };
        let degrees: Vec<_> =
            self.ignored.iter().filter(|name| named(name, &DEGREES)).map(String::as_str).collect();
        if !degrees.is_empty() && missing.iter().any(|column| matches!(*column, "x" | "y")) {
            return format!(". {} are degrees, and x and y are metres: {PROJECT}", degrees.join(" and "));
        }
        let times = self.ignored.iter().find(|name| named(name, &["timestamp", "ts", "stamp", "frame_time"]));
        if let Some(name) = times.filter(|_| missing.contains(&"t")) {
            return format!(
                ". Name the column {name} t_s where it is in seconds, or t_ms where it is in milliseconds"
            );
        }
        if missing.contains(&"t") && self.has_frame_numbers {
            return ". Numbers of frames are no times: write a column t in seconds (frame / frames a second)"
                .to_owned();
        }
        let near = self.ignored.iter().find_map(|name| {
            let known = NAMES
                .iter()
                .filter(|(_, column)| missing.contains(&column.needed_as()))
                .map(|(name, _)| *name);
            Some((name, spelling::nearest(name, known)?))
        });
        near.map(|(name, meant)| format!(". Is {name} the column {meant}?")).unwrap_or_default()
    }
}

impl Column {
    /// Its name among those that are needed; empty of another one.
    const fn needed_as(self) -> &'static str {
        match self {
            Self::Time | Self::TimeMillis => "t",
            Self::Id => "id",
            Self::Class => "class",
            Self::X => "x",
            Self::Y => "y",
            _ => "",
        }
    }
}
