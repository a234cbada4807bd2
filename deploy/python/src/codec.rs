//! Payloads of the compact format as JSON of the network, and back.

use crate::values::value_error;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use v2x_common::class::Class;
use v2x_common::id::AgentId;
use v2x_common::wire;
use v2x_common::wire::json::ReportDefaults;

/// JSON, and the time that it has only microseconds of: ns since 1970.
type Timed<'py> = (Bound<'py, PyBytes>, i64);

/// A detection frame of the compact format as JSON, and its capture time.
#[pyfunction]
pub(crate) fn decode_detections<'py>(py: Python<'py>, payload: &[u8]) -> PyResult<Timed<'py>> {
    let frame = wire::detections::decode(payload).map_err(value_error)?;
    let json = wire::json::encode_detections(&frame).map_err(value_error)?;
    Ok((PyBytes::new(py, &json), frame.captured_at.as_nanos()))
}

/// A fused frame of the compact format as JSON, and its time.
#[pyfunction]
pub(crate) fn decode_fused<'py>(py: Python<'py>, payload: &[u8]) -> PyResult<Timed<'py>> {
    let frame = wire::fused::decode(payload).map_err(value_error)?;
    let json = wire::json::encode_fused(&frame).map_err(value_error)?;
    Ok((PyBytes::new(py, &json), frame.fused_at.as_nanos()))
}

/// A sensor description of the compact format as JSON.
#[pyfunction]
pub(crate) fn decode_sensor<'py>(py: Python<'py>, payload: &[u8]) -> PyResult<Bound<'py, PyBytes>> {
    let description = wire::sensor::decode(payload).map_err(value_error)?;
    let json = wire::json::encode_sensor(&description).map_err(value_error)?;
    Ok(PyBytes::new(py, &json))
}

/// A detection frame of JSON in the compact format; `agent` stands in where it names none.
#[pyfunction]
pub(crate) fn encode_detections<'py>(
    py: Python<'py>,
    json: &[u8],
    agent: &str,
) -> PyResult<Bound<'py, PyBytes>> {
    let agent = AgentId::new(agent).map_err(value_error)?;
    let decoded =
        wire::json::decode_detections(json, agent, &ReportDefaults::default()).map_err(value_error)?;
    let mut bytes = Vec::new();
    wire::detections::encode(&decoded.frame, &mut bytes).map_err(value_error)?;
    Ok(PyBytes::new(py, &bytes))
}

/// The code of a class by its nuScenes name or a common one; `None` of an unknown one.
#[pyfunction]
pub(crate) fn class_code(name: &str) -> Option<u8> {
    Class::from_name(name).map(|class| class as u8)
}
