//! The engine as one of the compared methods.

use crate::data::conditions::Conditions;
use crate::data::fused_box::FusedBox;
use crate::data::observation::AgentReport;
use crate::drive::driver::{Consumer, Driver};
use crate::drive::keyframes::setup::Setup;
use crate::drive::publishing::OfKeyframes;
use std::collections::VecDeque;
use std::convert::Infallible;
use v2x_agent::noise::NoiseLevel;
use v2x_agent::truth::ObjectId;
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::fused::{FusedFrame, FusedObject};
use v2x_common::geometry::BevBox;
use v2x_common::id::{AgentId, FrameId};
use v2x_common::sensor::{Accuracy, FieldOfView, SensorDescription, SensorKind, SizeNoiseLaw};
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::association::{AssociationConfig, AssociationCost, ClassRule};
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::engine::EngineConfig;
use v2x_fusion_hub::engine::{Disposition, Refusal};
use v2x_fusion_hub::fusion::{FusionMethod, Hypotheses};

/// Arbitrary: the engine has no absolute times.
const START: Timestamp = Timestamp::from_nanos(1_700_000_000_000_000_000);
/// Keyframes per second. Declared, but not used by the engine.
const RATE_HZ: f64 = 2.0;
/// Recorded keyframes are sweeps of a sensor at 20 Hz, not exactly 0.5 s apart: this much later is still within the lag.
/// It is less than the time between two frames at 10 Hz, so that no further frame counts.
const LAG_TOLERANCE: Span = Span::from_millis(75);
/// With true identities objects are moved this far apart along x, m: no detection is in another object's gate.
const APART_M: f64 = 20_000.0;
/// With true identities every detection is in its own object's gate, at any distance.
const OPEN_GATE: f64 = 1e4;

/// The published objects of one keyframe.
#[derive(Clone, Debug, PartialEq)]
pub struct KeyframeOutput {
    /// Its number in the scene.
    pub frame: usize,
    /// The objects.
    pub boxes: Vec<FusedBox>,
}

/// An engine refused a frame of the protocol.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the engine refused the frame of agent {agent} at {at}: {refusal}")]
pub struct Refused {
    agent: AgentId,
    at: Timestamp,
    refusal: Refusal,
}

/// One engine in one scene.
#[derive(Debug)]
pub struct EngineRun {
    driver: Driver<OfKeyframes>,
    setup: Setup,
    agents: Vec<AgentId>,
    descriptions: Vec<SensorDescription>,
    conditions: Conditions,
    /// The true objects of the detections, by keyframe and agent.
    identities: Vec<Vec<Vec<Option<ObjectId>>>>,
    /// Numbers of the keyframes that are not published yet, by time.
    pending: VecDeque<usize>,
}

/// The objects of published keyframes, in the order of requests.
#[derive(Default)]
struct Published(Vec<Vec<FusedObject>>);

impl Consumer for Published {
    type Error = Infallible;

    fn receive(&mut self, _: Timestamp, frame: &FusedFrame) -> Result<(), Infallible> {
        self.0.push(frame.objects.clone());
        Ok(())
    }
}

impl EngineRun {
    /// A new engine that has the agents' sensor descriptions.
    pub fn new(setup: Setup, levels: [NoiseLevel; 2], conditions: Conditions) -> Self {
        Self::of(Engine::new(config(&setup)), (setup, levels, conditions))
    }

    /// The same with a user's method.
    pub fn with_fusion(
        setup: Setup,
        levels: [NoiseLevel; 2],
        conditions: Conditions,
        method: Box<dyn FusionMethod>,
    ) -> Self {
        Self::of(Engine::with_fusion(config(&setup), method), (setup, levels, conditions))
    }

    fn of(engine: Engine, (setup, levels, conditions): (Setup, [NoiseLevel; 2], Conditions)) -> Self {
        let names = ["agent-1", "agent-2"].map(|name| AgentId::new(name).expect("a legal name"));
        let law = |level: NoiseLevel| setup.declares_size_law.then(|| level.model().size);
        let descriptions = levels.map(|level| match setup.reads_fused_list {
            true => description_of_both(conditions, law(level)),
            false => description(conditions, law(level)),
        });
        let mut run = Self {
            driver: Driver::new(engine, OfKeyframes::new(lag(&setup))),
            setup,
            agents: names[..setup.n_agents].to_vec(),
            descriptions: descriptions.to_vec(),
            conditions,
            identities: Vec::new(),
            pending: VecDeque::new(),
        };
        run.describe();
        run
    }

    fn describe(&mut self) {
        for (agent, description) in self.agents.iter().zip(&self.descriptions) {
            self.driver.describe(*agent, *description);
        }
    }

