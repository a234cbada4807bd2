//! `lab fuse`: runs the engine of the hub on a log of detections.

pub(crate) mod args;

pub use args::FuseArgs;

use crate::commands::cpu_time::thread_cpu_time;
use crate::data::detection_log::{Arrival, DetectionLog, Survey};
use crate::data::truth_table::Truth;
use crate::drive::driver::Consumer;
use crate::drive::replay::{Counts, Replay};
use crate::drive::ticks::Ticks;
use crate::report::fused_table::{FusedTable, NewFile};
use crate::report::offline::{Report, SensorFigures};
use crate::report::output::print;
use crate::report::progress::Progress;
use crate::score::offline::{Region, TruthScorer};
use anyhow::{Context, ensure};
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::Write;
use std::path::Path;
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::FusedFrame;
use v2x_common::time::Timestamp;
use v2x_fusion_hub::diagnosis::{Code, Finding, Observation, Surroundings, Survey as Diagnosis, Tokens};
use v2x_fusion_hub::engine::{Engine, EngineConfig};

/// Fuses the log, writes the fused objects and prints the report.
pub fn fuse(args: &FuseArgs) -> anyhow::Result<()> {
    let report = run(args)?;
    print(&if args.json { serde_json::to_string(&report)? + "\n" } else { report.text() })?;
    Ok(())
}

/// The output file.
struct Sink<'a, W: Write> {
    table: FusedTable<W>,
    scorer: Option<TruthScorer>,
    diagnosis: &'a RefCell<Diagnosis>,
}

fn run(args: &FuseArgs) -> anyhow::Result<Report> {
    let settings = args.rules.settings()?;
    // Track ids start at 0.
    let config = EngineConfig { lineage: 0, ..settings.engine };
    let declared = args.sensor.declared(&config.sensing)?;
    let scorer = args.truth.as_deref().map(|path| read_truth(path, args.truth_region)).transpose()?;
    let file = open(&args.detections)?;
    let size = file.metadata().map_or(0, |metadata| metadata.len());
    let listened = settings.clone();
    let mut log = DetectionLog::by(file, &args.detections, settings)?;
    let positions =
        [("--range", args.sensor.range.is_some()), ("--accuracy", !args.sensor.accuracy.is_empty())];
    for (option, _) in positions.iter().filter(|(_, is_given)| *is_given && !log.has_poses()) {
        tracing::warn!("without the columns sensor_x and sensor_y {option} has no effect");
    }
    ensure!(!is_same(&args.detections, &args.out), "--out would overwrite the detections");
    ensure!(
        !args.truth.as_ref().is_some_and(|truth| is_same(truth, &args.out)),
        "--out would overwrite the truth"
    );
    let table = FusedTable::new(NewFile::create(&args.out)?).context("writing the fused objects")?;
    let diagnosis = RefCell::default();
    let (mut sink, mut progress) = (Sink { table, scorer, diagnosis: &diagnosis }, Progress::begin("KiB"));
    let mut survey = Survey::default();
    let replay = Replay { engine: Engine::new(config), declared, stopwatch: thread_cpu_time };
    let kib = |bytes: u64| usize::try_from(bytes / 1024).unwrap_or(usize::MAX);
    let outcome = replay.run(&mut log, &mut sink, |arrival, n_bytes| {
        survey.add(arrival);
        let Arrival { received_at, frame, reported } = arrival;
        if listened.listens_to(&frame.id.agent) {
            diagnosis.borrow_mut().note_frame(&Observation { frame, reported, received_at: *received_at });
        }
        progress.update(kib(n_bytes), kib(size));
    });
    progress.end();
    let (counts, engine) = outcome?;
    let fused_rows = sink.table.rows();
    sink.table.into_inner().finish()?;
    ensure!(counts.frames > 0, "{} holds no detections", args.detections.display());
    let truth = sink.scorer.as_ref().map(TruthScorer::score);
    let mut diagnosis = diagnosis.into_inner();
    diagnosis.conclude(&Surroundings { engine: &engine, tokens: &Tokens::default() });
    let found = unknown_classes(&log).into_iter().chain(warnings(diagnosis.findings()));
    let warnings = without_effect(&log).into_iter().chain(found).collect();
    let report = Report { fused_rows, truth, warnings, ..report(counts, &log, &survey) };
    Ok(Report { method: args.rules.method_key()?, ..report })
}

