//! Whether what lies between two agents' positions is a shift of place or one of time.
//!
//! A time displaces what moves by its speed times that, and leaves what stands where it is; a shift displaces all alike. Both are fitted
//! alone, and compared by the squares of the distances that they leave. Where all drives one way at one speed both explain the same, and then both
//! are said.

use super::change::{Change, Rigid};
use super::search::{beats_chance, shift};
use super::squares::{MIN_PAIRS, MIN_PLACES, Refined, nearest, refine_within};
use super::{Snapshot, Spot};

/// Prior standard deviations: of a time alone, and of a shift alone (m, m, rad, s).
const TIME_ALONE: [f64; 4] = [0.01, 0.01, 1e-4, 0.7];
const PLACE_ALONE: [f64; 4] = [5.0, 5.0, 1e-4, 1e-3];
/// Times from which the search begins, s.
const TIMES: [f64; 8] = [-1.0, -0.6, -0.3, -0.15, 0.15, 0.3, 0.6, 1.0];
/// Distances beyond this are of other objects: their squares count as this, m.
const FAR_M: f64 = 2.0;
/// Either one explains the other's part where it leaves out at most such a share of what the other one does.
const ALIKE: f64 = 0.8;
/// A time explains so much of what no change does, as a part of all, and so many times as many pairs, where only what stands agrees.
const EXPLAINS: f64 = 0.4;
const MORE_PAIRS: f64 = 1.3;
/// Velocities within this are of one stream: each is taken for the mean of those, because the error of one is as large as a shift, m/s.
const STREAM_MPS: f64 = 2.5;
/// Least times and shifts that are reported, s and m.
const LEAST_S: f64 = 0.08;
const LEAST_M: f64 = 1.0;

/// What lies between two agents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Between {
    /// A shift of place, m, with the pairs that it explains.
    Place([f64; 2], u64),
    /// A time, s, with the pairs that it explains.
    Time(f64, u64),
    /// A shift, m, or a time, s, with the pairs that the shift explains.
    Either([f64; 2], f64, u64),
}

/// Of a change that was found and has no turn; `None` where neither is any.
pub(super) fn between(snapshots: &[Snapshot]) -> Option<Between> {
    let snapshots = smoothed(snapshots);
    let time = best_time(&snapshots)?;
    let earlier_s = time.change.earlier_s;
    let none = left_m2(&snapshots, &Rigid::default());
    let by_time = none - left_m2(&snapshots, &time.change);
    let by_m = shift(&snapshots).into_iter().chain([[0.0; 2]]);
    let places =
        by_m.filter_map(|by_m| refine_within(&snapshots, Rigid { by_m, ..Rigid::default() }, &PLACE_ALONE));
    let places = places.map(|place| (none - left_m2(&snapshots, &place.change), place));
    let (by_place, place) = places.max_by(|(a, _), (b, _)| a.total_cmp(b))?;
    let (by_m, pairs) = (place.change.by_m, place.explained.pairs);
    tracing::debug!(earlier_s, ?by_m, by_time, by_place, none, "time or place");
    let is_time = earlier_s.abs() >= LEAST_S && by_time >= ALIKE * by_place;
    let is_place = libm::hypot(by_m[0], by_m[1]) >= LEAST_M && by_place >= ALIKE * by_time;
    match (is_place, is_time) {
        (true, false) => Some(Between::Place(by_m, pairs)),
        (false, true) => Some(Between::Time(earlier_s, time.explained.pairs)),
        (true, true) => Some(Between::Either(by_m, earlier_s, pairs)),
        (false, false) => None,
    }
}

/// A time by which most of what moves is displaced, where what stands makes a part of all agree; with the pairs that it explains.
pub(super) fn of_what_moves(snapshots: &[Snapshot], near: &Refined) -> Option<(Rigid, u64)> {
    let moving = of_moving(snapshots);
    if moving.iter().all(|[_, second]| second.spots.is_empty()) {
        return None;
    }
    let smoothed = smoothed(snapshots);
    let time = best_time(&smoothed)?;
    let none = left_m2(&smoothed, &Rigid::default());
    let gain = none - left_m2(&smoothed, &time.change);
    let pairs = time.explained.pairs;
    #[expect(clippy::cast_precision_loss, reason = "some hundred")]
    let has_more = pairs as f64 >= MORE_PAIRS * near.explained.pairs as f64;
    let is_found = time.change.earlier_s.abs() >= LEAST_S
        && pairs >= MIN_PAIRS
        && time.explained.places.len() >= MIN_PLACES
        && (has_more || gain >= EXPLAINS * none);
    let of_time = Rigid { earlier_s: time.change.earlier_s, ..Rigid::default() };
    (is_found
        && beats_chance(&moving, 1, &Change::Rigid(of_time))
        && matches!(between(snapshots), Some(Between::Time(..))))
    .then_some((of_time, pairs))
}

/// With what moves alone of the second one's: what stands fits by chance onto what stood at another time.
pub(super) fn of_moving(snapshots: &[Snapshot]) -> Vec<Snapshot> {
    let moves = |spot: &Spot| libm::hypot(spot.velocity[0], spot.velocity[1]) >= STREAM_MPS;
    let mut moving = snapshots.to_vec();
    moving.iter_mut().for_each(|[_, second]| second.spots.retain(moves));
    moving
}

fn best_time(snapshots: &[Snapshot]) -> Option<Refined> {
    let begin = TIMES.iter().map(|earlier_s| Rigid { earlier_s: *earlier_s, ..Rigid::default() });
    let refined = begin.filter_map(|begin| refine_within(snapshots, begin, &TIME_ALONE));
    refined.min_by(|a, b| left_m2(snapshots, &a.change).total_cmp(&left_m2(snapshots, &b.change)))
}

/// The squares of the distances from the second one's detections to the nearest ones of the first one that a change leaves, m².
fn left_m2(snapshots: &[Snapshot], change: &Rigid) -> f64 {
    let mut sum = 0.0;
    for [first, second] in snapshots {
        let Some(changed) = Change::Rigid(*change).apply(second) else { continue };
        let squares = changed.iter().map(|spot| {
            nearest(spot, &first.spots, Some(FAR_M)).map_or(FAR_M * FAR_M, |(squared, _)| squared)
        });
        sum += squares.sum::<f64>();
    }
    sum
}

/// The same with velocities of the second one that are those of their streams.
fn smoothed(snapshots: &[Snapshot]) -> Vec<Snapshot> {
    let all = || snapshots.iter().flat_map(|[_, second]| &second.spots).map(|spot| spot.velocity);
    let stream = |[x, y]: [f64; 2]| {
        let near = all().filter(|other| libm::hypot(other[0] - x, other[1] - y) <= STREAM_MPS);
        let (sum, n) =
            near.fold(([0.0; 2], 0_u32), |(sum, n), other| ([sum[0] + other[0], sum[1] + other[1]], n + 1));
        sum.map(|sum| sum / f64::from(n.max(1)))
    };
    let mut smoothed = snapshots.to_vec();
    for [_, second] in &mut smoothed {
        second.spots.iter_mut().for_each(|spot| spot.velocity = stream(spot.velocity));
    }
    smoothed
}
