//! Scenes as the devkit loads them: one score for each track, gaps interpolated.

use crate::score::tracking::amota::TrackingClass;
use crate::score::tracking::indexed::{Indexed, Spot};
use crate::score::tracking::sequence::{Instant, Sequence};
use std::collections::BTreeMap;
use v2x_common::class::Class;

/// The boxes of the seven classes, instant by instant.
pub(super) struct Filled {
    truth: Vec<Vec<Classed>>,
    reported: Vec<Vec<Classed>>,
}

#[derive(Clone, Copy)]
struct Classed {
    spot: Spot,
    class: TrackingClass,
}

impl Classed {
    /// `None` outside the seven classes.
    fn of(spot: Spot, class: Class) -> Option<Self> {
        TrackingClass::of(class).map(|class| Self { spot, class })
    }
}

impl Filled {
    pub(super) fn of(scene: &Sequence) -> Self {
        let true_boxes = |instant: &Instant| {
            instant.truth.iter().filter_map(|one| Classed::of(Spot::of_true(one), one.class)).collect()
        };
        let reported_boxes = |instant: &Instant| {
            instant.reported.iter().filter_map(|one| Classed::of(Spot::of_reported(one), one.class)).collect()
        };
        let mut truth: Vec<_> = scene.instants().iter().map(true_boxes).collect();
        let mut reported: Vec<_> = scene.instants().iter().map(reported_boxes).collect();
        average_scores(&mut reported);
        fill(&mut truth);
        fill(&mut reported);
        Self { truth, reported }
    }

    /// The boxes of one class.
    pub(super) fn indexed(&self, class: TrackingClass, radius_m: f64) -> Indexed {
        let spots = |boxes: &Vec<Classed>| {
            boxes.iter().filter(|one| one.class == class).map(|one| one.spot).collect::<Vec<_>>()
        };
        Indexed::of_spots(
            self.truth.iter().zip(&self.reported).map(|(truth, reported)| (spots(truth), spots(reported))),
            radius_m,
        )
    }
}

/// Gives each track the mean of its scores.
fn average_scores(instants: &mut [Vec<Classed>]) {
    let mut sums: BTreeMap<u64, (f64, f64)> = BTreeMap::new();
    for one in instants.iter().flatten() {
        let (sum, n) = sums.entry(one.spot.id).or_default();
        *sum += one.spot.score;
        *n += 1.0;
    }
    for one in instants.iter_mut().flatten() {
        let (sum, n) = sums[&one.spot.id];
        one.spot.score = sum / n;
    }
}

/// Adds boxes between the end of an id and its next beginning, after the other boxes.
fn fill(instants: &mut [Vec<Classed>]) {
    let mut by_id: BTreeMap<u64, (usize, Vec<(usize, Classed)>)> = BTreeMap::new();
    for (instant, one) in
        instants.iter().enumerate().flat_map(|(instant, boxes)| boxes.iter().map(move |one| (instant, one)))
    {
        let n_ids = by_id.len();
        by_id.entry(one.spot.id).or_insert_with(|| (n_ids, vec![])).1.push((instant, *one));
    }
    // In the order of first appearance: it decides where two objects have the same last track.
    let mut lives: Vec<_> = by_id.into_values().collect();
    lives.sort_unstable_by_key(|(number, _)| *number);
    for ends in lives.iter().flat_map(|(_, life)| life.windows(2)) {
        let (left, right) = (ends[0], ends[1]);
        for (instant, boxes) in (left.0 + 1..).zip(&mut instants[left.0 + 1..right.0]) {
            boxes.push(between(left, right, instant));
        }
    }
}

/// The devkit weighs the right end by its distance (`interpolate_tracks`), which reverses a gap of two instants or more.
/// This does the same, so that the figures agree with the devkit's.
#[expect(clippy::cast_precision_loss, reason = "numbers of instants")]
fn between(left: (usize, Classed), right: (usize, Classed), instant: usize) -> Classed {
    let weight = (right.0 - instant) as f64 / (right.0 - left.0) as f64;
    // Also for equal scores: a threshold is often exactly a track's score, so that rounding decides.
    let mixed = |left: f64, right: f64| (1.0 - weight) * left + weight * right;
    let (from, to) = (&left.1.spot, &right.1.spot);
    let spot = Spot {
        id: to.id,
        at: [mixed(from.at[0], to.at[0]), mixed(from.at[1], to.at[1])],
        score: mixed(from.score, to.score),
    };
    Classed { spot, class: right.1.class }
}
