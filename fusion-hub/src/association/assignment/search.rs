//! One Dijkstra search for an augmenting path, and the columns' state between searches.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// No row.
pub(super) const NONE: u32 = u32::MAX;

/// The state of a column, in one place: a search reads all of it at once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    /// Its dual potential.
    pub potential: f64,
    /// How far it is from the row that the search began with.
    pub distance: f64,
    /// The row that holds it.
    pub row: u32,
    /// The row before it on the path.
    pub parent: u32,
    /// Whether `distance` is final.
    pub is_closed: bool,
}

impl Column {
    /// Without row, and not reached.
    pub(super) const FREE: Self =
        Self { potential: 0.0, distance: f64::INFINITY, row: NONE, parent: NONE, is_closed: false };
}

/// A finite cost, ordered.
#[derive(Clone, Copy, Debug, PartialEq)]
struct OrderedCost(f64);

impl Eq for OrderedCost {}

impl PartialOrd for OrderedCost {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for OrderedCost {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

/// The front of a search.
#[derive(Debug, Default)]
pub(super) struct Search {
    heap: BinaryHeap<Reverse<(OrderedCost, u32)>>,
    /// Columns reached.
    pub touched: Vec<u32>,
    /// Rows reached, with their distance.
    pub rows: Vec<(u32, f64)>,
}

impl Search {
    /// Back to the state before the search, at the cost of what it touched.
    pub(super) fn reset(&mut self, columns: &mut [Column]) {
        for &col in &self.touched {
            let column = &mut columns[col as usize];
            column.distance = f64::INFINITY;
            column.is_closed = false;
        }
        self.touched.clear();
        self.heap.clear();
        self.rows.clear();
    }

    /// Notes a path over `row` to a column.
    pub(super) fn relax(&mut self, row: u32, (col, column): (u32, &mut Column), distance: f64) {
        // A closed column is final; rounding must not reopen it and tie the path into a loop.
        if distance < column.distance && !column.is_closed {
            if column.distance.is_infinite() {
                self.touched.push(col);
            }
            column.distance = distance;
            column.parent = row;
            self.heap.push(Reverse((OrderedCost(distance), col)));
        }
    }

    /// The nearest column that is not closed yet.
    pub(super) fn nearest(&mut self, columns: &[Column]) -> Option<(f64, u32)> {
        while let Some(Reverse((OrderedCost(distance), col))) = self.heap.pop() {
            let column = &columns[col as usize];
            if !column.is_closed && distance <= column.distance {
                return Some((distance, col));
            }
        }
        None
    }
}
