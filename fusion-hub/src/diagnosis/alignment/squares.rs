//! Which detections of two agents are of one object after a change, and the small change that brings most of them together.
//!
//! Iterated closest point (Besl & McKay 1992): least squares over pairs of nearest detections, repeated with the pairs that they give.
//! Parameters that the objects do not show stay near zero, by a prior; their standard deviations say so.

use super::change::{Change, Rigid};
use super::{Snapshot, Spot};
use std::collections::BTreeSet;

/// Detections nearer than this are of one object, in standard deviations, and at least and at most, m.
const NEAR_SIGMAS: f64 = 2.5;
const NEAR_M: (f64, f64) = (1.0, 2.0);
/// The same for the pairs of the first steps.
const WIDE_M: f64 = 3.5;
const STEPS: usize = 8;
/// Edge of the places at which objects were, m; they must have been at so many.
const PLACE_M: f64 = 5.0;
pub(super) const MIN_PLACES: usize = 4;
/// Fewest detections of one object by both.
pub(super) const MIN_PAIRS: u64 = 12;
/// Least share of the smaller number of detections that a change explains.
pub(super) const MIN_SHARE: f64 = 0.4;
/// Clocks are known to agree from this standard deviation on, s.
const CLOCKS_SIGMA_S: f64 = 0.03;
/// The time between two agents is known from this standard deviation on, as far as a shift of place is not one of time, s.
pub(super) const TIME_SIGMA_S: f64 = 0.15;
/// Prior standard deviations of a shift (m), a turn (rad), a time (s).
const PRIOR: [f64; 4] = [5.0, 5.0, 0.3, 0.7];
/// Errors of a difference beside those that are stated, m.
const UNSTATED_M: f64 = 0.3;
/// Standard deviations from which on a parameter is not zero.
const SURE: f64 = 5.0;
/// Smallest parameters that are reported: m, m, rad, s.
const MIN_REPORTED: [f64; 4] = [0.75, 0.75, 0.03, 0.08];

/// What a change explains.
#[derive(Clone, Debug, Default)]
pub(super) struct Explained {
    pub(super) pairs: u64,
    pub(super) places: BTreeSet<[i64; 2]>,
}

#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
pub(super) fn share(pairs: u64, possible: u64) -> f64 {
    pairs as f64 / (possible as f64).max(1.0)
}

/// The pairs of detections that are of one object after a change of those of `whose`. Each of the other one's counts once: what is
/// brought together into one place explains nothing.
pub(super) fn explained(snapshots: &[Snapshot], whose: usize, change: &Change) -> Explained {
    let mut explained = Explained::default();
    for snapshot in snapshots {
        let Some(changed) = change.apply(&snapshot[whose]) else { return Explained::default() };
        let others = &snapshot[1 - whose].spots;
        let mut met: Vec<&Spot> = Vec::with_capacity(changed.len());
        for spot in changed {
            if let Some((_, other)) = nearest(&spot, others, None)
                && !met.iter().any(|one| std::ptr::eq(*one, other))
            {
                met.push(other);
            }
        }
        // What another unit draws together is near the one thing that is there.
        if met.len() > 1 || !change.is_of_unit() {
            explained.pairs += met.len() as u64;
            explained.places.extend(met.iter().map(|other| other.at.map(place)));
        }
    }
    explained
}

/// The nearest of some spots within reach, with its distance squared: `within` metres, or what the errors allow.
pub(super) fn nearest<'a>(spot: &Spot, others: &'a [Spot], within: Option<f64>) -> Option<(f64, &'a Spot)> {
    let most_m = within.unwrap_or(NEAR_M.1);
    let mut best: Option<(f64, &Spot)> = None;
    for other in others {
        let (dx, dy) = (other.at[0] - spot.at[0], other.at[1] - spot.at[1]);
        if dx.abs() > most_m || dy.abs() > most_m {
            continue;
        }
        let squared = dx * dx + dy * dy;
        let reach_m = || {
            let sigma = libm::sqrt(spot.variance + other.variance);
            within.unwrap_or_else(|| (NEAR_SIGMAS * sigma).clamp(NEAR_M.0, NEAR_M.1))
        };
        if best.is_none_or(|(nearest, _)| squared < nearest) && squared <= reach_m() * reach_m() {
            best = Some((squared, other));
        }
    }
    best
}

#[expect(clippy::cast_possible_truncation, reason = "coordinates are limited")]
pub(super) fn place(coordinate_m: f64) -> i64 {
    libm::floor(coordinate_m / PLACE_M) as i64
}

/// A small change with the standard deviations of its parameters.
#[derive(Clone, Debug)]
pub(super) struct Refined {
    pub(super) change: Rigid,
    pub(super) sigma: [f64; 4],
    pub(super) explained: Explained,
}

impl Refined {
    fn parameters(&self) -> [f64; 4] {
        let Rigid { by_m: [x, y], turn_rad, earlier_s, .. } = self.change;
        [x, y, turn_rad, earlier_s]
    }

    fn is_reported(&self, k: usize) -> bool {
        let value = self.parameters()[k].abs();
        value >= MIN_REPORTED[k] && value >= SURE * self.sigma[k]
    }

