//! The recorded output of a user's method for exported detections.

use crate::data::conditions::Conditions;
use crate::data::fused_box::FusedBox;
use crate::data::noise::Shape;
use crate::drive::keyframes::setting::{SceneTrial, Setting};
use std::collections::BTreeMap;

/// The output of a method.
#[derive(Clone, Debug, Default)]
pub struct RecordedOutput {
    name: String,
    inputs: String,
    shape: Shape,
    conditions: Conditions,
    claims_accuracy: bool,
    by_scene: BTreeMap<(&'static str, u32, String), Vec<Vec<FusedBox>>>,
}

impl RecordedOutput {
    /// An empty output of a method of this name; `inputs` are its inputs apart from boxes and classes, in words.
    pub fn new(name: impl Into<String>, inputs: impl Into<String>) -> Self {
        Self { name: name.into(), inputs: inputs.into(), claims_accuracy: true, ..Self::default() }
    }

    /// Sets the shape of the detections' errors, and the agents' conditions.
    #[must_use]
    pub fn for_detections(self, shape: Shape, conditions: Conditions) -> Self {
        Self { shape, conditions, ..self }
    }

    /// Its boxes have no covariances.
    #[must_use]
    pub fn without_accuracy(self) -> Self {
        Self { claims_accuracy: false, ..self }
    }

    /// Whether its boxes have covariances.
    pub const fn claims_accuracy(&self) -> bool {
        self.claims_accuracy
    }

    /// Whether it is for the detections of this setting.
    pub fn is_for(&self, setting: &Setting) -> bool {
        let has_noise = || self.by_scene.keys().any(|(noise, ..)| *noise == setting.noise.name());
        self.shape == setting.shape && self.conditions == setting.conditions && has_noise()
    }

    /// Its name in tables.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its inputs apart from boxes and classes, in words.
    pub fn inputs(&self) -> &str {
        &self.inputs
    }

    /// Adds the boxes of a scene, by keyframe.
    pub fn insert(&mut self, trial_of_scene: &SceneTrial<'_>, by_keyframe: Vec<Vec<FusedBox>>) {
        self.by_scene.insert(key(trial_of_scene), by_keyframe);
    }

    /// The boxes of a scene, by keyframe; empty where there is no output.
    pub fn of(&self, trial_of_scene: &SceneTrial<'_>) -> std::vec::IntoIter<Vec<FusedBox>> {
        self.by_scene.get(&key(trial_of_scene)).cloned().unwrap_or_default().into_iter()
    }
}

fn key(trial_of_scene: &SceneTrial<'_>) -> (&'static str, u32, String) {
    (trial_of_scene.noise.name(), trial_of_scene.trial, trial_of_scene.scene.to_owned())
}