    /// Takes in the agents' reports of a keyframe, and returns the keyframes that are published then. In the paper's
    /// conditions, where every object is reported, only objects with a measurement of the keyframe are returned, else all.
    pub fn fuse(&mut self, reports: &[AgentReport], at: Span) -> Result<Vec<KeyframeOutput>, Refused> {
        let now = START + at;
        let mut published = Published::default();
        let Ok(()) = self.driver.publish_before(now, &mut published);
        if !self.setup.remembers {
            self.driver.restart(Engine::new(config(&self.setup)));
            self.describe();
        }
        let reports = &reports[..self.agents.len()];
        // Agent 2's frame arrives first. Both are of the same instant: the order is arbitrary, and the same for every
        // method.
        for (agent, report) in self.agents.iter().zip(reports).rev() {
            let frame = self.frame(*agent, report, now);
            let Ok(disposition) = self.driver.arrive(&frame, now, &mut published);
            if let Disposition::Refused(refusal) = disposition {
                return Err(Refused { agent: *agent, at: now, refusal });
            }
        }
        self.pending.push_back(self.identities.len());
        self.identities.push(reports.iter().map(|report| report.identities.clone()).collect());
        self.driver.publishing_mut().ask(now);
        let Ok(()) = self.driver.publish_through(now, &mut published);
        Ok(self.outputs(&published))
    }

    /// The keyframes that are not published yet, by all reports.
    pub fn finish(&mut self) -> Vec<KeyframeOutput> {
        let mut published = Published::default();
        let Ok(()) = self.driver.publish_through(Timestamp::MAX, &mut published);
        self.outputs(&published)
    }

    fn outputs(&mut self, published: &Published) -> Vec<KeyframeOutput> {
        let n = published.0.len();
        let frames: Vec<usize> = self.pending.drain(..n).collect();
        frames.into_iter().zip(&published.0).map(|(frame, objects)| self.output(frame, objects)).collect()
    }

    fn output(&self, frame: usize, objects: &[FusedObject]) -> KeyframeOutput {
        let is_published = |object: &&FusedObject| match self.conditions {
            Conditions::Paper => object.contributors.iter().any(|used| keyframe(used.frame) == frame),
            Conditions::Sensors | Conditions::Lidar | Conditions::Camera => true,
        };
        KeyframeOutput {
            frame,
            boxes: objects.iter().filter(is_published).map(|object| self.fused_box(object)).collect(),
        }
    }

    fn frame(&self, agent: AgentId, report: &AgentReport, now: Timestamp) -> DetectionFrame {
        let id = FrameId { agent, epoch: 1, sequence: self.identities.len() as u64 };
        let frame = DetectionFrame { sensor_revision: 1, ..DetectionFrame::empty(id, now) };
        if self.setup.has_true_identities {
            // Without a sensor pose: moved objects are outside of every field of view, and no detection is missed.
            let moved = report.detections.iter().zip(&report.identities);
            let moved = moved.map(|(detection, id)| shifted(detection, place_m(*id)));
            return DetectionFrame { detections: moved.collect(), ..frame };
        }
        DetectionFrame { sensor_pose: Some(report.pose), detections: report.detections.clone(), ..frame }
    }

    /// A fused object with its true object: that of agent 1's detection of the newest keyframe in it, else of agent 2's.
    fn fused_box(&self, object: &FusedObject) -> FusedBox {
        let newest = object.contributors.iter().map(|used| keyframe(used.frame)).max();
        let of_newest = |used: &&v2x_common::id::MeasurementId| Some(keyframe(used.frame)) == newest;
        // Contributors are sorted by agent.
        let identity = object.contributors.iter().find(of_newest).and_then(|used| {
            let agent = self.agents.iter().position(|agent| *agent == used.frame.agent)?;
            *self.identities.get(keyframe(used.frame))?.get(agent)?.get(usize::from(used.index))?
        });
        let mut fused = FusedBox::of(object, identity);
        if self.setup.has_true_identities {
            let [x, y] = place_m(identity);
            fused.bev = BevBox { x: fused.bev.x - x, y: fused.bev.y - y, ..fused.bev };
        }
        fused
    }
}

/// The sensor description of both agents.
fn description(conditions: Conditions, size_noise: Option<SizeNoiseLaw>) -> SensorDescription {
    SensorDescription {
        revision: 1,
        kind: SensorKind::Vehicle,
        field_of_view: conditions.field_of_view(),
        detection_probability: conditions.detection_probability(),
        clutter_per_m2: conditions.clutter_per_m2(),
        size_noise,
        body: None,
        accuracy: Accuracy { position_m: 0.0, yaw_rad: 0.0, clock_s: 0.0 },
        rate_hz: RATE_HZ,
    }
}

/// The same for a list of fused objects: around agent 1 it reaches as far as agent 2 covers, and it has both agents'
/// clutter in the area that either of them covers.
fn description_of_both(conditions: Conditions, size_noise: Option<SizeNoiseLaw>) -> SensorDescription {
    let range_m = conditions.range_m() + conditions.apart_m().unwrap_or(0.0);
    SensorDescription {
        field_of_view: FieldOfView::omnidirectional(0.0, range_m),
        clutter_per_m2: 2.0 * conditions.clutter_per_frame() / conditions.area_of_both_m2(),
        ..description(conditions, size_noise)
    }
}

