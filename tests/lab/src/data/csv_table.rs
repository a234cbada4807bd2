//! CSV tables of users, read row by row. Errors name line, column and value.

use crate::data::seconds;
use std::borrow::Cow;
use std::io::{Chain, Cursor, Read};
use std::path::{Path, PathBuf};
use v2x_agent::trajectories::{Newlines, line_of, separator_of};
use v2x_common::class::Class;
use v2x_common::detection::{MAX_COORDINATE_M, MAX_SIZE_M, MIN_SIZE_M};
use v2x_common::geometry::{BevBox, wrap_angle};
use v2x_common::spelling;
use v2x_common::time::{StampUnit, Timestamp};

/// Why a table cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum CsvError {
    /// A file that cannot be opened.
    #[error("cannot read {}", .path.display())]
    Open {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// It cannot be parsed as CSV.
    #[error("{} is no table{}", .path.display(), if_no_text(.source))]
    NoTable {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: csv::Error,
    },
    /// Required columns are missing.
    #[error("{} has no column {missing}; needed are {needed}{hint}", .path.display())]
    MissingColumns {
        /// Which file.
        path: PathBuf,
        /// All missing columns.
        missing: String,
        /// All required columns.
        needed: String,
        /// What may be wrong, and what to write.
        hint: String,
    },
    /// A row has more cells than the header: often a comma was used as decimal point.
    #[error("{}, line {line}: {cells} cells under {columns} columns; is a comma used as decimal point?", .path.display())]
    TooManyCells {
        /// Which file.
        path: PathBuf,
        /// Counted from 1, the header included.
        line: u64,
        /// Cells of the row.
        cells: usize,
        /// Cells of the header.
        columns: usize,
    },
    /// An invalid value.
    #[error("{}, line {line}, column {column}: {value:?}, expected {expected}", .path.display())]
    Field {
        /// Which file.
        path: PathBuf,
        /// Counted from 1, the header included.
        line: u64,
        /// The column's name.
        column: &'static str,
        /// The value.
        value: String,
        /// What is valid.
        expected: String,
    },
}

/// Columns as others call them, each with what it is here.
const OTHER_NAMES: [(&str, &str); 18] = [
    ("sensor", "sensor_id"),
    ("agent", "sensor_id"),
    ("agent_id", "sensor_id"),
    ("camera", "sensor_id"),
    ("source", "sensor_id"),
    ("time", "t"),
    ("timestamp", "t"),
    ("captured_at", "t"),
    ("received_at", "t_arr"),
    ("label", "class"),
    ("type", "class"),
    ("category", "class"),
    ("width", "w"),
    ("length", "d"),
    ("depth", "d"),
    ("heading", "yaw"),
    ("theta", "yaw"),
    ("rotation", "yaw"),
];
/// Columns of a log of detections whose cells may be empty.
const MAY_BE_EMPTY: [&str; 8] = ["w", "d", "yaw", "sx", "sy", "sw", "sd", "st"];

/// A table. It holds one row at a time.
#[derive(Debug)]
pub(crate) struct CsvTable<R> {
    path: PathBuf,
    reader: csv::Reader<Newlines<Chain<Cursor<Vec<u8>>, R>>>,
    /// Where columns are separated by something else, a comma may be that of a number.
    has_decimal_commas: bool,
    n_columns: usize,
    places: Vec<(&'static str, usize)>,
    record: csv::StringRecord,
}

impl CsvTable<std::fs::File> {
    /// Opens a file; see [`CsvTable::new`].
    pub(crate) fn open(path: &Path, columns: (&[&'static str], &[&'static str])) -> Result<Self, CsvError> {
        let file =
            std::fs::File::open(path).map_err(|source| CsvError::Open { path: path.to_owned(), source })?;
        Self::new(file, path, columns)
    }
}

impl<R: Read> CsvTable<R> {
    /// Reads the header; its columns are separated by what it has most of: commas, semicolons or tabs. It must contain the first columns and may contain the second; all others are ignored. `path` is
    /// for errors.
    pub(crate) fn new(
        mut table: R,
        path: &Path,
        (needed, optional): (&[&'static str], &[&'static str]),
    ) -> Result<Self, CsvError> {
        let path = path.to_owned();
        // The error of a short row names the first missing column.
        let first = match first_line(&mut table) {
            Ok(first) => first,
            Err(source) => return Err(CsvError::NoTable { path, source: source.into() }),
        };
        let separator = separator_of(&first);
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(separator)
            .trim(csv::Trim::All)
            .flexible(true)
            .from_reader(Newlines::of(Cursor::new(first).chain(table)));
        let header = match reader.headers() {
            Ok(header) => header.clone(),
            Err(source) => return Err(CsvError::NoTable { path, source }),
        };
        let place = |column: &&'static str| Some((*column, header.iter().position(|name| name == *column)?));
        let missing: Vec<&str> = needed.iter().filter(|one| place(one).is_none()).copied().collect();
        if !missing.is_empty() {
            return Err(CsvError::MissingColumns {
                path,
                missing: missing.join(", "),
                needed: needed.join(","),
                hint: hint(&header, &missing),
            });
        }
        let places = needed.iter().chain(optional).filter_map(place).collect();
        let has_decimal_commas = separator != b',';
        Ok(Self {
            path,
            reader,
            has_decimal_commas,
            n_columns: header.len(),
            places,
            record: csv::StringRecord::new(),
        })
    }

