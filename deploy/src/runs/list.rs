//! The list of runs.

use super::folders::{Run, age_in_words, bytes_in_words, runs};
use crate::output;
use std::fmt::Write;
use std::path::Path;

pub(super) fn list(folder: &Path, json: bool) -> anyhow::Result<()> {
    let runs = runs(folder)?;
    let text = if json { serde_json::to_string(&runs)? + "\n" } else { table(&runs, folder) };
    output::print(&text).map(|_| ())
}

pub(super) fn table(runs: &[Run], folder: &Path) -> String {
    if runs.is_empty() {
        return format!("no runs in {}; v2x demo makes one\n", folder.display());
    }
    let names: Vec<_> = runs.iter().map(|run| run.path.display().to_string()).collect();
    let width = names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let mut text = format!("{:<width$}  {:<10} {:>9} {:>8}  commit\n", "run", "verdict", "size", "age");
    for (run, name) in runs.iter().zip(names) {
        let verdict = match run.passed {
            _ if run.is_running => "running",
            Some(true) => "passed",
            Some(false) => "not passed",
            None => "–",
        };
        let commit = run.about.as_ref().map_or("–", |about| about.commit.as_str());
        let (size, age) = (bytes_in_words(run.bytes), age_in_words(run.age_s));
        let _ = writeln!(text, "{name:<width$}  {verdict:<10} {size:>9} {age:>8}  {commit}");
    }
    let all = runs.iter().map(|run| run.bytes).sum();
    let _ =
        writeln!(text, "{} runs, {}; report.html in each that was scored", runs.len(), bytes_in_words(all));
    text
}
