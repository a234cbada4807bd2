//! `lab throughput`: how many detections per second one core decodes, associates, fuses and publishes.

mod filters;
mod pipeline;
pub(crate) mod textbook;

pub use pipeline::Heap;

use crate::data::workload::Load;
use crate::report::output::print;
use anyhow::Context;
use serde::Serialize;
use v2x_common::duration::parse_seconds;
use v2x_fusion_hub::filter::{Filter, ImmState, State};
use v2x_fusion_hub::fusion::MotionModel;

/// Measure the whole pipeline without I/O on one thread: bytes of detection frames in, bytes of fused frames out
///
/// Agents send at 10 Hz with spread phases. The hub publishes at 20 Hz of simulated time. Cars drive on the rings of a wide
/// roundabout, one for each 100 m², and an agent detects each object that it sees with probability 0.95. The result counts CPU time of the
/// thread, without the time to generate the frames.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  lab throughput                          10 agents, 100 objects, none late
  lab throughput --agents 200 --late 0.2  a fifth of the frames 60 to 250 ms
                                          late
  lab throughput --objects 2000 --duration 5s --json
  lab throughput --agents 200 --objects 5000 --view 50 --motion imm
                                          how the cost grows with the number of
                                          tracks")]
pub struct ThroughputArgs {
    /// Number of agents
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1000))]
    agents: u32,
    /// Number of objects
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=20_000))]
    objects: u32,
    /// How many objects each agent sees: those nearest to it, where agents are spread over the area [default: every agent sees
    /// all; more than 3000 in several frames, of a sector each]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4000))]
    view: Option<u32>,
    /// Fraction of frames that arrive 60 to 250 ms late, 0 to 1
    #[arg(long, default_value_t = 0.0, value_name = "SHARE", value_parser = share)]
    late: f64,
    /// Motion model
    #[arg(long, value_enum, default_value_t = Motion::Cv)]
    motion: Motion,
    /// Simulated time, whole seconds such as 30s or 2min; a plain number is seconds [default: enough for about two million detections]
    #[arg(long = "duration", alias = "seconds", value_name = "DURATION", value_parser = simulated)]
    seconds: Option<u32>,
    /// Seed of the objects and of their reports
    #[arg(long, default_value_t = 1, value_parser = v2x_common::seed::parse_seed)]
    seed: u64,
    /// Print the result as one line of JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
enum Motion {
    /// Constant velocity: the paper's UniKF
    Cv,
    /// Four interacting models: parked, stopped, smooth, manoeuvring
    Imm,
}

fn share(text: &str) -> Result<f64, String> {
    let share: f64 = text.parse().map_err(|error| format!("{error}"))?;
    if (0.0..=1.0).contains(&share) { Ok(share) } else { Err("expected 0 to 1".to_owned()) }
}

/// A time in whole seconds, by which the pipeline goes.
fn simulated(text: &str) -> Result<u32, String> {
    let seconds = parse_seconds(text).map_err(|error| error.to_string())?;
    let is_within = (1.0..=100_000.0).contains(&seconds) && seconds.fract() == 0.0;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a whole number within the limits"
    )]
    is_within
        .then_some(seconds as u32)
        .ok_or_else(|| format!("{text} is no whole number of seconds from 1 to 100000"))
}

/// The output of `--json`. Times are CPU times per detection or per call.
#[derive(Clone, Debug, Serialize)]
struct Report {
    agents: u32,
    objects: u32,
    view: Option<u32>,
    late_share: f64,
    motion: Motion,
    seconds: i64,
    seed: u64,
    detections: u64,
    cpu_ns_per_detection: f64,
    detections_per_s_per_core: f64,
    allocations_per_detection: f64,
    /// Memory of the engine, with frames and lists, for each published object, bytes.
    bytes_per_object: f64,
    /// Mean number of objects in a fused frame. It shows that no object is left out.
    objects_published: f64,
    /// One predict and update of the dense 7-state filter in Joseph form, ns.
    textbook_filter_ns: f64,
    /// One predict and update by blocks with nalgebra, ns.
    structured_filter_ns: f64,
    /// One predict and update of our filter, ns.
    filter_ns: f64,
    /// Insertion of a late report before 25 newer ones of its track, which are applied again, ns.
    late_replay_ns: f64,
    publish_hz: f64,
    /// Decoding and ingestion of a detection frame, µs.
    frame_us_p50: f64,
    frame_us_p99: f64,
    /// Replay, creation and encoding of a fused frame, µs.
    publish_us_p50: f64,
    publish_us_p99: f64,
}

