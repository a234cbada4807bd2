//! The scenes and the noise of an evaluation: options that `tables` and `export` share.

use crate::data::dataset::nuscenes::Split;
use crate::data::dataset::source::Source;
use crate::data::noise::{NoisePair, Shape};
use crate::data::scene::{QUICK_SCENES, Scene, Statistics, spread};
use anyhow::ensure;

/// Number of trials with `--quick`.
const QUICK_TRIALS: u32 = 2;
/// Number of trials in the paper (N).
const PAPER_TRIALS: u32 = 5;

/// The scenes and the noise of an evaluation.
#[derive(Clone, Debug, clap::Args)]
pub struct DrawArgs {
    /// The scenes: synthetic (150 made-up ones), nuscenes:ROOT (its own tables), or csv:FILE (a row for each box, with the columns scene, frame, t_s, object_id, class, x, y,
    /// width, length, yaw, ego_x, ego_y, ego_yaw)
    #[arg(long, value_name = "SOURCE", default_value = "synthetic")]
    pub dataset: Source,
    /// Of nuscenes: which tables, ROOT/VERSION/scene.json and so on
    #[arg(long, default_value = "v1.0-trainval")]
    pub version: String,
    /// Of nuscenes: val (the official list), all, or names of scenes with commas between
    #[arg(long, default_value = "val", value_name = "val|all|SCENE…")]
    pub split: Split,
    /// Only these levels of noise of agents 1 and 2
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = NoisePair::ALL, hide_default_value = true)]
    pub noise: Vec<NoisePair>,
    /// Realisations of the noise [default: 5, as in the paper]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub trials: Option<u32>,
    /// Only some of the scenes, and two trials
    #[arg(long)]
    pub quick: bool,
    /// Seed of the noise
    #[arg(long, default_value_t = 1, value_parser = v2x_common::seed::parse_seed)]
    pub seed: u64,
    /// Distribution of all errors; the standard deviations stay the same
    #[arg(long, value_enum, default_value_t = Shape::Gaussian)]
    pub shape: Shape,
}

impl DrawArgs {
    /// Reads the scenes from the data set.
    pub fn scenes(&self) -> anyhow::Result<Vec<Scene>> {
        tracing::debug!(dataset = %self.dataset, "reading");
        let mut scenes = self.dataset.load(&self.version, &self.split)?;
        if self.quick {
            scenes = spread(scenes, QUICK_SCENES);
        }
        ensure!(Statistics::of(&scenes).boxes > 0, "there are no boxes in the scenes of {}", self.dataset);
        Ok(scenes)
    }

    /// Number of realisations of the noise.
    pub fn n_trials(&self) -> u32 {
        self.trials.unwrap_or(if self.quick { QUICK_TRIALS } else { PAPER_TRIALS })
    }
}
