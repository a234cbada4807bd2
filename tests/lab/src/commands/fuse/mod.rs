//! `lab fuse`: runs the engine of the hub on a log of detections.

pub(crate) mod args;
pub(crate) mod late_args;
mod lists;
mod page;
mod truth_check;
mod unpublished;
mod unusable;
mod words;

pub use args::FuseArgs;

use crate::commands::cpu_time::thread_cpu_time;
use crate::data::detection_log::{Arrival, DetectionLog, Survey};
use crate::data::truth_table::Truth;
use crate::drive::replay::{Counts, Replay};
use crate::report::offline::{LaggedReport, Report, SensorFigures};
use crate::report::output::print;
use crate::report::progress::Progress;
use anyhow::{Context, ensure};
use late_args::LateArgs;
use lists::{LaggedList, List, Sink};
use page::{Collected, Seen};
use std::cell::RefCell;
use std::fs::File;
use std::path::Path;
use truth_check::{Diagnoses, Known};
use unpublished::Unpublished;
use v2x_common::time::Span;
use v2x_fusion_hub::diagnosis::{Finding, Observation, Source, Surroundings, Tokens};
use v2x_fusion_hub::engine::{Engine, EngineConfig};
use v2x_fusion_hub::fusion::Fusion;

/// Fuses the log, writes the fused objects and prints the report.
pub fn fuse(args: &FuseArgs) -> anyhow::Result<()> {
    let report = run(args)?;
    print(&if args.json { serde_json::to_string(&report)? + "\n" } else { report.text() })?;
    Ok(())
}

fn run(args: &FuseArgs) -> anyhow::Result<Report> {
    let settings = args.settings()?;
    // Track ids start at 0.
    let config = EngineConfig { lineage: 0, ..settings.engine };
    let declared = args.sensor.declared(&config.sensing)?;
    let truth = known(args)?;
    let second_lag = config.fusion.second_lag();
    let has_memory = matches!(config.fusion, Fusion::Tracking(_));
    let file = open(&args.detections)?;
    let size = file.metadata().map_or(0, |metadata| metadata.len());
    let listened = settings.clone();
    let LateArgs { late, late_seed } = &args.late;
    let mut log = DetectionLog::by(file, &args.detections, settings)?.later(late, *late_seed);
    let positions =
        [("--range", args.sensor.range.is_some()), ("--accuracy", !args.sensor.accuracy.is_empty())];
    for (option, _) in positions.iter().filter(|(_, is_given)| *is_given && !log.has_poses()) {
        tracing::warn!("without the columns sensor_x and sensor_y {option} has no effect");
    }
    let diagnosis = RefCell::new(Diagnoses::new(truth.as_ref()));
    let (mut sink, mut progress) =
        (sink(args, (truth.as_ref(), second_lag), &diagnosis)?, Progress::begin("KiB"));
    let (mut survey, mut unpublished) = (Survey::default(), Unpublished::default());
    let mut collected = args.report.is_some().then(|| Collected::new(declared.clone()));
    let replay = Replay { engine: Engine::new(config), declared, second_lag, stopwatch: thread_cpu_time };
    let kib = |bytes: u64| usize::try_from(bytes / 1024).unwrap_or(usize::MAX);
    let outcome = replay.run(&mut log, &mut sink, |arrival, n_bytes| {
        survey.add(arrival);
        unpublished.note(arrival);
        collected.iter_mut().for_each(|collected| collected.note(arrival));
        let Arrival { received_at, frame, reported } = arrival;
        if listened.listens_to(&frame.id.agent) {
            diagnosis.borrow_mut().note_frame(&Observation { frame, reported, received_at: *received_at });
        }
        progress.update(kib(n_bytes), kib(size));
    });
    progress.end();
    let (counts, engine) = outcome?;
    let Sink { live, lagged: second, .. } = sink;
    ensure!(counts.frames > 0, "{} holds no detections", args.detections.display());
    let around = Surroundings { engine: &engine, tokens: &Tokens::default(), source: Source::Log };
    let (of_log, of_truth) = diagnosis.into_inner().conclude(&around);
    let mut findings = words::findings(&log, &survey, (&of_log, has_memory));
    // What is wrong with the log is the likelier cause.
    if !findings.iter().any(Finding::is_fault) {
        findings.extend(of_truth);
    }
    if live.is_empty() {
        unusable::check((&args.detections, &log), &counts, (&survey, &findings))?;
        findings.extend(unpublished.finding());
    }
    if let Some(truth) = &truth {
        unusable::check_truth(args, truth, &survey)?;
    }
    let (fused_rows, truth) = live.finish()?;
    let lagged = second.map(lagged).transpose()?;
    if let (Some(collected), Some(out)) = (collected, &args.report) {
        let name = args.detections.file_name().unwrap_or_default().to_string_lossy();
        let seen = Seen { findings: &findings, truth: truth.as_ref() };
        collected.write((out.as_path(), name.as_ref()), listened, &seen)?;
    }
    let page = args.report.as_ref().map(|path| path.display().to_string());
    let warnings = warnings(&findings, args.rules.hub_config.is_some());
    let report = Report { fused_rows, truth, lagged, warnings, page, ..report(counts, &log, &survey) };
    Ok(Report { method: args.rules.method_key()?, ..report })
}

