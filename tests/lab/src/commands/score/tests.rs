//! From an export over another method to its row in the tables.

use super::*;
use crate::commands::draws::DrawArgs;
use crate::commands::export::{ExportArgs, write};
use crate::data::dataset::synthetic;
use crate::data::noise::{NoisePair, Shape};
use crate::drive::keyframes::setting::Setting;
use crate::score::keyframes::counting::{Counting, Subset};
use crate::score::keyframes::experiments::{Experiment, Plan};
use std::path::Path;

/// A temporary folder. It is deleted at the end of the test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("lab-method_output-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).unwrap();
    }
}

fn scenes() -> Vec<Scene> {
    [3, 40].map(synthetic::scene).to_vec()
}

fn exported(folder: &Path, conditions: Conditions) -> Manifest {
    let draws = DrawArgs {
        dataset: crate::data::dataset::source::Source::Synthetic,
        version: String::new(),
        split: crate::data::dataset::nuscenes::Split::Val,
        noise: vec![NoisePair::N1N3, NoisePair::N3N3],
        trials: Some(2),
        quick: false,
        seed: 4,
        shape: Shape::Gaussian,
    };
    let args = ExportArgs::new(draws, conditions, folder.to_owned());
    let manifest = write(&args, &scenes()).unwrap();
    assert_eq!(Manifest::load(folder).unwrap(), manifest);
    manifest
}

