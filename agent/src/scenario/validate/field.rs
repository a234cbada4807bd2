//! A place in a scenario file, and errors about it.

use std::fmt::Display;

use crate::scenario::error::{Origin, ScenarioError};

/// A place in the file, for errors.
pub(super) struct Field<'a> {
    origin: &'a Origin,
    path: String,
}

impl<'a> Field<'a> {
    /// The whole file.
    pub(super) const fn root(origin: &'a Origin) -> Self {
        Self { origin, path: String::new() }
    }

    /// The place `name` within this one.
    pub(super) fn child(&self, name: impl Display) -> Self {
        let path = if self.path.is_empty() { name.to_string() } else { format!("{}.{name}", self.path) };
        Self { origin: self.origin, path }
    }

    pub(super) fn error(&self, value: impl Display, expected: impl Display) -> ScenarioError {
        ScenarioError::Value {
            origin: self.origin.clone(),
            place: None,
            field: self.path.clone(),
            value: value.to_string(),
            expected: expected.to_string(),
        }
    }

    /// The number in the child `name`, if it is finite and `is_valid`.
    pub(super) fn number(
        &self,
        name: &str,
        value: f64,
        is_valid: bool,
        expected: &str,
    ) -> Result<f64, ScenarioError> {
        if is_valid && value.is_finite() { Ok(value) } else { Err(self.child(name).error(value, expected)) }
    }
}
