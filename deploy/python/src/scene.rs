//! Scenes with ground truth.

use crate::records::{self, Records};
use crate::values::value_error;
use pyo3::prelude::*;
use pyo3::types::PyByteArray;
use std::sync::Arc;
use v2x_agent::ObjectId;
use v2x_common::detection::{MAX_COORDINATE_M, MAX_SIZE_M, MIN_SIZE_M};
use v2x_common::geometry::{BevBox, wrap_angle};
use v2x_common::time::Span;
use v2x_lab::protocol::{self, Keyframe, TrueBox};

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
    let scenes = py.detach(|| protocol::scenes(source, &of_nuscenes.0, &of_nuscenes.1)).map_err(value_error)?;
    let scenes = if quick { protocol::quick(scenes) } else { scenes };
    Ok(scenes.into_iter().map(|scene| Scene(Arc::new(scene))).collect())
}

#[pymethods]
impl Scene {
    /// A scene of records of `v2x.lab.KEYFRAME` and `v2x.lab.TRUTH`.
    #[new]
    fn new(name: String, keyframes: &[u8], truth: &[u8]) -> PyResult<Self> {
        let mut scene: Vec<Keyframe> = Vec::new();
        for (frame, (at, ego)) in records::keyframes(keyframes)?.into_iter().enumerate() {
            let is_later = scene.last().is_none_or(|last| at > last.at);
            if !(is_later && at >= Span::ZERO) {
                let words = format_args!("keyframe {frame} is at {} ns: times begin at 0 and increase", at.as_nanos());
                return Err(value_error(words));
            }
            if ![ego.x, ego.y, ego.yaw].iter().all(|value| value.abs() <= MAX_COORDINATE_M) {
                return Err(value_error(format_args!("the pose of keyframe {frame} is {ego:?}")));
            }
            scene.push(Keyframe { at, ego, objects: Vec::new() });
        }
        for (index, (frame, id, class, bev)) in records::truth(truth)?.into_iter().enumerate() {
            let wrong = |words: String| value_error(format_args!("true box {index}: {words}"));
            let keyframe = usize::try_from(frame).ok().and_then(|frame| scene.get_mut(frame));
            let keyframe = keyframe.ok_or_else(|| wrong(format!("frame is {frame}, which there is not")))?;
            let id = u32::try_from(id).ok().filter(|id| *id < 1 << 24);
            let id = id.ok_or_else(|| wrong("id is no number from 0 to 2^24".to_owned()))?;
            if keyframe.objects.iter().any(|other| other.id.0 == id) {
                return Err(wrong(format!("id {id} is twice in keyframe {frame}")));
            }
            check(&bev).map_err(wrong)?;
            let bev = BevBox { yaw: wrap_angle(bev.yaw), ..bev };
            keyframe.objects.push(TrueBox { id: ObjectId(id), class, bev });
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

fn check(bev: &BevBox) -> Result<(), String> {
    let fields = [("x", bev.x, MAX_COORDINATE_M), ("y", bev.y, MAX_COORDINATE_M), ("yaw", bev.yaw, 1e3)];
    if let Some((field, value, limit)) = fields.into_iter().find(|(_, value, limit)| !(value.abs() <= *limit)) {
        return Err(format!("{field} is {value}, expected at most {limit}"));
    }
    match [("w", bev.w), ("d", bev.d)].into_iter().find(|(_, size)| !(MIN_SIZE_M..=MAX_SIZE_M).contains(size)) {
        Some((field, value)) => Err(format!("{field} is {value}, expected {MIN_SIZE_M} to {MAX_SIZE_M} m")),
        None => Ok(()),
    }
}