/// How long after a keyframe later ones count.
fn lag(setup: &Setup) -> Span {
    if setup.lag > Span::ZERO { setup.lag + LAG_TOLERANCE } else { Span::ZERO }
}

fn config(setup: &Setup) -> EngineConfig {
    let lag = lag(setup);
    let config = setup.config.with_tracking(|tracking| {
        if lag > Span::ZERO {
            tracking.tracker.hypotheses = Hypotheses::with_lag(lag);
        }
    });
    if !setup.has_true_identities {
        return config;
    }
    // A bounded cost: a detection in its own object's gate is always assigned.
    let association = AssociationConfig {
        cost: AssociationCost::Csba,
        gate: OPEN_GATE,
        turned_headings: false,
        classes: ClassRule::Exact,
        ..AssociationConfig::default()
    };
    config.with_tracking(|tracking| {
        tracking.tracker.association = association;
        tracking.tracker.hypotheses = Hypotheses::with_lag(lag);
    })
}

/// Frames have the numbers of keyframes.
fn keyframe(frame: FrameId) -> usize {
    usize::try_from(frame.sequence).unwrap_or(usize::MAX)
}

/// The displacement of an object. Clutter has its own. Objects are placed in rows, since coordinates end at 100 000 km.
fn place_m(identity: Option<ObjectId>) -> [f64; 2] {
    const IN_A_ROW: u32 = 4000;
    identity.map_or([-APART_M, 0.0], |ObjectId(id)| {
        [f64::from(id % IN_A_ROW) * APART_M, f64::from(id / IN_A_ROW) * APART_M]
    })
}

fn shifted(detection: &Detection, [x_m, y_m]: [f64; 2]) -> Detection {
    let BevBox { x, y, .. } = detection.bev;
    Detection { bev: BevBox { x: x + x_m, y: y + y_m, ..detection.bev }, ..*detection }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::noise::{NoisePair, Realisation, Shape};
    use crate::data::observation::Protocol;
    use crate::data::test_scenes::parking;
    use crate::drive::keyframes::method::Method;

    fn last_frame(setup: Setup, n_frames: usize) -> Vec<FusedBox> {
        let scene = parking(n_frames);
        let (realisation, conditions) = (Realisation { seed: 3, trial: 0 }, Conditions::Paper);
        let protocol = Protocol { noise: NoisePair::N1N1, shape: Shape::Gaussian, conditions, realisation };
        let mut run = EngineRun::new(setup, protocol.noise.levels(), conditions);
        let mut outputs = Vec::new();
        for (frame, keyframe) in scene.keyframes.iter().enumerate() {
            outputs.extend(run.fuse(&protocol.observe(&scene, frame), keyframe.at).unwrap());
        }
        outputs.extend(run.finish());
        assert!(outputs.iter().map(|output| output.frame).eq(0..n_frames), "{setup:?}");
        outputs.pop().unwrap().boxes
    }

    #[test]
    fn every_object_is_published_once_at_its_position() {
        let methods = Method::ALL.iter().filter(|method| !matches!(method, Method::Psa));
        for setup in methods.map(|method| method.recipe(NoisePair::N1N1).setup) {
            let boxes = last_frame(setup, 12);
            let mut objects: Vec<u32> = boxes.iter().map(|one| one.object.unwrap().0).collect();
            objects.sort_unstable();
            // Methods that associate by overlap may publish an object twice.
            objects.dedup();
            assert_eq!(objects, (0..8).collect::<Vec<_>>(), "{setup:?}");
            for one in &boxes {
                let truth = parking(1).keyframes[0].objects[one.object.unwrap().0 as usize].bev;
                let off_m = truth.pose().distance_to(one.bev.x, one.bev.y);
                assert!(off_m < 5.0, "{setup:?}: {off_m} m off");
            }
        }
    }

    #[test]
    fn an_object_without_a_report_is_absent_in_the_papers_setting_and_can_coast_with_sensors() {
        let scene = parking(5);
        let n_objects = |conditions| {
            let realisation = Realisation { seed: 3, trial: 0 };
            let protocol =
                Protocol { noise: NoisePair::N1N1, shape: Shape::Gaussian, conditions, realisation };
            let mut run = EngineRun::new(Setup::ours(), protocol.noise.levels(), conditions);
            let mut fuse = |frame: usize, is_silent: bool| {
                let mut reports = protocol.observe(&scene, frame);
                if is_silent {
                    for report in &mut reports {
                        (report.detections, report.identities) = (Vec::new(), Vec::new());
                    }
                }
                run.fuse(&reports, scene.keyframes[frame].at).unwrap()
            };
            (0..4).for_each(|frame| drop(fuse(frame, false)));
            fuse(4, true)[0].boxes.len()
        };
        assert_eq!(n_objects(Conditions::Paper), 0);
        assert!(n_objects(Conditions::Sensors) > 0);
    }
}
