//! Scenes with ground truth.

use crate::records::{self, ArrayError, RecordError, Records};
use crate::values::value_error;
use pyo3::prelude::*;
use pyo3::types::PyByteArray;
use std::sync::Arc;
use v2x_agent::ObjectId;
use v2x_common::class::Class;
use v2x_common::detection::{MAX_COORDINATE_M, MAX_SIZE_M, MIN_SIZE_M};
use v2x_common::geometry::{BevBox, wrap_angle};
use v2x_common::time::Span;
use v2x_lab::protocol::{self, Keyframe, TrueBox};

/// Numbers of objects are below this: memory goes by the largest.
const MAX_OBJECTS: u32 = 1 << 24;

/// A scene: keyframes with true boxes.
#[pyclass(frozen, module = "v2x._v2x")]
pub(crate) struct Scene(pub(crate) Arc<protocol::Scene>);

/// The scenes of a data set, named as for `lab --dataset`.
#[pyfunction]
pub(crate) fn scenes(
    py: Python<'_>,
    source: &str,
    of_nuscenes: (String, String),
    quick: bool,
) -> PyResult<Vec<Scene>> {
    let scenes =
        py.detach(|| protocol::scenes(source, &of_nuscenes.0, &of_nuscenes.1)).map_err(value_error)?;
    let scenes = if quick { protocol::quick(scenes) } else { scenes };
    Ok(scenes.into_iter().map(|scene| Scene(Arc::new(scene))).collect())
}

#[pymethods]
impl Scene {
    /// A scene of records of `v2x.lab.KEYFRAME` and `v2x.lab.TRUTH`.
    #[new]
    fn new(name: String, keyframes: &[u8], truth: &[u8]) -> PyResult<Self> {
        let mut scene: Vec<Keyframe> = Vec::new();
        for (frame, (at, ego)) in records::keyframes(keyframes).map_err(value_error)?.into_iter().enumerate()
        {
            let is_later = scene.last().is_none_or(|last| at > last.at);
            if !(is_later && at >= Span::ZERO) {
                let words = format_args!(
                    "keyframe {frame} is at {} ns: times begin at 0 and increase",
                    at.as_nanos()
                );
                return Err(value_error(words));
            }
            if ![ego.x, ego.y, ego.yaw].iter().all(|value| value.abs() <= MAX_COORDINATE_M) {
                return Err(value_error(format_args!("the pose of keyframe {frame} is {ego:?}")));
            }
            scene.push(Keyframe { at, ego, objects: Vec::new() });
        }
        for (index, one) in records::truth(truth).map_err(value_error)?.into_iter().enumerate() {
            let wrong = |error| value_error(ArrayError::Record { what: "true box", index, error });
            add(&mut scene, one).map_err(wrong)?;
        }
        Ok(Self(Arc::new(protocol::Scene::new(name, scene))))
    }

    /// Its name, by which the noise is keyed.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// Number of keyframes.
    fn __len__(&self) -> usize {
        self.0.keyframes.len()
    }

    /// Records of `v2x.lab.KEYFRAME`.
    fn keyframes<'py>(&self, py: Python<'py>) -> Bound<'py, PyByteArray> {
        let mut records = Records::default();
        for Keyframe { at, ego, .. } in &self.0.keyframes {
            records.integer(at.as_nanos());
            [ego.x, ego.y, ego.yaw].into_iter().for_each(|value| records.float(value));
        }
        PyByteArray::new(py, &records.0)
    }

    /// Records of `v2x.lab.TRUTH`.
    fn truth<'py>(&self, py: Python<'py>) -> Bound<'py, PyByteArray> {
        let mut records = Records::default();
        for (frame, keyframe) in (0..).zip(&self.0.keyframes) {
            for TrueBox { id, class, bev } in &keyframe.objects {
                records.integer(frame);
                records.integer(id.0.into());
                records.class(*class, 0);
                records.bev(bev);
            }
        }
        PyByteArray::new(py, &records.0)
    }
}

/// Adds a true box to its keyframe.
fn add(
    scene: &mut [Keyframe],
    (frame, id, class, bev): (i64, i64, Class, BevBox),
) -> Result<(), RecordError> {
    let wrong = |field, code, expected| RecordError::Code { field, code, expected };
    let keyframe = usize::try_from(frame).ok().and_then(|place| scene.get_mut(place));
    let keyframe = keyframe.ok_or(wrong("frame", frame, "the place of a keyframe"))?;
    let number = u32::try_from(id).ok().filter(|id| *id < MAX_OBJECTS);
    let number = number.ok_or(wrong("id", id, "0 to 16777215"))?;
    if keyframe.objects.iter().any(|other| other.id.0 == number) {
        return Err(wrong("id", id, "an object that this keyframe does not have yet"));
    }
    check(&bev)?;
    keyframe.objects.push(TrueBox {
        id: ObjectId(number),
        class,
        bev: BevBox { yaw: wrap_angle(bev.yaw), ..bev },
    });
    Ok(())
}

fn check(bev: &BevBox) -> Result<(), RecordError> {
    let sizes = MIN_SIZE_M..=MAX_SIZE_M;
    let checks = [
        ("x", bev.x, bev.x.abs() <= MAX_COORDINATE_M, "at most 1e8 m"),
        ("y", bev.y, bev.y.abs() <= MAX_COORDINATE_M, "at most 1e8 m"),
        ("yaw", bev.yaw, bev.yaw.is_finite(), "a number"),
        ("w", bev.w, sizes.contains(&bev.w), "0.001 to 65 m"),
        ("d", bev.d, sizes.contains(&bev.d), "0.001 to 65 m"),
    ];
    match checks.into_iter().find(|(_, _, is_valid, _)| !is_valid) {
        Some((field, value, _, expected)) => Err(RecordError::Number { field, value, expected }),
        None => Ok(()),
    }
}
