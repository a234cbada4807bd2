//! The compiled part of the Python package `v2x`: what Python calls, in terms of bytes, numbers and tuples. The package's own
//! files (`python/v2x`) give it its shape, its types and its words.

mod codec;
mod engine;
mod records;
mod scene;
mod settings;
mod study;
mod values;

use pyo3::prelude::*;
use v2x_common::class::Class;
use v2x_common::schemas;
use v2x_fusion_hub::fusion::PRESETS;
use v2x_lab::protocol::Method;

/// The compiled part of `v2x`.
#[pymodule]
mod _v2x {
    use super::{Bound, PyModule, PyResult, constants};

    #[pymodule_export]
    use super::codec::{class_code, decode_detections, decode_fused, decode_sensor, encode_detections};
    #[pymodule_export]
    use super::engine::Engine;
    #[pymodule_export]
    use super::scene::{Scene, scenes};
    #[pymodule_export]
    use super::study::{Score, Study};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        constants(module)
    }
}

/// What is known without a call: classes by code, the presets of fusion, the JSON schemas, and the methods of the tables.
fn constants(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("CLASSES", Class::ALL.map(Class::name).to_vec())?;
    module.add("METHODS", PRESETS.iter().map(|preset| preset.key).collect::<Vec<_>>())?;
    module.add("TABLE_METHODS", Method::ALL.iter().map(|method| method.key()).collect::<Vec<_>>())?;
    module.add(
        "SCHEMAS",
        [schemas::DETECTION_FRAME, schemas::SENSOR_DESCRIPTION, schemas::FUSED_FRAME, schemas::DELTA_FRAME],
    )
}
