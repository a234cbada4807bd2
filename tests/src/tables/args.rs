//! The command line of `lab tables`.

use super::rows::Table;
use super::study::Study;
use crate::dataset::Source;
use crate::dataset::nuscenes::Split;
use crate::protocol::contender::Contender;
use crate::protocol::method::Method;
use crate::protocol::noise::{NoisePair, Shape};
use crate::protocol::run::Plan;
use crate::protocol::scene::{Scene, Statistics};
use anyhow::ensure;
use std::path::{Path, PathBuf};

/// What `--quick` takes of the data set, and how often.
const QUICK_SCENES: usize = 20;
const QUICK_TRIALS: u32 = 2;
/// N of the paper.
const PAPER_TRIALS: u32 = 5;
/// The paper's, and what tells whether they can be trusted.
const DEFAULT_TABLES: [Table; 7] =
    [Table::II, Table::III, Table::IV, Table::Fig3, Table::Fig4, Table::Robustness, Table::Nees];

/// Print the paper's tables: every method under every level of noise, the paper's value beside ours
///
/// True boxes are perturbed as the paper says (section II), every method sees the same errors, and errors are
/// counted by identity, false positives included. The same seed gives the same tables everywhere.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Counting: the paper's tables hold the errors of all boxes over the number of true positives (table); its formula
divides by the number of all boxes (printed). --json and the files hold both.

Examples:
  lab tables --quick                              a few seconds
  lab tables --out v2x-tables                     and a report with plots, Markdown, CSV, LaTeX and JSON
  lab tables --table II,fig4                      only these
  lab tables --ablation --sensors                 ours without its parts; misses, clutter, partly overlapping views
  lab tables --dataset csv:boxes.csv --trials 3   your own scenes
  lab tables --dataset nuscenes:/data/nuscenes --version v1.0-trainval --split val
  lab tables --noise N3-N3 --methods csba-wls,ours --json")]
pub struct TablesArgs {
    /// The scenes: synthetic (150 made-up ones), nuscenes:ROOT (its own tables), or csv:FILE (a row for each box, with the columns scene, frame, t_s, object_id, class, x, y,
    /// width, length, yaw, ego_x, ego_y, ego_yaw)
    #[arg(long, value_name = "SOURCE", default_value = "synthetic")]
    dataset: Source,
    /// Of nuscenes: which tables, ROOT/VERSION/scene.json and so on
    #[arg(long, default_value = "v1.0-trainval")]
    version: String,
    /// Of nuscenes: val (the official list), all, or names of scenes with commas between
    #[arg(long, default_value = "val", value_name = "val|all|SCENE…")]
    split: Split,
    /// Only these tables and figures [default: the paper's, robustness and nees]
    #[arg(long, value_enum, value_delimiter = ',')]
    table: Vec<Table>,
    /// Also ours without each of its parts
    #[arg(long)]
    ablation: bool,
    /// Also all methods with a detection probability of 0.9, 0.5 false reports a frame and partly overlapping views
    #[arg(long)]
    sensors: bool,
    /// Only these levels of noise of agents 1 and 2
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = NoisePair::ALL, hide_default_value = true)]
    noise: Vec<NoisePair>,
    /// Only these methods
    #[arg(long, value_enum, value_delimiter = ',', hide_possible_values = true)]
    methods: Vec<Method>,
    /// Realisations of the noise [default: 5, as in the paper]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    trials: Option<u32>,
    /// A part of the scenes, two trials
    #[arg(long)]
    quick: bool,
    /// Seed of all noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The shape of all errors; the same standard deviations
    #[arg(long, value_enum, default_value_t = Shape::Gaussian)]
    shape: Shape,
    /// Threads; of no influence on the numbers [default: all cores]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
    /// Folder for report.html with its plots (SVG, PDF), tables.md, tables.csv, tables.tex and tables.json
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print all rows as one line of JSON
    #[arg(long)]
    json: bool,
}

impl TablesArgs {
    /// Reads the scenes.
    pub(super) fn scenes(&self) -> anyhow::Result<Vec<Scene>> {
        tracing::debug!(dataset = %self.dataset, "reading");
        let mut scenes = self.dataset.load(&self.version, &self.split)?;
        if self.quick {
            scenes = spread(scenes, QUICK_SCENES);
        }
        ensure!(Statistics::of(&scenes).boxes > 0, "there are no boxes in the scenes of {}", self.dataset);
        Ok(scenes)
    }

    /// What is asked for.
    pub(super) fn study(&self, guests: Vec<Contender>) -> Study {
        let mut tables = if self.table.is_empty() { DEFAULT_TABLES.to_vec() } else { self.table.clone() };
        tables.extend(self.ablation.then_some(Table::Ablation));
        tables.extend(self.sensors.then_some(Table::Sensors));
        let (noise, methods) = (self.noise.clone(), self.methods.clone());
        Study { tables, noise, methods, shape: self.shape, guests }
    }

    /// What is to be computed for it.
    pub(super) fn plan(&self, study: &Study) -> Plan {
        Plan {
            experiments: study.experiments(),
            trials: self.trials.unwrap_or(if self.quick { QUICK_TRIALS } else { PAPER_TRIALS }),
            seed: self.seed,
            threads: self.threads.map_or_else(cores, usize::from),
        }
    }

    /// The name of the data set.
    pub(super) fn dataset(&self) -> String {
        self.dataset.to_string()
    }

    /// The folder for files.
    pub(super) fn out(&self) -> Option<&Path> {
        self.out.as_deref()
    }

    /// Whether rows are printed as JSON.
    pub(super) const fn is_json(&self) -> bool {
        self.json
    }
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// At most so many scenes, from all over the data set.
fn spread(scenes: Vec<Scene>, most: usize) -> Vec<Scene> {
    let step = scenes.len().div_ceil(most).max(1);
    scenes.into_iter().step_by(step).collect()
}
