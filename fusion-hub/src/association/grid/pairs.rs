//! Going through runs of points without a branch for each.

/// A point in the grid.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Point {
    /// m.
    pub x: f64,
    /// m.
    pub y: f64,
    /// Of cells.
    pub row: i32,
    /// In the frame.
    pub place: u32,
}

/// Pairs of places, of a query and of a point.
#[derive(Debug, Default)]
pub(in crate::association) struct Pairs {
    buffer: Vec<[u32; 2]>,
    count: usize,
    /// Start of the current query's pairs.
    begin: usize,
    /// Number of points visited.
    #[cfg(test)]
    pub visited: usize,
}

impl Pairs {
    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    /// Begins the next query.
    pub(super) fn begin_query(&mut self) {
        self.begin = self.count;
    }

    /// What was found.
    pub(in crate::association) fn as_slice(&self) -> &[[u32; 2]] {
        &self.buffer[..self.count]
    }
}

/// Points in a batch: a branch for each point of a cell would cost more.
pub(super) const BATCH: usize = 4;

/// Most points that one query finds, up to a batch more. So many candidates are ambiguous anyway, and thousands
/// of reports in one place must not stop the hub.
pub(super) const MOST_NEAR: usize = 256;

/// A query of a run of points.
pub(super) struct Probe {
    /// Place of the query.
    pub query: u32,
    /// Position, m.
    pub position: [f64; 2],
    /// How far along each axis, m.
    pub reach: [f64; 2],
    /// The row of cells searched, or all.
    pub row: Option<i32>,
}

impl Probe {
    /// Appends those points of a range that are near.
    pub(super) fn scan(&self, points: &[Point], range: std::ops::Range<usize>, pairs: &mut Pairs) {
        #[cfg(test)]
        {
            pairs.visited += range.len();
        }
        let mut start = range.start;
        while start < range.end && pairs.count - pairs.begin < MOST_NEAR {
            if pairs.buffer.len() < pairs.count + BATCH {
                pairs.buffer.resize(2 * pairs.buffer.len() + BATCH, [0; 2]);
            }
            let out = &mut pairs.buffer[pairs.count..pairs.count + BATCH];
            let mut found = 0;
            for (offset, point) in points[start..start + BATCH].iter().enumerate() {
                let (dx, dy) = (point.x - self.position[0], point.y - self.position[1]);
                let is_near = (dx.abs() <= self.reach[0]) & (dy.abs() <= self.reach[1]);
                // Two rows can share buckets; a point counts in its own.
                let is_in_row =
                    (self.row.is_none() | (Some(point.row) == self.row)) & (start + offset < range.end);
                out[found] = [self.query, point.place];
                found += usize::from(is_near & is_in_row);
            }
            pairs.count += found;
            start += BATCH;
        }
    }
}
