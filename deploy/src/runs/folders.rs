//! What is known of the folders of runs.

use anyhow::Context;
use serde::Serialize;
use std::fs::{self, File, TryLockError};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};
use v2x_common::clock;
use v2x_lab::Summary;
use v2x_lab::commands::About;

/// One run.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Run {
    pub(super) path: PathBuf,
    /// Whether its fusion passed; `None` where it was not scored.
    pub(super) passed: Option<bool>,
    pub(super) bytes: u64,
    pub(super) age_s: u64,
    /// Whether it still goes on.
    pub(super) is_running: bool,
    pub(super) about: Option<About>,
}

/// All runs in a folder, the newest first. A folder that does not exist holds none.
pub(super) fn runs(folder: &Path) -> anyhow::Result<Vec<Run>> {
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.with_context(|| format!("reading {}", folder.display()))?,
    };
    let mut runs = Vec::new();
    for entry in entries {
        let entry = entry.with_context(|| format!("reading {}", folder.display()))?;
        // A link may lead to where nothing is ours.
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) && is_run(&entry.path()) {
            runs.push(run(entry.path())?);
        }
    }
    runs.sort_by(|a, b| a.age_s.cmp(&b.age_s).then_with(|| b.path.cmp(&a.path)));
    Ok(runs)
}

/// Every run has its scenario and a folder of logs, whatever version made it.
fn is_run(path: &Path) -> bool {
    path.join("scenario.toml").is_file() && path.join("logs").is_dir()
}

fn run(path: PathBuf) -> anyhow::Result<Run> {
    let scenario = path.join("scenario.toml");
    let began = fs::metadata(&scenario).and_then(|metadata| metadata.modified());
    let began = began.with_context(|| format!("reading {}", scenario.display()))?;
    let now = SystemTime::UNIX_EPOCH + Duration::from_micros(clock::now().as_micros().unsigned_abs());
    Ok(Run {
        passed: json::<Summary>(&path.join("summary.json")).map(|summary| summary.verdict.passed),
        about: json(&path.join("about.json")),
        is_running: is_running(&path),
        bytes: size(&path),
        age_s: now.duration_since(began).unwrap_or_default().as_secs(),
        path,
    })
}

/// A file that is missing or of another version says nothing.
fn json<T: serde::de::DeserializeOwned>(path: &Path) -> Option<T> {
    serde_json::from_slice(&fs::read(path).ok()?).ok()
}

/// A run holds a lock on its `about.json`.
fn is_running(path: &Path) -> bool {
    File::open(path.join("about.json"))
        .is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
}

/// The size of all files below, as far as they can be read.
fn size(path: &Path) -> u64 {
    let entries = fs::read_dir(path).into_iter().flatten().flatten();
    let of = |entry: fs::DirEntry| match entry.metadata() {
        Ok(metadata) if metadata.is_dir() => size(&entry.path()),
        Ok(metadata) => metadata.len(),
        Err(_) => 0,
    };
    entries.map(of).sum()
}

/// A number of bytes for people.
pub(super) fn bytes_in_words(bytes: u64) -> String {
    #[expect(clippy::cast_precision_loss, reason = "three digits are shown")]
    let bytes = bytes as f64;
    match bytes {
        small if small < 1e3 => format!("{small:.0} B"),
        kilo if kilo < 1e6 => format!("{:.1} kB", kilo / 1e3),
        mega if mega < 1e9 => format!("{:.1} MB", mega / 1e6),
        giga => format!("{:.1} GB", giga / 1e9),
    }
}

/// An age for people.
pub(super) fn age_in_words(seconds: u64) -> String {
    match seconds {
        0..120 => format!("{seconds} s"),
        120..7200 => format!("{} min", seconds / 60),
        7200..172_800 => format!("{} h", seconds / 3600),
        _ => format!("{} days", seconds / 86_400),
    }
}