/// The unchanged detections of agent 1.
fn fuse_trivially(folder: &Path, manifest: &Manifest, to: &Path, has_ids: bool) {
    for part in manifest.parts() {
        let path = manifest.path(part);
        let mut table = csv::Reader::from_path(folder.join(&path)).unwrap();
        let header = table.headers().unwrap().clone();
        let column = |name: &str| header.iter().position(|column| column == name).unwrap();
        let places = ["t", "det_id", "class", "x", "y", "w", "d", "yaw", "det_id"].map(column);
        let places = &places[..if has_ids { 9 } else { 8 }];
        let mut text = "t,track_id,class,x,y,w,d,yaw".to_owned() + if has_ids { ",det_ids\n" } else { "\n" };
        for record in table.records().map(Result::unwrap) {
            if &record[column("sensor_id")] == "agent-1" {
                let cells: Vec<&str> = places.iter().map(|place| &record[*place]).collect();
                text += &(cells.join(",") + "\n");
            }
        }
        let path = to.join(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
}

/// Means of all metrics of single-1 and of the scored method, in every experiment.
fn both(manifest: &Manifest, method_output: MethodOutput) -> Vec<[[Option<f64>; 5]; 2]> {
    let contenders =
        vec![Contender::Method(Method::Single1), Contender::Recorded(Arc::new(method_output.output))];
    let setting =
        |noise: &NoisePair| Setting { noise: *noise, shape: manifest.shape, conditions: manifest.conditions };
    let experiments: Vec<_> = manifest
        .noise
        .iter()
        .map(|noise| Experiment { setting: setting(noise), contenders: contenders.clone() })
        .collect();
    assert!(experiments.iter().all(|one| one.contenders[1].has_output_for(&one.setting)));
    let plan = Plan { experiments, trials: manifest.trials, seed: manifest.seed, threads: 2 };
    let scores = plan.run(&scenes(), |_, _| {}).unwrap();
    let mut rows = Vec::new();
    for experiment in &plan.experiments {
        for counting in Counting::ALL {
            for subset in Subset::ALL {
                let of = |contender: &Contender| {
                    let cell = plan.cell(experiment.setting, contender.key()).unwrap();
                    let trial = scores.trial(cell, 1);
                    trial.of(subset).metrics(counting).map(|metric| metric.mean())
                };
                rows.push([of(&contenders[0]), of(&contenders[1])]);
            }
        }
    }
    rows
}

fn assert_same(rows: &[[[Option<f64>; 5]; 2]]) {
    for [ours, method_output] in rows {
        for (ours, method_output) in ours.iter().zip(method_output) {
            let (ours, method_output) = (ours.unwrap(), method_output.unwrap());
            // Floats are written with all their digits; only the order of additions may differ.
            assert!((ours - method_output).abs() <= 1e-12 * ours.abs(), "{ours} {method_output}");
        }
    }
}

#[test]
fn agent_1s_detections_unchanged_are_the_row_of_single_1_under_any_conditions() {
    for conditions in [Conditions::Paper, Conditions::Sensors] {
        let folder = Folder::new(&format!("single-{conditions:?}"));
        let manifest = exported(&folder.0, conditions);
        let fused = folder.0.join("fused");
        fuse_trivially(&folder.0, &manifest, &fused, true);
        let paths = [fused];
        assert_eq!(export_folder(None, &paths).unwrap(), std::path::absolute(&folder.0).unwrap());
        let method_output = read_output("mine", Some("σ"), (&manifest, &scenes()), &paths).unwrap();
        assert_eq!((method_output.output.inputs(), method_output.ignored_rows), ("σ", 0));
        assert!(!method_output.output.claims_accuracy());
        let rows = both(&manifest, method_output);
        assert_same(&rows);
        assert!(rows[0][0] != rows[9][0], "two levels of noise");
    }
}

#[test]
fn without_ids_boxes_are_matched_by_position_and_the_row_says_so() {
    let folder = Folder::new("position");
    let manifest = exported(&folder.0, Conditions::Paper);
    let fused = folder.0.join("fused");
    fuse_trivially(&folder.0, &manifest, &fused, false);
    let method_output = read_output("mine", None, (&manifest, &scenes()), &[fused]).unwrap();
    assert_eq!(method_output.output.inputs(), "matched by position");
    // Only rows of all objects; rows of standing and of moving objects are between them.
    for [ours, method_output] in both(&manifest, method_output).into_iter().step_by(Subset::ALL.len()) {
        // Position matching can swap near objects of one class. The error never grows by that.
        assert!(method_output[0].unwrap() <= ours[0].unwrap() + 1e-9, "{ours:?} {method_output:?}");
        assert!(method_output[0].unwrap() > 0.5 * ours[0].unwrap(), "{ours:?} {method_output:?}");
        assert_eq!((method_output[3], method_output[4]), (Some(1.0), Some(1.0)));
    }
}

#[test]
fn every_scene_and_trial_must_be_there_in_folders_or_single_files() {
    let folder = Folder::new("missing");
    let manifest = exported(&folder.0, Conditions::Paper);
    let fused = folder.0.join("fused");
    fuse_trivially(&folder.0, &manifest, &fused, true);
    let [inner, other] = ["N1-N3", "N3-N3"].map(|noise| fused.join(noise));
    assert_eq!(
        fused_files(&manifest, &[inner, other.join("trial-0"), other.join("trial-1")]).unwrap().len(),
        8
    );
    let single = other.join("trial-1").join(&manifest.scenes[1].file);
    let moved = folder.0.join("elsewhere/N3-N3/trial-1").join(&manifest.scenes[1].file);
    std::fs::create_dir_all(moved.parent().unwrap()).unwrap();
    std::fs::rename(&single, &moved).unwrap();
    let files = fused_files(&manifest, &[fused.clone(), moved.clone()]).unwrap();
    assert_eq!(files.last().unwrap().1, std::path::absolute(&moved).unwrap());
    std::fs::remove_file(other.join("trial-0").join(&manifest.scenes[0].file)).unwrap();
    let message = fused_files(&manifest, &[fused]).unwrap_err().to_string();
    assert!(message.starts_with("2 of 8 files of the export have no counterpart in "), "{message}");
    let first = manifest.path(manifest.parts().nth(4).unwrap());
    assert!(message.ends_with(&format!("{} is the first", first.display())), "{message}");
    let message = fused_files(&manifest, &[folder.0.join("nowhere")]).unwrap_err().to_string();
    assert!(message.ends_with("nowhere is not there"), "{message}");
}

#[test]
fn an_export_that_cannot_be_reproduced_is_an_error() {
    let folder = Folder::new("changed");
    let manifest = exported(&folder.0, Conditions::Paper);
    let fused = folder.0.join("fused");
    fuse_trivially(&folder.0, &manifest, &fused, true);
    let refused = |manifest: &Manifest, scenes: &[Scene]| {
        read_output("mine", None, (manifest, scenes), std::slice::from_ref(&fused))
            .map(|_| ())
            .unwrap_err()
            .to_string()
    };
    let other_seed = Manifest { seed: 5, ..manifest.clone() };
    assert!(refused(&other_seed, &scenes()).starts_with("the detections of the export are not those"));
    assert!(refused(&manifest, &scenes()[..1]).starts_with("the detections of the export are not those"));
    let args = ExportArgs::new(manifest.draws().unwrap(), Conditions::Paper, folder.0.clone());
    let message = write(&args, &scenes()).unwrap_err().to_string();
    assert!(message.contains("export.json is there already"), "{message}");
}

#[test]
fn a_methods_output_is_scored_only_with_its_own_detections() {
    let folder = Folder::new("blocks");
    let manifest = exported(&folder.0, Conditions::Paper);
    let fused = folder.0.join("fused");
    fuse_trivially(&folder.0, &manifest, &fused, true);
    let method_output = read_output("mine", None, (&manifest, &scenes()), &[fused]).unwrap();
    let study = crate::report::tables::study::Study {
        tables: vec![Table::II, Table::Robustness, Table::Nees, Table::Sensors],
        noise: manifest.noise,
        methods: vec![],
        shape: Shape::Gaussian,
        conditions: Conditions::Paper,
        further: vec![Contender::Recorded(Arc::new(method_output.output))],
        moment: crate::score::keyframes::moment::Moment::default(),
        is_brief: false,
    };
    for block in study.blocks() {
        let is_there = block.contenders.iter().any(|one| one.key() == "mine");
        let is_gaussian = block.setting.shape == Shape::Gaussian;
        let expected = match block.table {
            Table::II | Table::Robustness => is_gaussian,
            _ => false,
        };
        assert_eq!(is_there, expected, "{block:?}");
    }
}

#[test]
fn ambiguous_method_names_are_errors_and_a_run_needs_no_options() {
    assert!(check_name("mine-2.1").is_ok());
    for name in ["", "ours", "a_b", "a b", &"x".repeat(41)] {
        assert!(check_name(name).is_err(), "{name:?}");
    }
    let args = ScoreArgs {
        paths: vec!["a".into(), "b".into()],
        name: None,
        export: None,
        inputs: None,
        rows: RowArgs::default(),
        json: false,
    };
    assert!(score(&args).unwrap_err().to_string().starts_with("2 paths; without --name"));
    let rows = RowArgs { table: vec![Table::II], ..RowArgs::default() };
    assert!(score(&ScoreArgs { rows, ..args }).unwrap_err().to_string().contains("need --name"));
}
