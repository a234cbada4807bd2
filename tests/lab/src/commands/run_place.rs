//! Where the folder of a run is made, and what says which run it is.

use anyhow::Context;
use jiff::Zoned;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use v2x_common::version;

/// The folder of all runs, in the current one.
pub const RUNS: &str = "v2x-runs";

/// The contents of `about.json`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct About {
    /// Name of the scenario.
    pub scenario: String,
    /// When it began, local time with its offset.
    pub started: String,
    /// Version of the program.
    pub version: String,
    /// The commit that it was built from.
    pub commit: String,
}

/// A new folder `TIME-SCENARIO` in this one, by local time to the second; of several runs of one second the later ones have a
/// number.
pub fn new_folder(runs: &Path, scenario: &str) -> anyhow::Result<PathBuf> {
    std::fs::create_dir_all(runs).with_context(|| format!("making {}", runs.display()))?;
    let name = format!("{}-{}", Zoned::now().strftime("%Y-%m-%d_%H-%M-%S"), file_name(scenario));
    for number in 1_u32.. {
        let path = runs.join(if number == 1 { name.clone() } else { format!("{name}-{number}") });
        match std::fs::create_dir(&path) {
            Ok(()) => return Ok(path),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error).with_context(|| format!("making {}", path.display())),
        }
    }
    anyhow::bail!("{} holds too many runs of {name}", runs.display())
}

/// The name of a scenario as part of a file name.
fn file_name(scenario: &str) -> String {
    let legal = |c: char| if c.is_alphanumeric() || matches!(c, '-' | '.' | '_') { c } else { '-' };
    scenario.chars().take(60).map(legal).collect()
}

/// Writes `about.json`. As long as the file that is returned is open, `v2x runs prune` knows that the run goes on.
pub(super) fn write_about(folder: &Path, scenario: &str) -> anyhow::Result<File> {
    let path = folder.join("about.json");
    let about = About {
        scenario: scenario.to_owned(),
        started: Zoned::now().strftime("%Y-%m-%dT%H:%M:%S%:z").to_string(),
        version: version::VERSION.to_owned(),
        commit: version::COMMIT.to_owned(),
    };
    let write = || {
        let mut file = File::create(&path)?;
        // A file system without locks is no reason not to run.
        let _ = file.try_lock();
        file.write_all(serde_json::to_string_pretty(&about)?.as_bytes())?;
        Ok::<_, std::io::Error>(file)
    };
    write().with_context(|| format!("writing {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_one_second_have_folders_of_their_own_with_time_and_scenario() {
        let runs = std::env::temp_dir().join(format!("v2x-run-place-{}", std::process::id()));
        let folders: Vec<_> = (0..4).map(|_| new_folder(&runs, "my crossing/2").unwrap()).collect();
        let names: std::collections::BTreeSet<_> = folders.iter().collect();
        assert_eq!(names.len(), 4, "{folders:?}");
        for folder in &folders {
            let name = folder.file_name().unwrap().to_str().unwrap();
            let (time, scenario) = name.split_at(20);
            let shape: String = time.chars().map(|c| if c.is_ascii_digit() { '9' } else { c }).collect();
            assert_eq!(shape, "9999-99-99_99-99-99-");
            assert!(scenario.starts_with("my-crossing-2"), "{name}");
        }
        std::fs::remove_dir_all(runs).unwrap();
    }
}
