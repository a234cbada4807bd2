//! The paper's protocol: noisy detections of scenes, and scores.

use crate::records::{self, Records, det_id};
use crate::scene::Scene;
use crate::values::{named, value_error};
use pyo3::prelude::*;
use pyo3::types::PyByteArray;
use std::collections::BTreeMap;
use v2x_common::detection::Detection;
use v2x_lab::protocol::{self, Contender, Counting, Method, MethodOutput, OutputBox, Provenance, Subset};

/// What an agent reports: pose (x, y, yaw), detections, and their ids.
type Report<'py> = ((f64, f64, f64), Bound<'py, PyByteArray>, Vec<i64>);

/// The boxes of all keyframes of a scene: whether they name detections, how many each keyframe has, and the records.
type Output = (bool, Vec<usize>, Vec<u8>);

/// Scenes under one setting of noise.
#[pyclass(frozen, module = "v2x._v2x")]
pub(crate) struct Study(protocol::Study);

/// The score of a method.
#[pyclass(frozen, module = "v2x._v2x")]
pub(crate) struct Score(protocol::Score);

#[pymethods]
impl Study {
    #[new]
    fn new(
        scenes: Vec<PyRef<'_, Scene>>,
        setting: (String, String, String),
        trials: u32,
        seed: u64,
    ) -> PyResult<Self> {
        let (noise, shape, conditions) = setting;
        Ok(Self(protocol::Study {
            scenes: scenes.iter().map(|scene| scene.0.as_ref().clone()).collect(),
            noise: named("noise", &noise)?,
            shape: named("shape", &shape)?,
            conditions: named("conditions", &conditions)?,
            trials,
            seed,
        }))
    }

    /// What both agents report of every keyframe of a scene.
    fn reports<'py>(&self, py: Python<'py>, scene: usize, trial: u32) -> PyResult<Vec<[Report<'py>; 2]>> {
        let scene = self.scene(scene)?;
        let reports = py.detach(|| self.0.reports(scene, trial));
        let report = |(frame, report): (usize, &protocol::AgentReport)| {
            let ids = (0..report.detections.len()).map(|index| det_id(frame, index)).collect();
            let pose = (report.pose.x, report.pose.y, report.pose.yaw);
            (pose, PyByteArray::new(py, &records_of(&report.detections).0), ids)
        };
        let both = |(frame, [one, two]): (usize, &[protocol::AgentReport; 2])| {
            [report((frame, one)), report((frame, two))]
        };
        Ok(reports.iter().enumerate().map(both).collect())
    }

    /// The score of a row of the tables.
    fn score_method(&self, py: Python<'_>, key: &str, threads: usize) -> PyResult<Score> {
        let method = Method::ALL.iter().find(|method| method.key() == key).ok_or_else(|| {
            let known = Method::ALL.iter().map(|method| method.key()).collect::<Vec<_>>().join(", ");
            value_error(format_args!("method is {key:?}, expected one of {known}"))
        })?;
        let score = py.detach(|| self.0.score(Contender::Method(*method), threads));
        score.map(Score).map_err(value_error)
    }

    /// The score of what a method made of all scenes (inner list) in all trials.
    fn score_output(&self, py: Python<'_>, outputs: Vec<Vec<Output>>, threads: usize) -> PyResult<Score> {
        let mut made = BTreeMap::new();
        for (trial, outputs) in (0..).zip(&outputs) {
            for (scene, output) in outputs.iter().enumerate() {
                made.insert((trial, scene), method_output(output)?);
            }
        }
        let score = py.detach(|| {
            let mut recorded = self.0.output();
            for ((trial, scene), made) in &made {
                let scene = self.scene(*scene)?;
                self.0.add(&mut recorded, (scene, *trial), made).map_err(|error| {
                    value_error(format_args!("scene {}, trial {trial}: {error}", scene.name))
                })?;
            }
            self.0.score_output(recorded, threads).map_err(value_error)
        });
        score.map(Score)
    }
}

impl Study {
    fn scene(&self, scene: usize) -> PyResult<&protocol::Scene> {
        let n = self.0.scenes.len();
        self.0.scenes.get(scene).ok_or_else(|| value_error(format_args!("scene {scene} of {n}")))
    }
}

#[pymethods]
impl Score {
    /// Every number of a row of the tables by its name.
    fn metrics(&self, counting: &str, subset: &str) -> PyResult<Vec<(&'static str, Option<f64>)>> {
        let counting: Counting = named("counting", counting)?;
        let subset: Subset = named("subset", subset)?;
        Ok(self.0.metrics(counting, subset).named().collect())
    }
}

fn records_of(detections: &[Detection]) -> Records {
    let mut records = Records::default();
    detections.iter().for_each(|detection| records.detection(detection));
    records
}

fn method_output((names_detections, counts, bytes): &Output) -> PyResult<MethodOutput> {
    let boxes = records::boxes(bytes).map_err(value_error)?;
    if counts.iter().sum::<usize>() != boxes.len() {
        return Err(value_error("the keyframes have another number of boxes than there are"));
    }
    let mut rest: &[OutputBox] = &boxes;
    let by_keyframe = counts.iter().map(|count| {
        let (boxes, others) = rest.split_at(*count);
        rest = others;
        boxes.to_vec()
    });
    let by_keyframe = by_keyframe.collect();
    let provenance = if *names_detections { Provenance::Detections } else { Provenance::Position };
    Ok(MethodOutput { provenance, by_keyframe })
}
