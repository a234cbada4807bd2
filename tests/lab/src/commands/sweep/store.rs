//! Records of finished runs, one per line, so that a sweep that was stopped can continue.

use crate::drive::sweep::method::SweepMethod;
use crate::drive::sweep::plan::{Plan, Point};
use crate::score::sweep::record::Record;
use anyhow::Context;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock};

/// File name in the folder of a sweep.
const FILE: &str = "runs.jsonl";

/// A finished run.
#[derive(Serialize, Deserialize)]
struct Line {
    key: String,
    record: Record,
}

/// Stored records, and the file for new ones.
#[derive(Debug)]
pub(crate) struct Store {
    path: PathBuf,
    known: BTreeMap<String, Record>,
    file: Mutex<File>,
}

impl Store {
    /// Opens the store of a folder and creates the folder if needed. An incomplete last line is ignored.
    pub(crate) fn open(folder: &Path) -> anyhow::Result<Self> {
        std::fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
        let path = folder.join(FILE);
        let text = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(error).with_context(|| format!("reading {}", path.display())),
        };
        let lines = text.lines().filter_map(|line| serde_json::from_str::<Line>(line).ok());
        let known = lines.map(|line| (line.key, line.record)).collect();
        let file = OpenOptions::new().create(true).append(true).open(&path);
        let mut file = file.with_context(|| format!("writing {}", path.display()))?;
        if !text.is_empty() && !text.ends_with('\n') {
            file.write_all(b"\n").with_context(|| format!("writing {}", path.display()))?;
        }
        Ok(Self { path, known, file: Mutex::new(file) })
    }

    /// Number of stored records.
    pub(crate) fn len(&self) -> usize {
        self.known.len()
    }

    /// Whether there is no stored record.
    pub(crate) fn is_empty(&self) -> bool {
        self.known.is_empty()
    }

    /// The stored record of a run, if any.
    pub(crate) fn get(&self, key: &str) -> Option<&Record> {
        self.known.get(key)
    }

    /// Stores a record.
    pub(crate) fn keep(&self, key: &str, record: &Record) -> anyhow::Result<()> {
        let line = serde_json::to_string(&Line { key: key.to_owned(), record: record.clone() })? + "\n";
        let mut file = self.file.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        file.write_all(line.as_bytes()).with_context(|| format!("writing {}", self.path.display()))
    }
}

/// Everything that the result of a run depends on: the scenario, the files that it refers to (recorded links) and
/// this build.
pub(crate) fn key(plan: &Plan, point: &Point, method: SweepMethod) -> String {
    let parts = [
        build(),
        &format!("{:?}", point.scenario),
        &point.text,
        method.key(),
        &point.seed.to_string(),
        &point.n_agents.to_string(),
        &plan.length.duration.as_nanos().to_string(),
        &plan.length.settle.as_nanos().to_string(),
        if plan.live { "live" } else { "virtual" },
    ];
    // FNV-1a; the zero byte separates the parts.
    let hash = parts
        .iter()
        .flat_map(|part| part.bytes().chain([0]))
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
    format!("{hash:016x}")
}

/// An identifier of this build.
fn build() -> &'static str {
    static BUILD: OnceLock<String> = OnceLock::new();
    BUILD.get_or_init(|| {
        let file = std::env::current_exe().and_then(std::fs::metadata);
        let written = file.and_then(|file| Ok((file.len(), file.modified()?)));
        // Without that file, the version alone identifies the build.
        format!("{} {:?}", env!("CARGO_PKG_VERSION"), written.ok())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::sweep::record::Errors;

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("v2x-sweep-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&folder);
        folder
    }

    #[test]
    fn stored_records_are_read_after_a_stop_in_the_middle_of_a_line() {
        let folder = folder("stop");
        let record =
            Record { blocks: vec![[Errors { ate_m: 0.1, ..Errors::default() }; 4]], ..Record::default() };
        {
            let store = Store::open(&folder).unwrap();
            store.keep("a", &record).unwrap();
            store.keep("b", &record).unwrap();
        }
        let path = folder.join(FILE);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, &text[..text.len() - 20]).unwrap();
        let store = Store::open(&folder).unwrap();
        assert_eq!((store.get("a"), store.get("b")), (Some(&record), None));
        store.keep("b", &record).unwrap();
        let again = Store::open(&folder).unwrap();
        assert_eq!(again.get("b"), Some(&record));
        std::fs::remove_dir_all(folder).unwrap();
    }
}
