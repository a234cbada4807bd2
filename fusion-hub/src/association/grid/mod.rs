//! Points in a hashed uniform grid: finds near points for any mixture of spreads.
//!
//! Every point and every query has a spread along each axis, a squared length; they are near where
//! |Δ|² ≤ scale · (spread of the point + spread of the query) on both axes. Points of much larger spread than
//! is typical are in grids of their own, so that one of them does not widen the search for all. Cells hash to
//! a few buckets for each point: a far outlier costs no memory, and a query that would span more cells
//! than there are points goes through the points.

mod pairs;
#[cfg(test)]
mod tests;

pub(super) use pairs::Pairs;
use pairs::{BATCH, Point, Probe};
use std::cmp::Ordering;

/// Grids at most; the last one takes everything that is larger still.
const MAX_LEVELS: usize = 6;
/// The spreads within one grid differ by no more than this, but in the first and the last one.
const LEVEL_RATIO: f64 = 16.0;
/// The side of a cell in reaches of a typical query: what it searches, twice its reach, is in two rows of cells.
const CELL_IN_REACHES: f64 = 2.001;
/// Cells are never smaller, m.
const MIN_CELL_M: f64 = 1e-3;
/// At least this many, so that two cells seldom share one. Never fewer than two in all: see [`Level::shift`].
const BUCKETS_PER_POINT: usize = 2;
/// The typical spread is the median of at most so many.
const SAMPLES: usize = 31;

/// A point with its spread along each axis (m, m²).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    /// Position, m.
    pub position: [f64; 2],
    /// Squared length that it adds to a reach, m².
    pub spread: [f64; 2],
}

impl Spot {
    fn spread(&self) -> f64 {
        self.spread[0].max(self.spread[1])
    }
}

/// The points of one frame.
#[derive(Debug, Default)]
pub(super) struct Grid {
    scale: f64,
    levels: Vec<Level>,
    level_of: Vec<u8>,
}

/// Points of similar spread.
#[derive(Debug, Default)]
struct Level {
    spread: [f64; 2],
    cells_per_m: f64,
    /// Number of buckets less one.
    mask: u32,
    /// 32 less the bits of `mask`, of which there is at least one.
    shift: u32,
    /// The points of bucket i are points[starts[i]..starts[i + 1]].
    starts: Vec<u32>,
    count: usize,
    /// Followed by as many idle ones as a batch may run over.
    points: Vec<Point>,
    unsorted: Vec<(u32, Point)>,
}

/// The cell that a coordinate (in cells) is in: the nearest whole number. A coordinate out of range is
/// in the last cell, so that the order is kept.
fn cell(cells: f64) -> i32 {
    /// Numbers of this size have a unit in the last place of one.
    const ROUNDER: f64 = 6_755_399_441_055_744.0;
    #[expect(clippy::cast_possible_truncation, reason = "the whole number is in the lower half of the bits")]
    let whole = (cells.clamp(-1e9, 1e9) + ROUNDER).to_bits() as u32;
    whole.cast_signed()
}

/// The median spread of a sample of points, m²: robust against outliers.
fn typical_spread(spots: &[Spot]) -> f64 {
    let step = spots.len().div_ceil(SAMPLES).max(1);
    let mut sample = [f64::INFINITY; SAMPLES];
    let mut count = 0;
    for (slot, spot) in sample.iter_mut().zip(spots.iter().step_by(step)) {
        *slot = spot.spread();
        count += 1;
    }
    let by_size = |a: &f64, b: &f64| -> Ordering { a.total_cmp(b) };
    if count == 0 { 0.0 } else { *sample[..count].select_nth_unstable_by(count / 2, by_size).1 }
}

impl Grid {
    /// Takes in the points of a frame, which will be searched from spots like `queries`.
    pub(super) fn fill(&mut self, scale: f64, points: &[Spot], queries: &[Spot]) {
        self.scale = scale;
        self.levels.resize_with(MAX_LEVELS, Level::default);
        let typical_query = typical_spread(queries);
        let limit = 4.0 * (typical_query + typical_spread(points));
        let mut counts = [0usize; MAX_LEVELS];
        self.level_of.clear();
        self.level_of.extend(points.iter().map(|point| {
            let level = level_of(point.spread(), limit);
            counts[level as usize] += 1;
            level
        }));
        for ((number, level), count) in (0..).zip(&mut self.levels).zip(counts) {
            level.count = count;
            if count > 0 {
                let spots = (0..).zip(points).zip(&self.level_of);
                let of_level = spots.filter(|(_, level)| **level == number).map(|(spot, _)| spot);
                level.fill(of_level, count, (scale, typical_query));
            }
        }
    }

