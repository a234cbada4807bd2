//! The frames of an agent that has conventions of its own, for a reader that has these conventions from a hub.

use super::json::{self, ReportDefaults};
use super::{WireError, detections, is_json};
use crate::conventions::Conventions;
use crate::detection::DetectionFrame;
use crate::id::AgentId;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// How an agent writes its frames, and what is assumed where a JSON frame leaves a value out.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Writing {
    /// Where a JSON frame leaves a value out.
    pub report_defaults: ReportDefaults,
    /// How it writes its frames.
    pub conventions: Conventions,
}

/// How agents write, as a hub knows it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Writings {
    of_agents: BTreeMap<AgentId, Writing>,
    of_others: Writing,
}

impl Writings {
    /// Those of single agents; all others write by our own conventions.
    pub fn new(of_agents: BTreeMap<AgentId, Writing>) -> Self {
        Self { of_agents, of_others: Writing::default() }
    }

    /// A frame by our own conventions, with every detection as it was sent otherwise: one can have a value outside of its
    /// limits.
    ///
    /// # Errors
    /// Where it cannot be read, or needs a pose that it lacks.
    pub fn read(&self, agent: AgentId, encoding: &str, payload: &[u8]) -> Result<DetectionFrame, WireError> {
        let Writing { report_defaults, conventions } = self.of_agents.get(&agent).unwrap_or(&self.of_others);
        if is_json(encoding, payload) {
            let decoded = json::decode_detections_by(payload, agent, report_defaults, conventions);
            return decoded.map(|decoded| decoded.frame);
        }
        let mut frame = detections::decode_as_sent(payload)?;
        conventions.convert(&mut frame)?;
        Ok(frame)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conventions::CoordinateFrame;
    use crate::geometry::Pose;

    #[test]
    fn the_frames_of_an_agent_with_conventions_are_read_by_them_in_both_codecs() {
        let cam = AgentId::new("cam").unwrap();
        let frame = CoordinateFrame::Sensor(Pose { x: 100.0, y: 50.0, yaw: 0.0 });
        let conventions = Conventions { frame, ..Conventions::default() };
        let known = Writings::new([(cam, Writing { conventions, ..Writing::default() })].into());
        let text = br#"{"captured_at": 1000, "detections": [{"class": "car", "x": 10.0, "y": 2.0}]}"#;
        let as_sent = Writings::default().read(cam, super::super::ENCODING_JSON, text).unwrap();
        let mut bytes = Vec::new();
        detections::encode(&as_sent, &mut bytes).unwrap();
        for (encoding, payload) in
            [(super::super::ENCODING_JSON, &text[..]), (super::super::ENCODING_POSTCARD, &bytes[..])]
        {
            let read = known.read(cam, encoding, payload).unwrap();
            let bev = read.detections[0].bev;
            assert!((bev.x - 110.0).abs() < 1e-3 && (bev.y - 52.0).abs() < 1e-3, "{bev:?}");
            assert_eq!(read.sensor_pose, Some(Pose { x: 100.0, y: 50.0, yaw: 0.0 }));
        }
        assert!((as_sent.detections[0].bev.x - 10.0).abs() < 1e-9);
    }
}
