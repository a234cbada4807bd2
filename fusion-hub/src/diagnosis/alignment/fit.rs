//! Looks for the change that brings one agent's detections onto those of another one.
//!
//! Small changes are found by least squares over pairs of nearest detections ([`super::squares`]), from several beginnings.

use super::change::{Change, LARGE, Rigid};
use super::search::{beats_chance, is_the_only_one, shift, stood};
use super::squares::{
    Explained, MIN_PAIRS, MIN_PLACES, MIN_SHARE, Refined, TIME_SIGMA_S, explained, refine, share,
};
use super::times::{self, Between};
use super::{Snapshot, Spot, scale};

/// It must explain so many times what no change explains; a small one, which explains a part of it, less.
const MIN_RATIO_LARGE: f64 = 3.0;
const MIN_RATIO_SMALL: f64 = 1.5;
/// Who shares so much with another one agrees, and needs no further look.
const AGREES: f64 = 0.85;
/// Detections of agents that see nothing together: so many, such a share of them at one place, and their middles so near, m.
const MIN_APART: u64 = 16;
const MOST_SHARE_APART: f64 = 0.2;
const ONE_AREA_M: f64 = 150.0;
/// The same where all have poses: two vehicles that see a crowd from both ends share little.
const MOST_SHARE_APART_IN_VIEW: f64 = 0.05;
/// Such a share of what each reports is between what the other one does: their views overlap.
const WITHIN_SHARE: f64 = 0.3;
/// Most stand where so large a share of the detections does.
const STANDS_SHARE: f64 = 0.7;

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

/// Compares the two agents of some snapshots.
pub(in crate::diagnosis) fn fit(snapshots: &[Snapshot]) -> Fit {
    let possible: u64 = snapshots.iter().map(|[a, b]| a.spots.len().min(b.spots.len()) as u64).sum();
    let as_is = explained(snapshots, 1, &Change::Rigid(Rigid::default()));
    let near = refine(snapshots, Rigid::default());
    if let Some((factor, share)) =
        near.as_ref().and_then(|near| scale::find(snapshots, near, possible, || best_small(snapshots)))
    {
        return Fit::Changed { whose: 1, change: Change::Scaled(factor), share, is_time_known: true };
    }
    // The turn of a frame moves what is near the sensor little: the refined change decides, not what is explained as it is.
    if let Some(near) = near {
        let near_share = share(near.explained.pairs, possible);
        if near.is_small() && near_share >= MIN_SHARE {
            // What stands agrees at any time.
            let time = (near_share < AGREES).then(|| times::of_what_moves(snapshots, &near)).flatten();
            return match time {
                Some((rigid, pairs)) => Fit::Changed {
                    whose: 1,
                    change: Change::Rigid(rigid),
                    share: share(pairs, possible),
                    is_time_known: true,
                },
                None => agree(&near, snapshots, &as_is, possible),
            };
        }
        // Most objects agree as they are, so that the frames do: what is left is of those that move.
        if share(as_is.pairs, possible) >= MIN_SHARE && near.is_sure(possible) {
            return changed(&near, snapshots, possible);
        }
    }
    let large = LARGE.iter().flat_map(|change| [0, 1].map(|whose| (whose, *change)));
    let large = large.map(|(whose, change)| (explained(snapshots, whose, &change), whose, change));
    let best = large.max_by_key(|(explained, ..)| explained.pairs);
    if let Some((explained, whose, change)) = best.filter(|(explained, whose, change)| {
        is_clear(explained, &as_is, possible, MIN_RATIO_LARGE) && beats_chance(snapshots, *whose, change)
    }) {
        return Fit::Changed { whose, change, share: share(explained.pairs, possible), is_time_known: true };
    }
    let Some(best) = best_small(snapshots) else { return apart(snapshots, &as_is, possible) };
    if best.is_small() && share(best.explained.pairs, possible) >= MIN_SHARE {
        return agree(&best, snapshots, &as_is, possible);
    }
    let is_found = is_clear(&best.explained, &as_is, possible, MIN_RATIO_SMALL) || best.is_sure(possible);
    if is_found && is_no_chance(snapshots, &best.change) {
        return changed(&best, snapshots, possible);
    }
    apart(snapshots, &as_is, possible)
}