    /// Whether the table has this column, of those that were requested.
    pub(crate) fn has(&self, column: &str) -> bool {
        self.places.iter().any(|(name, _)| *name == column)
    }

    /// The file, for errors.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Number of bytes read.
    pub(crate) fn n_bytes(&self) -> u64 {
        self.reader.position().byte()
    }

    /// The next row; `None` at the end.
    pub(crate) fn next_row(&mut self) -> Result<Option<Row<'_>>, CsvError> {
        let path = &self.path;
        match self.reader.read_record(&mut self.record) {
            Ok(true) => {}
            Ok(false) => return Ok(None),
            Err(source) => return Err(CsvError::NoTable { path: path.clone(), source }),
        }
        let line = line_of(&self.reader, &self.record);
        let (cells, columns) = (self.record.len(), self.n_columns);
        if cells > columns {
            return Err(CsvError::TooManyCells { path: path.clone(), line, cells, columns });
        }
        let has_decimal_commas = self.has_decimal_commas;
        Ok(Some(Row { record: &self.record, places: &self.places, has_decimal_commas, line, path }))
    }
}

/// One row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row<'a> {
    record: &'a csv::StringRecord,
    places: &'a [(&'static str, usize)],
    has_decimal_commas: bool,
    line: u64,
    path: &'a Path,
}

impl<'a> Row<'a> {
    /// Line number, counted from 1, the header included.
    pub(crate) const fn line(&self) -> u64 {
        self.line
    }

