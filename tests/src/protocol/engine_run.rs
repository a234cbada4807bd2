//! The engine as one of the compared methods.

use super::counting::Prediction;
use super::observe::AgentReport;
use v2x_agent::noise::NoiseLevel;
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::fused::FusedObject;
use v2x_common::geometry::BevBox;
use v2x_common::id::{AgentId, FrameId, HubId};
use v2x_common::sensor::{Accuracy, FieldOfView, SensorDescription, SensorKind};
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::association::{AssociationConfig, AssociationCost};
use v2x_fusion_hub::config::{EngineConfig, Preset};
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::refusal::{Disposition, Refusal};

/// Any start does.
const START: Timestamp = Timestamp::from_nanos(1_700_000_000_000_000_000);
/// Beyond every object of every scene, m.
const RANGE_M: f64 = 1000.0;
/// Keyframes per second: only said, never used.
const RATE_HZ: f64 = 2.0;
/// With true identities objects are moved this far apart along x, m: so that no report fits another one's track.
const APART_M: f64 = 20_000.0;
/// With true identities every report fits its own track, far as it may lie from it.
const OPEN_GATE: f64 = 1e4;

/// What the engine is asked to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setup {
    /// Its rules.
    pub preset: Preset,
    /// Whether agents declare by which law their sizes err.
    pub declares_size_law: bool,
    /// How many of the two agents report.
    pub n_agents: usize,
    /// Whether objects are put far apart, so that association cannot fail.
    pub true_identities: bool,
}

/// An engine refused a frame of the protocol.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the engine refused the frame of agent {agent} at {at}: {refusal}")]
pub struct Refused {
    agent: AgentId,
    at: Timestamp,
    refusal: Refusal,
}

/// One engine in one scene; it sees keyframe after keyframe.
#[derive(Debug)]
pub struct EngineRun {
    engine: Engine,
    setup: Setup,
    agents: Vec<AgentId>,
    sequence: u64,
}

impl EngineRun {
    /// A new engine, which the agents have described their sensors to: detection probability 1, no clutter.
    pub fn new(setup: Setup, levels: [NoiseLevel; 2]) -> Self {
        let hub = HubId::new("lab").expect("a legal name");
        let mut config = EngineConfig::new(hub, 1).with_preset(setup.preset);
        if setup.true_identities {
            // A bounded cost: a report that fits no other track is never left alone.
            let association =
                AssociationConfig { cost: AssociationCost::Csba, gate: OPEN_GATE, class_aware: true };
            config = EngineConfig { association, ..config };
        }
        let mut engine = Engine::new(config);
        let names = ["agent-1", "agent-2"].map(|name| AgentId::new(name).expect("a legal name"));
        for (agent, level) in names.iter().zip(levels) {
            let size_noise = setup.declares_size_law.then(|| level.model().size);
            engine.handle_description(*agent, SensorDescription { size_noise, ..DESCRIPTION });
        }
        Self { engine, setup, agents: names[..setup.n_agents].to_vec(), sequence: 0 }
    }

    /// Takes in what the agents report of a keyframe; tells the objects that were measured in it.
    pub fn fuse(&mut self, reports: &[AgentReport], at: Span) -> Result<Vec<Prediction>, Refused> {
        let now = START + at;
        // Agent 2's frame comes first. Both are of the same instant, so which one arrives first is chance, and every
        // method that keeps tracks gets them in this order.
        for (agent, report) in self.agents.iter().zip(reports).rev() {
            let frame = self.frame(*agent, report, now);
            if let Disposition::Refused(refusal) = self.engine.handle_frame(&frame, now) {
                return Err(Refused { agent: *agent, at: now, refusal });
            }
        }
        let sequence = self.sequence;
        self.sequence += 1;
        let fused = self.engine.fused(now);
        let measured = fused.objects.iter().filter(|object| object.last_measured_at == now);
        let apart_m = if self.setup.true_identities { APART_M } else { 0.0 };
        Ok(measured
            .filter_map(|object| prediction(object, (&self.agents, sequence), reports, apart_m))
            .collect())
    }

