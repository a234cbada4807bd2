//! The `[hub]` table as Python gives it.

use crate::values::value_error;
use pyo3::prelude::*;
use v2x_fusion_hub::HubSettings;

/// The settings of a table, as TOML or as JSON of a dict: a `[hub]` table, or a file that has one. `method` is over it.
pub(crate) fn settings(config: Option<(&str, bool)>, method: Option<&str>) -> PyResult<HubSettings> {
    let mut table: toml::Table = match config {
        None => toml::Table::new(),
        Some((json, true)) => serde_json::from_str(json).map_err(value_error)?,
        Some((text, false)) => text.parse().map_err(value_error)?,
    };
    if let Some(hub) = table.remove("hub") {
        table = match hub {
            toml::Value::Table(hub) => hub,
            _ => return Err(value_error("hub is no table")),
        };
    }
    if let Some(method) = method {
        table.insert("method".to_owned(), method.into());
    }
    HubSettings::from_table(table).map_err(value_error)
}
