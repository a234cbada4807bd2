//! The detections of a scene as a table.

use crate::data::detection_columns::COLUMNS;
use crate::data::observation::{AgentReport, Protocol};
use crate::data::scene::Scene;
use crate::data::seconds;
use std::fmt::{self, Write};
use std::str::FromStr;
use v2x_agent::truth::ObjectId;
use v2x_common::detection::Detection;
use v2x_common::time::Timestamp;

/// Names of the agents.
pub(crate) const AGENTS: [&str; 2] = ["agent-1", "agent-2"];
/// Further columns, after those of `lab fuse`.
pub(crate) const FURTHER_COLUMNS: [&str; 3] = ["det_id", "sensor_x", "sensor_y"];

/// Which detection of a scene: `agent-1:12:3` is the fourth one of the first agent in the thirteenth keyframe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct DetectionId {
    /// Place of the agent.
    pub agent: usize,
    /// Place of the keyframe.
    pub frame: usize,
    /// Place in the agent's report.
    pub index: usize,
}

impl fmt::Display for DetectionId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", AGENTS[self.agent], self.frame, self.index)
    }
}

/// The text is no [`DetectionId`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected a det_id such as agent-1:12:3")]
pub(crate) struct NoDetectionId;

impl FromStr for DetectionId {
    type Err = NoDetectionId;

    fn from_str(text: &str) -> Result<Self, NoDetectionId> {
        let mut parts = text.split(':');
        let agent = parts.next().and_then(|name| AGENTS.iter().position(|agent| *agent == name));
        let mut number = || parts.next().and_then(|part| part.parse().ok());
        match (agent, number(), number(), parts.next()) {
            (Some(agent), Some(frame), Some(index), None) => Ok(Self { agent, frame, index }),
            _ => Err(NoDetectionId),
        }
    }
}

/// What the agents report of each keyframe of a scene.
pub(crate) fn reports(protocol: &Protocol, scene: &Scene) -> Vec<[AgentReport; 2]> {
    (0..scene.keyframes.len()).map(|frame| protocol.observe(scene, frame)).collect()
}

/// The true object of a box of a keyframe that is made of these detections, by the rule of the tables: that of agent 1's
/// detection of this keyframe, else of agent 2's, else of the newest detection.
///
/// # Errors
/// A detection that there is not.
pub(crate) fn identity(
    named: impl IntoIterator<Item = DetectionId>,
    frame: usize,
    reports: &[[AgentReport; 2]],
) -> Result<Option<ObjectId>, DetectionId> {
    let rank = |id: &DetectionId| (id.frame == frame, id.frame, std::cmp::Reverse(id.agent));
    let mut best: Option<(DetectionId, Option<ObjectId>)> = None;
    for id in named {
        let report = reports.get(id.frame).map(|reports| &reports[id.agent]).ok_or(id)?;
        let object = *report.identities.get(id.index).ok_or(id)?;
        if best.is_none_or(|(known, _)| rank(&id) > rank(&known)) {
            best = Some((id, object));
        }
    }
    Ok(best.and_then(|(_, object)| object))
}

/// All detections as CSV, without the truth.
pub(crate) fn table(scene: &Scene, reports: &[[AgentReport; 2]]) -> String {
    let mut text = format!("{},{}\n", COLUMNS.join(","), FURTHER_COLUMNS.join(","));
    for (frame, (keyframe, reports)) in scene.keyframes.iter().zip(reports).enumerate() {
        let t = seconds::text(Timestamp::EPOCH + keyframe.at);
        for (agent, report) in reports.iter().enumerate() {
            for (index, detection) in report.detections.iter().enumerate() {
                // Writing to a text cannot fail.
                let _ = write!(text, "{t},{t},{},", AGENTS[agent]);
                let _ = write_detection(&mut text, detection);
                let id = DetectionId { agent, frame, index };
                let _ = writeln!(text, "{id},{},{}", report.pose.x, report.pose.y);
            }
        }
    }
    text
}

/// Writes the fewest digits that are read as the same number.
fn write_detection(out: &mut String, detection: &Detection) -> fmt::Result {
    let Detection { class, bev, covariance, .. } = detection;
    write!(out, "{class},{},{},{},{},{},", bev.x, bev.y, bev.w, bev.d, bev.yaw)?;
    let variances =
        [covariance.position.xx, covariance.position.yy, covariance.ww, covariance.dd, covariance.yaw];
    variances.into_iter().try_for_each(|variance| write!(out, "{},", libm::sqrt(variance)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::conditions::Conditions;
    use crate::data::dataset::synthetic;
    use crate::data::detection_log::DetectionLog;
    use crate::data::noise::{NoisePair, Realisation, Shape};
    use std::path::Path;

    #[test]
    fn ids_are_read_as_written() {
        let id = DetectionId { agent: 1, frame: 12, index: 3 };
        assert_eq!((id.to_string().as_str(), id.to_string().parse()), ("agent-2:12:3", Ok(id)));
        for wrong in ["", "agent-3:1:2", "agent-1:1", "agent-1:1:2:3", "agent-1:-1:2", "1:2:3"] {
            assert_eq!(wrong.parse::<DetectionId>(), Err(NoDetectionId), "{wrong:?}");
        }
    }

    #[test]
    fn exported_detections_are_read_back_bit_for_bit_and_hold_no_truth() {
        let scene = synthetic::scene(7);
        for conditions in [Conditions::Paper, Conditions::Sensors] {
            let realisation = Realisation { seed: 5, trial: 1 };
            let protocol =
                Protocol { noise: NoisePair::N3N3, shape: Shape::StudentT, conditions, realisation };
            let reports = reports(&protocol, &scene);
            let text = table(&scene, &reports);
            let header = "t_arr,t,sensor_id,class,x,y,w,d,yaw,sx,sy,sw,sd,st,det_id,sensor_x,sensor_y";
            assert_eq!(text.lines().next(), Some(header));
            let mut log = DetectionLog::new(text.as_bytes(), Path::new("scene.csv")).unwrap();
            for report in reports.iter().flatten().filter(|report| !report.detections.is_empty()) {
                let frame = log.next_arrival().unwrap().unwrap().frame;
                assert_eq!(
                    frame.sensor_pose.map(|pose| (pose.x, pose.y)),
                    Some((report.pose.x, report.pose.y))
                );
                assert_eq!(frame.detections.len(), report.detections.len());
                for (read, written) in frame.detections.iter().zip(&report.detections) {
                    assert_eq!((read.class, read.bev), (written.class, written.bev));
                    assert_eq!(written.covariance.position.xy, 0.0);
                    let ratio = read.covariance.ww / written.covariance.ww;
                    assert!((ratio - 1.0).abs() < 1e-12, "{ratio}");
                }
            }
            assert_eq!(log.next_arrival().unwrap(), None);
        }
    }
}
