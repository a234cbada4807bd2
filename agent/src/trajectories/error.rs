//! Why recorded traffic cannot be used.

use super::units::{LONG_STEP_S, unit_of_step};
use crate::nuscenes::TableError;
use std::fmt;
use v2x_common::time::Span;

/// A part of a text that holds a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Of a table.
    Column,
    /// Of XML.
    Attribute,
    /// Of XML.
    Element,
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Column => "column",
            Self::Attribute => "attribute",
            Self::Element => "element",
        })
    }
}

/// Why recorded traffic cannot be used. The caller names the file.
#[derive(Debug, thiserror::Error)]
pub enum TrafficError {
    /// Reading failed.
    #[error("cannot be read: {0}")]
    Read(#[from] std::io::Error),
    /// It is neither a table nor XML.
    #[error("{0}")]
    Format(&'static str),
    /// It has no rows.
    #[error("has no rows{0}")]
    Empty(String),
    /// A part of it was to be read, which counts from its earliest time, and that is not in its first row: read it again with
    /// this one in the options.
    #[error(
        "the earliest time is {earliest_s} s, and not in the first row: sort the rows by time, or read all of it, without from_s and to_s"
    )]
    EarlierRow {
        /// The earliest time, s.
        earliest_s: f64,
    },
    /// All rows are of one time.
    #[error(
        "has one time only: a trajectory needs a place at two times or more (for what stands, repeat its row)"
    )]
    OneTime,
    /// Columns are missing.
    #[error(
        "line {line}: no column {missing}; needed are t, id, class, x, y (optional yaw, w, d); found are {found}{hint}"
    )]
    MissingColumns {
        /// Of the header, counted from 1.
        line: u64,
        /// All missing columns.
        missing: String,
        /// The columns of the header.
        found: String,
        /// What may be meant by others.
        hint: String,
    },
    /// The text is no CSV.
    #[error("is no table{}", if_no_text(.0))]
    Table(#[from] csv::Error),
    /// The text is no XML.
    #[error("line {line}: {cause}")]
    Xml {
        /// Counted from 1.
        line: u64,
        /// The cause.
        cause: String,
    },
    /// A row has more cells than the header.
    #[error("line {line}: {cells} cells under {columns} columns; is a comma used as decimal point?")]
    TooManyCells {
        /// Counted from 1.
        line: u64,
        /// Cells of the row.
        cells: usize,
        /// Columns of the header.
        columns: usize,
    },
    /// An invalid value.
    #[error("line {line}, {part} {column}: {value:?}, expected {expected}")]
    Value {
        /// Counted from 1.
        line: u64,
        /// What it is in.
        part: Part,
        /// Name of the column, attribute or element.
        column: String,
        /// The value.
        value: String,
        /// What is valid.
        expected: &'static str,
    },
    /// One object is at two places at one time.
    #[error(
        "lines {first} and {second}: object {id} has two rows at {t_s} s; one object has one place at a time"
    )]
    Duplicate {
        /// The object.
        id: String,
        /// The time in the file, s.
        t_s: f64,
        /// Line of a row.
        first: u64,
        /// Line of the other.
        second: u64,
    },
    /// More rows than are kept.
    #[error("line {line}: more than {limit} rows; keep a part of the time by from_s and to_s")]
    TooManyRows {
        /// Counted from 1.
        line: u64,
        /// How many are kept.
        limit: usize,
    },
    /// No such scene.
    #[error("has no scene {wanted:?}; it has {known}")]
    NoSuchScene {
        /// The scene.
        wanted: String,
        /// The first scenes of the file.
        known: String,
    },
    /// A folder without the tables of nuScenes.
    #[error("is a folder, which has to hold the tables of nuScenes, but {0}")]
    Folder(String),
    /// A table of nuScenes.
    #[error("{0}")]
    Tables(TableError),
    /// The recording is too short or too long to be a world.
    #[error("lasts {length}, expected 0.1 s to 7 days{}", unit_in_words(*.step))]
    Length {
        /// From the first row to the last.
        length: Span,
        /// Usual time between two rows of an object.
        step: Span,
    },
}

/// The unit that times seem to be in, where rows are so far apart.
fn unit_in_words(step: Span) -> String {
    let step_s = step.as_secs_f64();
    let unit = (step_s >= LONG_STEP_S).then(|| unit_of_step(step_s));
    let words = unit.map(|(unit, change)| format!(": a row each {step_s} s; t looks like {unit}, {change}"));
    words.unwrap_or_default()
}

impl From<TableError> for TrafficError {
    fn from(cause: TableError) -> Self {
        Self::Tables(cause)
    }
}

/// What may be wrong with a text that is not UTF-8. Of another fault the reader of CSV says itself what it is.
fn if_no_text(error: &csv::Error) -> &'static str {
    match error.kind() {
        csv::ErrorKind::Utf8 { .. } => {
            ": it is no text in UTF-8, but in Latin-1, say, or no text at all; save it as UTF-8"
        }
        _ => "",
    }
}
