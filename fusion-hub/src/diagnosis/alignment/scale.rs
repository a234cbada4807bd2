//! Whether one agent's positions are a little further apart than those of another one: by a unit that is nearly a metre, or a bad
//! calibration.
//!
//! Errors by a factor are small near the sensor, and not far from it: a shift, a turn and a time explain a part of them. So the
//! factor must leave much less than these do alone.

use super::change::{Change, Rigid};
use super::squares::{MIN_PAIRS, Refined, nearest, refine, share};
use super::{Sighting, Snapshot, Spot};

/// Factors from which the search begins, and how often they are corrected.
const BEGINNINGS: [f64; 4] = [0.88, 0.95, 1.05, 1.1];
const STEPS: usize = 3;
/// Smallest and largest deviation from 1: sensors that see the near side of objects draw together what is far by a few hundredths.
const DEVIATIONS: (f64, f64) = (0.04, 0.2);
/// Agents that share so much agree.
const AGREES: f64 = 0.93;
/// Of what both see such a share must fit, so many times the fewest pairs, at so many places.
const MIN_SHARE: f64 = 0.75;
const PAIRS_TIMES: u64 = 2;
const MIN_PLACES: usize = 8;
/// Errors of one place that last, m, and standard deviations from which on a factor is not 1.
const LASTING_M: f64 = 0.4;
const SURE: f64 = 5.0;
/// What the squares of the differences are at most with the factor, as a part of those without it.
const LEAVES: f64 = 0.6;

/// Pairs of detections of one object after a change of the second agent's.
#[derive(Clone, Debug, Default)]
struct Pairs {
    /// The second one's changed place, the first one's place.
    of: Vec<[[f64; 2]; 2]>,
    /// Sums of squares of the differences with the factor, and without it.
    squares: [f64; 2],
}

/// By what the second agent's positions are to be multiplied, with the share of what both see that then fits; `near` is the small change without a
/// factor that is next to none, and `best_small` gives the best of all, which costs more.
pub(super) fn find(
    snapshots: &[Snapshot],
    near: &Refined,
    possible: u64,
    best_small: impl FnOnce() -> Option<Refined>,
) -> Option<(f64, f64)> {
    // Who agrees without a factor needs no further look.
    if share(near.explained.pairs, possible) >= AGREES {
        return None;
    }
    // Multiplied about another place they are shifted as well.
    let middle = middle(snapshots)?;
    let sensors =
        [0, 1].into_iter().filter_map(|whose| snapshots.first()?[whose].pose.map(|pose| [pose.x, pose.y]));
    let begin =
        sensors.chain([[0.0; 2], middle]).flat_map(|centre| BEGINNINGS.map(|factor| (centre, factor)));
    let begin = begin.filter_map(|(centre, factor)| {
        let refined = refine(&scaled(snapshots, centre, factor), Rigid::default())?;
        Some((refined.explained.pairs, centre, factor))
    });
    let (pairs, centre, mut factor) = begin.max_by_key(|(pairs, ..)| *pairs)?;
    if pairs < near.explained.pairs {
        return None;
    }
    let mut fitted = None;
    for _ in 0..STEPS {
        let changed = scaled(snapshots, centre, factor);
        let refined = refine(&changed, Rigid::default())?;
        let pairs = Pairs::of((snapshots, &changed), &refined.change, &near.change);
        let (correction, spread_m) = pairs.correction()?;
        fitted = Some((refined, pairs, spread_m, factor * correction));
        factor *= correction;
    }
    let (refined, pairs, spread_m, factor) = fitted?;
    let share = share(refined.explained.pairs, possible);
    let deviation = (factor - 1.0).abs();
    let n_places = refined.explained.places.len();
    tracing::debug!(factor, share, near = near.explained.pairs, pairs = refined.explained.pairs, n_places, spread_m, squares = ?pairs.squares, "scaled");
    #[expect(clippy::cast_precision_loss, reason = "some hundred places")]
    let sigma = LASTING_M / (spread_m * libm::sqrt(n_places as f64));
    let is_found = (DEVIATIONS.0..=DEVIATIONS.1).contains(&deviation)
        && share >= MIN_SHARE
        && refined.explained.pairs >= PAIRS_TIMES * MIN_PAIRS
        && refined.explained.pairs >= near.explained.pairs
        && n_places >= MIN_PLACES
        && deviation >= SURE * sigma
        && pairs.squares[0] <= LEAVES * pairs.squares[1];
    if !is_found {
        return None;
    }
    // What a time or a shift explains, too, is no unit.
    let small = best_small()?;
    let pairs = Pairs::of((snapshots, &scaled(snapshots, centre, factor)), &refined.change, &small.change);
    (pairs.squares[0] <= LEAVES * pairs.squares[1]).then_some((factor, share))
}

