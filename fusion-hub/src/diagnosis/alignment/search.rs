//! Where the search for a change begins, and what it explains by chance.

use super::Snapshot;
use super::change::Change;
use super::squares::explained;

/// A change must explain so many times what it explains by chance.
const CHANCE_RATIO: u64 = 2;

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
