//! Scenario files: world, agents and links of a simulation, as TOML with units in the field names.
//!
//! `toml_file` is what a file can say, [`Scenario`] what it means, `validate` leads from one to the other.

mod config;
mod error;
mod files;
mod load;
mod place;
mod toml_file;
mod validate;

pub use config::{AgentConfig, Scenario, ScenarioFile};
pub use error::{Origin, ScenarioError};
pub use files::{Files, with_paths};

#[cfg(test)]
mod recorded_tests;
#[cfg(test)]
mod tests;
