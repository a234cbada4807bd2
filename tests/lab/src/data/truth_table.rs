//! The ground truth of a log: a table, interpolated to any time.

use crate::data::csv_table::{CsvError, CsvTable, Row};
use crate::data::seconds;
use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;
use v2x_agent::truth::{ObjectId, TrueObject};
use v2x_common::class::Class;
use v2x_common::geometry::{BevBox, angle_difference, wrap_angle};
use v2x_common::reported::RawHeadings;
use v2x_common::time::{Span, Timestamp};

/// Required columns.
pub(crate) const COLUMNS: [&str; 10] = ["t", "object_id", "class", "x", "y", "vx", "vy", "w", "d", "yaw"];
/// A row within this time is used without interpolation.
pub(crate) const TOLERANCE: Span = Span::from_millis(1);
/// The rows within this time before and after show whether an object moves: labels of parked cars jump by decimetres from row
/// to row, and the velocities that were made of them by metres per second.
const AROUND: Span = Span::from_millis(500);
/// Rows that are nearer to each other say nothing of it.
const LEAST_APART: Span = Span::from_millis(300);

/// One row of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sample {
    at: Timestamp,
    bev: BevBox,
    velocity: Option<(f64, f64)>,
    line: u64,
}

/// All rows of an object.
#[derive(Clone, Debug, PartialEq)]
struct Life {
    id: ObjectId,
    class: Class,
    /// In order of time; at least one.
    samples: Vec<Sample>,
    /// The first sample that is not in the past.
    place: usize,
}

/// The truth by time. Requested times must not decrease.
#[derive(Clone, Debug)]
pub(crate) struct Truth {
    /// Objects that are not there yet, by first row.
    to_come: std::vec::IntoIter<Life>,
    there: Vec<Life>,
    begin: Timestamp,
    end: Timestamp,
    unknown_classes: u64,
    headings: RawHeadings,
}

/// The true objects at one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Moment {
    /// The objects; an unknown velocity is zero.
    pub objects: Vec<TrueObject>,
    /// Velocity of each object where it is known, m/s.
    pub velocities: Vec<Option<(f64, f64)>>,
    /// Mean speed of each object along the straight line from half a second before to half a second after, m/s; by its velocity
    /// where the rows are too rare.
    pub speeds: Vec<Option<f64>>,
}

impl Truth {
    /// Reads a table; `path` is for errors.
    pub(crate) fn read(table: impl Read, path: &Path) -> Result<Self, CsvError> {
        let mut table = CsvTable::new(table, path, (&COLUMNS, &[]))?;
        let mut lives: BTreeMap<String, Life> = BTreeMap::new();
        let (mut unknown_classes, mut headings) = (0, RawHeadings::default());
        while let Some(row) = table.next_row()? {
            let name = row.text("object_id");
            if name.is_empty() {
                return Err(row.wrong("object_id", "an object's name or number"));
            }
            let (sample, class) = (sample(&row)?, row.class("class")?);
            // As it is written: read, it is wrapped.
            headings.note(row.number("yaw", f64::is_finite, "an angle in rad")?);
            unknown_classes += u64::from(class.is_none());
            if let Some(life) = lives.get_mut(name) {
                life.samples.push(sample);
            } else {
                let id = ObjectId(
                    u32::try_from(lives.len()).map_err(|_| row.wrong("object_id", "fewer objects"))?,
                );
                let class = class.unwrap_or(Class::Unknown);
                lives.insert(name.to_owned(), Life { id, class, samples: vec![sample], place: 0 });
            }
        }
        let mut lives: Vec<Life> = lives.into_values().collect();
        lives.iter_mut().try_for_each(|life| life.sort(path))?;
        Ok(Self { headings, ..Self::of(lives, unknown_classes) })
    }

    fn of(mut lives: Vec<Life>, unknown_classes: u64) -> Self {
        lives.sort_by_key(|life| (life.samples[0].at, life.id));
        let begin = lives.iter().map(|life| life.samples[0].at).min();
        let end = lives.iter().filter_map(|life| life.samples.last()).map(|sample| sample.at).max();
        Self {
            to_come: lives.into_iter(),
            there: Vec::new(),
            begin: begin.unwrap_or(Timestamp::MAX),
            end: end.unwrap_or(Timestamp::MIN),
            unknown_classes,
            headings: RawHeadings::default(),
        }
    }