/// What is found, in words; where nobody has given a file of settings yet, also how one is made.
fn warnings(findings: &[Finding], has_settings: bool) -> Vec<String> {
    let mut warnings: Vec<_> = findings.iter().map(ToString::to_string).collect();
    if !has_settings && warnings.iter().any(|one| one.contains("in the file of --hub-config")) {
        warnings.push(
            "the file of --hub-config is one of yours, such as settings.toml: write a line `[hub.agents.NAME]` as it is above, the \
             setting in the next line, and add `--hub-config settings.toml` to this command"
                .to_owned(),
        );
    }
    warnings
}

/// Where the lists go, none of which replaces a file that is read.
fn sink<'a>(
    args: &FuseArgs,
    (truth, second_lag): (Option<&Known>, Option<Span>),
    diagnosis: &'a RefCell<Diagnoses>,
) -> anyhow::Result<Sink<'a>> {
    let path = second_lag.and_then(|_| args.lagged_path());
    let outputs =
        [("--out", Some(&args.out)), ("--lagged-out", path.as_ref()), ("--report", args.report.as_ref())];
    for (option, path) in outputs.into_iter().filter_map(|(option, path)| Some((option, path?))) {
        ensure!(!is_same(&args.detections, path), "{option} would overwrite the detections");
        let is_truth = args.truth.as_ref().is_some_and(|truth| is_same(truth, path));
        ensure!(!is_truth, "{option} would overwrite the truth");
    }
    let is_page = args.report.as_ref().is_some_and(|page| {
        [Some(&args.out), path.as_ref()]
            .into_iter()
            .flatten()
            .any(|table| table == page || is_same(table, page))
    });
    ensure!(!is_page, "--report would overwrite a table of objects");
    let is_both = path.as_ref().is_some_and(|path| *path == args.out || is_same(path, &args.out));
    ensure!(!is_both, "--lagged-out would overwrite --out");
    let lagged = second_lag.map(|lag| LaggedList::new(lag, path, truth)).transpose()?;
    Ok(Sink { live: List::new(Some(&args.out), truth)?, lagged, diagnosis })
}

fn lagged(LaggedList { list, lag, path, .. }: LaggedList) -> anyhow::Result<LaggedReport> {
    let (fused_rows, truth) = list.finish()?;
    let out = path.map(|path| path.display().to_string());
    Ok(LaggedReport { lag_ms: lag.as_millis_f64(), out, fused_rows, truth })
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
        page: None,
        core_s,
        detections_per_s,
        truth: None,
        lagged: None,
    }
}

fn open(path: &Path) -> anyhow::Result<File> {
    File::open(path).with_context(|| format!("cannot read {}", path.display()))
}

fn known(args: &FuseArgs) -> anyhow::Result<Option<Known>> {
    let read = |path: &Path| anyhow::Ok((Truth::read(open(path)?, path)?, args.truth_region));
    args.truth.as_deref().map(read).transpose()
}

fn is_same(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

#[cfg(test)]
mod column_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod truth_tests;
