//! Commands whose standard output has no reader: as in `v2x status | head -1`, this is no error.

use crate::support::{Ending, TIMEOUT, folder, up};
use anyhow::Context;
use std::path::Path;
use std::process::Stdio;
use tokio::process::Command;

/// Runs `v2x` with a standard output that has been closed before it starts to print.
async fn run_without_reader(folder: &Path, args: &[&str]) -> anyhow::Result<Ending> {
    let mut process = Command::new(env!("CARGO_BIN_EXE_v2x"))
        .args(args)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .kill_on_drop(true)
        .spawn()
        .context("starting v2x")?;
    drop(process.stdout.take());
    let output =
        tokio::time::timeout(TIMEOUT, process.wait_with_output()).await.context("it does not end")??;
    let stderr = String::from_utf8(output.stderr)?;
    Ok(Ending { code: output.status.code(), stdout: String::new(), stderr })
}

fn assert_ends_quietly(args: &[&str], ending: &Ending) {
    assert_eq!(ending.code, Some(0), "{args:?}: {ending:#?}");
    let complaints = ["Broken pipe", "panicked", "v2x: "];
    assert!(complaints.iter().all(|words| !ending.stderr.contains(words)), "{args:?}: {ending:#?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn commands_without_a_network_end_quietly() -> anyhow::Result<()> {
    let folder = folder("closed-output")?;
    for args in [["links", "lte-uu"].as_slice(), &["links", "lte-uu", "--json"], &["--help"], &["--version"]]
    {
        assert_ends_quietly(args, &run_without_reader(&folder, args).await?);
    }
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn status_and_watch_of_a_network_end_quietly() -> anyhow::Result<()> {
    let folder = folder("closed-output-network")?;
    let (_up, endpoint) = up(&folder, "closed-output").await?;
    for command in [["status"].as_slice(), &["watch"], &["watch", "--json"]] {
        let args = [command, &["--network", "closed-output", "--connect", &endpoint]].concat();
        assert_ends_quietly(&args, &run_without_reader(&folder, &args).await?);
    }
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn the_demos_exit_code_is_its_verdict_also_then() -> anyhow::Result<()> {
    let folder = folder("closed-output-demo")?;
    let args = ["demo", "--duration", "6s", "--json", "--out", "run"];
    assert_ends_quietly(&args, &run_without_reader(&folder, &args).await?);
    Ok(())
}
