//! Small scenes for the tests of the protocol.

use crate::data::fused_box::FusedBox;
use crate::data::scene::{Keyframe, Scene, TrueBox};
use v2x_agent::truth::ObjectId;
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::id::TrackId;
use v2x_common::time::Span;

pub(crate) fn car(id: u32, x: f64, y: f64) -> TrueBox {
    let bev = BevBox { x, y, w: 2.0, d: 4.0, yaw: 0.0 };
    TrueBox { id: ObjectId(id), class: Class::Car, bev }
}

/// Keyframes at 2 Hz around an agent in the origin.
pub(crate) fn scene_of(frames: &[&[TrueBox]]) -> Scene {
    let keyframe = |(frame, objects): (i64, &&[TrueBox])| Keyframe {
        at: Span::from_millis(500 * frame),
        ego: Pose::default(),
        objects: objects.to_vec(),
    };
    Scene::new("test".to_owned(), (0..).zip(frames).map(keyframe).collect())
}

/// Parked cars in a row, too far apart for wrong associations.
pub(crate) fn parking(n_frames: usize) -> Scene {
    let cars: Vec<TrueBox> = (0..8u32).map(|id| car(id, 40.0 * f64::from(id) - 140.0, 30.0)).collect();
    scene_of(&vec![cars.as_slice(); n_frames])
}

/// A fused car of a true object, with existence 1.
pub(crate) fn fused_car(object: u32, x: f64, y: f64) -> FusedBox {
    let covariance = BoxCovariance { position: Covariance2::isotropic(0.5), ww: 0.1, dd: 0.2, yaw: 0.01 };
    FusedBox {
        bev: car(0, x, y).bev,
        class: Class::Car,
        existence: 1.0,
        velocity: None,
        covariance,
        track: TrackId::new(1, object),
        object: Some(ObjectId(object)),
    }
}
