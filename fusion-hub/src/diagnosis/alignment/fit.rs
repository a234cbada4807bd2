//! Looks for the change that brings one agent's detections onto those of another one.
//!
//! Small changes are found by least squares over pairs of nearest detections, repeated with the pairs that they give (iterated
//! closest point, Besl & McKay 1992), from several beginnings. Parameters that the objects do not show stay near zero, by a
//! prior; their standard deviations say so.

use super::change::{Change, LARGE, Rigid};
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
const MIN_PLACES: usize = 4;
/// Fewest detections of one object by both.
const MIN_PAIRS: u64 = 12;
/// Least share of the smaller number of detections that a change explains.
const MIN_SHARE: f64 = 0.4;
/// It must explain so many times what no change explains; a small one, which explains a part of it, less.
const MIN_RATIO_LARGE: f64 = 3.0;
const MIN_RATIO_SMALL: f64 = 1.5;
/// And so many times what it explains by chance.
const CHANCE_RATIO: u64 = 2;
/// Detections of agents that see nothing together: so many, such a share of them at one place, and their middles so near, m.
const MIN_APART: u64 = 16;
const MOST_SHARE_APART: f64 = 0.2;
const ONE_AREA_M: f64 = 150.0;
/// The same where all have poses: two vehicles that see a crowd from both ends share little.
const MOST_SHARE_APART_IN_VIEW: f64 = 0.05;
/// Such a share of what each reports is between what the other one does: their views overlap.
const WITHIN_SHARE: f64 = 0.3;
/// Clocks are known to agree from this standard deviation on, s.
const CLOCKS_SIGMA_S: f64 = 0.03;
/// The time between two agents is known from this standard deviation on, as far as a shift of place is not one of time, s.
const TIME_SIGMA_S: f64 = 0.15;
/// What is this near to where it was a snapshot before stands, m; and so large a share of the detections.
const STANDS_M: f64 = 1.0;
const STANDS_SHARE: f64 = 0.7;
/// Prior standard deviations of a shift (m), a turn (rad), a time (s).
const PRIOR: [f64; 4] = [5.0, 5.0, 0.3, 0.7];
/// Errors of a difference beside those that are stated, m.
const UNSTATED_M: f64 = 0.3;
/// Standard deviations from which on a parameter is not zero.
const SURE: f64 = 5.0;
/// Smallest parameters that are reported: m, m, rad, s.
const MIN_REPORTED: [f64; 4] = [0.75, 0.75, 0.03, 0.08];

/// How two agents' detections go together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::diagnosis) enum Fit {
    /// They do as they are.
    Agree {
        /// What moves shows that their clocks agree.
        clocks: bool,
    },
    /// They do after a change of the positions of one of them, by its place in the pair.
    Changed {
        /// Whose positions are changed.
        whose: usize,
        /// How.
        change: Change,
        /// Share of the detections that it explains.
        share: f64,
        /// What moves shows the time between the two, or nothing moves; otherwise a shift can be one of time.
        is_time_known: bool,
    },
    /// Nothing brings them together, though both report objects not far from each other all the time, and somebody's frames
    /// have no pose of a sensor, by the places in the pair; or all have one, and what one reports is all about what the other does.
    Apart {
        /// Whose frames have none.
        without_pose: [bool; 2],
    },
    /// Nothing can be said.
    Unknown,
}

/// What a change explains.
#[derive(Clone, Debug, Default)]
struct Explained {
    pairs: u64,
    places: BTreeSet<[i64; 2]>,
}

/// Compares the two agents of some snapshots.
pub(in crate::diagnosis) fn fit(snapshots: &[Snapshot]) -> Fit {
    let possible: u64 = snapshots.iter().map(|[a, b]| a.spots.len().min(b.spots.len()) as u64).sum();
    let as_is = explained(snapshots, 1, &Change::Rigid(Rigid::default()));
    let near = refine(snapshots, Rigid::default());
    // The turn of a frame moves what is near the sensor little: the refined change decides, not what is explained as it is.
    if let Some(near) = near {
        let near_share = share(near.explained.pairs, possible);
        if near.is_small() && near_share >= MIN_SHARE {
            return Fit::Agree { clocks: near.shows_clocks() };
        }
        // Most objects agree as they are, so that the frames do: what is left is of those that move.
        if share(as_is.pairs, possible) >= MIN_SHARE && near.is_sure(possible) {
            return near.changed(snapshots, possible);
        }
    }
    let large = LARGE.iter().flat_map(|change| [0, 1].map(|whose| (whose, *change)));
    let large = large.map(|(whose, change)| (explained(snapshots, whose, &change), whose, change));
    let best = large.max_by_key(|(explained, ..)| explained.pairs);
    if let Some((explained, whose, change)) = best.filter(|(explained, whose, change)| {
        is_clear(explained, &as_is, possible, MIN_RATIO_LARGE)
            && beats_chance(explained, snapshots, *whose, change)
    }) {
        return Fit::Changed { whose, change, share: share(explained.pairs, possible), is_time_known: true };
    }
    let refined = beginnings(snapshots).into_iter().filter_map(|begin| refine(snapshots, begin));
    let best = refined.max_by_key(|refined| refined.explained.pairs);
    let Some(best) = best else { return apart(snapshots, &as_is, possible) };
    if best.is_small() && share(best.explained.pairs, possible) >= MIN_SHARE {
        return Fit::Agree { clocks: best.shows_clocks() };
    }
    let is_found = is_clear(&best.explained, &as_is, possible, MIN_RATIO_SMALL) || best.is_sure(possible);
    if is_found && beats_chance(&best.explained, snapshots, 1, &Change::Rigid(best.change)) {
        return best.changed(snapshots, possible);
    }
    apart(snapshots, &as_is, possible)
}

