//! The scenarios that are swept where none is named.

/// A roadside unit in time, and a car whose link is what is varied.
pub(crate) const DEFAULT_SCENARIO: &str = include_str!("../../../../../deploy/scenarios/latency.toml");

/// For as many agents as one likes.
pub(crate) const TEN_AGENTS: &str = include_str!("../../../../../deploy/scenarios/ten-agents.toml");