    /// The largest heading where they are degrees and no radians: those are rarely beyond a turn, and by little.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub(crate) fn degrees(&self) -> Option<f64> {
        const DEGREES_SHARE: f64 = 0.3;
        const MOST_RADIANS: f64 = 15.0;
        let RawHeadings { n, beyond_a_turn, largest, .. } = self.headings;
        (beyond_a_turn as f64 >= DEGREES_SHARE * n as f64 && largest >= MOST_RADIANS).then_some(largest)
    }

    /// The time from the first to the last row. Outside of it the truth is unknown. Without any row it ends before it begins.
    pub(crate) fn span(&self) -> (Timestamp, Timestamp) {
        (self.begin - TOLERANCE, self.end + TOLERANCE)
    }

    /// Rows with an unknown class name.
    pub(crate) const fn unknown_classes(&self) -> u64 {
        self.unknown_classes
    }

    /// The objects at a time, which must not be earlier than the last requested time. An object exists between its first and
    /// its last row.
    pub(crate) fn at(&mut self, now: Timestamp) -> Moment {
        while self.to_come.as_slice().first().is_some_and(|life| life.samples[0].at <= now + TOLERANCE) {
            self.there.extend(self.to_come.next());
        }
        self.there.retain_mut(|life| life.advance(now));
        let mut moment = Moment::default();
        for life in &self.there {
            let Sample { bev, velocity, .. } = life.at(now);
            let (id, class) = (life.id, life.class);
            moment.objects.push(TrueObject { id, class, bev, velocity: velocity.unwrap_or_default() });
            moment.velocities.push(velocity);
            moment.speeds.push(life.speed(now).or_else(|| velocity.map(|(x, y)| libm::hypot(x, y))));
        }
        moment
    }
}

impl Life {
    /// Sorts the rows by time. Two rows of one time are an error.
    fn sort(&mut self, path: &Path) -> Result<(), CsvError> {
        self.samples.sort_by_key(|sample| sample.at);
        match self.samples.windows(2).find(|pair| pair[0].at == pair[1].at) {
            Some(pair) => Err(CsvError::Field {
                path: path.to_owned(),
                line: pair[1].line,
                column: "t",
                value: seconds::text(pair[1].at),
                expected: format!("another time than the same object's in line {}", pair[0].line),
            }),
            None => Ok(()),
        }
    }

    /// Advances to a time; whether the object still exists.
    fn advance(&mut self, now: Timestamp) -> bool {
        while self.samples.get(self.place).is_some_and(|sample| sample.at + TOLERANCE < now) {
            self.place += 1;
        }
        self.place < self.samples.len()
    }

    /// The nearest row within the tolerance, else interpolated between the rows before and after.
    fn at(&self, now: Timestamp) -> Sample {
        let after = self.samples[self.place];
        let next =
            self.samples.get(self.place + 1).filter(|next| (next.at - now).abs() < (after.at - now).abs());
        let nearest = next.copied().unwrap_or(after);
        match self.place.checked_sub(1).map(|before| self.samples[before]) {
            Some(before) if (nearest.at - now).abs() > TOLERANCE => between(&before, &after, now),
            _ => nearest,
        }
    }

    /// The mean speed around a time by the rows alone, m/s; none where they are too near to each other.
    fn speed(&self, now: Timestamp) -> Option<f64> {
        let (before, after) = self.samples.split_at(self.place);
        let first = before.iter().rev().take_while(|row| now - row.at <= AROUND + TOLERANCE).last();
        let first = first.or_else(|| after.first())?;
        let last = after.iter().take_while(|row| row.at - now <= AROUND + TOLERANCE).last();
        let last = last.or_else(|| before.last())?;
        let apart = last.at - first.at;
        let distance = first.bev.pose().distance_to(last.bev.x, last.bev.y);
        (apart >= LEAST_APART).then(|| distance / apart.as_secs_f64())
    }
}

/// Linear interpolation; the heading turns the shorter way.
fn between(before: &Sample, after: &Sample, now: Timestamp) -> Sample {
    let share = (now - before.at).as_secs_f64() / (after.at - before.at).as_secs_f64();
    let mix = |a: f64, b: f64| a + share * (b - a);
    let (a, b) = (&before.bev, &after.bev);
    let velocity = before.velocity.zip(after.velocity);
    Sample {
        at: now,
        bev: BevBox {
            x: mix(a.x, b.x),
            y: mix(a.y, b.y),
            w: mix(a.w, b.w),
            d: mix(a.d, b.d),
            yaw: wrap_angle(a.yaw + share * angle_difference(b.yaw, a.yaw)),
        },
        velocity: velocity.map(|(a, b)| (mix(a.0, b.0), mix(a.1, b.1))),
        line: before.line,
    }
}