/// The fit of a small change.
fn changed(refined: &Refined, snapshots: &[Snapshot], possible: u64) -> Fit {
    let (mut rigid, mut pairs) = (refined.reported(), refined.explained.pairs);
    // No time displaces what stands.
    let stands = stands(snapshots) || is_the_only_one(snapshots, &refined.change);
    let is_shift = rigid.turn_rad == 0.0 && rigid.by_m != [0.0; 2];
    match if is_shift && !stands { times::between(snapshots) } else { None } {
        Some(Between::Time(earlier_s, of_time)) => {
            (rigid, pairs) = (Rigid { earlier_s, ..Rigid::default() }, of_time);
        }
        Some(Between::Either(by_m, or_earlier_s, of_place)) => {
            (rigid, pairs) = (Rigid { by_m, or_earlier_s, ..Rigid::default() }, of_place);
        }
        Some(Between::Place(..)) | None => {}
    }
    Fit::Changed {
        whose: 1,
        change: Change::Rigid(rigid),
        share: share(pairs, possible),
        is_time_known: refined.sigma[3] <= TIME_SIGMA_S || stands,
    }
}

/// Whether most of what the first one reports is where it was a snapshot before.
fn stands(snapshots: &[Snapshot]) -> bool {
    let (mut stand, mut all) = (0, 0);
    for (k, after) in snapshots.iter().enumerate() {
        all += after[0].spots.len() as u64;
        stand += after[0].spots.iter().filter(|spot| stood(snapshots, (k, 0), spot)).count() as u64;
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
fn is_clear(explained: &Explained, as_is: &Explained, possible: u64, ratio: f64) -> bool {
    explained.pairs >= MIN_PAIRS
        && explained.places.len() >= MIN_PLACES
        && share(explained.pairs, possible) >= MIN_SHARE
        && explained.pairs as f64 >= ratio * as_is.pairs as f64
}

/// Whether a small change of the second one's explains far more than it does by chance: of all that it sees, of enough that moves, or of
/// what stands.
fn is_no_chance(snapshots: &[Snapshot], rigid: &Rigid) -> bool {
    let change = &Change::Rigid(*rigid);
    beats_chance(snapshots, 1, change) || is_the_only_one(snapshots, rigid) || {
        let moving = times::of_moving(snapshots);
        explained(&moving, 1, change).pairs >= MIN_PAIRS && beats_chance(&moving, 1, change)
    }
}

/// Two that agree but for a small change. One of which no part is certain, and that explains far more than none, is a shift or a time that
/// cannot be told apart: then neither is small.
fn agree(refined: &Refined, snapshots: &[Snapshot], as_is: &Explained, possible: u64) -> Fit {
    let agree = Fit::Agree { clocks: refined.shows_clocks() };
    if !is_clear(&refined.explained, as_is, possible, MIN_RATIO_SMALL)
        || !is_no_chance(snapshots, &refined.change)
    {
        return agree;
    }
    let none = Rigid::default();
    let (rigid, pairs) = match times::between(snapshots) {
        Some(Between::Place(by_m, pairs)) => (Rigid { by_m, ..none }, pairs),
        Some(Between::Time(earlier_s, pairs)) => (Rigid { earlier_s, ..none }, pairs),
        Some(Between::Either(by_m, or_earlier_s, pairs)) => (Rigid { by_m, or_earlier_s, ..none }, pairs),
        None => return agree,
    };
    Fit::Changed {
        whose: 1,
        change: Change::Rigid(rigid),
        share: share(pairs, possible),
        is_time_known: true,
    }
}

/// The best small change.
fn best_small(snapshots: &[Snapshot]) -> Option<Refined> {
    let refined = beginnings(snapshots).into_iter().filter_map(|begin| refine(snapshots, begin));
    refined.max_by_key(|refined| refined.explained.pairs)
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

#[cfg(test)]
mod tests;
