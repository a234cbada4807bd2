//! Reads the file, prints the summary, writes the picture.

use super::WorldArgs;
use super::summary::Summary;
use crate::output;
use crate::recorded;
use anyhow::{Context, bail};
use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;
use v2x_agent::scenario::Scenario;
use v2x_agent::trajectories::Traffic;
use v2x_agent::world::{Road, traffic_roads};
use v2x_lab::recorded_svg;

pub(crate) fn run(args: &WorldArgs) -> anyhow::Result<()> {
    let (traffic, roads) = world(args)?;
    let name = args.file.file_name().unwrap_or(args.file.as_os_str()).to_string_lossy();
    let summary = Summary::of(&traffic, &name);
    let picture = args.svg.clone().unwrap_or_else(|| {
        PathBuf::from(format!("{}.world.svg", recorded::stem(&args.file).unwrap_or_default()))
    });
    std::fs::write(&picture, recorded_svg(&traffic, &roads, &name))
        .with_context(|| format!("writing the picture {}", picture.display()))?;
    let text = if args.json {
        serde_json::to_string(&summary)? + "\n"
    } else {
        summary.text(if args.all { usize::MAX } else { 12 })
    };
    output::print(&text)?;
    let _ = writeln!(std::io::stderr(), "picture: {}", picture.display());
    Ok(())
}

/// The traffic of a file, or that of a scenario with its roads.
fn world(args: &WorldArgs) -> anyhow::Result<(Arc<Traffic>, Vec<Road>)> {
    let path = &args.file;
    if path.extension().is_some_and(|suffix| suffix == "toml") {
        if let Some(option) = args.of.given() {
            bail!(
                "{option} is for a file of recorded traffic; of a scenario, {} says it itself",
                path.display()
            );
        }
        let scenario = Scenario::load(path)?;
        scenario.check_known("v2x world")?;
        let Some(world) = scenario.world.recorded() else {
            bail!("the world of {} is not recorded traffic (kind = \"trajectories\")", path.display());
        };
        return Ok((Arc::clone(&world.traffic), world.roads.clone()));
    }
    let (traffic, _) = args.of.open(path)?;
    let roads = traffic_roads(&traffic);
    Ok((Arc::new(traffic), roads))
}
