//! What somebody's method has answered to exported detections, ready to be scored.

use super::contender::Occasion;
use super::prediction::Prediction;
use std::collections::BTreeMap;

/// A method's answers.
#[derive(Clone, Debug, Default)]
pub struct Answers {
    name: String,
    told: String,
    by_scene: BTreeMap<(&'static str, u32, String), Vec<Vec<Prediction>>>,
}

impl Answers {
    /// No answers yet, of a method of this name; `told` says in words what it is told apart from boxes and classes.
    pub fn new(name: impl Into<String>, told: impl Into<String>) -> Self {
        Self { name: name.into(), told: told.into(), by_scene: BTreeMap::new() }
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
    pub fn insert(&mut self, occasion: &Occasion<'_>, by_keyframe: Vec<Vec<Prediction>>) {
        self.by_scene.insert(key(occasion), by_keyframe);
    }

    /// What it tells of a scene, keyframe by keyframe; nothing where it was not asked.
    pub fn of(&self, occasion: &Occasion<'_>) -> std::vec::IntoIter<Vec<Prediction>> {
        self.by_scene.get(&key(occasion)).cloned().unwrap_or_default().into_iter()
    }
}

fn key(occasion: &Occasion<'_>) -> (&'static str, u32, String) {
    (occasion.noise.name(), occasion.trial, occasion.scene.to_owned())
}