/// The middle of what the second agent sees.
#[expect(clippy::cast_precision_loss, reason = "some hundred detections")]
fn middle(snapshots: &[Snapshot]) -> Option<[f64; 2]> {
    let spots = || snapshots.iter().flat_map(|[_, second]| &second.spots);
    let n = spots().count();
    (n > 0).then(|| [0, 1].map(|axis| spots().map(|spot| spot.at[axis]).sum::<f64>() / n as f64))
}

/// With the second agent's positions multiplied about a place.
fn scaled(snapshots: &[Snapshot], centre: [f64; 2], factor: f64) -> Vec<Snapshot> {
    let place = |spot: &Spot| [0, 1].map(|axis| centre[axis] + factor * (spot.at[axis] - centre[axis]));
    let of_second = |sighting: &Sighting| {
        let spots = sighting.spots.iter().map(|spot| Spot { at: place(spot), ..*spot });
        Sighting { spots: spots.collect(), ..sighting.clone() }
    };
    snapshots.iter().map(|[first, second]| [first.clone(), of_second(second)]).collect()
}

impl Pairs {
    /// Of snapshots as they are and multiplied, with the small change of each.
    fn of((given, scaled): (&[Snapshot], &[Snapshot]), with: &Rigid, without: &Rigid) -> Self {
        let mut pairs = Self::default();
        let apply =
            |change: &Rigid, sighting: &Sighting| Change::Rigid(*change).apply(sighting).unwrap_or_default();
        for ([first, given], [_, scaled]) in given.iter().zip(scaled) {
            for (with, without) in apply(with, scaled).iter().zip(apply(without, given)) {
                let Some((squared, target)) = nearest(with, &first.spots, None) else { continue };
                pairs.of.push([with.at, target.at]);
                pairs.squares =
                    [pairs.squares[0] + squared, pairs.squares[1] + apart_squared(&without, target)];
            }
        }
        pairs
    }

    /// By what the factor is to be multiplied, by least squares about the middle; and how far from that the places are, m.
    #[expect(clippy::cast_precision_loss, reason = "some hundred pairs")]
    fn correction(&self) -> Option<(f64, f64)> {
        let n = self.of.len() as f64;
        let mean = |k: usize, axis: usize| self.of.iter().map(|pair| pair[k][axis]).sum::<f64>() / n;
        let means = [0, 1].map(|k| [0, 1].map(|axis| mean(k, axis)));
        let (mut product, mut square) = (0.0, 0.0);
        for [place, target] in &self.of {
            for axis in 0..2 {
                let (own, other) = (place[axis] - means[0][axis], target[axis] - means[1][axis]);
                product += own * other;
                square += own * own;
            }
        }
        let correction = product / square;
        (correction.is_finite() && correction > 0.0).then(|| (correction, libm::sqrt(square / n)))
    }
}

fn apart_squared(spot: &Spot, target: &Spot) -> f64 {
    let [x, y] = [0, 1].map(|axis| target.at[axis] - spot.at[axis]);
    x * x + y * y
}
