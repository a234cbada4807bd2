//! What somebody's method has answered to exported detections, ready to be scored.

use crate::data::conditions::Conditions;
use crate::data::fused_box::FusedBox;
use crate::data::noise::Shape;
use crate::drive::keyframes::setting::{Occasion, Setting};
use std::collections::BTreeMap;

/// A method's answers.
#[derive(Clone, Debug, Default)]
pub struct Answers {
    name: String,
    told: String,
    shape: Shape,
    conditions: Conditions,
    claims_accuracy: bool,
    by_scene: BTreeMap<(&'static str, u32, String), Vec<Vec<FusedBox>>>,
}

impl Answers {
    /// No answers yet, of a method of this name; `told` says in words what it is told apart from boxes and classes.
    pub fn new(name: impl Into<String>, told: impl Into<String>) -> Self {
        Self { name: name.into(), told: told.into(), claims_accuracy: true, ..Self::default() }
    }

    /// To detections whose errors are of another shape, or made under other conditions, than the paper's.
    #[must_use]
    pub fn to(self, shape: Shape, conditions: Conditions) -> Self {
        Self { shape, conditions, ..self }
    }

    /// Of a method that does not say how accurate its boxes are.
    #[must_use]
    pub fn without_accuracy(self) -> Self {
        Self { claims_accuracy: false, ..self }
    }

    /// Whether it says how accurate its boxes are.
    pub const fn claims_accuracy(&self) -> bool {
        self.claims_accuracy
    }

    /// Whether they are to detections of this kind.
    pub fn are_to(&self, setting: &Setting) -> bool {
        let has_noise = || self.by_scene.keys().any(|(noise, ..)| *noise == setting.noise.name());
        self.shape == setting.shape && self.conditions == setting.conditions && has_noise()
    }

    /// Its name in tables.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What it is told apart from boxes and classes, in words.
    pub fn told(&self) -> &str {
        &self.told
    }

    /// Notes what it tells of a scene, keyframe by keyframe.
    pub fn insert(&mut self, occasion: &Occasion<'_>, by_keyframe: Vec<Vec<FusedBox>>) {
        self.by_scene.insert(key(occasion), by_keyframe);
    }

    /// What it tells of a scene, keyframe by keyframe; nothing where it was not asked.
    pub fn of(&self, occasion: &Occasion<'_>) -> std::vec::IntoIter<Vec<FusedBox>> {
        self.by_scene.get(&key(occasion)).cloned().unwrap_or_default().into_iter()
    }
}

fn key(occasion: &Occasion<'_>) -> (&'static str, u32, String) {
    (occasion.noise.name(), occasion.trial, occasion.scene.to_owned())
}
