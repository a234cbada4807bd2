//! AP at intersections over union in bird's-eye view, as papers of cooperative perception report it.
//!
//! OpenCOOD, `opencood/utils/eval_utils.py` (OPV2V, V2XSet, V2V4Real, DAIR-V2X's reports alike): in each instant the boxes, by
//! falling score, take the free true box that they overlap most; over all instants, by falling score, the precision is made
//! falling and integrated over the recall (Pascal VOC 2010). Classes do not count.

use crate::score::detection::Scene;
use v2x_fusion_hub::values::overlap::Footprint;

/// Overlaps of AP.
pub const OVERLAPS: [f64; 3] = [0.3, 0.5, 0.7];

/// The average precision at each of [`OVERLAPS`]; `None` without true boxes.
pub fn average_precisions(scenes: &[Scene<'_>]) -> Option<[f64; 3]> {
    let instants = || scenes.iter().flat_map(|scene| scene.sequence.instants());
    let objects: usize = instants().map(|instant| instant.truth.len()).sum();
    if objects == 0 {
        return None;
    }
    // By reported box: its score, and whether it is right at each overlap.
    let mut outcomes: Vec<(f64, [bool; 3])> = Vec::new();
    for instant in instants() {
        let truth: Vec<_> = instant.truth.iter().map(|one| Footprint::of(&one.bev)).collect();
        let mut reported: Vec<_> =
            instant.reported.iter().map(|one| (one.score, Footprint::of(&one.bev))).collect();
        reported.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let mut is_taken = [0, 1, 2].map(|_| vec![false; truth.len()]);
        for (score, footprint) in reported {
            let overlaps: Vec<f64> = truth.iter().map(|one| one.iou(&footprint)).collect();
            let mut is_right = [false; 3];
            for ((is_right, is_taken), least) in is_right.iter_mut().zip(&mut is_taken).zip(OVERLAPS) {
                let free = overlaps.iter().enumerate().filter(|(place, _)| !is_taken[*place]);
                // Of equal overlaps the first one.
                let best = free.fold(None, |best: Option<(usize, f64)>, (place, overlap)| match best {
                    Some((_, most)) if most >= *overlap => best,
                    _ => Some((place, *overlap)),
                });
                if let Some((place, _)) = best.filter(|(_, overlap)| *overlap >= least) {
                    is_taken[place] = true;
                    *is_right = true;
                }
            }
            outcomes.push((score, is_right));
        }
    }
    outcomes.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    Some(
        [0, 1, 2]
            .map(|place| average_precision(objects, outcomes.iter().map(|(_, is_right)| is_right[place]))),
    )
}

/// The area under the precision, made falling, over the recall.
#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
fn average_precision(objects: usize, outcomes: impl Iterator<Item = bool>) -> f64 {
    let mut found = 0_usize;
    let precisions: Vec<(bool, f64)> = outcomes
        .enumerate()
        .map(|(number, is_right)| {
            found += usize::from(is_right);
            (is_right, found as f64 / (number + 1) as f64)
        })
        .collect();
    let (mut best, mut area) = (0.0_f64, 0.0);
    for (is_right, precision) in precisions.into_iter().rev() {
        best = best.max(precision);
        area += if is_right { best / objects as f64 } else { 0.0 };
    }
    area
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::tracking::testing::{Xs, sequence};

    fn of(instants: &[Xs]) -> Option<[f64; 3]> {
        let sequence = sequence(instants);
        average_precisions(&[Scene { sequence: &sequence, velocities: &[] }])
    }

    #[test]
    fn a_shifted_box_counts_where_it_overlaps_enough() {
        // The boxes are 4 m long: 1.5 m apart along them they overlap by 2.5 / 5.5 = 0.45.
        assert_eq!(of(&[(&[(0, 0.0)], &[(7, 1.5)])]), Some([1.0, 0.0, 0.0]));
        assert_eq!(of(&[(&[(0, 0.0)], &[(7, 0.0), (8, 0.0)])]), Some([1.0; 3]), "the false one comes last");
        assert_eq!(of(&[(&[(0, 0.0), (1, 50.0)], &[(7, 0.0)])]), Some([0.5; 3]));
        assert_eq!(of(&[(&[], &[(7, 0.0)])]), None);
    }
}
