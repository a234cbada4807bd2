//! The data model of all tracking metrics: true and reported boxes, instant by instant.

use crate::data::scene::TrueBox;
use std::collections::BTreeSet;
use v2x_agent::truth::ObjectId;
use v2x_common::class::Class;
use v2x_common::geometry::BevBox;

/// Pairs must be nearer than this, m: nuScenes' distance for tracking (`tracking_nips_2019.json`).
pub const GATE_M: f64 = 2.0;

/// A box that a method reports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReportedBox {
    /// Its track.
    pub track: u64,
    /// The reported class.
    pub class: Class,
    /// Confidence; only the order counts.
    pub score: f64,
    /// Position and size (m), heading (rad).
    pub bev: BevBox,
}

/// True and reported boxes of one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Instant {
    /// The true boxes.
    pub truth: Vec<TrueBox>,
    /// The reported boxes.
    pub reported: Vec<ReportedBox>,
}

/// One scene: equally spaced instants in the order of time. No object and no track is in an instant twice,
/// and all numbers are finite.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sequence(Vec<Instant>);

/// Why instants are no [`Sequence`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SequenceError {
    /// Two true boxes of one object.
    #[error("instant {instant}: object {} is there twice", object.0)]
    ObjectTwice {
        /// Number of the instant, from 0.
        instant: usize,
        /// The object.
        object: ObjectId,
    },
    /// Two boxes of one track.
    #[error("instant {instant}: track {track} is reported twice")]
    TrackTwice {
        /// Number of the instant, from 0.
        instant: usize,
        /// The track.
        track: u64,
    },
    /// A position, size, heading or score that is not finite.
    #[error("instant {instant}: a box or score is not finite")]
    NotFinite {
        /// Number of the instant, from 0.
        instant: usize,
    },
}

impl Sequence {
    /// A sequence of these instants.
    ///
    /// # Errors
    /// If an object or track is in an instant twice, or a number is not finite.
    pub fn new(instants: Vec<Instant>) -> Result<Self, SequenceError> {
        for (instant, Instant { truth, reported }) in instants.iter().enumerate() {
            let is_finite =
                |bev: &BevBox| [bev.x, bev.y, bev.w, bev.d, bev.yaw].iter().all(|one| one.is_finite());
            if !truth.iter().all(|one| is_finite(&one.bev))
                || !reported.iter().all(|one| is_finite(&one.bev) && one.score.is_finite())
            {
                return Err(SequenceError::NotFinite { instant });
            }
            if let Some(object) = twice(truth.iter().map(|one| one.id)) {
                return Err(SequenceError::ObjectTwice { instant, object });
            }
            if let Some(track) = twice(reported.iter().map(|one| one.track)) {
                return Err(SequenceError::TrackTwice { instant, track });
            }
        }
        Ok(Self(instants))
    }

    /// In the order of time.
    pub fn instants(&self) -> &[Instant] {
        &self.0
    }

    /// The same instants with only the boxes, true and reported, of some classes.
    #[must_use]
    pub fn of_classes(&self, keep: impl Fn(Class) -> bool) -> Self {
        let kept = |Instant { truth, reported }: &Instant| Instant {
            truth: truth.iter().filter(|one| keep(one.class)).copied().collect(),
            reported: reported.iter().filter(|one| keep(one.class)).copied().collect(),
        };
        Self(self.0.iter().map(kept).collect())
    }
}

/// The first repeated id.
fn twice<T: Ord + Copy>(ids: impl Iterator<Item = T>) -> Option<T> {
    let mut seen = BTreeSet::new();
    ids.into_iter().find(|id| !seen.insert(*id))
}

/// `None` if the divisor is 0.
#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
pub(crate) fn ratio(part: u64, whole: u64) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::tracking::testing::{at, instant, reported, truth};

    #[test]
    fn ids_are_unique_in_each_instant() {
        let object_twice = Sequence::new(vec![Instant::default(), instant(&[(3, 0.0), (3, 9.0)], &[])]);
        assert_eq!(object_twice, Err(SequenceError::ObjectTwice { instant: 1, object: ObjectId(3) }));
        let track_twice = Sequence::new(vec![instant(&[], &[(5, 0.0), (4, 1.0), (5, 9.0)])]);
        assert_eq!(track_twice, Err(SequenceError::TrackTwice { instant: 0, track: 5 }));
    }

    #[test]
    fn boxes_and_scores_are_numbers() {
        let not_finite = Err(SequenceError::NotFinite { instant: 0 });
        assert_eq!(Sequence::new(vec![instant(&[(0, f64::NAN)], &[])]), not_finite);
        assert_eq!(Sequence::new(vec![instant(&[], &[(0, f64::INFINITY)])]), not_finite);
        let endless = TrueBox { bev: BevBox { d: f64::INFINITY, ..at(0.0) }, ..truth(0, 0.0) };
        assert_eq!(Sequence::new(vec![Instant { truth: vec![endless], reported: vec![] }]), not_finite);
        let unsure = ReportedBox { score: f64::NAN, ..reported(0, 0.0) };
        assert_eq!(Sequence::new(vec![Instant { truth: vec![], reported: vec![unsure] }]), not_finite);
    }

    #[test]
    fn selecting_a_class_keeps_its_boxes_and_all_instants() {
        let bus = TrueBox { class: Class::RigidBus, bev: at(9.0), ..truth(1, 0.0) };
        let both = Instant { truth: vec![truth(0, 0.0), bus], reported: vec![reported(7, 0.1)] };
        let sequence = Sequence::new(vec![both, instant(&[(0, 1.0)], &[])]).unwrap();
        let buses = sequence.of_classes(|class| class == Class::RigidBus);
        assert_eq!(
            buses.instants(),
            [Instant { truth: vec![bus], reported: vec![] }, Instant { truth: vec![], reported: vec![] }]
        );
    }
}
