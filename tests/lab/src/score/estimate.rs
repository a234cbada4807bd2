//! One estimate of an object: the input of matching and errors.

use crate::data::fused_box::FusedBox;
use v2x_common::class::Class;
use v2x_common::covariance::Covariance2;
use v2x_common::detection::Detection;
use v2x_common::fused::FusedObject;
use v2x_common::geometry::BevBox;

/// The estimate of one object by a detector or a method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Estimate {
    /// The reported class.
    pub class: Class,
    /// Position, size and heading.
    pub bev: BevBox,
    /// The reported covariance of the position, m².
    pub position: Covariance2,
}

impl From<&FusedObject> for Estimate {
    fn from(object: &FusedObject) -> Self {
        // xx, x-y and yy of the upper triangle (v2x_common::fused::KINEMATIC_INDEX).
        let [xx, xy, _, _, yy, ..] = object.kinematic_covariance;
        Self { class: object.class, bev: object.bev, position: Covariance2 { xx, xy, yy } }
    }
}

impl From<&Detection> for Estimate {
    fn from(detection: &Detection) -> Self {
        Self { class: detection.class, bev: detection.bev, position: detection.covariance.position }
    }
}

impl From<&FusedBox> for Estimate {
    fn from(fused: &FusedBox) -> Self {
        Self { class: fused.class, bev: fused.bev, position: fused.covariance.position }
    }
}