    /// The text in a column; empty where the column is missing.
    pub(crate) fn text(&self, column: &str) -> &'a str {
        let place = self.places.iter().find(|(name, _)| *name == column).map(|(_, place)| *place);
        place.and_then(|place| self.record.get(place)).unwrap_or_default()
    }

    /// The error of an invalid value in a column.
    pub(crate) fn wrong(&self, column: &'static str, expected: impl Into<String>) -> CsvError {
        let (path, value) = (self.path.to_owned(), self.text(column).to_owned());
        CsvError::Field { path, line: self.line, column, value, expected: expected.into() }
    }

    /// A number with a point, whatever it is written with.
    fn plain(&self, text: &'a str) -> Cow<'a, str> {
        if self.has_decimal_commas && text.contains(',') {
            Cow::Owned(text.replacen(',', ".", 1))
        } else {
            Cow::Borrowed(text)
        }
    }

    /// A number for which `ok` holds.
    pub(crate) fn number(
        &self,
        column: &'static str,
        ok: impl Fn(f64) -> bool,
        expected: &str,
    ) -> Result<f64, CsvError> {
        let text = self.text(column);
        let number = self.plain(text).parse().ok().filter(|value| ok(*value));
        number.ok_or_else(|| self.wrong(column, format!("{expected}{}", if_comma(text))))
    }

    /// Any number, `nan` and `inf` included: the reader decides what can be.
    pub(crate) fn any_number(&self, column: &'static str, expected: &str) -> Result<f64, CsvError> {
        self.number(column, |_| true, expected)
    }

    /// The same, or `None` for an empty cell. A row that ends before this column is an error.
    pub(crate) fn any_number_if_given(
        &self,
        column: &'static str,
        expected: &str,
    ) -> Result<Option<f64>, CsvError> {
        let place = self.places.iter().find(|(name, _)| *name == column).map(|(_, place)| *place);
        match place.and_then(|place| self.record.get(place)) {
            Some("") => Ok(None),
            _ => self.any_number(column, expected).map(Some),
        }
    }

    /// A number, or `None` for an empty cell or `nan`.
    pub(crate) fn number_if_any(
        &self,
        column: &'static str,
        expected: &str,
    ) -> Result<Option<f64>, CsvError> {
        let text = self.text(column);
        if text.is_empty() || text.eq_ignore_ascii_case("nan") {
            return Ok(None);
        }
        self.number(column, f64::is_finite, expected).map(Some)
    }

    /// A time in seconds.
    pub(crate) fn seconds(&self, column: &'static str) -> Result<Timestamp, CsvError> {
        let text = self.text(column);
        seconds::parse(&self.plain(text))
            .ok_or_else(|| self.wrong(column, expected_time(text) + if_comma(text)))
    }

    /// A class by its name in any of the known vocabularies; `None` for another name.
    pub(crate) fn class(&self, column: &'static str) -> Result<Option<Class>, CsvError> {
        match self.text(column) {
            "" => Err(self.wrong(column, "a class such as car or vehicle.car")),
            name => Ok(Class::from_name(name)),
        }
    }

    /// The box in the columns x, y, those of its size (all in m) and yaw (rad), which may hold any number of turns.
    pub(crate) fn bev(&self, [w, d]: [&'static str; 2]) -> Result<BevBox, CsvError> {
        let coordinate =
            |column| self.number(column, |x| x.abs() <= MAX_COORDINATE_M, "a coordinate in m, at most 1e8");
        let size =
            |column| self.number(column, |size| (MIN_SIZE_M..=MAX_SIZE_M).contains(&size), "0.001 to 65 m");
        Ok(BevBox {
            x: coordinate("x")?,
            y: coordinate("y")?,
            w: size(w)?,
            d: size(d)?,
            yaw: wrap_angle(self.number("yaw", f64::is_finite, "an angle in rad")?),
        })
    }
}

/// What comes up to the end of the first line that is not empty, or to where no header goes on.
fn first_line(table: &mut impl Read) -> std::io::Result<Vec<u8>> {
    const LONGEST: u64 = 65_536;
    const AT_ONCE: u64 = 256;
    let mut first = Vec::new();
    let is_end = |byte: &u8| matches!(byte, b'\n' | b'\r');
    while (first.len() as u64) < LONGEST && !first.trim_ascii_start().iter().any(is_end) {
        if table.by_ref().take(AT_ONCE).read_to_end(&mut first)? == 0 {
            break;
        }
    }
    Ok(first)
}

/// What is said of a number with a decimal comma.
fn if_comma(text: &str) -> &'static str {
    let is_number = text.contains(',') && text.replacen(',', ".", 1).parse::<f64>().is_ok();
    if is_number { ", with a point in place of the comma" } else { "" }
}

/// What is said of a file that is no text in UTF-8.
fn if_no_text(error: &csv::Error) -> &'static str {
    match error.kind() {
        csv::ErrorKind::Utf8 { .. } => {
            ": it is no text in UTF-8, but perhaps in Latin-1, or in UTF-16, as a spreadsheet writes \"Unicode text\": save it as CSV in UTF-8"
        }
        _ => "",
    }
}

/// What may be wrong with a header that lacks columns.
fn hint(header: &csv::StringRecord, missing: &[&str]) -> String {
    let first = header.get(0).unwrap_or_default();
    for (separator, name) in [('|', "`|`"), (' ', "spaces")] {
        if header.len() == 1 && first.contains(separator) {
            let names: Vec<&str> = first.split(separator).map(str::trim).collect();
            let missing: Vec<&str> = missing.iter().filter(|one| !names.contains(one)).copied().collect();
            let points = "commas, and points in numbers (1.5, and not 1,5)";
            return format!(
                ". Its columns are separated by {name}: write {points}{}",
                hint_of_names(&names, &missing)
            );
        }
    }
    hint_of_names(&header.iter().collect::<Vec<_>>(), missing)
}