    /// Lists every pair of a query and a point near it, as places, grouped by query in order; the points of one
    /// are in no particular order.
    pub(super) fn pairs(&self, queries: &[Spot], pairs: &mut Pairs) {
        pairs.clear();
        let levels = || self.levels.iter().filter(|level| level.count > 0);
        for (place, query) in (0..).zip(queries) {
            pairs.begin_query();
            for level in levels() {
                level.near(self.scale, (place, query), pairs);
            }
        }
    }
}

fn level_of(spread: f64, limit: f64) -> u8 {
    let (mut level, mut limit) = (0, limit);
    while spread > limit && usize::from(level) + 1 < MAX_LEVELS {
        limit *= LEVEL_RATIO;
        level += 1;
    }
    level
}

impl Level {
    fn fill<'a>(
        &mut self,
        spots: impl Iterator<Item = (u32, &'a Spot)> + Clone,
        count: usize,
        (scale, typical_query): (f64, f64),
    ) {
        self.spread = [0.0; 2];
        for (_, spot) in spots.clone() {
            self.spread[0] = self.spread[0].max(spot.spread[0]);
            self.spread[1] = self.spread[1].max(spot.spread[1]);
        }
        let reach = libm::sqrt(scale * (typical_query + self.spread[0].max(self.spread[1])));
        self.cells_per_m = 1.0 / (CELL_IN_REACHES * reach).max(MIN_CELL_M);
        let n_buckets = (BUCKETS_PER_POINT * count).next_power_of_two();
        self.mask = u32::try_from(n_buckets - 1).expect("points are numbered in 32 bits");
        self.shift = self.mask.leading_zeros();
        // Counting sort: counted one place ahead, so that filling counts every start up to its end.
        self.starts.clear();
        self.starts.resize(n_buckets + 2, 0);
        self.unsorted.clear();
        for (place, spot) in spots {
            let [x, y] = spot.position;
            let row = cell(y * self.cells_per_m);
            let bucket = self.bucket(cell(x * self.cells_per_m), row);
            self.starts[bucket as usize + 2] += 1;
            self.unsorted.push((bucket, Point { x, y, row, place }));
        }
        let mut sum = 0;
        for start in &mut self.starts {
            sum += *start;
            *start = sum;
        }
        self.points.resize(count + BATCH, Point::default());
        for (bucket, point) in &self.unsorted {
            let start = &mut self.starts[*bucket as usize + 1];
            self.points[*start as usize] = *point;
            *start += 1;
        }
    }

    /// Neighbours along x are neighbours here; rows begin as far from each other as can be (Fibonacci hashing,
    /// Knuth), so that a square of cells fills the buckets evenly.
    fn bucket(&self, column: i32, row: i32) -> u32 {
        let of_row = row.cast_unsigned().wrapping_mul(0x9E37_79B1) >> self.shift;
        column.cast_unsigned().wrapping_add(of_row) & self.mask
    }

    fn near(&self, scale: f64, (query, spot): (u32, &Spot), pairs: &mut Pairs) {
        let [x, y] = spot.position;
        // Widened by more than rounding can take away: the exact test is the caller's.
        let reach = |axis: usize| {
            let exact = libm::sqrt(scale * (spot.spread[axis] + self.spread[axis]));
            exact * (1.0 + 1e-9) + spot.position[axis].abs() * (4.0 * f64::EPSILON)
        };
        let (reach_x, reach_y) = (reach(0), reach(1));
        let cell_of = |coordinate: f64| cell(coordinate * self.cells_per_m);
        let (first_row, last_row) = (cell_of(y - reach_y), cell_of(y + reach_y));
        let (first, last) = (cell_of(x - reach_x), cell_of(x + reach_x));
        let span = |from: i32, to: i32| i64::from(to) - i64::from(from) + 1;
        let cells = span(first_row, last_row) * span(first, last);
        let mut probe = Probe { query, position: [x, y], reach: [reach_x, reach_y], row: None };
        if cells >= i64::try_from(self.count).unwrap_or(i64::MAX) {
            probe.scan(&self.points, 0..self.count, pairs);
            return;
        }
        // Fewer cells than buckets: no bucket comes up twice within a row of cells.
        let width = last.abs_diff(first);
        let in_row = |bucket: u32| self.starts[bucket as usize] as usize;
        for row in first_row..=last_row {
            probe.row = Some(row);
            let start = self.bucket(first, row);
            let end = start + width;
            probe.scan(&self.points, in_row(start)..in_row(end.min(self.mask) + 1), pairs);
            if end > self.mask {
                probe.scan(&self.points, 0..in_row(end - self.mask), pairs);
            }
        }
    }
}
