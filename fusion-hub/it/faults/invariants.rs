//! What holds of every list, and of a hub after everything.

use std::collections::BTreeSet;
use v2x_common::fused::{FusedFrame, FusedObject};
use v2x_common::geometry::BevBox;
use v2x_common::id::FrameId;
use v2x_common::time::Timestamp;
use v2x_common::wire;

/// More objects are not made of so few detections.
const MOST_OBJECTS: usize = 3_000;

/// What the lists of one lineage have said so far.
#[derive(Default)]
pub(super) struct Lists {
    newest: Option<(u64, Timestamp)>,
    /// Frames by their number and arrival: a process that counts anew uses numbers again, once the old ones are forgotten.
    pub(super) included: BTreeSet<(FrameId, Timestamp)>,
}

impl Lists {
    /// Panics where a list is not sound.
    pub(super) fn check(&mut self, list: &FusedFrame, now: Timestamp) {
        if let Some((sequence, at)) = self.newest {
            assert!(list.sequence > sequence, "sequence {} after {sequence}", list.sequence);
            assert!(list.fused_at >= at, "a list of {:?} after one of {at:?}", list.fused_at);
        }
        assert!(list.fused_at <= now, "a list of {:?} at {now:?}", list.fused_at);
        self.newest = Some((list.sequence, list.fused_at));
        assert!(list.objects.len() <= MOST_OBJECTS, "{} objects", list.objects.len());
        let is_unique = list.objects.is_sorted_by(|a, b| a.track < b.track);
        assert!(is_unique, "one object for each track, by id");
        list.objects.iter().for_each(check_object);
        for inclusion in &list.includes {
            let is_new = self.included.insert((inclusion.frame, inclusion.received_at));
            assert!(is_new, "{:?} is new in two lists", inclusion.frame);
        }
        let mut bytes = Vec::new();
        wire::fused::encode(list, &mut bytes).expect("a list of few objects fits");
        wire::fused::decode(&bytes).expect("what is encoded can be decoded");
    }
}

fn check_object(object: &FusedObject) {
    let BevBox { x, y, w, d, yaw } = object.bev;
    let variances = [object.ww, object.dd, object.yaw_variance];
    let numbers = [x, y, w, d, yaw, object.velocity.0, object.velocity.1, object.class_conflict];
    let all = numbers.iter().chain(&variances).chain(&object.kinematic_covariance);
    assert!(all.into_iter().all(|number| number.is_finite()), "{object:?}");
    assert!(w > 0.0 && d > 0.0 && variances.iter().all(|variance| *variance > 0.0), "{object:?}");
    assert!((0.0..=1.0).contains(&object.existence), "{object:?}");
    let total: f64 = object.class_probabilities.iter().map(|(_, probability)| probability).sum();
    assert!((total - 1.0).abs() < 1e-3, "{object:?}");
    assert!(is_positive_definite(&object.kinematic_covariance), "{object:?}");
}

/// By Cholesky's decomposition of the matrix whose upper triangle this is, row by row.
pub(super) fn is_positive_definite(upper: &[f64; 10]) -> bool {
    let place = |row: usize, column: usize| {
        let (row, column) = (row.min(column), row.max(column));
        upper[row * 4 - row * (row + 1) / 2 + column]
    };
    let mut factor = [[0.0_f64; 4]; 4];
    for row in 0..4 {
        for column in 0..=row {
            let known: f64 = (0..column).map(|k| factor[row][k] * factor[column][k]).sum();
            let rest = place(row, column) - known;
            if row == column {
                if rest.is_nan() || rest <= 0.0 {
                    return false;
                }
                factor[row][row] = libm::sqrt(rest);
            } else {
                factor[row][column] = rest / factor[column][column];
            }
        }
    }
    true
}

#[test]
fn positive_definite_matrices_are_distinguished_from_others() {
    assert!(is_positive_definite(&[1.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 3.0, 0.0, 4.0]));
    assert!(is_positive_definite(&[2.0, 0.5, 0.9, 0.0, 2.0, 0.0, 0.9, 3.0, 0.1, 4.0]));
    assert!(
        !is_positive_definite(&[1.0, 0.0, 2.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0]),
        "correlated by more than 1"
    );
    assert!(!is_positive_definite(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0]));
}
