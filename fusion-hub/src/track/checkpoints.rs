//! Estimates of a track after some of its evidence, so that a rollback does not begin at the first detection.
//!
//! Near the newest evidence they are dense, because most late evidence belongs there; further back they are sparse, because
//! a replay is long there anyway, and each takes nearly a kilobyte. Where they lie changes no result.

use super::Snapshot;
use std::collections::VecDeque;
use v2x_common::time::{Span, Timestamp};

/// Fewest items of evidence between two checkpoints.
const LEAST_SPACING: usize = 4;
/// Most items of evidence between two checkpoints to which late evidence can still come.
const MOST_SPACING: usize = 16;
/// A replay becomes longer by one part in so many, at most, because checkpoints are sparse; by half of it on average.
const SPACING_SHARE: usize = 16;
/// Where no late evidence can come any more two checkpoints are at most so far apart: evidence is folded at one of them, and
/// what is learnt of agents is read from there.
const MOST_APART: Span = Span::from_millis(100);

/// Where an estimate stands in the evidence of its track.
#[derive(Clone, Copy, Debug)]
struct Mark {
    /// After how many items, of those that are held.
    count: usize,
    /// Capture time of the last one of them.
    at: Timestamp,
    /// Place of the estimate.
    place: usize,
}

/// Estimates of one track, by the number of items that they hold.
#[derive(Clone, Debug)]
pub(super) struct Checkpoints<F> {
    marks: VecDeque<Mark>,
    /// In no order: those in use keep their places.
    snapshots: Vec<Snapshot<F>>,
    free: Vec<usize>,
}

impl<F: Copy> Checkpoints<F> {
    /// None, with room for some.
    pub(super) fn with_capacity(n_items: usize) -> Self {
        let n = n_items / LEAST_SPACING + 1;
        Self {
            marks: VecDeque::with_capacity(n),
            snapshots: Vec::with_capacity(n),
            free: Vec::with_capacity(n),
        }
    }

    /// Whether one is due after `count` of `total` items, where the last one was after `last`.
    #[inline(always)]
    pub(super) const fn is_due(count: usize, last: usize, total: usize) -> bool {
        count >= last + spacing(total - count)
    }

    pub(super) fn clear(&mut self) {
        self.marks.clear();
        self.snapshots.clear();
        self.free.clear();
    }

    /// The same as others; its own memory is used again.
    pub(super) fn copy_from(&mut self, other: &Self) {
        self.marks.clone_from(&other.marks);
        self.snapshots.clone_from(&other.snapshots);
        self.free.clone_from(&other.free);
    }

    pub(super) fn is_empty(&self) -> bool {
        self.marks.is_empty()
    }

    /// The last one, and after how many items it stands.
    #[inline(always)]
    pub(super) fn last(&self) -> Option<(usize, &Snapshot<F>)> {
        self.marks.back().map(|mark| (mark.count, &self.snapshots[mark.place]))
    }

    /// The last one that stands after at most `count` items.
    pub(super) fn last_within(&self, count: usize) -> Option<(usize, &Snapshot<F>)> {
        let mark = &self.marks[self.n_within(count).checked_sub(1)?];
        Some((mark.count, &self.snapshots[mark.place]))
    }

    /// How many stand after at most `count` items.
    fn n_within(&self, count: usize) -> usize {
        self.marks.partition_point(|mark| mark.count <= count)
    }

    /// Adds one after all others. `at` is the capture time of the last item that it holds, and `total` how many items there are.
    pub(super) fn push(&mut self, (count, at): (usize, Timestamp), snapshot: &Snapshot<F>, total: usize) {
        let place = match self.free.pop() {
            Some(place) => {
                self.snapshots[place] = *snapshot;
                place
            }
            None => {
                self.snapshots.push(*snapshot);
                self.snapshots.len() - 1
            }
        };
        self.marks.push_back(Mark { count, at, place });
        self.thin(total);
    }

    /// Removes those between which there are few items for how far back they are.
    fn thin(&mut self, total: usize) {
        let sparse_from = |mark: &Mark| total - mark.count >= 2 * LEAST_SPACING * SPACING_SHARE;
        let Some(newest) = self.marks.iter().rposition(sparse_from) else { return };
        for place in (1..newest).rev() {
            let (before, after) = (self.marks[place - 1], self.marks[place + 1]);
            if after.count - before.count <= spacing(total - after.count) {
                self.remove(place);
            }
        }
    }

    /// Removes those of times before `horizon`, where nothing can come any more, except as many as folding needs.
    pub(super) fn thin_before(&mut self, horizon: Timestamp) {
        let n_old = self.marks.iter().take_while(|mark| mark.at < horizon).count();
        for place in (1..n_old.saturating_sub(1)).rev() {
            if self.marks[place + 1].at - self.marks[place - 1].at <= MOST_APART {
                self.remove(place);
            }
        }
    }

    fn remove(&mut self, place: usize) {
        if let Some(mark) = self.marks.remove(place) {
            self.free.push(mark.place);
        }
    }

    /// Keeps those that stand after at most `count` items.
    pub(super) fn truncate(&mut self, count: usize) {
        let n = self.n_within(count);
        self.free.extend(self.marks.drain(n..).map(|mark| mark.place));
    }

    /// An item has been inserted at a place in the evidence.
    pub(super) fn note_inserted(&mut self, place: usize) {
        for mark in self.marks.iter_mut().rev().take_while(|mark| mark.count > place) {
            mark.count += 1;
        }
    }

    /// Removes all before the last one that stands after at most `count` items, which is then the first one; after how many
    /// items it stands.
    pub(super) fn begin_within(&mut self, count: usize) -> Option<usize> {
        let before = self.n_within(count).checked_sub(1)?;
        self.free.extend(self.marks.drain(..before).map(|mark| mark.place));
        self.marks.front().map(|mark| mark.count)
    }

    /// The first one is to be after `count` items.
    pub(super) fn replace_first(&mut self, count: usize, snapshot: &Snapshot<F>) {
        if let Some(first) = self.marks.front_mut() {
            first.count = count;
            self.snapshots[first.place] = *snapshot;
        }
    }

    /// The first `count` items are not held any more.
    pub(super) fn note_forgotten(&mut self, count: usize) {
        for mark in &mut self.marks {
            mark.count = mark.count.saturating_sub(count);
        }
    }
}

/// How many items are between two checkpoints that have so many items after them.
const fn spacing(n_after: usize) -> usize {
    let share = n_after / SPACING_SHARE;
    if share < LEAST_SPACING {
        LEAST_SPACING
    } else if share > MOST_SPACING {
        MOST_SPACING
    } else {
        share
    }
}
