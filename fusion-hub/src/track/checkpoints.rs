//! Estimates of a track after some of its evidence, so that a rollback does not begin at the first detection.
//!
//! Near the newest evidence they are dense, because most late evidence belongs there; further back they are sparse, because
//! a replay is long there anyway, and each takes nearly a kilobyte. Where they lie changes no result.

use super::Snapshot;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use v2x_common::time::{Span, Timestamp};

/// Fewest items of evidence between two checkpoints, and least time: many agents report within what counts as one time.
const LEAST_SPACING: usize = 4;
const LEAST_APART: Span = Span::from_millis(5);
/// Most items of evidence between two checkpoints to which late evidence can still come.
const MOST_SPACING: usize = 64;
/// A replay becomes longer by one part in so many, at most, because checkpoints are sparse; by half of it on average.
const SPACING_SHARE: usize = 16;
/// Where no late evidence can come any more two checkpoints are at most so far apart: evidence is folded at one of them, and
/// what is learnt of agents is read from there.
const MOST_APART: Span = Span::from_millis(100);

/// So many are added before they are thinned again.
const THINNED_EVERY: usize = 16;

/// Where an estimate stands in the evidence of its track.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Mark {
    /// After how many items, of those that are held.
    count: usize,
    /// Capture time of the last one of them.
    at: Timestamp,
    /// Place of the estimate.
    place: usize,
}

/// Estimates of one track, by the number of items that they hold.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Checkpoints<F> {
    marks: VecDeque<Mark>,
    /// In no order: those in use keep their places.
    snapshots: Vec<Snapshot<F>>,
    free: Vec<usize>,
    /// From so many on, those that are dense for how far back they are get removed.
    thinned_from: usize,
}

impl<F: Copy> Checkpoints<F> {
    /// None, with room for some.
    pub(super) fn with_capacity(n_items: usize) -> Self {
        let n = n_items / LEAST_SPACING + 1;
        Self {
            marks: VecDeque::with_capacity(n),
            snapshots: Vec::with_capacity(n),
            free: Vec::with_capacity(n),
            thinned_from: THINNED_EVERY,
        }
    }

    /// Whether one is due after `count` of `total` items, the last of them captured at `at`.
    #[inline(always)]
    pub(super) fn is_due(&self, (count, at): (usize, Timestamp), total: usize) -> bool {
        self.marks
            .back()
            .is_none_or(|last| count >= last.count + spacing(total - count) && at - last.at >= LEAST_APART)
    }

    pub(super) fn clear(&mut self) {
        self.marks.clear();
        self.snapshots.clear();
        self.free.clear();
        self.thinned_from = THINNED_EVERY;
    }

