//! Values as Python gives them.

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyFloat;
use serde::Deserialize;
use serde::de::IntoDeserializer;
use serde::de::value::{Error, StrDeserializer};
use std::fmt::Display;
use v2x_common::id::AgentId;
use v2x_common::time::Timestamp;

/// A time: a Python integer of nanoseconds since 1970.
#[derive(Clone, Copy)]
pub(crate) struct Nanos(pub(crate) Timestamp);

impl<'py> FromPyObject<'_, 'py> for Nanos {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if value.is_instance_of::<PyFloat>() {
            let words = "a time is an integer of nanoseconds since 1970, not a float, which has no room for one: take \
                         time.time_ns(), or v2x.nanoseconds(seconds)";
            return Err(PyTypeError::new_err(words));
        }
        Ok(Self(Timestamp::from_nanos(value.extract()?)))
    }
}

/// The name of an agent.
pub(crate) fn agent(name: &str) -> PyResult<AgentId> {
    AgentId::new(name).map_err(|error| value_error(format_args!("agent: {error}")))
}

/// The value of an enumeration by its name; `what` is for the error.
pub(crate) fn named<'a, T: Deserialize<'a>>(what: &str, name: &'a str) -> PyResult<T> {
    let name: StrDeserializer<'a, Error> = name.into_deserializer();
    T::deserialize(name).map_err(|error| value_error(format_args!("{what}: {error}")))
}

/// A `ValueError`.
pub(crate) fn value_error(error: impl Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}