/// The same of the names alone.
fn hint_of_names(header: &[&str], missing: &[&str]) -> String {
    let is_other_case = |one: &&&str| header.iter().any(|name| name.eq_ignore_ascii_case(one));
    let other: Vec<&str> = missing.iter().filter(is_other_case).copied().collect();
    let names = |names: &[&str]| names.join(", ");
    if !other.is_empty() {
        return format!(". Names of columns are in small letters: write {}", names(&other));
    }
    let mut hints = Vec::new();
    let meant = |one: &&str| {
        let other = OTHER_NAMES.iter().filter(|(_, ours)| ours == one).map(|(other, _)| *other);
        let other =
            other.into_iter().find_map(|other| header.iter().find(|name| name.eq_ignore_ascii_case(other)));
        let written = other.copied().or_else(|| {
            // Names of one or two letters are near to each other, whatever they mean.
            let long = |name: &&str| name.len() > 3 && one.len() > 3;
            spelling::nearest(one, header.iter().copied().filter(long))
        })?;
        Some(format!("call the column {written} {one}"))
    };
    hints.extend(missing.iter().filter_map(meant));
    if missing.contains(&"t_arr") {
        hints.push("where the time of arrival is not known, write t as t_arr, too".to_owned());
    }
    let optional: Vec<&str> = missing.iter().filter(|one| MAY_BE_EMPTY.contains(one)).copied().collect();
    // Of the truth every cell is needed.
    let is_log = header.iter().chain(missing).any(|name| matches!(*name, "t_arr" | "sensor_id"));
    if is_log || missing.iter().any(|one| one.starts_with('s') && optional.contains(one)) {
        let cells = (!optional.is_empty()).then(|| format!("the cells of {} may be empty", names(&optional)));
        hints.extend(cells);
    }
    hints.iter().map(|one| format!("; {one}")).collect()
}

