//! `lab score`: scores the output of another method on exported detections as one more row of every table, or
//! scores a recorded run again.

pub(crate) mod args;
pub(crate) mod files;

pub use args::ScoreArgs;

use crate::commands::export::manifest::{Fingerprint, Manifest};
use crate::commands::recorded_run::RecordedRun;
use crate::commands::run_folder::{RunFolder, print_summary, rescore};
use crate::commands::score::files::{export_folder, fused_files};
use crate::commands::tables::{Detectors, RowArgs, TablesArgs, tables_of};
use crate::data::conditions::Conditions;
use crate::data::exported::{reports, table};
use crate::data::method_output::{ExportedScene, SceneOutput};
use crate::data::scene::Scene;
use crate::drive::keyframes::contender::Contender;
use crate::drive::keyframes::method::Method;
use crate::drive::keyframes::outputs::RecordedOutput;
use crate::drive::keyframes::setting::SceneTrial;
use crate::report::progress::Progress;
use crate::report::tables::kind::Table;
use crate::score::keyframes::by_position::assign_objects;
use anyhow::{Context, bail, ensure};
use std::fs::File;
use std::path::PathBuf;
use std::sync::Arc;
use v2x_fusion_hub::association::assignment::Assigner;

/// Longest name of a method, characters.
const MAX_NAME_LEN: usize = 40;

/// Scores and prints the result.
pub fn score(args: &ScoreArgs) -> anyhow::Result<()> {
    let Some(name) = &args.name else { return score_run(args) };
    check_name(name)?;
    let manifest = Manifest::load(&export_folder(args.export.as_deref(), &args.paths)?)?;
    let draws = manifest.draws()?;
    let scenes = draws.scenes()?;
    let method_output = read_output(name, args.inputs.as_deref(), (&manifest, &scenes), &args.paths)?;
    print_notes(name, &method_output);
    let mut rows = args.rows.clone();
    if rows.table.is_empty() && manifest.conditions == Conditions::Sensors {
        (rows.table, rows.sensors) = (vec![Table::Sensors], false);
    }
    rows.detectors = Detectors::of(manifest.conditions);
    let further = vec![Contender::Recorded(Arc::new(method_output.output))];
    tables_of(&TablesArgs::new(draws, rows, args.json), &scenes, further)
}

fn score_run(args: &ScoreArgs) -> anyhow::Result<()> {
    let is_plain = args.export.is_none() && args.inputs.is_none() && args.rows == RowArgs::default();
    ensure!(is_plain, "options about tables need --name; without it, a recorded run is scored again");
    match args.paths.as_slice() {
        [file] if file.is_file() && !RunFolder::is_run(file) => match RecordedRun::unpack(file)? {
            Some(run) => print_summary(&run.folder().score()?, args.json),
            None => rescore(file, args.json),
        },
        [folder] => rescore(folder, args.json),
        paths => bail!("{} paths; without --name, one folder of a recorded run is scored", paths.len()),
    }
}

fn check_name(name: &str) -> anyhow::Result<()> {
    let is_legal = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '.' | '+');
    let is_short = (1..=MAX_NAME_LEN).contains(&name.len());
    ensure!(
        is_short && name.chars().all(is_legal),
        "--name {name:?}: expected up to 40 letters, digits, - . +"
    );
    let is_taken = Method::ALL.iter().any(|method| method.key() == name);
    ensure!(!is_taken, "--name {name}: the tables have a row of this name");
    Ok(())
}

/// The output of a method on an export, with counts for warnings.
#[derive(Clone, Debug)]
pub(crate) struct MethodOutput {
    /// The estimates.
    pub output: RecordedOutput,
    /// Number of boxes that are scored.
    pub boxes: u64,
    /// Number of rows whose time is not that of a keyframe.
    pub ignored_rows: u64,
    /// Number of rows with an unknown class name.
    pub unknown_classes: u64,
}

/// Reads the output of a method on an export. `inputs` names the inputs that the method uses.
pub(crate) fn read_output(
    name: &str,
    inputs: Option<&str>,
    (manifest, scenes): (&Manifest, &[Scene]),
    paths: &[PathBuf],
) -> anyhow::Result<MethodOutput> {
    const CHANGED: &str = "the detections of the export are not those that its export.json leads to: another version \
                           of lab made it, or the data set has changed; export anew";
    ensure!(manifest.is_of(scenes), CHANGED);
    let files = fused_files(manifest, paths)?;
    let (mut progress, mut fingerprint) = (Progress::begin("files"), Fingerprint::default());
    let (mut read, mut assigner) = (Vec::new(), Assigner::default());
    for (part, path) in &files {
        let scene = &scenes[part.scene];
        let reports = reports(&manifest.protocol(*part), scene);
        fingerprint.add(&table(scene, &reports));
        let file = File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
        let mut scene_output = SceneOutput::read(file, path, ExportedScene { scene, reports: &reports })?;
        if scene_output.is_matched_by_position {
            let keyframes = scene_output.by_keyframe.iter_mut().zip(&scene.keyframes);
            keyframes.for_each(|(boxes, keyframe)| assign_objects(boxes, keyframe, &mut assigner));
        }
        read.push((*part, scene_output));
        progress.update(read.len(), files.len());
    }
    progress.end();
    ensure!(fingerprint.text() == manifest.fingerprint, CHANGED);
    let any_by_position = read.iter().any(|(_, fused)| fused.is_matched_by_position);
    ensure!(
        !any_by_position || manifest.conditions == Conditions::Paper,
        "with missed detections and clutter, boxes are matched by their column det_ids only, which is missing"
    );
    let by_position = any_by_position.then_some("matched by position");
    let inputs: Vec<&str> = inputs.into_iter().chain(by_position).collect();
    let mut output =
        RecordedOutput::new(name, inputs.join(", ")).for_detections(manifest.shape, manifest.conditions);
    if !read.iter().all(|(_, fused)| fused.claims_accuracy) {
        output = output.without_accuracy();
    }
    let sum = |of: fn(&SceneOutput) -> u64| read.iter().map(|(_, fused)| of(fused)).sum();
    let boxes = sum(|fused| fused.by_keyframe.iter().map(|boxes| boxes.len() as u64).sum());
    let (ignored_rows, unknown_classes) =
        (sum(|fused| fused.ignored_rows), sum(|fused| fused.unknown_classes));
    for (part, fused) in read {
        let (noise, conditions, trial) = (part.noise, manifest.conditions, part.trial);
        let trial_of_scene = SceneTrial { noise, conditions, trial, scene: &scenes[part.scene].name };
        output.insert(&trial_of_scene, fused.by_keyframe);
    }
    Ok(MethodOutput { output, boxes, ignored_rows, unknown_classes })
}

#[expect(clippy::print_stderr, reason = "what people read while the JSON goes elsewhere")]
fn print_notes(name: &str, method_output: &MethodOutput) {
    let MethodOutput { output, boxes, ignored_rows, unknown_classes } = method_output;
    let mut line = format!("{name}: {boxes} boxes at keyframes");
    for (n, what) in [(ignored_rows, "rows at other times ignored"), (unknown_classes, "of unknown class")] {
        if *n > 0 {
            line += &format!(", {n} {what}");
        }
    }
    if !output.claims_accuracy() {
        line += "; without sx,sy,sw,sd,st no row in the table of claimed accuracies (nees)";
    }
    eprintln!("{line}");
}

#[cfg(test)]
mod tests;
