//! What an export is of: enough to make its detections again, and so to know whose they are.

use crate::commands::draws::DrawArgs;
use crate::commands::export::file_names::file_names;
use crate::data::conditions::Conditions;
use crate::data::dataset::source::Source;
use crate::data::noise::{NoisePair, Realisation, Shape, stable_hash};
use crate::data::observation::Protocol;
use crate::data::scene::Scene;
use anyhow::{Context, ensure};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Its file.
pub(crate) const FILE_NAME: &str = "export.json";
/// Of the file and of the tables beside it.
const FORMAT: u32 = 1;

/// The contents of `export.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Manifest {
    /// Version of this format.
    pub format: u32,
    /// Version of the laboratory that wrote it.
    pub lab: String,
    /// As `--dataset` names it.
    pub dataset: String,
    /// Of nuScenes.
    pub version: String,
    /// Of nuScenes.
    pub split: String,
    /// Whether only a part of the scenes was taken.
    pub quick: bool,
    /// Levels of noise of both agents.
    pub noise: Vec<NoisePair>,
    /// Realisations of the noise.
    pub trials: u32,
    /// Of all noise.
    pub seed: u64,
    /// Of all errors.
    pub shape: Shape,
    /// What agents can see.
    pub conditions: Conditions,
    /// All scenes.
    pub scenes: Vec<SceneFile>,
    /// Of all detections.
    pub fingerprint: String,
}

/// A scene, and where its detections are.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SceneFile {
    /// Its name in its data set.
    pub name: String,
    /// Its file below `NOISE/trial-NUMBER`.
    pub file: String,
    /// How many keyframes it has.
    pub keyframes: usize,
}

/// One table of an export.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Part {
    /// Levels of noise of both agents.
    pub noise: NoisePair,
    /// The number of the trial.
    pub trial: u32,
    /// The place of the scene.
    pub scene: usize,
}

impl Manifest {
    /// Of an export of these scenes; its fingerprint is yet to come.
    pub(crate) fn new(draws: &DrawArgs, conditions: Conditions, scenes: &[Scene]) -> anyhow::Result<Self> {
        let files = file_names(scenes.iter().map(|scene| scene.name.as_str()));
        let scene_file = |(scene, file): (&Scene, String)| SceneFile {
            name: scene.name.clone(),
            file,
            keyframes: scene.keyframes.len(),
        };
        let mut noise = Vec::new();
        draws.noise.iter().for_each(|pair| {
            if !noise.contains(pair) {
                noise.push(*pair);
            }
        });
        Ok(Self {
            format: FORMAT,
            lab: env!("CARGO_PKG_VERSION").to_owned(),
            dataset: absolute(&draws.dataset)?.to_string(),
            version: draws.version.clone(),
            split: draws.split.to_string(),
            quick: draws.quick,
            noise,
            trials: draws.n_trials(),
            seed: draws.seed,
            shape: draws.shape,
            conditions,
            scenes: scenes.iter().zip(files).map(scene_file).collect(),
            fingerprint: String::new(),
        })
    }

    /// Reads the one in a folder.
    pub(crate) fn load(folder: &Path) -> anyhow::Result<Self> {
        let path = folder.join(FILE_NAME);
        let text =
            std::fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
        let manifest: Self =
            serde_json::from_str(&text).with_context(|| format!("{} is no export's", path.display()))?;
        let format = manifest.format;
        ensure!(format == FORMAT, "{} is of format {format}, expected {FORMAT}", path.display());
        Ok(manifest)
    }

    /// The scenes, and the errors that fall on them, as `lab tables` would be asked for them.
    pub(crate) fn draws(&self) -> anyhow::Result<DrawArgs> {
        Ok(DrawArgs {
            dataset: self.dataset.parse()?,
            version: self.version.clone(),
            split: match self.split.parse() {
                Ok(split) => split,
                Err(never) => match never {},
            },
            noise: self.noise.clone(),
            trials: Some(self.trials),
            quick: self.quick,
            seed: self.seed,
            shape: self.shape,
        })
    }

    /// Its tables, in order.
    pub(crate) fn parts(&self) -> impl Iterator<Item = Part> {
        let trials = |noise: &NoisePair| {
            (0..self.trials).map({
                let noise = *noise;
                move |trial| (noise, trial)
            })
        };
        let scenes = |(noise, trial)| (0..self.scenes.len()).map(move |scene| Part { noise, trial, scene });
        self.noise.iter().flat_map(trials).flat_map(scenes)
    }

    /// Where a table is below the export's folder.
    pub(crate) fn path(&self, part: Part) -> PathBuf {
        let Part { noise, trial, scene } = part;
        [noise.name(), &format!("trial-{trial}"), &self.scenes[scene].file].iter().collect()
    }

    /// How the detections of a table were made.
    pub(crate) const fn protocol(&self, part: Part) -> Protocol {
        let Part { noise, trial, .. } = part;
        let Self { shape, conditions, seed, .. } = *self;
        Protocol { noise, shape, conditions, realisation: Realisation { seed, trial } }
    }

    /// Whether these are its scenes, as far as names and lengths go.
    pub(crate) fn is_of(&self, scenes: &[Scene]) -> bool {
        let is_same = |(file, scene): (&SceneFile, &Scene)| {
            file.name == scene.name && file.keyframes == scene.keyframes.len()
        };
        self.scenes.len() == scenes.len() && self.scenes.iter().zip(scenes).all(is_same)
    }
}

/// So that an export can be scored from another folder.
fn absolute(dataset: &Source) -> anyhow::Result<Source> {
    let absolute = |path| std::path::absolute(path).context("the path of the data set");
    Ok(match dataset {
        Source::Synthetic => Source::Synthetic,
        Source::Csv(path) => Source::Csv(absolute(path)?),
        Source::NuScenes(path) => Source::NuScenes(absolute(path)?),
    })
}

/// Of tables, in order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fingerprint(u64);

impl Default for Fingerprint {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fingerprint {
    /// Takes in a table.
    pub(crate) fn add(&mut self, table: &str) {
        self.0 = (self.0 ^ stable_hash(table)).wrapping_mul(0x0100_0000_01b3);
    }

    /// As it is written.
    pub(crate) fn text(self) -> String {
        format!("{:016x}", self.0)
    }
}