/// What is expected instead of a text that is no time in seconds, with the unit that it seems to be in.
fn expected_time(text: &str) -> String {
    /// The largest time, 292 years.
    const MAX_S: f64 = 9.22e9;
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() && number.abs() > MAX_S => match StampUnit::of(number) {
            Some(unit) => format!("a time in s (it seems to be in {})", unit.name()),
            None => "a time in s, 9.22e9 at most (is it in milli-, micro- or nanoseconds?)".to_owned(),
        },
        _ => "a time in s".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> Result<CsvTable<&[u8]>, CsvError> {
        CsvTable::new(text.as_bytes(), Path::new("a.csv"), (&["x", "y"], &["z"]))
    }

    #[test]
    fn all_missing_columns_are_named_at_once() {
        let message = table("z,w\n").unwrap_err().to_string();
        assert_eq!(message, "a.csv has no column x, y; needed are x,y");
    }

    #[test]
    fn separators_capitals_and_columns_that_may_be_empty_are_hinted_at() {
        let hint = |needed: &[&'static str], text: &str| {
            let error = CsvTable::new(text.as_bytes(), Path::new("a.csv"), (needed, &[])).unwrap_err();
            error.to_string().split_once(needed.join(",").as_str()).unwrap().1.to_owned()
        };
        let points = "commas, and points in numbers (1.5, and not 1,5)";
        assert_eq!(hint(&["x", "y"], "x|y\n"), format!(". Its columns are separated by `|`: write {points}"));
        let capitals = hint(&["x", "y"], "X|Y\n");
        assert!(
            capitals.contains("separated by `|`") && capitals.ends_with("in small letters: write x, y"),
            "{capitals}"
        );
        assert_eq!(hint(&["x", "sensor_id"], "x,sensor\n"), "; call the column sensor sensor_id");
        assert_eq!(hint(&["x", "class"], "x,clas\n"), "; call the column clas class");
        assert_eq!(hint(&["x", "y"], "X,Y\n"), ". Names of columns are in small letters: write x, y");
        assert_eq!(hint(&["x", "yaw"], "t_arr,sensor_id,x\n"), "; the cells of yaw may be empty");
        assert_eq!(hint(&["x", "yaw"], "t,object_id,x\n"), "");
        let words = hint(&["t_arr", "t", "sx"], "t\n");
        assert_eq!(
            words,
            "; where the time of arrival is not known, write t as t_arr, too; the cells of sx may be empty"
        );
    }

    #[test]
    fn decimal_commas_and_other_encodings_are_called_by_their_names() {
        let mut quoted = table("x,y\n\"1,5\",2\n").unwrap();
        let row = quoted.next_row().unwrap().unwrap();
        let error = row.number("x", |_| true, "a number").unwrap_err().to_string();
        assert!(error.ends_with("\"1,5\", expected a number, with a point in place of the comma"), "{error}");
        let error = table("x,y\n1,5,2,5\n").unwrap().next_row().unwrap_err().to_string();
        assert!(
            error.contains("4 cells under 2 columns") && error.ends_with("is a comma used as decimal point?"),
            "{error}"
        );
        let utf16: Vec<u8> = "\u{feff}x,y\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
        let error = CsvTable::new(&utf16[..], Path::new("a.csv"), (&["x"], &[])).unwrap_err().to_string();
        assert!(error.contains("UTF-16") && error.contains("save it as CSV in UTF-8"), "{error}");
    }

    #[test]
    fn semicolons_and_tabs_separate_columns_too_and_then_numbers_may_have_decimal_commas() {
        for text in
            ["x;y\n1,5;-2e3\n", "\u{feff}x;y\n1.5;-2000,0\n", "x\ty\r\n1,5\t-2000\r\n", "x,y\n1.5,-2000\n"]
        {
            let mut table = table(text).unwrap();
            let row = table.next_row().unwrap().unwrap();
            let number = |column| row.number(column, f64::is_finite, "a number").unwrap();
            assert_eq!([number("x"), number("y")], [1.5, -2000.0], "{text:?}");
        }
        let mut times = table("x;y\n12,345;0\n").unwrap();
        let row = times.next_row().unwrap().unwrap();
        assert_eq!(row.seconds("x").unwrap(), Timestamp::EPOCH + v2x_common::time::Span::from_millis(12_345));
    }

    #[test]
    fn columns_stand_in_any_order_and_others_are_ignored() {
        let mut table = table("\u{feff}w,y, x\n1,2,3\n").unwrap();
        assert!(table.has("x") && !table.has("z") && !table.has("w"));
        let row = table.next_row().unwrap().unwrap();
        assert_eq!((row.text("x"), row.text("y"), row.text("w"), row.line()), ("3", "2", "", 2));
        assert!(table.next_row().unwrap().is_none());
    }

    #[test]
    fn rows_that_are_too_short_or_too_long_are_errors_with_their_line() {
        let mut short = table("x,y\n1,2\n3\n").unwrap();
        short.next_row().unwrap();
        let row = short.next_row().unwrap().unwrap();
        let message = row.number("y", f64::is_finite, "a number").unwrap_err().to_string();
        assert_eq!(message, "a.csv, line 3, column y: \"\", expected a number");
        let message = table("x,y\n1,2,5\n").unwrap().next_row().unwrap_err().to_string();
        assert_eq!(message, "a.csv, line 2: 3 cells under 2 columns; is a comma used as decimal point?");
    }

    #[test]
    fn lines_are_counted_whatever_they_end_in() {
        for text in ["x,y\r\n1,2\r\n\r\nbad,3\r\n", "x,y\n1,2\n\nbad,3"] {
            let mut table = table(text).unwrap();
            assert_eq!(table.next_row().unwrap().map(|row| row.line()), Some(2), "{text:?}");
            let message = table.next_row().unwrap().unwrap().seconds("x").unwrap_err().to_string();
            assert!(message.starts_with("a.csv, line 4, column x: \"bad\""), "{message}");
        }
    }

    #[test]
    fn a_time_in_another_unit_since_1970_is_named_with_the_unit() {
        for (x, unit) in [
            ("1700000000050", "a time in s (it seems to be in milliseconds)"),
            ("1.7e15", "a time in s (it seems to be in microseconds)"),
            ("1700000000050000000", "a time in s (it seems to be in nanoseconds)"),
            ("58000000000", "a time in s, 9.22e9 at most (is it in milli-, micro- or nanoseconds?)"),
            ("soon", "a time in s"),
        ] {
            let text = format!("x,y\n{x},0\n");
            let mut table = table(&text).unwrap();
            let message = table.next_row().unwrap().unwrap().seconds("x").unwrap_err().to_string();
            assert_eq!(message, format!("a.csv, line 2, column x: {x:?}, expected {unit}"));
        }
    }
}