fn sample(row: &Row<'_>) -> Result<Sample, CsvError> {
    let speed = |column| row.number_if_any(column, "a speed in m/s, or nan");
    let velocity = speed("vx")?.zip(speed("vy")?);
    Ok(Sample { at: row.seconds("t")?, bev: row.bev(["w", "d"])?, velocity, line: row.line() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn truth(rows: &str) -> Result<Truth, CsvError> {
        let text = format!("{}\n{rows}", COLUMNS.join(","));
        Truth::read(text.as_bytes(), Path::new("truth.csv"))
    }

    fn at_ms(ms: i64) -> Timestamp {
        Timestamp::EPOCH + Span::from_millis(ms)
    }

    #[test]
    fn between_two_rows_position_and_heading_are_interpolated_along_the_shorter_arc() {
        // Out of order; from 3.1 rad on to -3.1 rad, past half a turn.
        let mut truth = truth("1,a,car,10,4,8,0,2,4,-3.1\n0,a,car,0,0,10,nan,2,5,3.1\n").unwrap();
        let moment = truth.at(at_ms(250));
        let bev = moment.objects[0].bev;
        assert_eq!((bev.x, bev.y, bev.d, moment.velocities[0]), (2.5, 1.0, 4.75, None));
        let turned = std::f64::consts::TAU - 6.2;
        assert!((bev.yaw - (3.1 + turned / 4.0)).abs() < 1e-12, "{}", bev.yaw);
        let end = truth.at(at_ms(1000));
        assert_eq!((end.objects[0].bev.yaw, end.velocities[0]), (-3.1, Some((8.0, 0.0))));
    }

    #[test]
    fn a_parked_object_whose_labels_jump_has_no_speed_and_rare_rows_have_that_of_their_velocity() {
        let mut rows: String = (0..11)
            .map(|k| format!("{},parked,car,{},0,2,0,2,4,0\n", 0.1 * f64::from(k), 0.2 * f64::from(k % 2)))
            .collect();
        rows.push_str(
            "0,drives,car,0,9,0,0,2,4,0\n0.5,drives,car,4,9,0,0,2,4,0\n1,drives,car,8,9,0,0,2,4,0\n",
        );
        rows.push_str("0,rare,car,0,20,3,4,2,4,0\n5,rare,car,0,20,3,4,2,4,0\n");
        let mut truth = truth(&rows).unwrap();
        let speeds: Vec<f64> = truth.at(at_ms(500)).speeds.into_iter().flatten().collect();
        // Parked, driving, and of rows five seconds apart.
        let off: Vec<f64> = speeds.iter().zip([0.0, 8.0, 5.0]).map(|(speed, right)| speed - right).collect();
        assert!(off.len() == 3 && off.iter().all(|off| off.abs() < 1e-9), "{speeds:?}");
    }

    #[test]
    fn rows_within_a_millisecond_are_taken_as_they_are() {
        let mut truth = truth("0.0009,a,car,1,0,0,0,2,4,0\n0.1011,a,car,7,0,0,0,2,4,0\n").unwrap();
        assert_eq!(truth.at(at_ms(0)).objects[0].bev.x, 1.0);
        let x = truth.at(at_ms(100)).objects[0].bev.x;
        assert!(x < 7.0, "1.1 ms away: between the rows, {x}");
    }

    #[test]
    fn objects_are_absent_before_their_first_and_after_their_last_row() {
        let rows = "0.1,a,car,1,0,0,0,2,4,0\n0.3,a,car,1,0,0,0,2,4,0\n0.2,b,truck,9,0,0,0,2,4,0\n";
        let mut truth = truth(rows).unwrap();
        let n = [0, 100, 200, 300, 302].map(|ms| truth.at(at_ms(ms)).objects.len());
        assert_eq!(n, [0, 1, 2, 1, 0]);
        assert_eq!(truth.span(), (at_ms(99), at_ms(301)));
    }

    #[test]
    fn two_rows_of_one_object_at_one_time_are_an_error() {
        let rows = "0.1,a,car,1,0,0,0,2,4,0\n0.2,a,car,1,0,0,0,2,4,0\n0.10,a,car,2,0,0,0,2,4,0\n";
        let message = truth(rows).unwrap_err().to_string();
        assert_eq!(
            message,
            "truth.csv, line 4, column t: \"0.1\", expected another time than the same object's in line 2"
        );
        let message = truth("0.1,,car,1,0,0,0,2,4,0\n").unwrap_err().to_string();
        assert!(message.contains("line 2, column object_id"), "{message}");
    }
}
