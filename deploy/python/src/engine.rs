//! The engine behind the payloads of the network.

use crate::records::{self, Records};
use crate::settings::settings;
use crate::values::{Nanos, agent, value_error};
use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyBytes};
use serde::Deserialize;
use serde_json::{Map, Value, json};
use std::sync::{Mutex, PoisonError};
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::FusedFrame;
use v2x_common::geometry::Pose;
use v2x_common::id::{AgentId, FrameId, MapFrame};
use v2x_common::wire::journal::Body;
use v2x_common::wire::{self, WireError};
use v2x_fusion_hub::engine::AgentStatistics;
use v2x_fusion_hub::hub::{Core, Handled};
use v2x_fusion_hub::{Engine as HubEngine, Refusal};

/// Bytes of a record of `v2x.OBJECT`.
const OBJECT_BYTES: usize = 264;

/// What became of a frame: whether it was accepted, whether it came after newer ones, and of a refused one the reason, the
/// words, and whether the payload itself is wrong.
type Outcome = (bool, bool, Option<&'static str>, Option<String>, bool);

/// The head of a frame: agent, capture time, epoch, sequence, pose (x, y, yaw), map frame, revision of the description.
type Head = (String, Nanos, u64, Option<u64>, Option<(f64, f64, f64)>, Option<String>, u32);

/// The core of a hub.
#[pyclass(frozen, module = "v2x._v2x")]
pub(crate) struct Engine(Mutex<Core>);

impl Engine {
    /// Does something with the core, without the interpreter: other threads of Python run meanwhile.
    fn with<T: Send>(&self, py: Python<'_>, act: impl FnOnce(&mut Core) -> T + Send) -> T {
        // After a panic the counts are off by one frame at worst.
        py.detach(|| act(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner)))
    }
}

#[pymethods]
impl Engine {
    #[new]
    #[pyo3(signature = (toml, json, method, lineage))]
    fn new(toml: Option<&str>, json: Option<&str>, method: Option<&str>, lineage: u32) -> PyResult<Self> {
        let config = json.map(|text| (text, true)).or(toml.map(|text| (text, false)));
        let mut settings = settings(config, method)?;
        settings.engine.lineage = lineage;
        // Nobody asks it for findings.
        Ok(Self(Mutex::new(Core::new(settings, HubEngine::new).unsurveyed())))
    }

    /// Takes in a payload of the network; the agent is that of the key, or else of the payload.
    fn handle_payload(
        &self,
        py: Python<'_>,
        payload: &[u8],
        now: Nanos,
        key: (String, Option<String>),
    ) -> PyResult<Outcome> {
        let (encoding, sender) = &key;
        let body = Body::of(encoding, payload);
        let sender = match sender {
            Some(name) => agent(name)?,
            None => match sender_of(&body) {
                Ok(Some(agent)) => agent,
                Ok(None) => return Err(value_error("the frame names no agent: name it, agent=…")),
                Err(error) => return Ok(outcome(Handled::Refused(error.into()))),
            },
        };
        Ok(outcome(self.with(py, |core| core.handle_frame(sender, now.0, &body))))
    }

    /// Takes in the records of `v2x.DETECTION`.
    fn handle_records(&self, py: Python<'_>, records: &[u8], now: Nanos, head: Head) -> PyResult<Outcome> {
        let reports = match records::detections(records) {
            Ok(reports) => reports,
            // As a value of JSON that cannot be.
            Err(error) => return Ok((false, false, Some("absurd_value"), Some(error.to_string()), true)),
        };
        let head = frame_of(&head)?;
        Ok(outcome(self.with(py, |core| core.handle_reports(head, reports.into_iter(), now.0))))
    }

    /// Takes in a sensor description; the reason and the words where it is refused.
    fn describe(
        &self,
        py: Python<'_>,
        payload: &[u8],
        key: (String, String),
    ) -> PyResult<Option<(&'static str, String)>> {
        let (sender, body) = (agent(&key.1)?, Body::of(&key.0, payload));
        let handled = self.with(py, |core| core.handle_description(sender, &body));
        Ok(handled.err().map(|refusal| (refusal.reason(), refusal.to_string())))
    }

