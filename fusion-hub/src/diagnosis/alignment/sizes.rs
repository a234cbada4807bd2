//! How large two agents say that the same vehicles are.

use super::fit::Fit;
use super::squares::{nearest, place};
use super::{Snapshot, Spot};
use std::collections::BTreeSet;

/// Fewest vehicles that both report, in snapshots with at least two of them, and places at which they were: one odd vehicle may stand
/// there all day.
const MIN_VEHICLES: usize = 30;
const MIN_OF_SNAPSHOT: usize = 2;
const MIN_PLACES: usize = 6;
/// Such a share of the ratios is within such a factor of the middle one, in width and in depth.
const ALIKE: f64 = 0.7;
const ABOUT: f64 = 1.25;

/// The second agent's vehicles against the first one's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::diagnosis) struct Ratio {
    /// So many times as wide and as deep, in the middle.
    pub(in crate::diagnosis) factors: [f64; 2],
    /// So wide and deep in the mean, m: the first one's and the second one's.
    pub(in crate::diagnosis) mean_m: [[f64; 2]; 2],
    /// Vehicles that both saw.
    pub(in crate::diagnosis) n: usize,
}

/// `None` where too few of the same vehicles were seen, or the ratios scatter: no factor is between them.
pub(in crate::diagnosis) fn ratio(snapshots: &[Snapshot], fit: &Fit) -> Option<Ratio> {
    let mut both: Vec<[[f64; 2]; 2]> = Vec::new();
    let mut places = BTreeSet::new();
    for snapshot in snapshots {
        let met = met(snapshot, fit)?;
        if met.len() >= MIN_OF_SNAPSHOT {
            places.extend(met.iter().map(|[spot, _]| spot.at.map(place)));
            both.extend(met.iter().filter_map(|[first, second]| Some([first.size?, second.size?])));
        }
    }
    if both.len() < MIN_VEHICLES || places.len() < MIN_PLACES {
        return None;
    }
    let mut factors = [0.0; 2];
    for (k, factor) in factors.iter_mut().enumerate() {
        let mut ratios: Vec<_> = both.iter().map(|[first, second]| second[k] / first[k]).collect();
        ratios.sort_by(f64::total_cmp);
        *factor = ratios[ratios.len() / 2];
        let (least, most) = (*factor / ABOUT, *factor * ABOUT);
        let n_alike = ratios.iter().filter(|ratio| (least..=most).contains(*ratio)).count();
        #[expect(clippy::cast_precision_loss, reason = "some hundred")]
        if (n_alike as f64) < ALIKE * ratios.len() as f64 {
            return None;
        }
    }
    #[expect(clippy::cast_precision_loss, reason = "some hundred")]
    let mean = |whose: usize, k: usize| both.iter().map(|one| one[whose][k]).sum::<f64>() / both.len() as f64;
    Some(Ratio { factors, mean_m: [0, 1].map(|whose| [0, 1].map(|k| mean(whose, k))), n: both.len() })
}

/// The vehicles with a size that both report, the first one's and the second one's, once the frames are as they are meant; `None` where
/// nothing brings these together.
fn met(snapshot: &Snapshot, fit: &Fit) -> Option<Vec<[Spot; 2]>> {
    let mut sides = snapshot.clone().map(|one| one.spots);
    match fit {
        Fit::Agree { .. } => {}
        Fit::Changed { whose, change, .. } => sides[*whose] = change.apply(&snapshot[*whose])?,
        Fit::Apart { .. } | Fit::Unknown => return None,
    }
    let [first, second] = sides;
    let has_size = |spot: &&Spot| spot.size.is_some();
    let met = second.iter().filter(has_size).filter_map(|spot| {
        let (_, other) = nearest(spot, &first, None)?;
        // Of two that are near one, the nearer one is meant.
        let (_, back) = nearest(other, &second, None)?;
        (std::ptr::eq(back, spot) && other.size.is_some()).then_some([*other, *spot])
    });
    Some(met.collect())
}

#[cfg(test)]
mod tests {
    use super::super::Sighting;
    use super::*;

    fn snapshots(second: impl Fn(usize, [f64; 2]) -> Option<[f64; 2]>, n_cars: u32) -> Vec<Snapshot> {
        let snapshot = |step: u32| {
            let spot = |k: u32, size| Spot {
                at: [20.0 * f64::from(k) + 3.0 * f64::from(step), 2.0],
                velocity: [7.0, 0.0],
                variance: 0.1,
                size,
            };
            let own = |k: u32| [1.7 + 0.05 * f64::from(k), 4.2 + 0.1 * f64::from(k)];
            let of = |size: &dyn Fn(u32) -> Option<[f64; 2]>| {
                Sighting::new(None, (0..n_cars).map(|k| spot(k, size(k))).collect())
            };
            [of(&|k| Some(own(k))), of(&|k| second(k as usize + step as usize, own(k)))]
        };
        (0..12).map(snapshot).collect()
    }

    #[test]
    fn vehicles_that_are_larger_by_a_factor_have_it_and_others_have_none() {
        let agree = Fit::Agree { clocks: true };
        let by = |factor: f64| snapshots(move |_, size| Some(size.map(|one| factor * one)), 5);
        let found = ratio(&by(1.3), &agree).unwrap();
        assert!(found.factors.iter().all(|factor| (factor - 1.3).abs() < 1e-9), "{found:?}");
        assert!(found.n >= MIN_VEHICLES && (found.mean_m[1][1] / found.mean_m[0][1] - 1.3).abs() < 1e-9);
        assert!(ratio(&by(1.0), &agree).unwrap().factors.iter().all(|factor| (factor - 1.0).abs() < 1e-9));
        // Whoever sees a part of each now and then, gives no sizes, or shares one car only.
        let part = |n: usize, size: [f64; 2]| Some(size.map(|one| one * [0.5, 1.0, 0.7][n % 3]));
        assert_eq!(ratio(&snapshots(part, 5), &agree), None);
        assert_eq!(ratio(&snapshots(|_, _| None, 5), &agree), None);
        assert_eq!(ratio(&snapshots(|_, size| Some(size.map(|one| 1.3 * one)), 1), &agree), None);
        assert_eq!(ratio(&by(1.3), &Fit::Unknown), None);
    }
}
