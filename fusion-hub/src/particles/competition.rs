//! Which tracks compete for which reports: connected components of the candidate pairs.

use super::places::{NONE, as_u32, length};

/// A pair and its cost (−2 ln p), below 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    /// The report's place in the frame.
    pub(super) place: u32,
    pub(super) cost: f64,
}

/// A track: the places of its versions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub(super) start: u32,
    pub(super) end: u32,
}

/// The pairs of one frame, version by version.
#[derive(Debug, Default)]
pub(super) struct Competition {
    edges: Vec<Edge>,
    /// For each version the end of its edges.
    edge_ends: Vec<u32>,
    rows: Vec<Row>,
    /// For each row one that it competes with, or itself.
    parents: Vec<u32>,
    /// For each measurement the first row that it may be of.
    first_rows: Vec<u32>,
    /// Components and their rows, in order.
    members: Vec<(u32, u32)>,
}

impl Competition {
    /// Begins a frame.
    pub(super) fn begin(&mut self, n_measurements: usize) {
        self.edges.clear();
        self.edge_ends.clear();
        self.rows.clear();
        self.parents.clear();
        self.first_rows.clear();
        self.first_rows.resize(n_measurements, NONE);
    }

    /// Ends a version that does not compete.
    pub(super) fn skip_version(&mut self) {
        self.edge_ends.push(length(&self.edges));
    }

    /// Ends a version with these candidate pairs.
    pub(super) fn version(&mut self, edges: impl Iterator<Item = Edge>) {
        self.edges.extend(edges.filter(|edge| edge.cost < 0.0));
        self.edge_ends.push(length(&self.edges));
    }

    /// Ends a track with this number of versions.
    pub(super) fn row(&mut self, n_versions: usize) {
        let end = length(&self.edge_ends);
        let start = end - as_u32(n_versions);
        let row = length(&self.rows);
        self.rows.push(Row { start, end });
        self.parents.push(row);
        for edge in self.start_of(start)..self.start_of(end) {
            let first = &mut self.first_rows[self.edges[edge].place as usize];
            if *first == NONE {
                *first = row;
            } else {
                let (a, b) = (root(&mut self.parents, *first), root(&mut self.parents, row));
                self.parents[a.max(b) as usize] = a.min(b);
            }
        }
    }

    fn start_of(&self, version: u32) -> usize {
        version.checked_sub(1).map_or(0, |before| self.edge_ends[before as usize] as usize)
    }

    /// The edges of a version.
    pub(super) fn edges_of(&self, version: u32) -> &[Edge] {
        &self.edges[self.start_of(version)..self.start_of(version + 1)]
    }

    /// Whether a competing track is a candidate for this report.
    pub(super) fn is_about(&self, place: u16) -> bool {
        self.first_rows[usize::from(place)] != NONE
    }

    /// Finds the components.
    pub(super) fn finish(&mut self) {
        let Self { parents, members, .. } = self;
        members.clear();
        members.extend((0..length(parents)).map(|row| (root(parents, row), row)));
        members.sort_unstable();
    }

    /// Each component's rows, in order.
    pub(super) fn components(&self) -> impl Iterator<Item = impl ExactSizeIterator<Item = Row>> {
        let components = self.members.chunk_by(|a, b| a.0 == b.0);
        components.map(|members| members.iter().map(|(_, row)| self.rows[*row as usize]))
    }
}

fn root(parents: &mut [u32], row: u32) -> u32 {
    let mut row = row;
    while parents[row as usize] != row {
        parents[row as usize] = parents[parents[row as usize] as usize];
        row = parents[row as usize];
    }
    row
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tracks_with_a_report_in_common_are_one_component() {
        let mut competition = Competition::default();
        competition.begin(5);
        let edge = |place: u32| Edge { place, cost: -1.0 };
        competition.version([edge(0), edge(1)].into_iter());
        competition.row(1);
        competition.skip_version();
        competition.version([edge(3), Edge { place: 0, cost: 0.5 }].into_iter());
        competition.version([edge(4)].into_iter());
        competition.row(2);
        competition.version([edge(2), edge(1)].into_iter());
        competition.row(1);
        competition.finish();
        let components: Vec<Vec<_>> =
            competition.components().map(|rows| rows.map(|row| (row.start, row.end)).collect()).collect();
        assert_eq!(components, [vec![(0, 1), (4, 5)], vec![(2, 4)]]);
        assert_eq!(competition.edges_of(2).len(), 1, "a pair that costs more than two alone is none");
    }
}
