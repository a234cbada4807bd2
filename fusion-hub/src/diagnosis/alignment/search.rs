//! Where the search for a change begins, and what it explains by chance.

use super::change::{Change, Rigid};
use super::squares::{MIN_PAIRS, MIN_PLACES, explained, nearest};
use super::{Snapshot, Spot};

/// A change must explain so many times what it explains by chance.
const CHANCE_RATIO: u64 = 2;

/// What is this near to where it was a snapshot before, and so many before, stands, m. Snapshots are some tenths of a second apart: in that
/// time also what walks is near to where it was.
const STANDS_M: f64 = 1.0;
const STANDS_FOR: usize = 6;
/// Other shifts with which one is compared: no nearer to it than this, no further, and in these steps, m.
const NO_NEARER_M: f64 = 3.0;
const NO_FURTHER_STEPS: i32 = 10;
const STEP_M: f64 = 1.5;
/// What stands is the same in each snapshot: so many show it.
const SHOW_IT: usize = 4;

/// Whether a change explains far more than the same one does of detections of another time: lanes and rows of parked cars
/// fit onto each other, whoever sees them, and say nothing.
pub(super) fn beats_chance(snapshots: &[Snapshot], whose: usize, change: &Change) -> bool {
    let n = snapshots.len();
    let apart = |k: usize| {
        let mut pair = snapshots[k].clone();
        pair[1 - whose] = snapshots[(k + n / 2) % n].clone()[1 - whose].clone();
        pair
    };
    let shuffled: Vec<_> = (0..n).map(apart).collect();
    explained(snapshots, whose, change).pairs >= CHANCE_RATIO * explained(&shuffled, whose, change).pairs
}

/// Whether a change of the second one explains far more of what stands than any other shift does: rows of parked cars fit onto each other
/// in several ways, and what stands anywhere does in one.
pub(super) fn is_the_only_one(snapshots: &[Snapshot], change: &Rigid) -> bool {
    let standing = of_standing(snapshots);
    let found = explained(&standing, 1, &Change::Rigid(*change));
    if found.pairs < MIN_PAIRS || found.places.len() < MIN_PLACES {
        return false;
    }
    let every = standing.len().div_ceil(SHOW_IT).max(1);
    let some: Vec<_> = standing.iter().step_by(every).cloned().collect();
    let pairs = |change: Rigid| explained(&some, 1, &Change::Rigid(change)).pairs;
    let (by_it, steps) = (pairs(*change), -NO_FURTHER_STEPS..=NO_FURTHER_STEPS);
    let others =
        steps.clone().flat_map(|x| steps.clone().map(move |y| [x, y].map(|step| STEP_M * f64::from(step))));
    others.filter(|[x, y]| libm::hypot(*x, *y) >= NO_NEARER_M).all(|[x, y]| {
        let by_m = [change.by_m[0] + x, change.by_m[1] + y];
        by_it >= CHANCE_RATIO * pairs(Rigid { by_m, ..*change })
    })
}

/// With what stands alone.
fn of_standing(snapshots: &[Snapshot]) -> Vec<Snapshot> {
    let mut standing = snapshots.to_vec();
    for (k, pair) in standing.iter_mut().enumerate() {
        for (whose, sighting) in pair.iter_mut().enumerate() {
            sighting.spots.retain(|spot| stood(snapshots, (k, whose), spot));
        }
    }
    standing
}

/// Whether what one of a snapshot reports is where it was in those before; in the first ones, where it is in those after.
pub(super) fn stood(snapshots: &[Snapshot], (k, whose): (usize, usize), spot: &Spot) -> bool {
    let long = STANDS_FOR.min(snapshots.len() / 2).max(1);
    [1, long].into_iter().all(|apart| {
        let other = k.checked_sub(apart).or_else(|| Some(k + apart).filter(|other| *other < snapshots.len()));
        other.is_some_and(|other| nearest(spot, &snapshots[other][whose].spots, Some(STANDS_M)).is_some())
    })
}

/// The shift that most pairs of detections have, by a grid; m.
pub(super) fn shift(snapshots: &[Snapshot]) -> Option<[f64; 2]> {
    const REACH_M: f64 = 30.0;
    const N: usize = 61;
    let cell = |by_m: f64| {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 60")]
        (by_m.abs() <= REACH_M).then(|| libm::round(by_m + REACH_M) as usize)
    };
    let mut counts = vec![0_u32; N * N];
    for [a, b] in snapshots {
        for (a, b) in a.spots.iter().flat_map(|a| b.spots.iter().map(move |b| (a, b))) {
            if let (Some(x), Some(y)) = (cell(a.at[0] - b.at[0]), cell(a.at[1] - b.at[1])) {
                counts[y * N + x] += 1;
            }
        }
    }
    let (peak, count) = counts.iter().enumerate().max_by_key(|(_, count)| **count)?;
    #[expect(clippy::cast_precision_loss, reason = "0 to 60")]
    let metres = |cell: usize| cell as f64 - REACH_M;
    (*count > 0).then(|| [metres(peak % N), metres(peak / N)])
}
