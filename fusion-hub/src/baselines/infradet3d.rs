//! InfraDet3D-Late (Zimmer 2023; deploy/docs/methods.md): `merge_boxes_late_fusion.py` of the TUM Traffic kit, in the plane.

use super::mean::mean;
use super::pairing::{distance_within, fold};
use super::report::{Fused, Report};
use crate::values::Measurement;
use serde::{Deserialize, Serialize};

/// Largest distance of centres in a pair, m (the authors' default, and the paper's).
const REACH_M: f64 = 3.0;

/// What a pair becomes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Merge {
    /// Position and heading of the first agent's box, mean size: as the paper's rows indicate.
    FirstBoxMeanSize,
    /// Mean position, mean size, heading of the first agent's box: the authors' code.
    MeanBoxFirstHeading,
}

/// Pairs by centre distance, at least total distance; the score of a pair is the mean.
pub fn fuse(agents: &[&[Report]], merge: Merge) -> Vec<Fused> {
    fold(
        agents,
        |one, report| distance_within(REACH_M, one, report),
        |one, report| {
            #[expect(clippy::cast_precision_loss, reason = "numbers of agents")]
            let n = one.members.len() as f64;
            let middle = mean(&[(&one.z, n), (&report.z, 1.0)]);
            one.score = (n * one.score + report.score) / (n + 1.0);
            one.z = match merge {
                Merge::FirstBoxMeanSize => {
                    Measurement { size: middle.size, relative_variance: middle.relative_variance, ..one.z }
                }
                Merge::MeanBoxFirstHeading => {
                    Measurement { yaw: one.z.yaw, yaw_variance: one.z.yaw_variance, ..middle }
                }
            };
        },
    )
}

#[cfg(test)]
mod tests {
    use super::super::Rule;
    use super::super::testing::{report, sized};
    use super::*;

    fn merged(merge: Merge, distance_m: f64) -> Vec<Fused> {
        let (a, b) = ([report(0.0, 0.0)], [sized(report(distance_m, 0.0), [1.0, 6.0], 0.2)]);
        Rule::InfraDet3d(merge).fuse(&[&a, &b])
    }

    #[test]
    fn the_papers_row_keeps_the_first_place_and_averages_sizes() {
        let z = merged(Merge::FirstBoxMeanSize, 2.0)[0].z;
        assert_eq!((z.position, z.size, z.yaw), ([0.0, 0.0], [1.5, 5.0], 0.0));
    }

    #[test]
    fn the_authors_code_averages_places_and_keeps_the_heading() {
        let z = merged(Merge::MeanBoxFirstHeading, 2.0)[0].z;
        assert_eq!((z.position, z.size, z.yaw), ([1.0, 0.0], [1.5, 5.0], 0.0));
    }

    #[test]
    fn three_metres_are_a_pair_and_more_are_not() {
        assert_eq!(merged(Merge::FirstBoxMeanSize, 3.0).len(), 1);
        assert_eq!(merged(Merge::FirstBoxMeanSize, 3.01).len(), 2);
    }
}
