//! The manifest of an export. It holds what is needed to generate the same detections again, so that `lab score`
//! can recover the object of each detection.

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

/// File name of the manifest.
pub(crate) const FILE_NAME: &str = "export.json";
/// Version of the manifest and of the tables.
const FORMAT: u32 = 1;

/// The contents of `export.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Manifest {
    /// Version of this format.
    pub format: u32,
    /// Version of the laboratory that wrote it.
    pub lab: String,
    /// Data set, as `--dataset` names it.
    pub dataset: String,
    /// Version of nuScenes.
    pub version: String,
    /// Split of nuScenes.
    pub split: String,
    /// Whether only a part of the scenes was taken.
    pub quick: bool,
    /// Noise levels of both agents.
    pub noise: Vec<NoisePair>,
    /// Number of realisations of the noise.
    pub trials: u32,
    /// Seed of the noise.
    pub seed: u64,
    /// Distribution of the errors.
    pub shape: Shape,
    /// Detection conditions of the agents.
    pub conditions: Conditions,
    /// All scenes of the export.
    pub scenes: Vec<SceneFile>,
    /// Fingerprint of all detections.
    pub fingerprint: String,
}

/// A scene and its file of detections.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SceneFile {
    /// Name of the scene in its data set.
    pub name: String,
    /// Its file in `NOISE/trial-NUMBER`.
    pub file: String,
    /// Number of keyframes.
    pub keyframes: usize,
}

/// One table of an export.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Part {
    /// Noise levels of both agents.
    pub noise: NoisePair,
    /// Number of the trial.
    pub trial: u32,
    /// Index of the scene.
    pub scene: usize,
}

impl Manifest {
    /// The manifest of an export of `scenes`, with an empty fingerprint.
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

    /// Reads the manifest in a folder.
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

    /// The scenes and the noise as options of `lab tables`.
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

    /// All tables, in order.
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

    /// Path of a table, relative to the folder of the export.
    pub(crate) fn path(&self, part: Part) -> PathBuf {
        let Part { noise, trial, scene } = part;
        [noise.name(), &format!("trial-{trial}"), &self.scenes[scene].file].iter().collect()
    }

    /// How the detections of a table are generated.
    pub(crate) const fn protocol(&self, part: Part) -> Protocol {
        let Part { noise, trial, .. } = part;
        let Self { shape, conditions, seed, .. } = *self;
        Protocol { noise, shape, conditions, realisation: Realisation { seed, trial } }
    }

    /// Whether names and lengths of `scenes` are those of the manifest.
    pub(crate) fn is_of(&self, scenes: &[Scene]) -> bool {
        let is_same = |(file, scene): (&SceneFile, &Scene)| {
            file.name == scene.name && file.keyframes == scene.keyframes.len()
        };
        self.scenes.len() == scenes.len() && self.scenes.iter().zip(scenes).all(is_same)
    }
}

/// Makes paths absolute, so that an export can be scored from any folder.
fn absolute(dataset: &Source) -> anyhow::Result<Source> {
    let absolute = |path| std::path::absolute(path).context("the path of the data set");
    Ok(match dataset {
        Source::Synthetic => Source::Synthetic,
        Source::Csv(path) => Source::Csv(absolute(path)?),
        Source::NuScenes(path) => Source::NuScenes(absolute(path)?),
    })
}

/// A fingerprint of tables, in order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fingerprint(u64);

impl Default for Fingerprint {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fingerprint {
    /// Adds a table.
    pub(crate) fn add(&mut self, table: &str) {
        self.0 = (self.0 ^ stable_hash(table)).wrapping_mul(0x0100_0000_01b3);
    }

    /// The fingerprint as the manifest holds it.
    pub(crate) fn text(self) -> String {
        format!("{:016x}", self.0)
    }
}
