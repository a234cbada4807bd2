//! `v2x runs`, on folders as runs leave them.

use crate::support::{Ending, folder, run};
use std::fs;
use std::path::Path;

/// A folder of a run; `passed` where it was scored.
fn make_run(folder: &Path, name: &str, about: &str) -> anyhow::Result<()> {
    let path = folder.join("v2x-runs").join(name);
    fs::create_dir_all(path.join("logs"))?;
    fs::write(path.join("logs/hub.log"), "log")?;
    fs::write(path.join("scenario.toml"), "name = \"crossing\"")?;
    fs::write(path.join("about.json"), about)?;
    Ok(())
}

const ABOUT: &str = r#"{ "scenario": "crossing", "started": "2026-11-28T14:05:31+01:00", "version": "0.1.0", "commit": "0123456789ab" }"#;

fn lines(ending: &Ending) -> Vec<&str> {
    ending.stdout.lines().filter(|line| line.starts_with("v2x-runs/")).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn runs_are_listed_and_all_but_the_newest_pruned_and_nothing_else() -> anyhow::Result<()> {
    let folder = folder("runs")?;
    for name in
        ["2026-11-26_10-00-00-crossing", "2026-11-27_10-00-00-highway", "2026-11-28_10-00-00-crossing"]
    {
        make_run(&folder, name, ABOUT)?;
    }
    // Of somebody else.
    fs::create_dir_all(folder.join("v2x-runs/notes"))?;
    let listed = run(&folder, &["runs"]).await?;
    assert_eq!(listed.code, Some(0), "{listed:#?}");
    assert!(
        lines(&listed).len() == 3 && lines(&listed)[0].contains("2026-11-28_10-00-00-crossing"),
        "{listed:#?}"
    );
    assert!(listed.stdout.contains("0123456789ab") && listed.stdout.contains("3 runs"), "{listed:#?}");

    let asked = run(&folder, &["runs", "prune", "--keep", "1"]).await?;
    assert!(asked.code == Some(1) && asked.stderr.contains("--yes"), "{asked:#?}");
    let dry = run(&folder, &["runs", "prune", "--keep", "1", "--dry-run"]).await?;
    assert!(dry.code == Some(0) && dry.stdout.contains("would delete these 2 runs"), "{dry:#?}");
    let young = run(&folder, &["runs", "prune", "--older-than", "1h", "--yes"]).await?;
    assert!(young.code == Some(0) && young.stdout.contains("nothing to delete"), "{young:#?}");
    assert_eq!(lines(&run(&folder, &["runs"]).await?).len(), 3, "nothing was deleted so far");

    let pruned = run(&folder, &["runs", "prune", "--keep", "1", "--yes"]).await?;
    assert!(pruned.code == Some(0) && pruned.stdout.contains("deleted 2 runs"), "{pruned:#?}");
    let left = run(&folder, &["runs", "--json"]).await?;
    let left: serde_json::Value = serde_json::from_str(&left.stdout)?;
    assert_eq!(left.as_array().map(Vec::len), Some(1), "{left:#}");
    assert_eq!(left[0]["path"], "v2x-runs/2026-11-28_10-00-00-crossing");
    assert!(folder.join("v2x-runs/notes").exists());
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_run_that_goes_on_is_not_pruned() -> anyhow::Result<()> {
    let folder = folder("runs-running")?;
    make_run(&folder, "2026-11-28_10-00-00-crossing", ABOUT)?;
    let about = fs::File::open(folder.join("v2x-runs/2026-11-28_10-00-00-crossing/about.json"))?;
    about.lock()?;
    assert!(run(&folder, &["runs"]).await?.stdout.contains("running"));
    let pruned = run(&folder, &["runs", "prune", "--keep", "0", "--yes"]).await?;
    assert!(pruned.stdout.contains("nothing to delete"), "{pruned:#?}");
    about.unlock()?;
    let pruned = run(&folder, &["runs", "prune", "--keep", "0", "--yes"]).await?;
    assert!(pruned.stdout.contains("deleted 1 runs"), "{pruned:#?}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn no_runs_are_no_error_and_prune_needs_to_know_which() -> anyhow::Result<()> {
    let folder = folder("runs-none")?;
    let listed = run(&folder, &["runs"]).await?;
    assert!(listed.code == Some(0) && listed.stdout.contains("no runs in v2x-runs"), "{listed:#?}");
    let pruned = run(&folder, &["runs", "prune"]).await?;
    assert!(pruned.code == Some(2) && pruned.stderr.contains("--keep"), "{pruned:#?}");
    let version = run(&folder, &["--version"]).await?;
    assert!(version.stdout.contains("(commit "), "{version:#?}");
    Ok(())
}
