//! Optimal assignment of rows (detections) to columns (tracks) over sparse candidates.
//!
//! Successive shortest augmenting paths with dual potentials (Jonker & Volgenant 1987, on adjacency
//! lists). Every row may also stay alone at a fixed cost, so that a pair which costs more than two
//! lone ones is never forced. Independent of the order in which candidates are given, up to exact ties.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A pair that may be assigned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Which row.
    pub row: u32,
    /// Which column.
    pub col: u32,
    /// What the pair costs; finite.
    pub cost: f64,
}

const NONE: u32 = u32::MAX;

/// The solver with its buffers, to be reused: solving allocates nothing once they have grown.
#[derive(Debug, Default)]
pub struct Assigner {
    // Adjacency: the edges of row i are edges[starts[i]..starts[i + 1]].
    starts: Vec<u32>,
    edges: Vec<(u32, f64)>,
    row_potential: Vec<f64>,
    col_potential: Vec<f64>,
    row_of_col: Vec<u32>,
    result: Vec<Option<u32>>,
    search: Search,
}

/// State of one Dijkstra search for an augmenting path.
#[derive(Debug, Default)]
struct Search {
    heap: BinaryHeap<Reverse<(OrderedCost, u32)>>,
    distance: Vec<f64>,
    parent_row: Vec<u32>,
    closed: Vec<bool>,
    touched: Vec<u32>,
    /// Rows reached, with their distance.
    rows: Vec<(u32, f64)>,
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

/// Where an augmenting path ends.
enum End {
    /// At a column that nobody holds.
    Column(u32),
    /// At a row that stays alone.
    Alone(u32),
}

impl Assigner {
    /// For each row the column that it gets, such that the sum of costs is least, where every row that
    /// gets none costs `unmatched_cost`.
    ///
    /// # Panics
    /// Where a candidate's row or column is out of range.
    pub fn solve(
        &mut self,
        n_rows: usize,
        n_cols: usize,
        candidates: &[Candidate],
        unmatched_cost: f64,
    ) -> &[Option<u32>] {
        self.load(n_rows, n_cols, candidates, unmatched_cost);
        for row in 0..u32::try_from(n_rows).expect("rows are numbered in 32 bits") {
            self.augment(row, unmatched_cost);
        }
        &self.result
    }

    fn load(&mut self, n_rows: usize, n_cols: usize, candidates: &[Candidate], unmatched_cost: f64) {
        self.starts.clear();
        self.starts.resize(n_rows + 1, 0);
        for candidate in candidates {
            self.starts[candidate.row as usize + 1] += 1;
        }
        for row in 0..n_rows {
            self.starts[row + 1] += self.starts[row];
        }
        self.edges.clear();
        self.edges.resize(candidates.len(), (NONE, 0.0));
        self.row_potential.clear();
        self.row_potential.resize(n_rows, unmatched_cost);
        // Filled from each row's end backwards, by counting its end down; the ends become the starts.
        for candidate in candidates.iter().rev() {
            assert!((candidate.col as usize) < n_cols, "candidate column out of range");
            let row = candidate.row as usize;
            self.starts[row + 1] -= 1;
            self.edges[self.starts[row + 1] as usize] = (candidate.col, candidate.cost);
            self.row_potential[row] = self.row_potential[row].min(candidate.cost);
        }
        // Each starts[row + 1] now holds where row's edges begin: shift them down by one place.
        for row in 0..n_rows {
            self.starts[row] = self.starts[row + 1];
        }
        self.starts[n_rows] = u32::try_from(candidates.len()).expect("candidates are numbered in 32 bits");
        self.col_potential.clear();
        self.col_potential.resize(n_cols, 0.0);
        self.row_of_col.clear();
        self.row_of_col.resize(n_cols, NONE);
        self.result.clear();
        self.result.resize(n_rows, None);
        self.search.reset(n_cols);
    }

    fn augment(&mut self, start: u32, unmatched_cost: f64) {
        let (end, length) = self.shortest_path(start, unmatched_cost);
        for &col in &self.search.touched {
            if self.search.closed[col as usize] {
                self.col_potential[col as usize] += self.search.distance[col as usize] - length;
            }
        }
        for &(row, distance) in &self.search.rows {
            self.row_potential[row as usize] += length - distance;
        }
        // Walk back from the end to `start`: every row on the path passes on the column that it held.
        let mut freed = match end {
            End::Column(col) => Some(col),
            End::Alone(row) => self.result[row as usize].take(),
        };
        while let Some(col) = freed {
            let row = self.search.parent_row[col as usize];
            self.row_of_col[col as usize] = row;
            freed = self.result[row as usize].replace(col);
        }
        self.search.forget();
    }

