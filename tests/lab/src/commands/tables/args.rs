//! The command line of `lab tables`.

use crate::commands::draws::DrawArgs;
use crate::drive::keyframes::contender::Contender;
use crate::drive::keyframes::method::Method;
use crate::report::tables::kind::Table;
use crate::report::tables::study::Study;
use crate::score::keyframes::experiments::Plan;
use std::path::{Path, PathBuf};

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
    #[command(flatten)]
    draws: DrawArgs,
    #[command(flatten)]
    rows: RowArgs,
    /// Print all rows as one line of JSON
    #[arg(long)]
    json: bool,
}

/// Which tables, of whom, and where they go.
#[derive(Clone, Debug, Default, PartialEq, clap::Args)]
pub struct RowArgs {
    /// Only these tables and figures [default: the paper's, nees, and robustness at the lowest and highest noise]
    #[arg(long, value_enum, value_delimiter = ',')]
    pub table: Vec<Table>,
    /// Also ours without each of its parts
    #[arg(long)]
    pub ablation: bool,
    /// Also all methods with a detection probability of 0.9, 0.5 false reports a frame and partly overlapping views
    #[arg(long)]
    pub sensors: bool,
    /// Only these methods
    #[arg(long, value_enum, value_delimiter = ',')]
    pub methods: Vec<Method>,
    /// Threads; of no influence on the numbers [default: all cores]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=256))]
    pub threads: Option<u16>,
    /// Folder for report.html with its plots (SVG, PDF), tables.md, tables.csv, tables.tex and tables.json
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

impl TablesArgs {
    /// These rows of these draws.
    pub const fn new(draws: DrawArgs, rows: RowArgs, json: bool) -> Self {
        Self { draws, rows, json }
    }

    /// Which scenes, and which errors fall on them.
    pub(super) const fn draws(&self) -> &DrawArgs {
        &self.draws
    }

    /// What is asked for.
    pub(super) fn study(&self, further: Vec<Contender>) -> Study {
        let rows = &self.rows;
        let mut tables = if rows.table.is_empty() { DEFAULT_TABLES.to_vec() } else { rows.table.clone() };
        tables.extend(rows.ablation.then_some(Table::Ablation));
        tables.extend(rows.sensors.then_some(Table::Sensors));
        let (noise, methods) = (self.draws.noise.clone(), rows.methods.clone());
        let is_brief = rows.table.is_empty();
        Study { tables, noise, methods, shape: self.draws.shape, further, is_brief }
    }

    /// What is to be computed for it.
    pub(super) fn plan(&self, study: &Study) -> Plan {
        Plan {
            experiments: study.experiments(),
            trials: self.draws.n_trials(),
            seed: self.draws.seed,
            threads: self.rows.threads.map_or_else(cores, usize::from),
        }
    }

    /// The name of the data set.
    pub(super) fn dataset(&self) -> String {
        self.draws.dataset.to_string()
    }

    /// The folder for files.
    pub(super) fn out(&self) -> Option<&Path> {
        self.rows.out.as_deref()
    }

    /// Whether rows are printed as JSON.
    pub(super) const fn is_json(&self) -> bool {
        self.json
    }
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}
