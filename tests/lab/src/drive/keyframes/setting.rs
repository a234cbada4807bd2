//! What detections are like, and of which scene.

use crate::data::conditions::Conditions;
use crate::data::noise::{NoisePair, Shape};

/// What detections are like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setting {
    /// Levels of noise of both agents.
    pub noise: NoisePair,
    /// The shape of the errors.
    pub shape: Shape,
    /// What agents can see.
    pub conditions: Conditions,
}

/// Which scene a contender is asked about.
#[derive(Clone, Copy, Debug)]
pub struct SceneTrial<'a> {
    /// Levels of noise of both agents.
    pub noise: NoisePair,
    /// What agents can see.
    pub conditions: Conditions,
    /// The number of the trial.
    pub trial: u32,
    /// The scene's name.
    pub scene: &'a str,
}
