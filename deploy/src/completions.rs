//! `v2x completions` and `v2x man`: what a shell and a reader of manuals expect of a program.

use crate::output;
use anyhow::Context;
use clap::Command;
use std::path::PathBuf;

/// Print the completions of a shell
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x completions bash > ~/.local/share/bash-completion/completions/v2x
  v2x completions zsh > ~/.zfunc/_v2x
  v2x completions fish > ~/.config/fish/completions/v2x.fish")]
pub(crate) struct CompletionsArgs {
    /// The shell
    shell: clap_complete::Shell,
}

/// Write the manual: one page for v2x, and one for each command
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x man ~/.local/share/man/man1   then: man v2x, man v2x-watch")]
pub(crate) struct ManArgs {
    /// The folder for the pages; it is made where it is missing
    folder: PathBuf,
}

/// Prints the completions.
pub(crate) fn completions(args: &CompletionsArgs, mut command: Command) -> anyhow::Result<()> {
    let mut script = Vec::new();
    let name = command.get_name().to_owned();
    clap_complete::generate(args.shell, &mut command, name, &mut script);
    output::print(&String::from_utf8(script).context("completions that are no text")?)?;
    Ok(())
}

/// Writes the pages.
pub(crate) fn man(args: &ManArgs, command: Command) -> anyhow::Result<()> {
    let folder = &args.folder;
    std::fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
    clap_mangen::generate_to(command, folder)
        .with_context(|| format!("writing the manual into {}", folder.display()))?;
    output::print(&format!("the manual is in {}\n", folder.display()))?;
    Ok(())
}
