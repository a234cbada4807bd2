//! A fused object as the tables score it.

use v2x_agent::truth::ObjectId;
use v2x_common::class::Class;
use v2x_common::covariance::BoxCovariance;
use v2x_common::fused::FusedObject;
use v2x_common::geometry::BevBox;
use v2x_common::id::TrackId;

/// A fused object as the tables score it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FusedBox {
    /// The box.
    pub bev: BevBox,
    /// The published class.
    pub class: Class,
    /// Existence probability, 0 to 1.
    pub existence: f64,
    /// The published velocity east and north, m/s; `None` where the method has none.
    pub velocity: Option<[f64; 2]>,
    /// The published covariance.
    pub covariance: BoxCovariance,
    /// The method's track.
    pub track: TrackId,
    /// The true object that it is scored against, by the provenance of its measurements: that of agent 1's detection of
    /// this keyframe in it, else of agent 2's, else of the newest detection; `None` for clutter.
    pub object: Option<ObjectId>,
}

impl FusedBox {
    /// A fused object with its true object.
    pub fn of(fused: &FusedObject, object: Option<ObjectId>) -> Self {
        let [xx, xy, _, _, yy, ..] = fused.kinematic_covariance;
        let position = v2x_common::covariance::Covariance2 { xx, xy, yy };
        let (ww, dd, yaw) = (fused.ww, fused.dd, fused.yaw_variance);
        Self {
            bev: fused.bev,
            class: fused.class,
            existence: fused.existence,
            velocity: Some([fused.velocity.0, fused.velocity.1]),
            covariance: BoxCovariance { position, ww, dd, yaw },
            track: fused.track,
            object,
        }
    }
}
