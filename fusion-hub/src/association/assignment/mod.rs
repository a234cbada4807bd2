//! Optimal assignment of rows to columns over sparse candidates.
//!
//! Row minima first; then, for rows whose cheapest column is taken, shortest augmenting paths with
//! dual potentials (Jonker & Volgenant 1987, on adjacency lists). Every row may also stay alone at a fixed
//! cost, so that a pair which costs more than two lone ones is never forced. A call costs what its candidates
//! and conflicts cost, whatever the number of columns. Which of several optima is found depends on the order
//! of rows and candidates, the sum does not.

mod search;
#[cfg(test)]
mod tests;

use search::{Column, NONE, Search};

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

/// The solver with its buffers, to be reused: solving allocates nothing once they have grown.
///
/// Takes candidates in any order ([`Assigner::solve`]), or row by row: [`Assigner::begin`], then
/// [`Assigner::edge`] and [`Assigner::end_row`], then [`Assigner::finish`].
#[derive(Debug, Default)]
pub struct Assigner {
    unmatched_cost: f64,
    // Adjacency: the edges of row i are edges[starts[i]..starts[i + 1]].
    starts: Vec<u32>,
    edges: Vec<Edge>,
    row_potential: Vec<f64>,
    /// [`Column::FREE`] but for those in `edges`.
    columns: Vec<Column>,
    result: Vec<Option<u32>>,
    /// Rows whose cheapest column belongs to another row.
    conflicts: Vec<u32>,
    search: Search,
    by_row: ByRow,
}

#[derive(Clone, Copy, Debug)]
struct Edge {
    col: u32,
    cost: f64,
}

/// Candidates sorted by row.
#[derive(Debug, Default)]
struct ByRow {
    ends: Vec<u32>,
    edges: Vec<Edge>,
}

/// Where an augmenting path ends.
enum End {
    /// At a free column.
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
        let mut by_row = std::mem::take(&mut self.by_row);
        by_row.sort(n_rows, candidates);
        self.begin(n_cols, unmatched_cost);
        let mut start = 0;
        for &end in &by_row.ends[..n_rows] {
            for edge in &by_row.edges[start..end as usize] {
                assert!((edge.col as usize) < n_cols, "candidate column out of range");
                self.edge(edge.col, edge.cost);
            }
            self.end_row();
            start = end as usize;
        }
        self.by_row = by_row;
        self.finish()
    }

    /// Begins a problem with this many columns, in which a row that gets none costs `unmatched_cost`.
    pub fn begin(&mut self, n_cols: usize, unmatched_cost: f64) {
        for edge in self.edges.drain(..) {
            self.columns[edge.col as usize] = Column::FREE;
        }
        if self.columns.len() < n_cols {
            self.columns.resize(n_cols, Column::FREE);
        }
        self.unmatched_cost = unmatched_cost;
        self.starts.clear();
        self.starts.push(0);
        self.row_potential.clear();
        self.result.clear();
        self.conflicts.clear();
    }

    /// Adds a candidate of the current row.
    pub fn edge(&mut self, col: u32, cost: f64) {
        // A pair that costs more than an unmatched row is in no optimum.
        if cost <= self.unmatched_cost {
            self.edges.push(Edge { col, cost });
        }
    }

    /// Ends the current row; the next one begins. It gets its cheapest column at once where that is free.
    ///
    /// # Panics
    /// Where a candidate's column is out of range.
    pub fn end_row(&mut self) {
        let row = u32::try_from(self.result.len()).expect("rows are numbered in 32 bits");
        let mut cheapest = Edge { col: NONE, cost: self.unmatched_cost };
        let start = *self.starts.last().expect("begun with one start") as usize;
        for edge in &self.edges[start..] {
            if edge.cost < cheapest.cost || cheapest.col == NONE {
                cheapest = *edge;
            }
        }
        self.starts.push(u32::try_from(self.edges.len()).expect("candidates are numbered in 32 bits"));
        self.row_potential.push(cheapest.cost);
        let mut found = None;
        if cheapest.col != NONE {
            let column = &mut self.columns[cheapest.col as usize];
            if column.row == NONE {
                column.row = row;
                found = Some(cheapest.col);
            } else {
                self.conflicts.push(row);
            }
        }
        self.result.push(found);
    }

    /// For each row, in the order in which they were ended, the column that it gets.
    pub fn finish(&mut self) -> &[Option<u32>] {
        for place in 0..self.conflicts.len() {
            self.augment(self.conflicts[place]);
        }
        &self.result
    }

    fn augment(&mut self, start: u32) {
        let (end, length) = self.shortest_path(start);
        for &col in &self.search.touched {
            let column = &mut self.columns[col as usize];
            if column.is_closed {
                column.potential += column.distance - length;
            }
        }
        for &(row, distance) in &self.search.rows {
            self.row_potential[row as usize] += length - distance;
        }
        // From the end back to `start`: every row on the path passes its column on.
        let mut freed = match end {
            End::Column(col) => Some(col),
            End::Alone(row) => self.result[row as usize].take(),
        };
        while let Some(col) = freed {
            let column = &mut self.columns[col as usize];
            column.row = column.parent;
            freed = self.result[column.parent as usize].replace(col);
        }
        self.search.reset(&mut self.columns);
    }

    /// Dijkstra from a lone row over reduced costs, to the nearest end.
    fn shortest_path(&mut self, start: u32) -> (End, f64) {
        let mut best_alone = (f64::INFINITY, NONE);
        let mut row = start;
        let mut base = 0.0;
        loop {
            self.search.rows.push((row, base));
            let potential = self.row_potential[row as usize];
            let alone = base + (self.unmatched_cost - potential);
            if alone < best_alone.0 {
                best_alone = (alone, row);
            }
            let edges = self.starts[row as usize] as usize..self.starts[row as usize + 1] as usize;
            for &Edge { col, cost } in &self.edges[edges] {
                let column = &mut self.columns[col as usize];
                let distance = base + (cost - potential - column.potential);
                self.search.relax(row, (col, column), distance);
            }
            let Some((distance, col)) = self.search.nearest(&self.columns) else {
                return (End::Alone(best_alone.1), best_alone.0);
            };
            if best_alone.0 <= distance {
                return (End::Alone(best_alone.1), best_alone.0);
            }
            let column = &mut self.columns[col as usize];
            if column.row == NONE {
                return (End::Column(col), distance);
            }
            column.is_closed = true;
            row = column.row;
            base = distance;
        }
    }
}

impl ByRow {
    /// Sorts by row; within a row the order stays.
    fn sort(&mut self, n_rows: usize, candidates: &[Candidate]) {
        // Counted into the next row's place, so that after the sums each row's place is where it starts;
        // filling counts it up to where it ends.
        self.ends.clear();
        self.ends.resize(n_rows + 1, 0);
        for candidate in candidates {
            self.ends[candidate.row as usize + 1] += 1;
        }
        for row in 0..n_rows {
            self.ends[row + 1] += self.ends[row];
        }
        self.edges.clear();
        self.edges.resize(candidates.len(), Edge { col: NONE, cost: 0.0 });
        for &Candidate { row, col, cost } in candidates {
            let place = &mut self.ends[row as usize];
            self.edges[*place as usize] = Edge { col, cost };
            *place += 1;
        }
    }
}
