//! Scenario files: world, agents and links of a simulation, as TOML with units in the field names.
//!
//! `toml_file` is what a file can say, [`Scenario`] what it means, `validate` leads from one to the other.

mod config;
mod edit;
mod error;
mod files;
mod load;
mod place;
mod toml_file;
mod validate;

pub use config::{AgentConfig, Scenario, ScenarioFile, Sumo, UnknownWorld};
pub use edit::{EditError, NoSuchWorld, Rider, WorldSource, recorded_world, with_world, without_riders};
pub use error::{Origin, ScenarioError};
pub use files::{
    Files, folder_of_tables, maker_in_words, open_traffic, open_vehicle_types, table_in, with_paths,
};

#[cfg(test)]
mod recorded_tests;
#[cfg(test)]
mod tests;
