//! Recorded traffic that a command is given by its file.

use anyhow::{Context, bail};
use std::path::{Path, PathBuf};
use v2x_agent::scenario::{maker_in_words, open_traffic, open_vehicle_types};
use v2x_agent::trajectories::{ReadOptions, Traffic};
use v2x_common::duration::parse_signed_seconds;
use v2x_common::shipped;

/// The name of a file without its suffix, or that of a folder, for what is made of it.
pub(crate) fn stem(path: &Path) -> Option<String> {
    let name = if path.is_dir() { path.file_name() } else { path.file_stem() };
    name.map(|name| name.to_string_lossy().into_owned())
}

/// Which part of a file, and what else is needed to read it.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct TrafficArgs {
    /// Begin so long after the file's earliest time, such as 12s or 2min; a plain number is seconds
    #[arg(long, value_name = "DURATION", allow_negative_numbers = true, value_parser = parse_signed_seconds)]
    from: Option<f64>,
    /// End so long after the file's earliest time; a plain number is seconds
    #[arg(long, value_name = "DURATION", value_parser = parse_signed_seconds)]
    to: Option<f64>,
    /// The scene, of a file with several [default: the first]
    #[arg(long, value_name = "NAME")]
    scene: Option<String>,
    /// A file with SUMO's vehicle types (its elements vType): sizes and classes by type
    #[arg(long, value_name = "FILE")]
    pub(crate) vtypes: Option<PathBuf>,
}

impl TrafficArgs {
    /// The first of these options that is given.
    pub(crate) fn given(&self) -> Option<&'static str> {
        let Self { from, to, scene, vtypes } = self;
        let all = [
            ("--from", from.is_some()),
            ("--to", to.is_some()),
            ("--scene", scene.is_some()),
            ("--vtypes", vtypes.is_some()),
        ];
        all.into_iter().find(|(_, is_given)| *is_given).map(|(option, _)| option)
    }

    /// The traffic of a file, and how it was read.
    pub(crate) fn open(&self, file: &Path) -> anyhow::Result<(Traffic, ReadOptions)> {
        let mut options = ReadOptions {
            from_s: self.from,
            to_s: self.to,
            scene: self.scene.clone(),
            ..ReadOptions::default()
        };
        if let Some(vtypes) = &self.vtypes {
            check_readable(vtypes)?;
            let types = open_vehicle_types(vtypes);
            options.vehicle_types = types.with_context(|| vtypes.display().to_string())?;
        }
        check_readable(file)?;
        let traffic = open_traffic(file, &options).with_context(|| file.display().to_string())?;
        Ok((traffic, options))
    }
}

fn check_readable(file: &Path) -> anyhow::Result<()> {
    if !file.exists() && shipped::SHIPPED.iter().any(|(name, _)| Path::new(name) == file) {
        let name = file.display();
        bail!(
            "{name} is a shipped scenario: its world is simulated, and no recorded traffic; `v2x up {name} --web` shows it"
        );
    }
    let maker = || maker_in_words(file);
    std::fs::metadata(file).map(|_| ()).with_context(|| format!("reading {}{}", file.display(), maker()))
}
