//! What a hub publishes: fused objects, and the frame that contains them.

use crate::class::Class;
use crate::geometry::BevBox;
use crate::heading::HeadingKind;
use crate::id::{AgentId, FrameId, HubId, MapFrame, MeasurementId, TrackId};
use crate::time::{Span, Timestamp};
use serde::{Deserialize, Serialize};

/// Symmetric 4×4 covariance of (x, y, vx, vy), upper triangle by rows: xx, x-y, x-vx, x-vy, yy, y-vx,
/// y-vy, vx-vx, vx-vy, vy-vy; m², m²/s and m²/s².
pub type KinematicCovariance = [f64; 10];

/// Places of the diagonal in a [`KinematicCovariance`].
pub const KINEMATIC_DIAGONAL: [usize; 4] = [0, 4, 7, 9];

/// Row and column of every element of a [`KinematicCovariance`].
pub const KINEMATIC_INDEX: [(usize, usize); 10] =
    [(0, 0), (0, 1), (0, 2), (0, 3), (1, 1), (1, 2), (1, 3), (2, 2), (2, 3), (3, 3)];

/// The published estimate of one track, valid at the frame's `fused_at`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FusedObject {
    /// The same as long as the track exists; unique over restarts of the hub.
    pub track: TrackId,
    /// The most probable class.
    pub class: Class,
    /// All classes with their probabilities, most probable first; they sum to 1.
    pub class_probabilities: Vec<(Class, f64)>,
    /// How much the agents contradict each other about the class, in [0, 1]: the conflict of Dempster's rule.
    pub class_conflict: f64,
    /// Position, size and heading in the map frame.
    pub bev: BevBox,
    /// Velocity east and north, m/s.
    pub velocity: (f64, f64),
    /// Covariance of position and velocity.
    pub kinematic_covariance: KinematicCovariance,
    /// Variance of the width, m².
    pub ww: f64,
    /// Variance of the depth, m².
    pub dd: f64,
    /// Variance of the heading, rad².
    pub yaw_variance: f64,
    /// What is known of the heading. The variance of an axis holds that the front may be at the other end.
    pub heading: HeadingKind,
    /// Probability that the object exists.
    pub existence: f64,
    /// Time from the first measurement to `fused_at`.
    pub age: Span,
    /// Capture time of its last measurement before `fused_at`, by the agent's clock.
    pub last_measured_at: Timestamp,
    /// The last measurement of each agent that contributed, by agent; with a lag, of those not after `fused_at`.
    pub contributors: Vec<MeasurementId>,
}

impl FusedObject {
    /// An object of which only the box is known: σ of 1 m in position and size and of 1 rad in heading, velocity 0 with
    /// σ of 30 m/s, existence 1. A fusion method overwrites what it estimates.
    pub fn from_box(track: TrackId, class: Class, bev: BevBox) -> Self {
        let mut kinematic_covariance = [0.0; 10];
        for (place, variance) in KINEMATIC_DIAGONAL.into_iter().zip([1.0, 1.0, 900.0, 900.0]) {
            kinematic_covariance[place] = variance;
        }
        Self {
            track,
            class,
            class_probabilities: vec![(class, 1.0)],
            class_conflict: 0.0,
            bev,
            velocity: (0.0, 0.0),
            kinematic_covariance,
            ww: 1.0,
            dd: 1.0,
            yaw_variance: 1.0,
            heading: HeadingKind::Known,
            existence: 1.0,
            age: Span::ZERO,
            last_measured_at: Timestamp::EPOCH,
            contributors: Vec::new(),
        }
    }

    /// The state (x, y, vx, vy) in the map frame, m and m/s.
    #[cfg(feature = "nalgebra")]
    pub const fn kinematic_state(&self) -> nalgebra::Vector4<f64> {
        nalgebra::Vector4::new(self.bev.x, self.bev.y, self.velocity.0, self.velocity.1)
    }

    /// The covariance of [`Self::kinematic_state`], m², m²/s and m²/s².
    #[cfg(feature = "nalgebra")]
    pub fn kinematic_covariance_matrix(&self) -> nalgebra::Matrix4<f64> {
        let mut matrix = nalgebra::Matrix4::zeros();
        for (value, (row, column)) in self.kinematic_covariance.into_iter().zip(KINEMATIC_INDEX) {
            matrix[(row, column)] = value;
            matrix[(column, row)] = value;
        }
        matrix
    }

    /// The whole state [x, y, vx, vy, w, d, θ] as in the paper (eq. 7); m, m/s, m and rad in the map frame.
    #[cfg(feature = "nalgebra")]
    pub fn state(&self) -> nalgebra::SVector<f64, 7> {
        let BevBox { x, y, w, d, yaw } = self.bev;
        nalgebra::SVector::from([x, y, self.velocity.0, self.velocity.1, w, d, yaw])
    }