/// Measures and prints the result. `heap` returns what is used of the heap.
pub fn throughput(args: &ThroughputArgs, heap: fn() -> Heap) -> anyhow::Result<()> {
    let ThroughputArgs { agents, objects, view, late, seed, .. } = *args;
    let load = Load { agents, rate_hz: 10, objects, view, late_share: late, seed };
    let per_second = i64::from(agents) * i64::from(view.map_or(objects, |view| view.min(objects))) * 10;
    let seconds = args.seconds.map_or((2_000_000 / per_second).clamp(2, 1000), i64::from);
    let report = match args.motion {
        Motion::Cv => measure::<State>(load, (args.motion, MotionModel::Cv), seconds, heap)?,
        Motion::Imm => measure::<ImmState>(load, (args.motion, MotionModel::Imm), seconds, heap)?,
    };
    let text = if args.json { serde_json::to_string(&report)? + "\n" } else { text(&report) };
    print(&text).context("writing the result")
}

fn measure<F: Filter>(
    load: Load,
    (motion, model): (Motion, MotionModel),
    seconds: i64,
    heap: fn() -> Heap,
) -> anyhow::Result<Report> {
    let costs = filters::filter_costs::<F>();
    let late_replay_ns = filters::late_replay_ns::<F>()?;
    let measured = pipeline::run(load, model, seconds, heap)?;
    #[expect(clippy::cast_precision_loss, reason = "counts below 2^53")]
    let (detections, allocations) = (measured.detections as f64, measured.allocations as f64);
    let cpu_ns_per_detection = measured.cpu.as_secs_f64() * 1e9 / detections;
    Ok(Report {
        agents: load.agents,
        objects: load.objects,
        view: load.view,
        late_share: load.late_share,
        motion,
        seconds,
        seed: load.seed,
        detections: measured.detections,
        cpu_ns_per_detection,
        detections_per_s_per_core: 1e9 / cpu_ns_per_detection,
        allocations_per_detection: allocations / detections,
        bytes_per_object: measured.bytes_held as f64 / measured.objects_published.max(1.0),
        objects_published: measured.objects_published,
        textbook_filter_ns: costs.textbook_ns,
        structured_filter_ns: costs.structured_ns,
        filter_ns: costs.ours_ns,
        late_replay_ns,
        publish_hz: 20.0,
        frame_us_p50: measured.frame_us.p50,
        frame_us_p99: measured.frame_us.p99,
        publish_us_p50: measured.publish_us.p50,
        publish_us_p99: measured.publish_us.p99,
    })
}

fn text(report: &Report) -> String {
    let Report { agents, objects, late_share, seconds, detections, .. } = report;
    let lines = [
        format!(
            "{agents} agents at 10 Hz, {objects} objects, {late_share} late, {seconds} s: {detections} detections"
        ),
        format!("  detections/s/core    {:>12.0}", report.detections_per_s_per_core),
        format!(
            "  CPU per detection    {:>9.1} ns   allocations {:.6}",
            report.cpu_ns_per_detection, report.allocations_per_detection
        ),
        format!("  memory               {:>9.1} kB for each object", report.bytes_per_object / 1e3),
        format!("  frame taken in       {:>9.1} µs   p99 {:.1}", report.frame_us_p50, report.frame_us_p99),
        format!(
            "  fused frame made     {:>9.1} µs   p99 {:.1}, {:.1} objects, at {} Hz",
            report.publish_us_p50, report.publish_us_p99, report.objects_published, report.publish_hz
        ),
        format!("  predict and update   {:>9.1} ns   {}", report.filter_ns, comparison(report)),
        format!("  late, 25 newer       {:>9.1} ns", report.late_replay_ns),
    ];
    lines.map(|line| line + "\n").concat()
}

/// A note on the comparison: the textbook filters have one constant-velocity model, and IMM has four models.
fn comparison(report: &Report) -> String {
    let (dense, blocks, ours) = (report.textbook_filter_ns, report.structured_filter_ns, report.filter_ns);
    match report.motion {
        Motion::Cv => format!(
            "dense textbook {dense:.1} ({:.0}×), nalgebra by blocks {blocks:.1} ({:.1}×)",
            dense / ours,
            blocks / ours
        ),
        Motion::Imm => {
            format!("one constant-velocity filter: dense textbook {dense:.1}, nalgebra by blocks {blocks:.1}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_simulated_time_is_written_with_a_unit_or_as_seconds_and_is_whole() {
        assert_eq!(simulated("30"), Ok(30));
        assert_eq!(simulated("2min"), Ok(120));
        for wrong in ["500ms", "0", "1.5s", "2d", "soon"] {
            assert!(simulated(wrong).is_err(), "{wrong}");
        }
    }
}
