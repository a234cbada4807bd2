//! `lab export`: writes the noisy detections of `lab tables`, for methods in any language.
//!
//! `DIR/export.json` is the manifest. `DIR/N1-N3/trial-0/SCENE.csv` holds the detections of a scene in the columns of
//! `lab fuse`, with `det_id` (`agent-1:12:3`: agent, keyframe, index in its report), `sensor_x` and `sensor_y`.
//! Both times are the time of the keyframe since the start of the scene. The files hold no ground truth.

pub(crate) mod file_names;
pub(crate) mod manifest;

use crate::commands::draws::DrawArgs;
use crate::commands::export::manifest::{FILE_NAME, Fingerprint, Manifest};
use crate::data::conditions::Conditions;
use crate::data::exported;
use crate::data::scene::Scene;
use crate::report::output::print;
use crate::report::progress::Progress;
use anyhow::{Context, ensure};
use std::path::{Path, PathBuf};

/// Write the noisy detections of all scenes and trials, without ground truth, for a method of your own in any language
///
/// `lab score --name` adds the output of that method to the tables as one more row.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
DIR/export.json says what is exported; the detections of a scene are in
DIR/N1-N3/trial-0/SCENE.csv, in the columns of lab fuse and det_id, sensor_x,
sensor_y; t and t_arr are the keyframe's time since the scene's start.

Examples:
  lab export --noise N1-N3 --quick --out detections
        20 scenes, 2 trials
  lab export --dataset csv:boxes.csv --out detections
        your own scenes, all four levels of noise
  python3 deploy/examples/own_method.py detections fused
  lab score --name mine fused --export detections --table II")]
pub struct ExportArgs {
    #[command(flatten)]
    draws: DrawArgs,
    /// Detection conditions of the agents; the table of --sensors needs sensors
    #[arg(long, value_enum, default_value_t = Conditions::Paper)]
    conditions: Conditions,
    /// The folder to create
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

impl ExportArgs {
    /// Exports `draws` into `folder`.
    pub const fn new(draws: DrawArgs, conditions: Conditions, out: PathBuf) -> Self {
        Self { draws, conditions, out }
    }
}

/// Reads the scenes and exports them.
pub fn export(args: &ExportArgs) -> anyhow::Result<()> {
    let scenes = args.draws.scenes()?;
    let manifest = write(args, &scenes)?;
    let n_files = manifest.parts().count();
    print(&format!("{n_files} tables of detections in {}\n", args.out.display()))?;
    Ok(())
}

/// Exports these scenes.
pub(crate) fn write(args: &ExportArgs, scenes: &[Scene]) -> anyhow::Result<Manifest> {
    let mut manifest = Manifest::new(&args.draws, args.conditions, scenes)?;
    let path = args.out.join(FILE_NAME);
    ensure!(!path.exists(), "{} is there already: export into a new folder", path.display());
    let (mut progress, mut fingerprint) = (Progress::begin("tables"), Fingerprint::default());
    let n_files = manifest.parts().count();
    for (done, part) in (1..).zip(manifest.parts()) {
        let scene = &scenes[part.scene];
        let table = exported::table(scene, &exported::reports(&manifest.protocol(part), scene));
        fingerprint.add(&table);
        write_file(&args.out.join(manifest.path(part)), &table)?;
        progress.update(done, n_files);
    }
    progress.end();
    manifest.fingerprint = fingerprint.text();
    // Written last: an export with a manifest is complete.
    write_file(&path, &(serde_json::to_string_pretty(&manifest)? + "\n"))?;
    Ok(manifest)
}

fn write_file(path: &Path, text: &str) -> anyhow::Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
    }
    std::fs::write(path, text).with_context(|| format!("writing {}", path.display()))
}
