//! Parameters of which no world can be made.

use std::fmt;

/// A parameter of a world that is outside of its limits.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{field} is {value}, expected {expected}")]
pub struct InvalidParameter {
    /// The field's name.
    pub field: &'static str,
    /// The value found.
    pub value: String,
    /// The allowed values.
    pub expected: String,
}

impl InvalidParameter {
    /// A share of the places for vehicles.
    pub(super) fn check_share(field: &'static str, share: f64) -> Result<(), Self> {
        let expected = "0 to 1 (share of the places that are taken)";
        Self::check(field, &share, (0.0..=1.0).contains(&share), expected)
    }

    /// A number of objects for which there is room.
    pub(super) fn check_count(field: &'static str, count: u32, limit: u32) -> Result<(), Self> {
        Self::check(field, &count, count <= limit, &format!("at most {limit}"))
    }

    pub(super) fn check(
        field: &'static str,
        value: &dyn fmt::Display,
        is_valid: bool,
        expected: &str,
    ) -> Result<(), Self> {
        if is_valid {
            Ok(())
        } else {
            Err(Self { field, value: format!("{value}"), expected: expected.to_owned() })
        }
    }
}