    fn frame(&self, agent: AgentId, report: &AgentReport, now: Timestamp) -> DetectionFrame {
        let id = FrameId { agent, epoch: 1, sequence: self.sequence };
        let frame =
            DetectionFrame { sensor_revision: DESCRIPTION.revision, ..DetectionFrame::empty(id, now) };
        if self.setup.true_identities {
            // Without a pose: nothing is near its sensor any more, and nothing is looked for.
            let moved = report.detections.iter().zip(&report.identities);
            let moved = moved.map(|(detection, id)| shifted(detection, f64::from(id.0) * APART_M));
            return DetectionFrame { detections: moved.collect(), ..frame };
        }
        DetectionFrame { sensor_pose: Some(report.pose), detections: report.detections.clone(), ..frame }
    }
}

/// What both agents say of their sensors, but for the law of sizes.
pub(super) const DESCRIPTION: SensorDescription = SensorDescription {
    revision: 1,
    kind: SensorKind::Vehicle,
    field_of_view: FieldOfView::omnidirectional(0.0, RANGE_M),
    detection_probability: 1.0,
    clutter_per_m2: 0.0,
    size_noise: None,
    body: None,
    accuracy: Accuracy { position_m: 0.0, yaw_rad: 0.0, clock_s: 0.0 },
    rate_hz: RATE_HZ,
};

fn shifted(detection: &Detection, x_m: f64) -> Detection {
    Detection { bev: BevBox { x: detection.bev.x + x_m, ..detection.bev }, ..*detection }
}

/// A fused object as it is scored: by the identity of agent 1's detection of this keyframe in it, else agent 2's.
fn prediction(
    object: &FusedObject,
    (agents, sequence): (&[AgentId], u64),
    reports: &[AgentReport],
    apart_m: f64,
) -> Option<Prediction> {
    let detection_of = |agent: &AgentId| {
        let mut used = object.contributors.iter();
        used.find(|used| used.frame.agent == *agent && used.frame.sequence == sequence)
    };
    let found = agents.iter().zip(reports).find_map(|(agent, report)| Some((detection_of(agent)?, report)));
    let (used, report) = found?;
    let place = usize::from(used.index);
    let moved_by_m = f64::from(report.identities[place].0) * apart_m;
    let bev = BevBox { x: object.bev.x - moved_by_m, ..object.bev };
    Some(Prediction { bev, object: report.objects[place] })
}

#[cfg(test)]
mod tests {
    use super::super::noise::{NoisePair, Realisation, Shape};
    use super::super::observe::Protocol;
    use super::super::testing::parking;
    use super::*;

    const OURS: Setup =
        Setup { preset: Preset::Ours, declares_size_law: true, n_agents: 2, true_identities: false };

    fn last_frame(setup: Setup, n_frames: usize) -> Vec<Prediction> {
        let scene = parking(n_frames);
        let realisation = Realisation { seed: 3, trial: 0 };
        let protocol = Protocol { noise: NoisePair::N1N1, shape: Shape::Gaussian, realisation };
        let mut run = EngineRun::new(setup, protocol.noise.levels());
        let mut told = Vec::new();
        for (frame, keyframe) in scene.keyframes.iter().enumerate() {
            told = run.fuse(&protocol.observe(&scene, frame), keyframe.at).unwrap();
        }
        told
    }

    #[test]
    fn every_object_is_told_once_and_where_it_is() {
        for setup in [
            OURS,
            Setup { preset: Preset::Paper, declares_size_law: false, ..OURS },
            Setup { n_agents: 1, ..OURS },
            Setup { true_identities: true, ..OURS },
        ] {
            let told = last_frame(setup, 12);
            let mut objects: Vec<usize> = told.iter().map(|one| one.object).collect();
            objects.sort_unstable();
            assert_eq!(objects, (0..8).collect::<Vec<_>>(), "{setup:?}");
            for one in &told {
                let truth = parking(1).keyframes[0].objects[one.object].bev;
                let off_m = truth.pose().distance_to(one.bev.x, one.bev.y);
                assert!(off_m < 5.0, "{setup:?}: {off_m} m off");
            }
        }
    }
}
