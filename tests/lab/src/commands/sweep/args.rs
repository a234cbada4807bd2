//! Options of `lab sweep`.

use crate::drive::sweep::axis::Axis;
use crate::drive::sweep::method::SweepMethod;
use crate::drive::sweep::plan::{Length, PUBLISH_HZ, Plan};
use crate::drive::sweep::{axis, scenarios};
use anyhow::{Context, ensure};
use std::path::{Path, PathBuf};
use v2x_agent::scenario::with_paths;
use v2x_common::duration::{parse_millis, parse_seconds};
use v2x_common::shipped;
use v2x_common::time::Span;

/// Shortest scored time, s.
const SHORTEST_S: f64 = 2.0;
/// Number of default values of an axis in a live sweep, which runs in real time.
const LIVE_VALUES: usize = 5;

/// Error and timing against latency, loss, clock offset, or any other parameter of a scenario
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = after_help())]
pub struct SweepArgs {
    /// The parameter to vary: a name below or the path of a parameter, with your own values: latency=0,100,300,
    /// world.traffic=0.2:0.8:0.2, agents.car.link=ideal,lte-uu. Two parameters make a grid
    #[arg(required = true, num_args = 1..=2, value_name = "AXIS[=VALUES]")]
    axes: Vec<Axis>,
    /// The scenario file, or a shipped scenario's name [default: a roadside unit and a late car at a crossing; for agents: ten agents]
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    /// Methods to compare [default: all; ours-uncorrected only with clock or pose errors]
    #[arg(long, value_delimiter = ',', value_name = "METHOD")]
    methods: Vec<SweepMethod>,
    /// Δmax, such as 300,500ms,1s; a plain number is ms; each value is one curve [default: the scenario's]
    #[arg(long, value_delimiter = ',', value_name = "DURATION", value_parser = parse_millis)]
    delta_max: Vec<f64>,
    /// Number of seeds [default: 5; live 2]
    #[arg(long)]
    seeds: Option<u64>,
    /// How long the agents capture [default: 60s; live 15s]
    #[arg(long = "duration", alias = "duration-s", value_name = "DURATION", value_parser = parse_seconds)]
    duration_s: Option<f64>,
    /// Start of the scored time
    #[arg(long = "settle", alias = "settle-s", default_value = "2s", value_name = "DURATION", value_parser = parse_seconds)]
    settle_s: f64,
    /// Run every point as processes over Zenoh, with one hub for each method, all on the same frames
    #[arg(long)]
    pub live: bool,
    /// Folder of the results; a sweep that was stopped continues from it [default: v2x-sweeps/AXIS]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Number of threads [default: number of cores]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
    /// Print the rows as one line of JSON
    #[arg(long)]
    pub json: bool,
}

fn after_help() -> String {
    format!(
        "Axes (\"other\" agents are all but the scenario's first), with their default\nvalues:\n{}\n\
         Examples:\n  \
         lab sweep latency            error against delay, every method, five seeds\n  \
         lab sweep latency --delta-max 300,500,1000\n                               \
         a curve for each Δmax\n  \
         lab sweep latency=0,200,400 loss=0,0.2,0.5\n                               \
         a grid\n  \
         lab sweep agents.car.link=ideal,pc5,lte-uu\n                               \
         links by name (v2x links lists them)\n  \
         lab sweep clock --scenario my.toml\n                               \
         your own scenario\n  \
         lab sweep latency --live     the same as processes over Zenoh, beside the\n                               \
         virtual curves\n  \
         lab sweep latency --json > rows.json\n\n\
         Hubs publish at {PUBLISH_HZ} Hz, at every phase between two captures, and wait for\n\
         that: it is in arrive → fused. What methods differ in (motion, late_data,\n\
         registration, …) is not taken from the scenario. Objects count that both of the\n\
         first two agents have in view. Errors are matched by identity, at any distance;\n\
         columns by_place match within 4 m.",
        axis::descriptions()
    )
}

fn no_scenario(path: &Path) -> String {
    format!("reading the scenario {} (a file, such as deploy/scenarios/highway.toml)", path.display())
}

/// A scenario's text with the whole paths of the files of its world: points of a sweep are written elsewhere.
fn with_files_of(scenario: &Path, text: &str) -> String {
    let folder = scenario.parent().unwrap_or(Path::new(""));
    with_paths(text, |_, file| std::path::absolute(folder.join(file)).ok())
}

impl SweepArgs {
    /// The plan of the sweep.
    pub fn plan(&self) -> anyhow::Result<Plan> {
        let text = match &self.scenario {
            Some(path) => with_files_of(path, &shipped::read(path).with_context(|| no_scenario(path))?),
            None if self.axes.iter().any(Axis::is_number_of_agents) => scenarios::TEN_AGENTS.to_owned(),
            None => scenarios::DEFAULT_SCENARIO.to_owned(),
        };
        let base = text.parse().with_context(|| match &self.scenario {
            Some(path) => format!("in {}", path.display()),
            None => "in the default scenario".to_owned(),
        })?;
        let duration_s = self.duration_s.unwrap_or(if self.live { 15.0 } else { 60.0 });
        ensure!(
            (0.0..=86_400.0).contains(&self.settle_s),
            "--settle is {} s, expected 0 to 86400",
            self.settle_s
        );
        let shortest_s = self.settle_s + SHORTEST_S;
        ensure!(
            (shortest_s..=86_400.0).contains(&duration_s),
            "--duration is {duration_s} s: with --settle {}s it must be {shortest_s} to 86400 s",
            self.settle_s
        );
        let n_seeds = self.seeds.unwrap_or(if self.live { 2 } else { 5 });
        ensure!((1..=10_000).contains(&n_seeds), "--seeds is {n_seeds}, expected 1 to 10000");
        if let [one, other] = &self.axes[..] {
            ensure!(!one.overlaps(other), "{} and {} vary the same parameter", one.name, other.name);
        }
        let sweeps_delta_max = self.axes.iter().any(Axis::is_delta_max);
        ensure!(
            !sweeps_delta_max || self.delta_max.is_empty(),
            "--delta-max is what the axis varies already: leave it out"
        );
        let mut delta_max_ms: Vec<Option<f64>> = self.delta_max.iter().copied().map(Some).collect();
        if delta_max_ms.is_empty() {
            delta_max_ms.push(None);
        }
        let mut axes = self.axes.clone();
        if self.live {
            axes.iter_mut().for_each(|axis| axis.thin_out(LIVE_VALUES));
        }
        let mut methods: Vec<SweepMethod> = Vec::new();
        for method in &self.methods {
            if !methods.contains(method) {
                methods.push(*method);
            }
        }
        if methods.is_empty() {
            methods = SweepMethod::ALL.to_vec();
            // Without errors to correct it gives the results of `ours`.
            if !axes.iter().any(Axis::is_registration_error) {
                methods.retain(|method| *method != SweepMethod::OursUncorrected);
            }
        }
        Ok(Plan {
            base,
            axes,
            delta_max_ms,
            seeds: (1..=n_seeds).collect(),
            methods,
            length: Length {
                duration: Span::from_secs_f64(duration_s),
                settle: Span::from_secs_f64(self.settle_s),
            },
            live: self.live,
        })
    }

    /// Folder of the results.
    pub fn folder(&self) -> PathBuf {
        let name = || {
            let names: Vec<&str> = self.axes.iter().map(|axis| axis.name.as_str()).collect();
            PathBuf::from("v2x-sweeps").join(names.join("-by-").replace(['*', '/'], "all"))
        };
        self.out.clone().unwrap_or_else(name)
    }
}