    /// The objects as records of `v2x.OBJECT`.
    fn objects<'py>(&self, py: Python<'py>, now: Nanos) -> Bound<'py, PyByteArray> {
        PyByteArray::new(py, &self.with(py, |core| objects(core.fused(now.0))).0)
    }

    /// Those of the second list; `None` where there is none.
    fn lagged<'py>(&self, py: Python<'py>, now: Nanos) -> Option<Bound<'py, PyByteArray>> {
        let records = self.with(py, |core| core.lagged(now.0).map(objects))?;
        Some(PyByteArray::new(py, &records.0))
    }

    /// The fused frame as JSON of the network, and its time.
    fn fused<'py>(&self, py: Python<'py>, now: Nanos) -> PyResult<(Bound<'py, PyBytes>, i64)> {
        let encode = |core: &mut Core| {
            let frame = core.fused(now.0);
            wire::json::encode_fused(frame).map(|json| (json, frame.fused_at.as_nanos()))
        };
        let (json, fused_at) = self.with(py, encode).map_err(value_error)?;
        Ok((PyBytes::new(py, &json), fused_at))
    }

    /// What is counted of the agents, as JSON.
    fn agents(&self, py: Python<'_>) -> String {
        self.with(py, |core| {
            let engine = core.engine();
            let agents = engine.agents().iter();
            let counts = agents.map(|(agent, record)| (agent.to_string(), counts(&record.statistics)));
            Value::Object(counts.collect()).to_string()
        })
    }

    /// The settings that hold, as JSON.
    fn settings(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |core| serde_json::to_string(core.settings())).map_err(value_error)
    }
}

/// The agent that a payload names.
fn sender_of(body: &Body<'_>) -> Result<Option<AgentId>, WireError> {
    #[derive(Deserialize)]
    struct Named {
        agent: Option<AgentId>,
    }
    match *body {
        Body::Postcard(bytes) => Ok(Some(wire::detections::decode_as_sent(bytes)?.id.agent)),
        Body::Json(bytes) => match serde_json::from_slice::<Named>(bytes) {
            Ok(named) => Ok(named.agent),
            Err(error) => Err(WireError::json(&error)),
        },
        Body::TooLarge(_) => Ok(None),
    }
}

fn frame_of(head: &Head) -> PyResult<DetectionFrame> {
    let (name, captured_at, epoch, sequence, pose, map_frame, sensor_revision) = head;
    let captured_at = captured_at.0;
    // As of JSON: such an agent can send one frame in a microsecond.
    let by_time = u64::try_from(captured_at.as_micros()).unwrap_or(0);
    let id = FrameId { agent: agent(name)?, epoch: *epoch, sequence: sequence.unwrap_or(by_time) };
    let map_frame = map_frame.as_deref().map(MapFrame::new).transpose();
    Ok(DetectionFrame {
        sensor_pose: pose.map(|(x, y, yaw)| Pose { x, y, yaw }),
        map_frame: map_frame.map_err(|error| value_error(format_args!("map_frame: {error}")))?,
        sensor_revision: *sensor_revision,
        ..DetectionFrame::empty(id, captured_at)
    })
}

fn outcome(handled: Handled) -> Outcome {
    match handled {
        Handled::Accepted { out_of_sequence, .. } => (true, out_of_sequence, None, None, false),
        Handled::Refused(refusal) => {
            let is_malformed = matches!(refusal, Refusal::Malformed(_));
            (false, false, Some(refusal.reason()), Some(refusal.to_string()), is_malformed)
        }
    }
}

fn objects(frame: &FusedFrame) -> Records {
    let mut records = Records::with_capacity(frame.objects.len(), OBJECT_BYTES);
    frame.objects.iter().for_each(|object| records.object(object));
    records
}

fn counts(statistics: &AgentStatistics) -> Value {
    let refused: Map<_, _> =
        statistics.refused.iter().map(|(reason, count)| (reason.to_string(), (*count).into())).collect();
    let dropped = statistics.dropped.by_cause.iter();
    let dropped: Map<_, _> =
        dropped.map(|((field, cause), count)| (format!("{field} {cause}"), (*count).into())).collect();
    let unmapped = statistics.unmapped_classes.names();
    let unmapped: Map<_, _> = unmapped.map(|(name, count)| (name.to_owned(), count.into())).collect();
    json!({
        "accepted": statistics.accepted,
        "out_of_sequence": statistics.out_of_sequence,
        "refused": refused,
        "last_refusal": statistics.last_refusal.as_ref().map(ToString::to_string),
        "dropped_detections": dropped,
        "last_dropped": statistics.dropped.last.as_ref().map(ToString::to_string),
        "unmapped_names": unmapped,
        "descriptions_refused": statistics.descriptions_refused,
        "nis_per_dof": statistics.nis_per_dof(),
    })
}
