//! Recorded delays and losses.

use v2x_common::time::Span;

/// One recorded frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TracePoint {
    /// When it was sent, since the start of the recording, s.
    pub t_s: f64,
    /// Its delay, s.
    pub delay_s: f64,
    /// Whether it was lost.
    pub is_lost: bool,
}

/// A recording, which repeats from its start when it ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// By time; never empty.
    points: Vec<TracePoint>,
    length_s: f64,
}

/// Why a recording cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TraceError {
    /// A row that cannot be read.
    #[error("line {line}: {source}")]
    Row {
        /// Its line.
        line: usize,
        /// What is wrong with it.
        source: RowError,
    },
    /// No rows.
    #[error("no rows; expected the columns t_s, delay_s, lost")]
    Empty,
}

/// What is wrong with a row.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RowError {
    /// The header lacks a column.
    #[error("no column {column} in {header:?}")]
    Column {
        /// The column's name.
        column: &'static str,
        /// The header found.
        header: String,
    },
    /// A cell that is no finite number.
    #[error("{column} is {cell:?}, expected a number")]
    Number {
        /// The column's name.
        column: &'static str,
        /// The cell found.
        cell: String,
    },
    /// A loss that is neither no nor yes.
    #[error("lost is {0}, expected 0 or 1")]
    Lost(f64),
    /// A delay outside of its limits, s.
    #[error("delay is {0}, expected 0 to 600 s")]
    Delay(f64),
    /// A time before that of the row above, s.
    #[error("t goes back to {0}")]
    Backward(f64),
}

/// Places of the columns in a row; other columns are ignored.
struct Columns {
    t: usize,
    delay: usize,
    lost: Option<usize>,
}

impl Trace {
    /// Reads CSV: columns `t` (s), `delay` (s) and perhaps `lost` (0 or 1), in any order, with a header; rows by
    /// rising time.
    pub fn from_csv(text: &str) -> Result<Self, TraceError> {
        let mut lines = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty());
        let (line, header) = lines.next().ok_or(TraceError::Empty)?;
        let columns = Columns::of(header).map_err(|source| TraceError::Row { line, source })?;
        let mut points: Vec<TracePoint> = Vec::new();
        for (line, row) in lines {
            let point = columns.read(row).map_err(|source| TraceError::Row { line, source })?;
            if points.last().is_some_and(|last| last.t_s > point.t_s) {
                return Err(TraceError::Row { line, source: RowError::Backward(point.t_s) });
            }
            points.push(point);
        }
        let (first, last) = (points.first().ok_or(TraceError::Empty)?.t_s, points[points.len() - 1].t_s);
        points.iter_mut().for_each(|point| point.t_s -= first);
        // The last row is valid for the mean interval between rows.
        let n = points.len() as f64;
        let length_s = (last - first) * if n > 1.0 { n / (n - 1.0) } else { 1.0 };
        Ok(Self { points, length_s })
    }

    /// The recorded frame that was sent last at this time since the start.
    pub fn at(&self, since_start: Span) -> TracePoint {
        let t_s = since_start.as_secs_f64();
        let t_s =
            if self.length_s > 0.0 { t_s - self.length_s * libm::floor(t_s / self.length_s) } else { 0.0 };
        let after = self.points.partition_point(|point| point.t_s <= t_s);
        self.points[after.saturating_sub(1)]
    }

    /// Whether it contains losses.
    pub fn loses(&self) -> bool {
        self.points.iter().any(|point| point.is_lost)
    }
}

impl Columns {
    fn of(header: &str) -> Result<Self, RowError> {
        let names: Vec<String> = header.split(',').map(|name| name.trim().to_lowercase()).collect();
        let place = |wanted: [&str; 2]| names.iter().position(|name| wanted.contains(&name.as_str()));
        let needed = |wanted: [&'static str; 2]| {
            place(wanted).ok_or_else(|| RowError::Column { column: wanted[0], header: header.to_owned() })
        };
        Ok(Self {
            t: needed(["t", "t_s"])?,
            delay: needed(["delay", "delay_s"])?,
            lost: place(["lost", "is_lost"]),
        })
    }

    fn read(&self, row: &str) -> Result<TracePoint, RowError> {
        let cells: Vec<&str> = row.split(',').map(str::trim).collect();
        let number = |column: &'static str, place: usize| {
            let cell = cells.get(place).copied().unwrap_or_default();
            let number = cell.parse::<f64>().ok().filter(|number| number.is_finite());
            number.ok_or_else(|| RowError::Number { column, cell: cell.to_owned() })
        };
        let is_lost = match self.lost.map(|place| number("lost", place)).transpose()? {
            None => false,
            Some(lost) if lost == 0.0 || lost == 1.0 => lost == 1.0,
            Some(lost) => return Err(RowError::Lost(lost)),
        };
        // A lost frame has no delay.
        let delay_s = if is_lost { 0.0 } else { number("delay", self.delay)? };
        if !(0.0..=600.0).contains(&delay_s) {
            return Err(RowError::Delay(delay_s));
        }
        Ok(TracePoint { t_s: number("t", self.t)?, delay_s, is_lost })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "t,delay,size,lost\n10.0,0.02,900,0\n10.1,0.05,900,0\n10.2,,900,1\n";

    #[test]
    fn a_recorded_frame_is_valid_until_the_next_and_the_recording_repeats() {
        let trace = Trace::from_csv(TEXT).unwrap();
        let at = |ms: i64| trace.at(Span::from_millis(ms));
        assert_eq!((at(0).delay_s, at(99).delay_s, at(101).delay_s), (0.02, 0.02, 0.05));
        assert!(at(250).is_lost && !at(301).is_lost);
        assert_eq!(at(301).delay_s, 0.02);
    }

    #[test]
    fn errors_name_the_line_and_the_value() {
        for (text, named) in [
            ("", "no rows"),
            ("t,lost\n", "line 1: no column delay"),
            ("t,delay\n0,fast\n", "line 2: delay is \"fast\""),
            ("t,delay\n1,0.1\n0,0.1\n", "line 3: t goes back to 0"),
            ("t,delay,lost\n0,0.1,2\n", "line 2: lost is 2"),
            ("t,delay\n0,-1\n", "delay is -1"),
        ] {
            let message = Trace::from_csv(text).unwrap_err().to_string();
            assert!(message.contains(named), "{message:?} should name {named:?}");
        }
    }
}