    /// Dijkstra from a lone row over reduced costs, to the nearest end.
    fn shortest_path(&mut self, start: u32, unmatched_cost: f64) -> (End, f64) {
        let mut best_alone = (f64::INFINITY, NONE);
        let mut row = start;
        let mut base = 0.0;
        loop {
            self.search.rows.push((row, base));
            let potential = self.row_potential[row as usize];
            let alone = base + (unmatched_cost - potential);
            if alone < best_alone.0 {
                best_alone = (alone, row);
            }
            let edges = self.starts[row as usize] as usize..self.starts[row as usize + 1] as usize;
            for &(col, cost) in &self.edges[edges] {
                let distance = base + (cost - potential - self.col_potential[col as usize]);
                self.search.relax(row, col, distance);
            }
            let Some((distance, col)) = self.search.nearest() else {
                return (End::Alone(best_alone.1), best_alone.0);
            };
            if best_alone.0 <= distance {
                return (End::Alone(best_alone.1), best_alone.0);
            }
            if self.row_of_col[col as usize] == NONE {
                return (End::Column(col), distance);
            }
            self.search.closed[col as usize] = true;
            row = self.row_of_col[col as usize];
            base = distance;
        }
    }
}

impl Search {
    fn reset(&mut self, n_cols: usize) {
        self.forget();
        self.distance.clear();
        self.distance.resize(n_cols, f64::INFINITY);
        self.parent_row.clear();
        self.parent_row.resize(n_cols, NONE);
        self.closed.clear();
        self.closed.resize(n_cols, false);
    }

    /// Back to the state before the search, at the cost of what it touched.
    fn forget(&mut self) {
        for &col in &self.touched {
            if let Some(distance) = self.distance.get_mut(col as usize) {
                *distance = f64::INFINITY;
                self.closed[col as usize] = false;
            }
        }
        self.touched.clear();
        self.heap.clear();
        self.rows.clear();
    }

    fn relax(&mut self, row: u32, col: u32, distance: f64) {
        let known = &mut self.distance[col as usize];
        // A closed column is final; rounding must not reopen it and tie the path into a loop.
        if distance < *known && !self.closed[col as usize] {
            if known.is_infinite() {
                self.touched.push(col);
            }
            *known = distance;
            self.parent_row[col as usize] = row;
            self.heap.push(Reverse((OrderedCost(distance), col)));
        }
    }

    /// The nearest column that is not closed yet.
    fn nearest(&mut self) -> Option<(f64, u32)> {
        while let Some(Reverse((OrderedCost(distance), col))) = self.heap.pop() {
            if !self.closed[col as usize] && distance <= self.distance[col as usize] {
                return Some((distance, col));
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn total(result: &[Option<u32>], candidates: &[Candidate], unmatched_cost: f64) -> f64 {
        let cost_of = |row: usize, col: u32| {
            let found = candidates.iter().filter(|c| c.row as usize == row && c.col == col);
            found.map(|c| c.cost).fold(f64::INFINITY, f64::min)
        };
        result.iter().enumerate().map(|(row, col)| col.map_or(unmatched_cost, |col| cost_of(row, col))).sum()
    }

    /// Every assignment tried.
    fn brute_force(
        row: usize,
        n_rows: usize,
        free: &mut [bool],
        candidates: &[Candidate],
        alone: f64,
    ) -> f64 {
        if row == n_rows {
            return 0.0;
        }
        let mut best = alone + brute_force(row + 1, n_rows, free, candidates, alone);
        for candidate in candidates.iter().filter(|c| c.row as usize == row) {
            if std::mem::take(&mut free[candidate.col as usize]) {
                best = best.min(candidate.cost + brute_force(row + 1, n_rows, free, candidates, alone));
                free[candidate.col as usize] = true;
            }
        }
        best
    }

    #[test]
    fn a_greedy_choice_is_undone_where_the_sum_is_less() {
        let c = |row, col, cost| Candidate { row, col, cost };
        let candidates = [c(0, 0, 1.0), c(0, 1, 2.0), c(1, 0, 1.5)];
        assert_eq!(Assigner::default().solve(2, 2, &candidates, 10.0), [Some(1), Some(0)]);
    }

    #[test]
    fn a_pair_dearer_than_staying_alone_is_not_made() {
        let candidates = [Candidate { row: 0, col: 0, cost: 1.1 }];
        assert_eq!(Assigner::default().solve(1, 1, &candidates, 1.0), [None]);
        assert_eq!(Assigner::default().solve(0, 3, &[], 1.0), []);
        assert_eq!(Assigner::default().solve(2, 0, &[], 1.0), [None, None]);
    }

    proptest! {
        #[test]
        fn the_sum_is_the_brute_force_optimum(
            n_rows in 0usize..6,
            n_cols in 1usize..6,
            raw in prop::collection::vec((0u32..6, 0u32..6, -5.0..10.0f64), 0..20),
            alone in -1.0..8.0f64,
        ) {
            let mut candidates: Vec<Candidate> = Vec::new();
            for (row, col, cost) in raw {
                let new = candidates.iter().all(|c| (c.row, c.col) != (row, col));
                if (row as usize) < n_rows && (col as usize) < n_cols && new {
                    candidates.push(Candidate { row, col, cost });
                }
            }
            let mut assigner = Assigner::default();
            // A solver that was used before must not remember.
            assigner.solve(2, 2, &[Candidate { row: 1, col: 1, cost: 0.5 }], 1.0);
            let result = assigner.solve(n_rows, n_cols, &candidates, alone).to_vec();
            let mut taken: Vec<_> = result.iter().flatten().collect();
            taken.sort_unstable();
            prop_assert!(taken.windows(2).all(|pair| pair[0] != pair[1]));
            let best = brute_force(0, n_rows, &mut vec![true; n_cols], &candidates, alone);
            prop_assert!((total(&result, &candidates, alone) - best).abs() < 1e-9);
        }
    }
}