    /// No parameter is large and certain enough to be reported.
    pub(super) fn is_small(&self) -> bool {
        (0..4).all(|k| !self.is_reported(k))
    }

    /// What moves shows the time between the two.
    pub(super) fn shows_clocks(&self) -> bool {
        self.sigma[3] <= CLOCKS_SIGMA_S
    }

    /// Its pairs are enough for its parameters, whatever no change explains: a shift of two metres leaves many of them near.
    pub(super) fn is_sure(&self, possible: u64) -> bool {
        !self.is_small()
            && self.explained.pairs >= MIN_PAIRS
            && self.explained.places.len() >= MIN_PLACES
            && share(self.explained.pairs, possible) >= 1.5 * MIN_SHARE
    }

    /// The change with the parameters that are reported; the others are zero.
    pub(super) fn reported(&self) -> Rigid {
        let kept = |k: usize| if self.is_reported(k) { self.parameters()[k] } else { 0.0 };
        Rigid { by_m: [kept(0), kept(1)], turn_rad: kept(2), earlier_s: kept(3), ..Rigid::default() }
    }
}

/// Least squares from a beginning.
pub(super) fn refine(snapshots: &[Snapshot], begin: Rigid) -> Option<Refined> {
    refine_within(snapshots, begin, &PRIOR)
}

/// The same with other standard deviations in advance.
pub(super) fn refine_within(snapshots: &[Snapshot], begin: Rigid, prior: &[f64; 4]) -> Option<Refined> {
    let (mut change, mut sigma) = (begin, *prior);
    for step in 0..STEPS {
        let within = (step < STEPS / 2).then_some(WIDE_M);
        let normal = Normal::of(snapshots, (&change, prior), within);
        let (solution, deviations) = normal.solve()?;
        let [x, y, turn_rad, earlier_s] = solution;
        change = Rigid { by_m: [x, y], turn_rad, earlier_s, ..Rigid::default() };
        sigma = deviations;
    }
    let explained = explained(snapshots, 1, &Change::Rigid(change));
    Some(Refined { change, sigma, explained })
}

/// Normal equations of the four parameters.
struct Normal {
    matrix: [[f64; 4]; 4],
    right: [f64; 4],
}

impl Normal {
    fn of(snapshots: &[Snapshot], (change, prior): (&Rigid, &[f64; 4]), within: Option<f64>) -> Self {
        let mut normal = Self { matrix: [[0.0; 4]; 4], right: [0.0; 4] };
        for (k, prior) in prior.iter().enumerate() {
            normal.matrix[k][k] = 1.0 / (prior * prior);
        }
        for [a, b] in snapshots {
            let centre = b.centre();
            let Some(changed) = Change::Rigid(*change).apply(b) else { continue };
            for (before, spot) in b.spots.iter().zip(&changed) {
                let Some((_, target)) = nearest(spot, &a.spots, within) else { continue };
                normal.add(before, target, (centre, change.turn_rad));
            }
        }
        normal
    }

    /// The detection goes to the target: t = c + R(b − c) + s − v·τ, with the turn linear about the present one.
    fn add(&mut self, spot: &Spot, target: &Spot, (centre, turn_rad): ([f64; 2], f64)) {
        let weight = 1.0 / (spot.variance + target.variance + UNSTATED_M * UNSTATED_M);
        let (sin, cos) = libm::sincos(turn_rad);
        let [x, y] = [spot.at[0] - centre[0], spot.at[1] - centre[1]];
        let turned = [x * cos - y * sin, x * sin + y * cos];
        let by_turn = [-turned[1], turned[0]];
        for axis in 0..2 {
            let mut row = [0.0, 0.0, by_turn[axis], -spot.velocity[axis]];
            row[axis] = 1.0;
            let value = target.at[axis] - centre[axis] - turned[axis] + by_turn[axis] * turn_rad;
            for i in 0..4 {
                self.right[i] += weight * row[i] * value;
                for j in 0..4 {
                    self.matrix[i][j] += weight * row[i] * row[j];
                }
            }
        }
    }

    /// The solution and its standard deviations, by elimination; the prior keeps the matrix positive definite.
    fn solve(&self) -> Option<([f64; 4], [f64; 4])> {
        // The matrix, its right side, and the unit matrix that becomes the inverse.
        let mut rows = [[0.0; 9]; 4];
        for (i, row) in rows.iter_mut().enumerate() {
            row[..4].copy_from_slice(&self.matrix[i]);
            row[4] = self.right[i];
            row[5 + i] = 1.0;
        }
        for pivot in 0..4 {
            let by = rows[pivot][pivot];
            if !(by.is_finite() && by > 0.0) {
                return None;
            }
            rows[pivot].iter_mut().for_each(|value| *value /= by);
            let pivot_row = rows[pivot];
            for (_, row) in rows.iter_mut().enumerate().filter(|(k, _)| *k != pivot) {
                let factor = row[pivot];
                row.iter_mut().zip(pivot_row).for_each(|(value, of_pivot)| *value -= factor * of_pivot);
            }
        }
        let solution = [0, 1, 2, 3].map(|k| rows[k][4]);
        let sigma = [0, 1, 2, 3].map(|k| libm::sqrt(rows[k][5 + k].max(0.0)));
        solution.iter().all(|value| value.is_finite()).then_some((solution, sigma))
    }
}
