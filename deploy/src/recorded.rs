//! Recorded traffic that a command is given by its file.

use anyhow::Context;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use v2x_agent::trajectories::{ReadOptions, Traffic, TrafficError, read, read_vehicle_types};

/// The traffic of a file; with a file of SUMO's vehicle types, these are put into the options.
pub(crate) fn open(file: &Path, vtypes: Option<&Path>, options: &mut ReadOptions) -> anyhow::Result<Traffic> {
    if let Some(vtypes) = vtypes {
        options.vehicle_types = parse(vtypes, read_vehicle_types)?;
    }
    parse(file, |text| read(text, options))
}

fn parse<T>(
    file: &Path,
    parse: impl FnOnce(BufReader<File>) -> Result<T, TrafficError>,
) -> anyhow::Result<T> {
    let text = File::open(file).with_context(|| format!("reading {}", file.display()))?;
    parse(BufReader::with_capacity(1 << 16, text)).with_context(|| file.display().to_string())
}
