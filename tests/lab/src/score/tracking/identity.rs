//! IDF1, IDP, IDR: identity over the whole scene.
//!
//! Ristani et al., "Performance measures and a data set for multi-target, multi-camera tracking", ECCVW 2016:
//! objects and tracks of a scene are assigned once, such that the fewest boxes are wrong, as in py-motmetrics
//! (`id_global_assignment`). Scenes are combined by adding the counts.

use crate::score::tracking::indexed::Indexed;
use crate::score::tracking::sequence::{Sequence, ratio};
use v2x_fusion_hub::association::assignment::{Assigner, Candidate};

/// Counts of boxes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Identity {
    /// Instants at which an object and its assigned track are within the gate.
    pub true_positives: u64,
    /// True boxes.
    pub objects: u64,
    /// Reported boxes.
    pub reported: u64,
}

impl Identity {
    /// The counts of a scene. Boxes nearer than `gate_m` may be pairs ([`super::GATE_M`]).
    pub fn of(sequence: &Sequence, gate_m: f64) -> Self {
        let indexed = Indexed::of(sequence, gate_m);
        let mut together = vec![0_u32; indexed.couples.len()];
        for pair in indexed.instants.iter().flat_map(|instant| &instant.pairs) {
            together[pair.couple as usize] += 1;
        }
        // Assigning a couple removes one false box and one miss for each common instant.
        let candidate = |(&(row, col), together): (&(u32, u32), &u32)| Candidate {
            row,
            col,
            cost: -f64::from(*together),
        };
        let candidates: Vec<_> = indexed.couples.iter().zip(&together).map(candidate).collect();
        let mut assigner = Assigner::default();
        let tracks = assigner.solve(indexed.n_objects, indexed.n_tracks, &candidates, 0.0);
        let is_chosen = |(object, track): (u32, u32)| tracks[object as usize] == Some(track);
        let chosen = indexed.couples.iter().zip(together).filter(|(couple, _)| is_chosen(**couple));
        Self {
            true_positives: chosen.map(|(_, together)| u64::from(together)).sum(),
            objects: indexed.n_true(),
            reported: indexed.n_reported(),
        }
    }

    /// Adds another scene.
    pub const fn merge(&mut self, other: &Self) {
        self.true_positives += other.true_positives;
        self.objects += other.objects;
        self.reported += other.reported;
    }

    /// Reported boxes that are no pair with their track's object.
    pub const fn false_positives(&self) -> u64 {
        self.reported - self.true_positives
    }

    /// True boxes that are no pair with their object's track.
    pub const fn false_negatives(&self) -> u64 {
        self.objects - self.true_positives
    }

    /// Precision; `None` without reported boxes.
    pub fn idp(&self) -> Option<f64> {
        ratio(self.true_positives, self.reported)
    }

    /// Recall; `None` without true boxes.
    pub fn idr(&self) -> Option<f64> {
        ratio(self.true_positives, self.objects)
    }

    /// The harmonic mean of both: 2 IDTP / (objects + reported); `None` where there is neither.
    pub fn idf1(&self) -> Option<f64> {
        ratio(2 * self.true_positives, self.objects + self.reported)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::tracking::sequence::GATE_M;
    use crate::score::tracking::testing::{Xs, sequence};

    #[test]
    fn a_track_that_changes_its_object_counts_for_the_longer_part_only() {
        let on: Xs = (&[(0, 0.0), (1, 9.0)], &[(7, 0.0)]);
        let off: Xs = (&[(0, 0.0), (1, 9.0)], &[(7, 9.0)]);
        let identity = Identity::of(&sequence(&[on, off, off]), GATE_M);
        assert_eq!(
            (identity.true_positives, identity.false_positives(), identity.false_negatives()),
            (2, 1, 4)
        );
        assert_eq!((identity.idp(), identity.idr()), (Some(2.0 / 3.0), Some(2.0 / 6.0)));
        assert_eq!(identity.idf1(), Some(4.0 / 9.0));
    }

    #[test]
    fn the_assignment_is_the_global_optimum() {
        // Track 7 is on object 0 three times and on object 1 twice; track 8 is on object 0 twice.
        let both: Xs = (&[(0, 0.0), (1, 1.0)], &[(7, 0.5)]);
        let swapped: Xs = (&[(0, 0.0), (1, 9.0)], &[(7, 0.0), (8, 0.5)]);
        let other: Xs = (&[(0, 0.0), (1, 9.0)], &[(8, 0.5)]);
        let identity = Identity::of(&sequence(&[both, both, swapped, other]), GATE_M);
        assert_eq!(identity.true_positives, 4);
    }

    #[test]
    fn without_boxes_there_are_no_ratios() {
        let silent = Identity::of(&sequence(&[(&[(0, 0.0)], &[])]), GATE_M);
        assert_eq!((silent.idp(), silent.idr(), silent.idf1()), (None, Some(0.0), Some(0.0)));
        assert_eq!(Identity::default().idf1(), None);
    }
}
