//! What a method tells of an object.

use v2x_agent::truth::ObjectId;
use v2x_common::class::Class;
use v2x_common::covariance::BoxCovariance;
use v2x_common::fused::FusedObject;
use v2x_common::geometry::BevBox;
use v2x_common::id::TrackId;

/// An object as it is scored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FusedBox {
    /// The box.
    pub bev: BevBox,
    /// What it is said to be.
    pub class: Class,
    /// How surely it exists, 0 to 1.
    pub existence: f64,
    /// What is claimed of the box's error.
    pub covariance: BoxCovariance,
    /// Which one it is to the method.
    pub track: TrackId,
    /// Which true object it is scored against: by the identity of agent 1's detection of this keyframe in it, else
    /// of agent 2's, else of its newest one; `None` for what is of nothing.
    pub object: Option<ObjectId>,
}

impl FusedBox {
    /// A fused object whose identity is known.
    pub fn of(fused: &FusedObject, object: Option<ObjectId>) -> Self {
        let [xx, xy, _, _, yy, ..] = fused.kinematic_covariance;
        let position = v2x_common::covariance::Covariance2 { xx, xy, yy };
        let (ww, dd, yaw) = (fused.ww, fused.dd, fused.yaw_variance);
        Self {
            bev: fused.bev,
            class: fused.class,
            existence: fused.existence,
            covariance: BoxCovariance { position, ww, dd, yaw },
            track: fused.track,
            object,
        }
    }
}
