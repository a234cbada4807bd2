//! Tables of rows with a header.

use std::f64::consts::FRAC_PI_2;
use std::io::BufRead;

use v2x_common::detection::{MAX_COORDINATE_M, MAX_SIZE_M, MIN_SIZE_M};

use super::builder::{At, Builder, Kind, Row};
use super::columns::{Column, Columns};
use super::error::{Part, TrafficError};
use super::newlines::{Newlines, line_of};
use super::options::ReadOptions;
use super::traffic::{EGO, Format, Traffic};

/// Farther times are in another unit, s.
const LATEST_S: f64 = 9e9;
/// Scenes that are named in an error.
const NAMED: usize = 12;
const TIME: &str = "a time in s (a column t_ms holds milliseconds)";

/// Reads a table; its separator is the one of its first line.
pub(super) fn read(
    input: impl BufRead,
    delimiter: u8,
    options: &ReadOptions,
) -> Result<Traffic, TrafficError> {
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .trim(csv::Trim::All)
        .flexible(true)
        .from_reader(Newlines::of(input));
    let header = reader.headers()?.clone();
    let columns = Columns::of(header.iter());
    let missing = columns.missing();
    if !missing.is_empty() {
        let (line, found) = (line_of(&reader, &header), header.iter().collect::<Vec<_>>().join(", "));
        let hint = columns.hint(&missing);
        return Err(TrafficError::MissingColumns { line, missing: missing.join(", "), found, hint });
    }
    let mut rows = Rows {
        columns: &columns,
        delimiter,
        builder: Builder::new(options),
        other_scenes: Vec::new(),
        ego: None,
    };
    rows.builder.ignored(&columns.ignored);
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record)? {
        rows.add(&record, line_of(&reader, &record), options)?;
    }
    rows.finish(options)
}

struct Rows<'a> {
    columns: &'a Columns,
    delimiter: u8,
    builder: Builder<'a>,
    other_scenes: Vec<String>,
    /// The time of the ego's last row: each time has one, whatever the number of objects.
    ego: Option<f64>,
}

impl Rows<'_> {
    fn add(
        &mut self,
        record: &csv::StringRecord,
        line: u64,
        options: &ReadOptions,
    ) -> Result<(), TrafficError> {
        let has_decimal_commas = self.delimiter != b',';
        let cells = Cells { columns: self.columns, record, line, has_decimal_commas };
        let n = record.len();
        // A separator may follow the last cell.
        if n > self.columns.n && record.iter().skip(self.columns.n).any(|cell| !cell.is_empty()) {
            return Err(TrafficError::TooManyCells { line, cells: n, columns: self.columns.n });
        }
        if !self.is_wanted(cells.text(Column::Scene), options) {
            return Ok(());
        }
        let row = cells.row()?;
        self.builder.add(&row)?;
        if self.columns.format == Format::Laboratory && self.ego != Some(row.t_s) {
            self.ego = Some(row.t_s);
            // The columns `ego_x`, `ego_y`, `ego_yaw`.
            if let Some(at) = cells.ego()? {
                let row = Row { id: EGO, kind: Kind::Name("car"), at, size: (None, None), ..row };
                self.builder.add(&row)?;
            }
        }
        Ok(())
    }

    /// Whether a row is of the scene that is read: the one that is asked for, or the first one.
    fn is_wanted(&mut self, scene: Option<&str>, options: &ReadOptions) -> bool {
        let Some(scene) = scene else { return true };
        let wanted = options.scene.as_deref().or(self.builder.scene.as_deref()).unwrap_or(scene);
        if wanted == scene {
            if self.builder.scene.is_none() {
                self.builder.scene = Some(scene.to_owned());
            }
            return true;
        }
        if self.other_scenes.len() < NAMED && self.other_scenes.iter().all(|other| other != scene) {
            self.other_scenes.push(scene.to_owned());
        }
        false
    }

    fn finish(mut self, options: &ReadOptions) -> Result<Traffic, TrafficError> {
        let others = self.other_scenes.join(", ");
        match (&options.scene, &self.builder.scene) {
            (Some(wanted), None) => {
                let known = if others.is_empty() { "none".to_owned() } else { others };
                return Err(TrafficError::NoSuchScene { wanted: wanted.clone(), known });
            }
            (None, Some(scene)) if !others.is_empty() => {
                let note = format!("scene {scene} of several; others by  scene = \"…\": {others}");
                self.builder.remarks.notes.push(note);
            }
            _ => {}
        }
        self.builder.finish(self.columns.format)
    }
}

