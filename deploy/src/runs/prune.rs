//! Deleting old runs.

use super::args::PruneArgs;
use super::folders::{Run, bytes_in_words, runs};
use super::list::table;
use crate::output;
use anyhow::{Context, bail};
use std::io::{BufRead, IsTerminal, Write};
use std::path::Path;

pub(super) fn prune(folder: &Path, args: &PruneArgs) -> anyhow::Result<()> {
    let all = runs(folder)?;
    let chosen = chosen(&all, args);
    if chosen.is_empty() {
        return output::print(&format!("nothing to delete: {} runs in {}\n", all.len(), folder.display()))
            .map(|_| ());
    }
    output::print(&table(&chosen, folder))?;
    let size = bytes_in_words(chosen.iter().map(|run| run.bytes).sum());
    if args.dry_run {
        return output::print(&format!("would delete these {} runs, {size}\n", chosen.len())).map(|_| ());
    }
    if !args.yes && !agrees(&format!("Delete these {} runs, {size}? [y/N] ", chosen.len()))? {
        return output::print("nothing was deleted\n").map(|_| ());
    }
    for run in &chosen {
        std::fs::remove_dir_all(&run.path).with_context(|| format!("deleting {}", run.path.display()))?;
    }
    output::print(&format!("deleted {} runs, {size}\n", chosen.len())).map(|_| ())
}

/// The runs that everything given selects; of those that go on none.
fn chosen(all: &[Run], args: &PruneArgs) -> Vec<Run> {
    let is_chosen = |(place, run): &(usize, &Run)| {
        let is_beyond = args.keep.is_none_or(|keep| *place >= keep);
        let is_old = args.older_than.is_none_or(|age| run.age_s > age.as_secs());
        is_beyond && is_old && !run.is_running
    };
    all.iter().enumerate().filter(is_chosen).map(|(_, run)| run.clone()).collect()
}

fn agrees(question: &str) -> anyhow::Result<bool> {
    let stdin = std::io::stdin();
    if !stdin.is_terminal() {
        bail!("nothing was deleted: --yes deletes without a question, --dry-run only lists");
    }
    let mut stderr = std::io::stderr();
    stderr.write_all(question.as_bytes()).and_then(|()| stderr.flush()).context("asking")?;
    let mut answer = String::new();
    stdin.lock().read_line(&mut answer).context("reading the answer")?;
    Ok(matches!(answer.trim().to_ascii_lowercase().as_str(), "y" | "yes"))
}
