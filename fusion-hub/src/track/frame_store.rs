//! The frames that can still matter: each measurement is held once, and tracks refer to it.
//!
//! Nothing older than Δmax is admitted. What is older than that, and folded into every track, is forgotten.

use super::evidence::{Evidence, FrameSlot};
use crate::values::{
    AgentSlot, CompactMeasurement, Coverage, DetectionModel, Measurement, SensorModel, SizeLaws,
};
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;
use std::collections::VecDeque;
use v2x_common::covariance::Velocity;
use v2x_common::detection::DetectionFrame;
use v2x_common::geometry::Pose;
use v2x_common::id::FrameId;
use v2x_common::time::Timestamp;

/// Least and greatest of no scores.
const NO_SCORES: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

/// A frame that can still matter.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StoredFrame {
    /// Capture time.
    pub captured_at: Timestamp,
    /// Agent, boot epoch and sequence number.
    pub id: FrameId,
    /// Slot of the agent.
    pub agent: AgentSlot,
    /// Reported velocities, by the detection's index.
    velocities: Vec<(u16, Velocity)>,
    /// How it is read as evidence of existence.
    pub model: DetectionModel,
    /// What the sensor covered; `None` where its missed detections do not count.
    pub coverage: Option<Coverage>,
    /// Pose of the sensor, where it is known.
    pub pose: Option<Pose>,
    /// Least and greatest score; where there are none, ∞ and -∞.
    pub scores: [f64; 2],
}

impl StoredFrame {
    /// Mean variance (m²) along an axis of what the sensor's pose adds to an error of a position (m), the same in all frames of
    /// some seconds.
    #[inline(always)]
    pub fn pose_variance(&self, [x, y]: [f64; 2]) -> f64 {
        let errors = &self.model.pose;
        if errors.are_none() {
            return 0.0;
        }
        errors.variance_at(self.pose.map_or(0.0, |pose| pose.distance_to(x, y)))
    }
}

#[cfg(test)]
impl StoredFrame {
    /// A frame outside of a store.
    pub(crate) const fn for_tests(
        id: FrameId,
        captured_at: Timestamp,
        agent: AgentSlot,
        model: DetectionModel,
        coverage: Option<Coverage>,
    ) -> Self {
        Self {
            captured_at,
            id,
            agent,
            velocities: Vec::new(),
            model,
            coverage,
            pose: None,
            scores: NO_SCORES,
        }
    }
}

/// All frames within the memory, by capture time.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct FrameStore {
    slots: Vec<StoredFrame>,
    /// Measurements, by slot.
    measurements: Vec<Vec<CompactMeasurement>>,
    laws: SizeLaws,
    free: Vec<FrameSlot>,
    /// By (capture time, id).
    order: VecDeque<(Timestamp, FrameSlot)>,
}

/// A frame before it is stored, with what is known of its sensor.
#[derive(Clone, Copy, Debug)]
pub struct SensedFrame<'a> {
    /// The frame, in the hub's map frame and time.
    pub frame: &'a DetectionFrame,
    /// Slot of its agent.
    pub agent: AgentSlot,
    /// How its detections are read as measurements.
    pub sensor: &'a SensorModel,
    /// How they are read as evidence of existence.
    pub model: &'a DetectionModel,
    /// What the sensor covered; `None` where its missed detections do not count.
    pub coverage: Option<Coverage>,
}

impl FrameStore {
    /// Stores a frame.
    pub fn insert(&mut self, sensed: &SensedFrame<'_>) -> FrameSlot {
        let SensedFrame { frame, agent, sensor, model, coverage } = *sensed;
        let slot = self.vacant_slot(frame.id);
        let stored = &mut self.slots[slot.index()];
        stored.captured_at = frame.captured_at;
        stored.id = frame.id;
        stored.agent = agent;
        stored.model = *model;
        stored.coverage = coverage;
        stored.pose = frame.sensor_pose;
        let scores = frame.detections.iter().map(|detection| detection.score);
        stored.scores = scores.fold(NO_SCORES, |[least, most], score| [least.min(score), most.max(score)]);
        stored.velocities.clear();
        let measurements = &mut self.measurements[slot.index()];
        measurements.clear();
        measurements.reserve_exact(frame.detections.len());
        for (index, detection) in (0..).zip(&frame.detections) {
            let mut z = sensor.measurement(detection);
            model.headings.correct(&mut z);
            model.errors.scale(&mut z);
            let evidence = model.evidence(detection, frame.sensor_pose.as_ref());
            measurements.push(CompactMeasurement::new(&z, &evidence, &mut self.laws));
            stored.velocities.extend(z.velocity.map(|velocity| (index, velocity)));
        }
        let key = (frame.captured_at, slot);
        let place = self.order.iter().rposition(|other| self.compare(*other, key) == Ordering::Less);
        self.order.insert(place.map_or(0, |place| place + 1), key);
        slot
    }

