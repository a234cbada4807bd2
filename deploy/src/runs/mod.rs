//! `v2x runs`: the folders of earlier runs.

mod args;
mod folders;
mod list;
mod prune;

pub(crate) use args::RunsArgs;

use args::RunsCommand;

/// Lists runs, or deletes old ones.
pub(crate) fn run(args: &RunsArgs) -> anyhow::Result<()> {
    match &args.command {
        None => list::list(&args.folder, args.json),
        Some(RunsCommand::Prune(prune_args)) => prune::prune(&args.folder, prune_args),
    }
}
