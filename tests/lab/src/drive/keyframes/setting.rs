//! The settings under which detections are made.

use crate::data::conditions::Conditions;
use crate::data::noise::{NoisePair, Shape};

/// Noise and conditions of detections.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setting {
    /// Levels of noise of both agents.
    pub noise: NoisePair,
    /// The shape of the errors.
    pub shape: Shape,
    /// Coverage and errors of detection.
    pub conditions: Conditions,
}

/// One trial of one scene.
#[derive(Clone, Copy, Debug)]
pub struct SceneTrial<'a> {
    /// Levels of noise of both agents.
    pub noise: NoisePair,
    /// Coverage and errors of detection.
    pub conditions: Conditions,
    /// The number of the trial.
    pub trial: u32,
    /// The scene's name.
    pub scene: &'a str,
}