/// The cells of one row.
#[derive(Clone, Copy)]
struct Cells<'a> {
    columns: &'a Columns,
    record: &'a csv::StringRecord,
    /// Counted from 1.
    line: u64,
    has_decimal_commas: bool,
}

impl<'a> Cells<'a> {
    /// The text in a column; `None` where there is no such column.
    fn text(&self, column: Column) -> Option<&'a str> {
        let (place, _) = self.columns.find(column)?;
        Some(self.record.get(place).unwrap_or_default())
    }

    fn wrong(&self, column: Column, expected: &'static str) -> TrafficError {
        TrafficError::Value {
            line: self.line,
            column: self.columns.find(column).map_or("", |(_, name)| name).to_owned(),
            part: Part::Column,
            value: self.text(column).unwrap_or_default().to_owned(),
            expected,
        }
    }

    fn number(
        &self,
        column: Column,
        expected: &'static str,
        ok: impl Fn(f64) -> bool,
    ) -> Result<f64, TrafficError> {
        let text = self.text(column).unwrap_or_default();
        let number = if self.has_decimal_commas { text.replace(',', ".").parse() } else { text.parse() };
        number.ok().filter(|value| ok(*value)).ok_or_else(|| self.wrong(column, expected))
    }

    /// A number; `None` where the column is missing, or the cell empty or `nan`.
    fn number_if_any(
        &self,
        column: Column,
        expected: &'static str,
        ok: impl Fn(f64) -> bool,
    ) -> Result<Option<f64>, TrafficError> {
        match self.text(column) {
            None | Some("") => Ok(None),
            Some(text) if text.eq_ignore_ascii_case("nan") => Ok(None),
            Some(_) => self.number(column, expected, ok).map(Some),
        }
    }

    fn name(&self, column: Column, expected: &'static str) -> Result<&'a str, TrafficError> {
        self.text(column).filter(|name| !name.is_empty()).ok_or_else(|| self.wrong(column, expected))
    }

    fn row(&self) -> Result<Row<'a>, TrafficError> {
        let is_time = |t: f64| t.abs() <= LATEST_S;
        let t_s = if self.columns.find(Column::Time).is_some() {
            self.number(Column::Time, TIME, is_time)?
        } else {
            self.number(Column::TimeMillis, "a time in ms", |t| is_time(t / 1e3))? / 1e3
        };
        let size = |column| {
            let size = self.number_if_any(column, "a size of 0.001 to 65 m, or nothing", |size| {
                size == 0.0 || (MIN_SIZE_M..=MAX_SIZE_M).contains(&size)
            });
            size.map(|size| size.filter(|size| *size > 0.0))
        };
        Ok(Row {
            line: self.line,
            t_s,
            id: self.name(Column::Id, "an id")?,
            kind: Kind::Name(self.name(Column::Class, "a class such as car or vehicle.car")?),
            at: At {
                x: self.coordinate(Column::X)?,
                y: self.coordinate(Column::Y)?,
                yaw: self.yaw()?,
                is_front: false,
            },
            size: (size(Column::Width)?, size(Column::Depth)?),
        })
    }

    fn coordinate(&self, column: Column) -> Result<f64, TrafficError> {
        self.number(column, "a coordinate in m, at most 1e8", |value| value.abs() <= MAX_COORDINATE_M)
    }

    /// Radians, counter-clockwise from east; not a number where the row does not say.
    fn yaw(&self) -> Result<f64, TrafficError> {
        let angle = |column, expected| self.number_if_any(column, expected, f64::is_finite);
        let degrees = "an angle in degrees, or nothing";
        if let Some(yaw) = angle(Column::Yaw, "an angle in rad, or nothing")? {
            return Ok(yaw);
        }
        if let Some(yaw_deg) = angle(Column::YawDegrees, degrees)? {
            return Ok(yaw_deg.to_radians());
        }
        Ok(angle(Column::Compass, degrees)?
            .map_or(f64::NAN, |compass_deg| FRAC_PI_2 - compass_deg.to_radians()))
    }

    /// The ego of the laboratory's tables, where it is known.
    fn ego(&self) -> Result<Option<At>, TrafficError> {
        let number = |column, ok: fn(f64) -> bool| self.number_if_any(column, "a number, or nan", ok);
        let coordinate = |column| number(column, |value| value.abs() <= MAX_COORDINATE_M);
        let (x, y) = (coordinate(Column::EgoX)?, coordinate(Column::EgoY)?);
        let yaw = number(Column::EgoYaw, f64::is_finite)?;
        let (Some(x), Some(y)) = (x, y) else { return Ok(None) };
        Ok(Some(At { x, y, yaw: yaw.unwrap_or(f64::NAN), is_front: false }))
    }
}