    /// The covariance of [`Self::state`]. Sizes and heading are correlated with nothing else.
    #[cfg(feature = "nalgebra")]
    pub fn covariance_matrix(&self) -> nalgebra::SMatrix<f64, 7, 7> {
        let mut matrix = nalgebra::SMatrix::<f64, 7, 7>::zeros();
        matrix.fixed_view_mut::<4, 4>(0, 0).copy_from(&self.kinematic_covariance_matrix());
        for (place, variance) in (4..).zip([self.ww, self.dd, self.yaw_variance]) {
            matrix[(place, place)] = variance;
        }
        matrix
    }

    /// The object without its contributors.
    #[must_use]
    pub fn without_contributors(&self) -> Self {
        let class_probabilities = self.class_probabilities.clone();
        Self { contributors: Vec::new(), class_probabilities, ..*self }
    }

    /// The classes as both codecs write them: [`Self::class`] first, then the others as they are listed.
    ///
    /// A class that the list lacks has the probability 1 where the list is empty, 0 elsewhere.
    pub(crate) fn classes(&self) -> impl Iterator<Item = (Class, f64)> {
        let listed = &self.class_probabilities;
        let leads = listed.first().is_some_and(|(class, _)| *class == self.class);
        let own = (!leads).then(|| {
            let found = listed.iter().find(|(class, _)| *class == self.class);
            found.copied().unwrap_or((self.class, if listed.is_empty() { 1.0 } else { 0.0 }))
        });
        own.into_iter().chain(listed.iter().copied().filter(move |(class, _)| leads || *class != self.class))
    }
}

/// Statistics of one agent at the hub.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AgentHealth {
    /// The agent.
    pub agent: AgentId,
    /// The boot epoch of its newest accepted frame.
    pub epoch: u64,
    /// Capture time of its newest accepted frame.
    pub newest_captured_at: Timestamp,
    /// Number of frames accepted since the hub's start.
    pub accepted: u64,
    /// Number of frames refused since the hub's start, for any reason.
    pub refused: u64,
    /// Number of accepted frames that were older than an already fused one.
    pub out_of_sequence: u64,
}

/// A detection frame of which this fused frame is the first to contain the information.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Inclusion {
    /// The detection frame.
    pub frame: FrameId,
    /// Its capture time, by the agent's clock.
    pub captured_at: Timestamp,
    /// Its time of arrival, by the hub's clock.
    pub received_at: Timestamp,
}

/// The hub's list of objects, valid at `fused_at`.
#[derive(Clone, Debug, PartialEq)]
pub struct FusedFrame {
    /// The hub.
    pub hub: HubId,
    /// The hub's lineage: new at every start.
    pub lineage: u32,
    /// Number in this lineage.
    pub sequence: u64,
    /// The hub time for which all states hold: the time of publishing minus the configured lag.
    pub fused_at: Timestamp,
    /// The coordinate frame of all positions.
    pub map_frame: Option<MapFrame>,
    /// The objects, by track id.
    pub objects: Vec<FusedObject>,
    /// Statistics of the agents, by agent.
    pub agents: Vec<AgentHealth>,
    /// The detection frames that are new in this frame, by arrival; with a lag their capture time may be after `fused_at`.
    pub includes: Vec<Inclusion>,
}

impl FusedFrame {
    /// The frame without objects, agents and inclusions.
    #[must_use]
    pub fn without_lists(&self) -> Self {
        let Self { hub, lineage, sequence, fused_at, map_frame, .. } = *self;
        let (agents, includes) = (Vec::new(), Vec::new());
        Self { hub, lineage, sequence, fused_at, map_frame, objects: Vec::new(), agents, includes }
    }
}

#[cfg(all(test, feature = "nalgebra"))]
mod tests {
    use super::*;

    #[test]
    fn the_matrix_is_symmetric_with_the_elements_of_the_upper_triangle() {
        let mut object = FusedObject::from_box(TrackId::default(), Class::Car, BevBox::default());
        object.kinematic_covariance = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0];
        let matrix = object.kinematic_covariance_matrix();
        assert_eq!(matrix, matrix.transpose());
        assert_eq!((matrix[(0, 3)], matrix[(3, 0)], matrix[(2, 2)], matrix[(3, 2)]), (4.0, 4.0, 8.0, 9.0));
        object.velocity = (3.0, -1.0);
        assert_eq!(object.kinematic_state().as_slice(), [0.0, 0.0, 3.0, -1.0]);
    }

    #[test]
    fn the_whole_state_has_the_order_of_the_paper() {
        let bev = BevBox { x: 1.0, y: 2.0, w: 5.0, d: 6.0, yaw: 0.7 };
        let mut object = FusedObject::from_box(TrackId::default(), Class::Car, bev);
        object.velocity = (3.0, 4.0);
        (object.ww, object.dd, object.yaw_variance) = (55.0, 66.0, 77.0);
        assert_eq!(object.state().as_slice(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 0.7]);
        let covariance = object.covariance_matrix();
        assert_eq!(covariance.diagonal().as_slice(), [1.0, 1.0, 900.0, 900.0, 55.0, 66.0, 77.0]);
        assert_eq!((covariance[(0, 4)], covariance[(6, 5)]), (0.0, 0.0));
    }
}