    fn vacant_slot(&mut self, id: FrameId) -> FrameSlot {
        self.free.pop().unwrap_or_else(|| {
            let slot = u32::try_from(self.slots.len()).expect("the engine's history bounds the frames");
            self.slots.push(StoredFrame {
                captured_at: Timestamp::MIN,
                id,
                agent: AgentSlot::default(),
                velocities: Vec::new(),
                model: DetectionModel::default(),
                coverage: None,
                pose: None,
                scores: NO_SCORES,
            });
            self.measurements.push(Vec::new());
            FrameSlot(slot)
        })
    }

    fn compare(&self, a: (Timestamp, FrameSlot), b: (Timestamp, FrameSlot)) -> Ordering {
        a.0.cmp(&b.0).then_with(|| self.get(a.1).id.cmp(&self.get(b.1).id))
    }

    /// The frame in a slot.
    pub fn get(&self, slot: FrameSlot) -> &StoredFrame {
        &self.slots[slot.index()]
    }

    /// What a frame does not hold was not missed.
    pub fn withdraw_coverage(&mut self, slot: FrameSlot) {
        self.slots[slot.index()].coverage = None;
    }

    /// The measurements of a frame, without velocities.
    pub fn measurements(&self, slot: FrameSlot) -> impl Iterator<Item = Measurement> {
        self.compact(slot).iter().map(|compact| compact.expanded(&self.laws))
    }

    /// The positions of a frame's measurements, m.
    pub fn positions(&self, slot: FrameSlot) -> impl Iterator<Item = [f64; 2]> {
        self.compact(slot).iter().map(CompactMeasurement::position)
    }

    fn compact(&self, slot: FrameSlot) -> &[CompactMeasurement] {
        &self.measurements[slot.index()]
    }

    /// The measurement of a detection as it is held; `None` for a missed detection.
    #[inline(always)]
    pub fn held(&self, evidence: &Evidence) -> Option<&CompactMeasurement> {
        self.compact(evidence.frame).get(usize::from(evidence.index()))
    }

    /// The whole measurement of a detection, from how it is held.
    #[inline(always)]
    pub fn expanded(&self, evidence: &Evidence, held: &CompactMeasurement) -> Measurement {
        let mut z = held.expanded(&self.laws);
        if held.has_velocity {
            z.velocity = self.velocity(evidence);
        }
        z
    }

    /// The measurement of a detection without its velocity; `None` for a missed detection.
    pub fn measurement(&self, evidence: &Evidence) -> Option<Measurement> {
        Some(self.held(evidence)?.expanded(&self.laws))
    }

    fn velocity(&self, evidence: &Evidence) -> Option<Velocity> {
        let velocities = &self.get(evidence.frame).velocities;
        let place = velocities.binary_search_by_key(&evidence.index(), |(index, _)| *index).ok()?;
        Some(velocities[place].1)
    }

    /// Whether one item of evidence precedes another: by capture time, then by ids and indices, never by arrival.
    pub fn is_before(&self, a: &Evidence, b: &Evidence) -> bool {
        let by_time = self.compare((a.captured_at, a.frame), (b.captured_at, b.frame));
        by_time.then(a.index().cmp(&b.index())) == Ordering::Less
    }

    /// Frames captured at this time or later, in order.
    pub fn since(&self, at: Timestamp) -> impl Iterator<Item = (FrameSlot, &StoredFrame)> {
        let start = self.order.partition_point(|(captured_at, _)| *captured_at < at);
        self.order.range(start..).map(|(_, slot)| (*slot, self.get(*slot)))
    }

    /// Forgets frames captured before this time; no track may refer to them any more.
    pub fn forget_before(&mut self, at: Timestamp) {
        while let Some((captured_at, slot)) = self.order.front().copied() {
            if captured_at >= at {
                break;
            }
            self.order.pop_front();
            self.free.push(slot);
        }
    }
}
