//! CLEAR MOT: MOTA, MOTP, identity switches, fragmentations (Bernardin & Stiefelhagen 2008), as py-motmetrics
//! counts them.
//!
//! All counts are sums over instants: scenes are combined by adding the sums before any ratio is taken.

use crate::score::tracking::sequence::ratio;

/// Sums over instants.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Clear {
    /// True boxes.
    pub objects: u64,
    /// True boxes with a track.
    pub found: u64,
    /// True boxes with another track than the object had before.
    pub switches: u64,
    /// Reported boxes without an object.
    pub false_positives: u64,
    /// How often an object lost its track while it was there, and got one again.
    pub fragmentations: u64,
    /// Sum of the distances of pairs, m.
    pub distance_sum_m: f64,
}

impl Clear {
    /// Adds another scene.
    pub fn merge(&mut self, other: &Self) {
        self.objects += other.objects;
        self.found += other.found;
        self.switches += other.switches;
        self.false_positives += other.false_positives;
        self.fragmentations += other.fragmentations;
        self.distance_sum_m += other.distance_sum_m;
    }

    /// True boxes with the same track as before, or with a first one.
    pub const fn matches(&self) -> u64 {
        self.found - self.switches
    }

    /// True boxes without a track.
    pub const fn misses(&self) -> u64 {
        self.objects - self.found
    }

    /// 1 − (misses + false positives + switches) / objects: at most 1, negative where errors outnumber objects;
    /// `None` without objects.
    pub fn mota(&self) -> Option<f64> {
        ratio(self.misses() + self.false_positives + self.switches, self.objects).map(|errors| 1.0 - errors)
    }

    /// Mean distance of pairs, m; `None` without pairs.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub fn motp_m(&self) -> Option<f64> {
        (self.found > 0).then(|| self.distance_sum_m / self.found as f64)
    }

    /// Share of the true boxes with a track; `None` without true boxes.
    pub fn recall(&self) -> Option<f64> {
        ratio(self.found, self.objects)
    }

    /// Share of the reported boxes with an object; `None` without reported boxes.
    pub fn precision(&self) -> Option<f64> {
        ratio(self.found, self.found + self.false_positives)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::tracking::sequence::GATE_M;
    use crate::score::tracking::testing::{Xs, sequence};

    fn of(instants: &[Xs]) -> Clear {
        Clear::of(&sequence(instants), GATE_M)
    }

    #[test]
    fn an_object_keeps_its_track_although_another_one_is_nearer() {
        let clear = of(&[(&[(0, 0.0)], &[(7, 1.0)]), (&[(0, 0.0)], &[(8, 0.1), (7, 1.5)])]);
        assert_eq!((clear.matches(), clear.switches, clear.false_positives), (2, 0, 1));
        assert_eq!(clear.motp_m(), Some(1.25));
    }

    #[test]
    fn beyond_the_gate_it_switches() {
        let clear = of(&[(&[(0, 0.0)], &[(7, 1.0)]), (&[(0, 0.0)], &[(8, 0.5), (7, 2.0)])]);
        assert_eq!((clear.matches(), clear.switches, clear.false_positives), (1, 1, 1));
        assert_eq!(
            (clear.mota(), clear.recall(), clear.precision()),
            (Some(0.0), Some(1.0), Some(2.0 / 3.0))
        );
    }

    #[test]
    fn a_track_is_remembered_over_misses_and_absence() {
        let found: Xs = (&[(0, 0.0)], &[(7, 0.0)]);
        let missed: Xs = (&[(0, 0.0)], &[]);
        let absent: Xs = (&[], &[]);
        let clear = of(&[missed, found, missed, missed, found, absent, found, missed]);
        assert_eq!((clear.switches, clear.fragmentations, clear.misses()), (0, 1, 4));
    }

    #[test]
    fn of_two_objects_with_the_same_last_track_the_first_one_keeps_it() {
        let before: [Xs; 2] = [(&[(0, 0.0)], &[(7, 0.0)]), (&[(1, 0.5)], &[(7, 0.5)])];
        for (objects, motp_m) in [([(0, 0.0), (1, 0.5)], 0.2), ([(1, 0.5), (0, 0.0)], 0.3)] {
            let clear = of(&[before[0], before[1], (&objects, &[(7, 0.2)])]);
            assert_eq!((clear.found, clear.switches, clear.misses()), (3, 0, 1));
            assert!((clear.motp_m().unwrap() - motp_m / 3.0).abs() < 1e-12, "{objects:?}");
        }
    }

    #[test]
    fn without_objects_there_are_no_ratios() {
        let clear = of(&[(&[], &[(7, 0.0)]), (&[], &[])]);
        assert_eq!(
            (clear.false_positives, clear.mota(), clear.motp_m(), clear.recall()),
            (1, None, None, None)
        );
        assert_eq!(Clear::default().precision(), None);
    }
}
