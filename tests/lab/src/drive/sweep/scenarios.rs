//! The default scenarios of sweeps.

/// A roadside unit without delay, and a car with a varied link.
pub(crate) const DEFAULT_SCENARIO: &str = include_str!("../../../../../deploy/scenarios/latency.toml");

/// Ten agents.
pub(crate) const TEN_AGENTS: &str = include_str!("../../../../../deploy/scenarios/ten-agents.toml");
