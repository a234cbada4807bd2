//! What shells and readers of manuals are given names every command.

use crate::support::{folder, run};
use anyhow::{Context, ensure};
use std::path::Path;

/// The commands that `v2x --help` lists.
async fn commands(folder: &Path) -> anyhow::Result<Vec<String>> {
    let help = run(folder, &["--help"]).await?.stdout;
    let (_, list) = help.split_once("Commands:\n").context("no list of commands")?;
    let lines = list.lines().take_while(|line| !line.trim().is_empty());
    // A description that takes two lines is indented further.
    let names = lines.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    let names: Vec<_> = names.filter_map(|line| line.split_whitespace().next()).map(str::to_owned).collect();
    ensure!(names.len() > 15 && names.iter().any(|name| name == "replay"), "{names:?}");
    Ok(names.into_iter().filter(|name| name != "help").collect())
}

#[tokio::test(flavor = "multi_thread")]
async fn the_completions_of_each_shell_name_every_command() -> anyhow::Result<()> {
    let folder = folder("completions")?;
    let commands = commands(&folder).await?;
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let ending = run(&folder, &["completions", shell]).await?;
        ensure!(ending.code == Some(0) && ending.stdout.lines().count() > 100, "{shell}: {}", ending.stderr);
        let words: std::collections::BTreeSet<_> =
            ending.stdout.split(|c: char| !(c.is_alphanumeric() || c == '-')).collect();
        for command in &commands {
            ensure!(words.contains(command.as_str()), "{shell} does not name {command}");
        }
    }
    let unknown = run(&folder, &["completions", "tcsh"]).await?;
    ensure!(unknown.code == Some(2) && unknown.stderr.contains("fish"), "{unknown:#?}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn the_manual_has_a_page_for_every_command() -> anyhow::Result<()> {
    let folder = folder("manual")?;
    let ending = run(&folder, &["man", "new/man1"]).await?;
    ensure!(ending.code == Some(0), "{ending:#?}");
    let page = |name: &str| {
        let path = folder.join(format!("new/man1/{name}.1"));
        std::fs::read_to_string(&path).with_context(|| format!("reading {}", path.display()))
    };
    let first = page("v2x")?;
    for command in commands(&folder).await? {
        ensure!(first.contains(&format!("v2x\\-{command}(1)")), "the first page does not name {command}");
        ensure!(page(&format!("v2x-{command}"))?.contains(".SH NAME"), "{command}");
    }
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn the_help_of_every_command_fits_into_80_columns() -> anyhow::Result<()> {
    let folder = folder("help")?;
    let mut paths: Vec<Vec<String>> = vec![vec![]];
    let mut n = 0;
    while let Some(path) = paths.pop() {
        let mut command: Vec<&str> = path.iter().map(String::as_str).collect();
        command.push("--help");
        let help = run(&folder, &command).await?.stdout;
        let wide = help.lines().find(|line| line.chars().count() > 80);
        ensure!(wide.is_none() && !help.is_empty(), "v2x {}: {wide:?}", command.join(" "));
        n += 1;
        let list = help.split_once("Commands:\n").map(|(_, list)| list).unwrap_or_default();
        let lines = list.lines().take_while(|line| !line.trim().is_empty());
        let names = lines.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
        let names = names.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help");
        paths.extend(names.map(|name| path.iter().cloned().chain([name.to_owned()]).collect()));
    }
    ensure!(n > 20, "{n} commands");
    Ok(())
}