/// Whether most of what the first one reports is where it was a snapshot before.
fn stands(snapshots: &[Snapshot]) -> bool {
    let (mut stand, mut all) = (0, 0);
    for (before, after) in snapshots.iter().zip(snapshots.iter().skip(1)) {
        all += after[0].spots.len() as u64;
        let stays = |spot: &&Spot| nearest(spot, &before[0].spots, Some(STANDS_M)).is_some();
        stand += after[0].spots.iter().filter(stays).count() as u64;
    }
    all > 0 && share(stand, all) >= STANDS_SHARE
}

/// Of what no change brings together.
fn apart(snapshots: &[Snapshot], as_is: &Explained, possible: u64) -> Fit {
    let without_pose = [0, 1].map(|whose| snapshots.iter().all(|pair| pair[whose].pose.is_none()));
    let middle = |whose: usize, axis: usize| {
        let spots = snapshots.iter().flat_map(|pair| &pair[whose].spots);
        let (sum, n) = spots.fold((0.0, 0_u64), |(sum, n), spot| (sum + spot.at[axis], n + 1));
        sum / share(n, 1)
    };
    let apart_m = libm::hypot(middle(0, 0) - middle(1, 0), middle(0, 1) - middle(1, 1));
    let is_apart = possible >= MIN_APART
        && apart_m <= ONE_AREA_M
        && match without_pose.contains(&true) {
            true => share(as_is.pairs, possible) < MOST_SHARE_APART,
            false => {
                share(as_is.pairs, possible) < MOST_SHARE_APART_IN_VIEW && lie_within_each_other(snapshots)
            }
        };
    if is_apart { Fit::Apart { without_pose } } else { Fit::Unknown }
}

/// Whether much of what each of both reports is between what the other one does.
fn lie_within_each_other(snapshots: &[Snapshot]) -> bool {
    let spots = |whose: usize| snapshots.iter().flat_map(move |pair| &pair[whose].spots);
    [0, 1].into_iter().all(|whose| {
        let extent = [0, 1].map(|axis| {
            let along = spots(1 - whose).map(|spot| spot.at[axis]);
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), one| {
                (one.min(least), one.max(most))
            })
        });
        let is_within =
            |spot: &&Spot| (0..2).all(|axis| (extent[axis].0..=extent[axis].1).contains(&spot.at[axis]));
        let (within, all) = (spots(whose).filter(is_within).count(), spots(whose).count());
        share(within as u64, all as u64) >= WITHIN_SHARE
    })
}

#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
fn share(pairs: u64, possible: u64) -> f64 {
    pairs as f64 / (possible as f64).max(1.0)
}

#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
fn is_clear(explained: &Explained, as_is: &Explained, possible: u64, ratio: f64) -> bool {
    explained.pairs >= MIN_PAIRS
        && explained.places.len() >= MIN_PLACES
        && share(explained.pairs, possible) >= MIN_SHARE
        && explained.pairs as f64 >= ratio * as_is.pairs as f64
}

/// Whether a change explains far more than the same one does of detections of another time: lanes and rows of parked cars
/// fit onto each other, whoever sees them, and say nothing.
fn beats_chance(explained_now: &Explained, snapshots: &[Snapshot], whose: usize, change: &Change) -> bool {
    let n = snapshots.len();
    let apart = |k: usize| {
        let mut pair = snapshots[k].clone();
        pair[1 - whose] = snapshots[(k + n / 2) % n].clone()[1 - whose].clone();
        pair
    };
    let shuffled: Vec<_> = (0..n).map(apart).collect();
    explained_now.pairs >= CHANCE_RATIO * explained(&shuffled, whose, change).pairs
}