    /// The same as others; its own memory is used again.
    pub(super) fn copy_from(&mut self, other: &Self) {
        self.marks.clone_from(&other.marks);
        self.snapshots.clone_from(&other.snapshots);
        self.free.clone_from(&other.free);
        self.thinned_from = other.thinned_from;
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
                // They are large: no room for twice as many.
                if self.snapshots.len() == self.snapshots.capacity() {
                    self.snapshots.reserve_exact(1 + self.snapshots.len() / 8);
                }
                self.snapshots.push(*snapshot);
                self.snapshots.len() - 1
            }
        };
        self.marks.push_back(Mark { count, at, place });
        if self.marks.len() >= self.thinned_from {
            self.thin(total);
            self.thinned_from = self.marks.len() + THINNED_EVERY;
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::{Filter, State};
    use crate::values::{DetectionModel, Measurement, ScoreEvidence};
    use proptest::prelude::*;
    use v2x_common::class::Class;
    use v2x_common::covariance::Covariance2;

    fn at(us: i64) -> Timestamp {
        Timestamp::EPOCH + Span::from_micros(us)
    }

    /// An estimate whose position distinguishes it from others.
    fn snapshot(x: f64) -> Snapshot<State> {
        let model = DetectionModel::default();
        let frame =
            super::super::snapshot::FrameEvidence { at: at(0), agent: Default::default(), model: &model };
        let z = Measurement {
            class: Class::Car,
            position: [x, 0.0],
            r: Covariance2::isotropic(1.0),
            size: [1.8, 4.5],
            relative_variance: [0.04; 2],
            size_law: [None; 2],
            heading: v2x_common::detection::HeadingKind::Known,
            yaw: 0.0,
            yaw_variance: 0.01,
            velocity: None,
            is_track: false,
            since_last_s: f64::INFINITY,
        };
        Snapshot::initial(&frame, &z, ScoreEvidence::NONE, true)
    }

    /// After so many items, one each `us` microseconds.
    fn after(n: usize, us: i64) -> Checkpoints<State> {
        let mut checkpoints = Checkpoints::with_capacity(64);
        for count in 1..=n {
            let captured_at = at(us * count as i64);
            if checkpoints.is_due((count, captured_at), count) {
                checkpoints.push((count, captured_at), &snapshot(count as f64), count);
            }
        }
        checkpoints
    }

    fn counts(checkpoints: &Checkpoints<State>) -> Vec<usize> {
        checkpoints.marks.iter().map(|mark| mark.count).collect()
    }

    #[test]
    fn near_the_newest_item_there_is_one_for_every_four_and_far_from_it_a_replay_is_longer_by_a_sixteenth() {
        let found = counts(&after(4000, 10_000));
        for pair in found.windows(2) {
            let (gap, n_after) = (pair[1] - pair[0], 4000 - pair[1]);
            assert!(gap == LEAST_SPACING || gap <= (n_after / SPACING_SHARE).min(MOST_SPACING), "{pair:?}");
        }
        assert!(found.windows(2).any(|pair| pair[1] - pair[0] > 32) && found.len() < 170, "{}", found.len());
    }

    #[test]
    fn of_many_items_at_about_one_time_there_is_one_each_five_milliseconds() {
        let found = counts(&after(1000, 500));
        assert!(found.windows(2).all(|pair| pair[1] - pair[0] >= 10), "{found:?}");
    }

    #[test]
    fn before_the_horizon_few_are_kept_but_one_within_a_tenth_of_a_second_of_every_time() {
        let mut checkpoints = after(100, 10_000);
        let horizon = at(600_000);
        checkpoints.thin_before(horizon);
        let old: Vec<_> = checkpoints.marks.iter().filter(|mark| mark.at < horizon).collect();
        assert!(old.len() <= 9, "{} in 0.6 s", old.len());
        assert!(old.windows(2).all(|pair| pair[1].at - pair[0].at <= MOST_APART));
        assert_eq!(checkpoints.marks.iter().filter(|mark| mark.at >= horizon).count(), 10);
    }

    proptest! {
        #[test]
        fn each_estimate_is_found_by_its_count_whatever_was_removed_and_inserted(
            steps in prop::collection::vec((0..4_u8, 0..300_usize), 1..60),
        ) {
            let (mut total, mut checkpoints) = (200, after(200, 6_000));
            for (kind, number) in steps {
                let place = number % (total + 1);
                match kind {
                    0 => {
                        checkpoints.note_inserted(place);
                        total += 1;
                        checkpoints.truncate(place);
                    }
                    1 => checkpoints.truncate(place.max(1)),
                    2 => checkpoints.thin_before(at(6_000 * place as i64)),
                    _ => {
                        let captured_at = at(6_000 * total as i64);
                        if checkpoints.is_due((total, captured_at), total) {
                            checkpoints.push((total, captured_at), &snapshot(total as f64), total);
                        }
                    }
                }
                let mut used: Vec<_> = checkpoints.marks.iter().map(|mark| mark.place).collect();
                used.extend(&checkpoints.free);
                used.sort_unstable();
                prop_assert!(used.iter().copied().eq(0..checkpoints.snapshots.len()), "a place is lost or used twice");
                for mark in &checkpoints.marks {
                    let (count, found) = checkpoints.last_within(mark.count).expect("there is one");
                    prop_assert_eq!(count, mark.count);
                    prop_assert_eq!(found.state.rough_position().0[0], mark.count as f64);
                }
            }
        }
    }
}
