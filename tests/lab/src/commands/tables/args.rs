//! Options of `lab tables`.

use crate::commands::draws::DrawArgs;
use crate::data::conditions::Conditions;
use crate::drive::keyframes::contender::Contender;
use crate::drive::keyframes::method::Method;
use crate::report::tables::kind::Table;
use crate::report::tables::study::Study;
use crate::score::keyframes::experiments::Plan;
use crate::score::keyframes::moment::Moment;
use std::path::{Path, PathBuf};

/// The tables of the paper, and the checks of consistency and robustness.
const DEFAULT_TABLES: [Table; 7] =
    [Table::II, Table::III, Table::IV, Table::Fig3, Table::Fig4, Table::Robustness, Table::Nees];

/// Print the tables of the paper: every method at every noise level, with the published value beside ours
///
/// True boxes are perturbed as in section II of the paper. Every method receives the same detections. Errors are
/// counted by identity and include false positives. The same seed gives the same tables on every machine.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Counting: the paper's tables hold the errors of all boxes over the number of
true positives (table); its formula divides by the number of all boxes
(printed). --json and the files hold both.

Examples:
  lab tables --quick               a few seconds
  lab tables --out v2x-tables      and a report with plots, Markdown, CSV, LaTeX
                                   and JSON
  lab tables --table II,fig4       only these
  lab tables --table fig5          the picture of one moment, under NMS and
                                   under ours
  lab tables --table fig5 --methods dair-v2x,csba-wls,ours --moment typical
  lab tables --ablation --sensors  ours without its parts; misses, clutter,
                                   partly overlapping views
  lab tables --table II --detectors lidar
                                   with detectors that err as those on lidars do
  lab tables --dataset csv:boxes.csv --trials 3
                                   your own scenes
  lab tables --dataset nuscenes:/data/nuscenes \\
      --version v1.0-trainval --split val
  lab tables --noise N3-N3 --methods csba-wls,ours --json")]
pub struct TablesArgs {
    #[command(flatten)]
    draws: DrawArgs,
    #[command(flatten)]
    rows: RowArgs,
    /// Print all rows as one line of JSON
    #[arg(long)]
    json: bool,
}

/// The tables, the methods and the output.
#[derive(Clone, Debug, Default, PartialEq, clap::Args)]
pub struct RowArgs {
    /// Only these tables and figures [default: the paper's, nees, and robustness at the lowest and highest noise]
    #[arg(long, value_enum, value_delimiter = ',')]
    pub table: Vec<Table>,
    /// Which keyframe fig5 shows: telling (where the first and the last method differ most), typical (the median), or
    /// SCENE:KEYFRAME
    #[arg(long, value_name = "WHICH", default_value_t)]
    pub moment: Moment,
    /// Also ours without each one of its parts
    #[arg(long)]
    pub ablation: bool,
    /// Also all methods with a detection probability of 0.9, 0.5 false detections per frame and partly overlapping views
    #[arg(long)]
    pub sensors: bool,
    /// How the agents' detectors err: as in the paper, or as those on lidars or cameras do, with the views of --sensors and
    /// the metrics of tracking and detection (HOTA, MOTA, AP, NDS and so on)
    #[arg(long, value_enum, default_value_t)]
    pub detectors: Detectors,
    /// Only these methods
    #[arg(long, value_enum, value_delimiter = ',')]
    pub methods: Vec<Method>,
    /// Number of threads; the results do not depend on it [default: all cores]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=256))]
    pub threads: Option<u16>,
    /// Folder for report.html with its plots (SVG, PDF), tables.md, tables.csv, tables.tex and tables.json [default: none;
    /// v2x-tables with fig5, which is a picture]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// How the agents' detectors err.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Detectors {
    /// Independent Gaussian errors, every object once, right classes and headings
    #[default]
    Paper,
    /// As learnt detectors on lidars do
    Lidar,
    /// As learnt detectors on cameras do
    Camera,
}

impl Detectors {
    /// Those of detections that were made under these conditions.
    pub(crate) const fn of(conditions: Conditions) -> Self {
        match conditions {
            Conditions::Paper | Conditions::Sensors => Self::Paper,
            Conditions::Lidar => Self::Lidar,
            Conditions::Camera => Self::Camera,
        }
    }

    /// The conditions of the tables.
    const fn conditions(self) -> Conditions {
        match self {
            Self::Paper => Conditions::Paper,
            Self::Lidar => Conditions::Lidar,
            Self::Camera => Conditions::Camera,
        }
    }
}

impl TablesArgs {
    /// The tables of `draws` as options.
    pub const fn new(draws: DrawArgs, rows: RowArgs, json: bool) -> Self {
        Self { draws, rows, json }
    }

    /// The scenes and the noise.
    pub(super) const fn draws(&self) -> &DrawArgs {
        &self.draws
    }

    /// The tables that the options ask for.
    pub(super) fn study(&self, further: Vec<Contender>) -> Study {
        let rows = &self.rows;
        let mut tables = if rows.table.is_empty() { DEFAULT_TABLES.to_vec() } else { rows.table.clone() };
        tables.extend(rows.ablation.then_some(Table::Ablation));
        tables.extend(rows.sensors.then_some(Table::Sensors));
        let (noise, methods) = (self.draws.noise.clone(), rows.methods.clone());
        let is_brief = rows.table.is_empty();
        let conditions = rows.detectors.conditions();
        let (shape, moment) = (self.draws.shape, rows.moment.clone());
        Study { tables, noise, methods, shape, conditions, further, moment, is_brief }
    }

    /// The plan of experiments for these tables.
    pub(super) fn plan(&self, study: &Study) -> Plan {
        Plan {
            experiments: study.experiments(),
            trials: self.draws.n_trials(),
            seed: self.draws.seed,
            threads: self.rows.threads.map_or_else(cores, usize::from),
        }
    }

    /// Name of the data set.
    pub(super) fn dataset(&self) -> String {
        self.draws.dataset.to_string()
    }

    /// Folder of the output files.
    pub(super) fn out(&self) -> Option<&Path> {
        let is_picture = self.rows.table.contains(&Table::Fig5);
        self.rows.out.as_deref().or_else(|| is_picture.then(|| Path::new("v2x-tables")))
    }

    /// Whether the rows are printed as JSON.
    pub(super) const fn is_json(&self) -> bool {
        self.json
    }
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}
