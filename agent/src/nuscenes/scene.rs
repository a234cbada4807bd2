//! A scene with annotated boxes.

use v2x_common::class::Class;
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::time::Timestamp;

/// One scene.
#[derive(Clone, Debug, PartialEq)]
pub struct AnnotatedScene {
    /// Such as `scene-0103`.
    pub name: String,
    /// Tokens of the annotated objects, in order of appearance in the tables.
    pub instances: Vec<String>,
    /// In order of time.
    pub keyframes: Vec<AnnotatedFrame>,
}

/// One keyframe.
#[derive(Clone, Debug, PartialEq)]
pub struct AnnotatedFrame {
    /// When it was captured.
    pub at: Timestamp,
    /// The middle of the ego vehicle's rear axle, in the map of the scene's city, m, and its heading, rad.
    pub ego: Pose,
    /// The annotated objects.
    pub boxes: Vec<Annotation>,
}

/// One object in one keyframe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Annotation {
    /// Its place in the scene's `instances`.
    pub instance: u32,
    /// Its class.
    pub class: Class,
    /// Position and size, m; heading, rad.
    pub bev: BevBox,
}
