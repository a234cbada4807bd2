//! What is missing of the folder of a run, in words that say which command makes it.

use anyhow::{anyhow, ensure};
use std::path::Path;

/// What makes a folder that can be scored.
const MAKERS: &str = "`v2x demo` makes a folder that can be scored; so does a recording of `v2x up SCENARIO --record run.mcap`: \
                      `lab report run.mcap`";

/// Refuses a folder that lacks what a score needs: its scenario, or its recording, which is to be at this path.
pub(super) fn check_whole(folder: &Path, recording: &Path) -> anyhow::Result<()> {
    ensure!(
        recording.is_file(),
        "{} has no {}: nothing of this run was recorded, or the file was moved or deleted. {}{MAKERS}",
        folder.display(),
        recording.file_name().unwrap_or_default().to_string_lossy(),
        others(folder)
    );
    let scenario = folder.join("scenario.toml");
    ensure!(
        scenario.is_file(),
        "{} has no scenario.toml: without it there is no truth. `lab report {}` writes a page without scores",
        folder.display(),
        recording.display()
    );
    Ok(())
}

/// Why this is neither a recording nor the folder of a run that ended.
pub(super) fn no_run(path: &Path) -> anyhow::Error {
    let shown = path.display();
    if !path.exists() {
        return anyhow!("{shown} is not there; `v2x runs` lists the folders of runs in v2x-runs");
    }
    let folder = if path.is_file() { path.parent().unwrap_or(path) } else { path };
    let has = |name: &str| folder.join(name).is_file();
    let others = others(folder);
    let is_run = has("about.json") || has("scenario.toml");
    match (is_run, others.is_empty()) {
        (true, true) => anyhow!(
            "{shown} has no run.json and no recording: it is of `v2x up` without `--record`, or of a run that was ended before its \
             time, and only its logs are there. {MAKERS}"
        ),
        (true, false) => {
            anyhow!("{shown} has no run.json: its run did not end, or it is of `v2x up`. {others}{MAKERS}")
        }
        (false, false) => anyhow!("{shown} is no folder of a run that ended: it has no run.json. {others}"),
        (false, true) => anyhow!(
            "{shown} is no folder of a run that ended: it has no run.json, and no recording lies there. {MAKERS}; `v2x runs` lists \
             the folders of runs"
        ),
    }
}

/// The recordings in a folder, as a sentence; nothing where there is none.
fn others(folder: &Path) -> String {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut recordings: Vec<_> =
        entries.map(|entry| entry.path()).filter(|path| is_recording(path)).collect();
    recordings.sort_unstable();
    match &recordings[..] {
        [] => String::new(),
        [one] => format!("There is a recording, {}: give that. ", one.display()),
        [first, ..] => {
            format!(
                "There are {} recordings, such as {}: give one of them. ",
                recordings.len(),
                first.display()
            )
        }
    }
}

fn is_recording(path: &Path) -> bool {
    path.extension().is_some_and(|suffix| suffix == "mcap" || suffix == "v2xrec")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_is_said_with_the_command_that_makes_it() {
        let folder = std::env::temp_dir().join(format!("v2x-run-parts-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let write = |name: &str| std::fs::write(folder.join(name), "").unwrap();
        let recording = folder.join("recording.mcap");
        let says = |words: &[&str], error: anyhow::Error| {
            let error = error.to_string();
            words.iter().for_each(|word| assert!(error.contains(word), "{word:?} is not in {error}"));
        };
        says(&["is not there", "v2x runs"], no_run(&folder.join("no-such-run")));
        says(&["no run.json, and no recording", "v2x demo"], no_run(&folder));
        write("about.json");
        says(&["`v2x up` without `--record`", "v2x up SCENARIO --record run.mcap"], no_run(&folder));
        write("mine.mcap");
        says(&["did not end", "mine.mcap: give that"], no_run(&folder));
        write("run.json");
        says(
            &["has no recording.mcap", "mine.mcap", "v2x demo"],
            check_whole(&folder, &recording).unwrap_err(),
        );
        write("recording.mcap");
        says(&["has no scenario.toml", "lab report"], check_whole(&folder, &recording).unwrap_err());
        write("scenario.toml");
        let whole = check_whole(&folder, &recording);
        std::fs::remove_dir_all(&folder).unwrap();
        whole.unwrap();
    }
}