fn report<R: std::io::Read>(counts: Counts, log: &DetectionLog<R>, survey: &Survey) -> Report {
    let core_s = counts.core.as_secs_f64();
    #[expect(clippy::cast_precision_loss, reason = "counts below 2^53")]
    let detections_per_s = (core_s > 0.0).then(|| counts.detections as f64 / core_s);
    let remarks = log.remarks();
    let by_sensor: Vec<_> = survey
        .sensors()
        .iter()
        .map(|(sensor, survey)| {
            SensorFigures::of(*sensor, survey, counts.sensors.get(sensor).cloned().unwrap_or_default())
        })
        .collect();
    Report {
        method: String::new(),
        sensors: log.n_sensors(),
        frames: counts.frames,
        detections: counts.detections,
        duration_s: counts.duration.as_secs_f64(),
        ticks: counts.ticks,
        fused_rows: 0,
        refused_frames: counts.refused.values().sum(),
        refused: counts.refused,
        dropped_detections: remarks.dropped().cloned().collect(),
        unknown_classes: remarks.unmapped.total(),
        unknown_class_names: remarks.unmapped.names().map(|(name, n)| (name.to_owned(), n)).collect(),
        by_sensor,
        warnings: Vec::new(),
        core_s,
        detections_per_s,
        truth: None,
    }
}

/// Tables of agents that are not in the log: mostly a name that is written differently.
fn without_effect<R: std::io::Read>(log: &DetectionLog<R>) -> Vec<String> {
    let sensors: BTreeSet<_> = log.sensors().collect();
    let names: Vec<_> = sensors.iter().map(|sensor| sensor.as_str()).collect();
    let others = log.settings().agents.keys().filter(|agent| !sensors.contains(agent));
    let words = others.map(|agent| {
        format!("[hub.agents.{agent}] has no effect: the sensors of the log are {}", names.join(", "))
    });
    words.collect()
}

/// Which line says what an unknown class is, for each sensor with the most frequent name of it.
fn unknown_classes<R: std::io::Read>(log: &DetectionLog<R>) -> Vec<String> {
    let of_sensors = log.remarks().unmapped_of();
    let words = of_sensors.filter_map(|(sensor, names)| {
        let (name, _) = names.names().max_by_key(|(_, count)| *count)?;
        Some(format!(
            "{sensor}: {} detections of unknown classes are fused as `unknown`. Write `classes = {{ {name:?} = \"car\" }}` under \
             `[hub.agents.{sensor}]` in the file of --hub-config, with the class that it is",
            names.total()
        ))
    });
    words.collect()
}

/// What looks wrong, but for what the report lists with numbers of its own.
fn warnings(findings: &[Finding]) -> Vec<String> {
    let is_listed = |code: Code| {
        matches!(
            code,
            Code::FramesRefused | Code::TimeUnit | Code::ImpossibleDetections | Code::UnknownClasses
        )
    };
    let findings = findings.iter().filter(|one| !is_listed(one.code));
    findings.map(ToString::to_string).collect()
}

impl<W: Write> Consumer for Sink<'_, W> {
    type Error = anyhow::Error;

    fn note_arrival(&mut self, frame: &DetectionFrame) {
        if let (Some(scorer), Some(pose)) = (&mut self.scorer, frame.sensor_pose) {
            scorer.note_sensor(frame.id.agent, pose);
        }
    }

    fn receive(&mut self, _: Timestamp, frame: &FusedFrame) -> anyhow::Result<()> {
        self.diagnosis.borrow_mut().note_list(frame);
        // With a lag, fused objects are estimates for an earlier time than their publication.
        self.table.write(frame.fused_at, &frame.objects).context("writing the fused objects")?;
        if let Some(scorer) = &mut self.scorer {
            scorer.add(frame.fused_at, &frame.objects);
        }
        Ok(())
    }

    fn receive_nothing(&mut self, ticks: Ticks) {
        if let Some(scorer) = &mut self.scorer {
            let (begin, end) = scorer.span();
            ticks.clamped_to(begin, end).for_each(|at| scorer.add(at, &[]));
        }
    }
}

fn open(path: &Path) -> anyhow::Result<File> {
    File::open(path).with_context(|| format!("cannot read {}", path.display()))
}

fn read_truth(path: &Path, region: Option<Region>) -> anyhow::Result<TruthScorer> {
    Ok(TruthScorer::new(Truth::read(open(path)?, path)?, region))
}

fn is_same(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

#[cfg(test)]
mod tests;
