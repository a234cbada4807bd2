//! One JSON table: a long list of records. One record at a time is in memory.

use serde::de::{DeserializeSeed, Deserializer, Error as _, IgnoredAny, SeqAccess, Visitor};
use serde_json::Value;
use std::fmt;
use std::io::{self, BufRead};

/// Opens a table by its name.
pub type OpenTable<'a> = dyn Fn(&str) -> io::Result<Box<dyn BufRead>> + 'a;

/// Why a table cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// It cannot be opened.
    #[error("cannot read table {table}: {cause}")]
    Open {
        /// Its name.
        table: &'static str,
        /// Why.
        cause: io::Error,
    },
    /// It is no JSON list.
    #[error("table {table}, record {record} (counted from 0): {cause}")]
    Json {
        /// Its name.
        table: &'static str,
        /// The first record that could not be read.
        record: usize,
        /// Where and why.
        cause: serde_json::Error,
    },
    /// A field is missing or invalid.
    #[error("table {table}, record {record}, field {field}: {value}, expected {expected}")]
    Field {
        /// The table's name.
        table: &'static str,
        /// The record's token, or its number.
        record: String,
        /// The field's name.
        field: &'static str,
        /// The value.
        value: Value,
        /// What is valid.
        expected: &'static str,
    },
    /// A keyframe without a lidar sweep.
    #[error(
        "table sample, record {record}, field token: no key frame of LIDAR_TOP in table sample_data is of it"
    )]
    NoSweep {
        /// The sample's token.
        record: String,
    },
}

/// One record of a table.
pub(super) struct Record {
    table: &'static str,
    number: usize,
    value: Value,
}

impl Record {
    /// An error about one of its fields.
    pub(super) fn wrong(&self, field: &'static str, expected: &'static str) -> TableError {
        let token = self.value.get("token").and_then(Value::as_str);
        TableError::Field {
            table: self.table,
            record: token.map_or_else(|| self.number.to_string(), str::to_owned),
            field,
            value: self.value.get(field).cloned().unwrap_or_default(),
            expected,
        }
    }

    pub(super) fn text(&self, field: &'static str) -> Result<&str, TableError> {
        let text = self.value.get(field).and_then(Value::as_str);
        text.ok_or_else(|| self.wrong(field, "a text"))
    }

    pub(super) fn flag(&self, field: &'static str) -> Result<bool, TableError> {
        self.value.get(field).and_then(Value::as_bool).ok_or_else(|| self.wrong(field, "true or false"))
    }

    pub(super) fn whole(&self, field: &'static str) -> Result<i64, TableError> {
        self.value.get(field).and_then(Value::as_i64).ok_or_else(|| self.wrong(field, "a whole number"))
    }

    /// A list of N numbers.
    pub(super) fn numbers<const N: usize>(
        &self,
        field: &'static str,
        expected: &'static str,
    ) -> Result<[f64; N], TableError> {
        let list = self.value.get(field).and_then(Value::as_array).filter(|list| list.len() == N);
        let numbers: Option<Vec<f64>> = list.and_then(|list| list.iter().map(Value::as_f64).collect());
        numbers.and_then(|numbers| numbers.try_into().ok()).ok_or_else(|| self.wrong(field, expected))
    }
}

/// Calls `take` with every record of a table.
pub(super) fn each(
    open: &OpenTable<'_>,
    table: &'static str,
    mut take: impl FnMut(&Record) -> Result<(), TableError>,
) -> Result<(), TableError> {
    let text = match open(table) {
        Ok(text) => text,
        Err(cause) => return Err(TableError::Open { table, cause }),
    };
    let mut records = Records { table, number: 0, refused: None, take: &mut take };
    let mut reader = serde_json::Deserializer::from_reader(text);
    let outcome = (&mut records).deserialize(&mut reader).and_then(|()| reader.end());
    match (records.refused, outcome) {
        (Some(refused), _) => Err(refused),
        (None, Err(cause)) => Err(TableError::Json { table, record: records.number, cause }),
        (None, Ok(())) => Ok(()),
    }
}

/// The list, as serde visits it.
struct Records<'a> {
    table: &'static str,
    number: usize,
    refused: Option<TableError>,
    take: &'a mut dyn FnMut(&Record) -> Result<(), TableError>,
}

impl<'de> DeserializeSeed<'de> for &mut Records<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for &mut Records<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list of records")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<(), A::Error> {
        while let Some(value) = list.next_element::<Value>()? {
            let record = Record { table: self.table, number: self.number, value };
            if let Err(refused) = (self.take)(&record) {
                self.refused = Some(refused);
                return Err(A::Error::custom("stopped"));
            }
            self.number += 1;
        }
        list.next_element::<IgnoredAny>().map(|_| ())
    }
}