/// The pairs of detections that are of one object after a change of those of `whose`. Each of the other one's counts once: what is
/// brought together into one place explains nothing.
fn explained(snapshots: &[Snapshot], whose: usize, change: &Change) -> Explained {
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
fn nearest<'a>(spot: &Spot, others: &'a [Spot], within: Option<f64>) -> Option<(f64, &'a Spot)> {
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
fn place(coordinate_m: f64) -> i64 {
    libm::floor(coordinate_m / PLACE_M) as i64
}

/// Small changes of the second agent's positions from which the search begins.
fn beginnings(snapshots: &[Snapshot]) -> Vec<Rigid> {
    let none = Rigid::default();
    let times = [-1.0, -0.6, -0.3, -0.15, 0.15, 0.3, 0.6, 1.0];
    let turns = [-0.35, -0.2, -0.1, -0.05, 0.05, 0.1, 0.2, 0.35];
    let mut beginnings = vec![none];
    beginnings.extend(shift(snapshots).map(|by_m| Rigid { by_m, ..none }));
    beginnings.extend(times.map(|earlier_s| Rigid { earlier_s, ..none }));
    beginnings.extend(turns.map(|turn_rad| Rigid { turn_rad, ..none }));
    beginnings
}

/// The shift that most pairs of detections have, by a grid; m.
fn shift(snapshots: &[Snapshot]) -> Option<[f64; 2]> {
    const REACH_M: f64 = 12.0;
    const N: usize = 25;
    let cell = |by_m: f64| {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 24")]
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
    #[expect(clippy::cast_precision_loss, reason = "0 to 24")]
    let metres = |cell: usize| cell as f64 - REACH_M;
    (*count > 0).then(|| [metres(peak % N), metres(peak / N)])
}

/// A small change with the standard deviations of its parameters.
#[derive(Clone, Debug)]
struct Refined {
    change: Rigid,
    sigma: [f64; 4],
    explained: Explained,
}

impl Refined {
    fn parameters(&self) -> [f64; 4] {
        let Rigid { by_m: [x, y], turn_rad, earlier_s } = self.change;
        [x, y, turn_rad, earlier_s]
    }

    fn is_reported(&self, k: usize) -> bool {
        let value = self.parameters()[k].abs();
        value >= MIN_REPORTED[k] && value >= SURE * self.sigma[k]
    }

    /// No parameter is large and certain enough to be reported.
    fn is_small(&self) -> bool {
        (0..4).all(|k| !self.is_reported(k))
    }

    /// What moves shows the time between the two.
    fn shows_clocks(&self) -> bool {
        self.sigma[3] <= CLOCKS_SIGMA_S
    }

    /// Its pairs are enough for its parameters, whatever no change explains: a shift of two metres leaves many of them near.
    fn is_sure(&self, possible: u64) -> bool {
        !self.is_small()
            && self.explained.pairs >= MIN_PAIRS
            && self.explained.places.len() >= MIN_PLACES
            && share(self.explained.pairs, possible) >= 1.5 * MIN_SHARE
    }

    /// The fit that it is.
    fn changed(&self, snapshots: &[Snapshot], possible: u64) -> Fit {
        Fit::Changed {
            whose: 1,
            change: Change::Rigid(self.reported()),
            share: share(self.explained.pairs, possible),
            is_time_known: self.sigma[3] <= TIME_SIGMA_S || stands(snapshots),
        }
    }

    /// The change with the parameters that are reported; the others are zero.
    fn reported(&self) -> Rigid {
        let kept = |k: usize| if self.is_reported(k) { self.parameters()[k] } else { 0.0 };
        Rigid { by_m: [kept(0), kept(1)], turn_rad: kept(2), earlier_s: kept(3) }
    }
}

/// Least squares from a beginning.
fn refine(snapshots: &[Snapshot], begin: Rigid) -> Option<Refined> {
    let (mut change, mut sigma) = (begin, PRIOR);
    for step in 0..STEPS {
        let within = (step < STEPS / 2).then_some(WIDE_M);
        let normal = Normal::of(snapshots, &change, within);
        let (solution, deviations) = normal.solve()?;
        change = Rigid { by_m: [solution[0], solution[1]], turn_rad: solution[2], earlier_s: solution[3] };
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
    fn of(snapshots: &[Snapshot], change: &Rigid, within: Option<f64>) -> Self {
        let mut normal = Self { matrix: [[0.0; 4]; 4], right: [0.0; 4] };
        for (k, prior) in PRIOR.iter().enumerate() {
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

#[cfg(test)]
mod tests;
