//! The scenarios that are shipped with the program, and those of the user.

use anyhow::{Context, bail};
use std::path::Path;
use v2x_agent::scenario::Scenario;
use v2x_fusion_hub::hub::HubSettings;

/// Name and text of each shipped scenario.
pub(crate) const SHIPPED: [(&str, &str); 4] = [
    ("crossing", include_str!("../scenarios/crossing.toml")),
    ("ten-agents", include_str!("../scenarios/ten-agents.toml")),
    ("highway", include_str!("../scenarios/highway.toml")),
    ("latency", include_str!("../scenarios/latency.toml")),
];

/// A scenario whose tables were all checked, with its text, which the processes of a run read again.
#[derive(Debug)]
pub(crate) struct Chosen {
    pub(crate) text: String,
    pub(crate) scenario: Scenario,
}

/// The scenario of a file, or a shipped one by name. The hub's settings are checked with it.
pub(crate) fn choose(name_or_file: &str) -> anyhow::Result<Chosen> {
    let shipped = SHIPPED.iter().find(|(name, _)| *name == name_or_file);
    let (text, scenario) = match shipped {
        Some((name, text)) => {
            ((*text).to_owned(), Scenario::from_toml(text).with_context(|| format!("scenario {name}"))?)
        }
        None => from_file(Path::new(name_or_file))?,
    };
    HubSettings::from_table(scenario.hub.clone()).with_context(|| format!("scenario {name_or_file}"))?;
    Ok(Chosen { text, scenario })
}

fn from_file(path: &Path) -> anyhow::Result<(String, Scenario)> {
    if !path.exists() {
        let names: Vec<_> = SHIPPED.iter().map(|(name, _)| *name).collect();
        bail!("no scenario file {}; shipped scenarios are {}", path.display(), names.join(", "));
    }
    let scenario = Scenario::load(path)?;
    let text = std::fs::read_to_string(path).with_context(|| format!("reading {}", path.display()))?;
    Ok((text, scenario))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shipped_scenario_is_valid() {
        for (name, _) in SHIPPED {
            let chosen = choose(name).unwrap();
            assert_eq!(chosen.scenario.name, name);
        }
    }

    #[test]
    fn a_missing_file_is_named_with_the_shipped_scenarios() {
        let message = format!("{:#}", choose("no-such.toml").unwrap_err());
        assert!(message.contains("no-such.toml") && message.contains("crossing"), "{message}");
    }
}
