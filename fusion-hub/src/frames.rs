//! The frames that can still matter: each measurement is held once, and tracks refer to it.
//!
//! Nothing older than Δmax is let in, so what is older than that, and folded into every track, is forgotten.

use crate::agents::AgentSlot;
use crate::filter::{CompactMeasurement, Measurement, SizeLaws};
use crate::registration::{Sighting, Slot, Source};
use crate::sensing::{Look, ReportModel, Sensing};
use std::cmp::Ordering;
use std::collections::VecDeque;
use v2x_common::covariance::Velocity;
use v2x_common::detection::DetectionFrame;
use v2x_common::id::FrameId;
use v2x_common::time::Timestamp;

/// Most frames held.
pub const MAX_FRAMES: usize = 1 << 16;
/// Most measurements held, in all frames.
pub const MAX_MEASUREMENTS: usize = 1 << 20;

/// Most of these that are one agent's: nobody fills the hub alone.
pub const MAX_MEASUREMENTS_OF_AGENT: usize = MAX_MEASUREMENTS / 8;

/// Where a frame is held, until it is forgotten.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameSlot(pub(crate) u32);

/// What a frame tells of one track: that it reported it, or looked and did not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Piece {
    /// When it was measured.
    pub captured_at: Timestamp,
    /// In which frame.
    pub frame: FrameSlot,
    /// Place in the frame; [`LOOK`] where the frame did not report the track.
    pub index: u16,
}

/// In place of a detection's number: looked, and not reported.
pub const LOOK: u16 = u16::MAX;

/// A frame that can still matter.
#[derive(Clone, Debug)]
pub struct StoredFrame {
    /// When it was measured.
    pub captured_at: Timestamp,
    /// Sender and number.
    pub id: FrameId,
    /// The sender's place in the books.
    pub agent: AgentSlot,
    /// Reported velocities, by the detection's number.
    velocities: Vec<(u16, Velocity)>,
    /// What each report says of existence.
    pub model: ReportModel,
    /// Where it looked; `None` where its misses count for nothing.
    pub look: Option<Look>,
    /// The sender as registration knows it; `None` where it does not.
    pub source: Option<Source>,
}

/// All frames within Δmax, by capture time.
#[derive(Debug, Default)]
pub struct FrameStore {
    slots: Vec<StoredFrame>,
    /// What was measured, by slot.
    measurements: Vec<Vec<CompactMeasurement>>,
    /// For each of them, where registration knows the sender, the agents with whose reports it was compared: a bit each.
    compared: Vec<Vec<u32>>,
    laws: SizeLaws,
    free: Vec<FrameSlot>,
    /// By (capture time, id).
    order: VecDeque<(Timestamp, FrameSlot)>,
    n_measurements: usize,
    /// By agent.
    n_measurements_of: Vec<usize>,
}

impl FrameStore {
    /// Takes a frame in, as measured by this sensor.
    pub fn insert(
        &mut self,
        frame: &DetectionFrame,
        agent: AgentSlot,
        sensing: &Sensing,
        look: Option<Look>,
    ) -> FrameSlot {
        let slot = self.vacant_slot(frame.id);
        let stored = &mut self.slots[slot.0 as usize];
        stored.captured_at = frame.captured_at;
        stored.id = frame.id;
        stored.agent = agent;
        stored.model = sensing.model();
        stored.look = look;
        stored.source = None;
        stored.velocities.clear();
        let measurements = &mut self.measurements[slot.0 as usize];
        measurements.clear();
        for (index, detection) in (0..).zip(&frame.detections) {
            let z = sensing.measurement(detection);
            measurements.push(CompactMeasurement::new(
                &z,
                stored.model.detection_over_clutter,
                &mut self.laws,
            ));
            stored.velocities.extend(z.velocity.map(|velocity| (index, velocity)));
        }
        self.compared[slot.0 as usize].clear();
        self.n_measurements += measurements.len();
        if self.n_measurements_of.len() <= agent.index() {
            self.n_measurements_of.resize(agent.index() + 1, 0);
        }
        self.n_measurements_of[agent.index()] += measurements.len();
        let key = (frame.captured_at, slot);
        let place = self.order.iter().rposition(|other| self.compare(*other, key) == Ordering::Less);
        self.order.insert(place.map_or(0, |place| place + 1), key);
        slot
    }

    /// Says whom registration takes a frame to be of.
    pub fn note_source(&mut self, slot: FrameSlot, source: Source) {
        self.slots[slot.0 as usize].source = Some(source);
        let n_measurements = self.compact(slot).len();
        let compared = &mut self.compared[slot.0 as usize];
        // A few more next time shall fit, too.
        compared.reserve(n_measurements.next_power_of_two());
        compared.resize(n_measurements, 0);
    }

    fn vacant_slot(&mut self, id: FrameId) -> FrameSlot {
        self.free.pop().unwrap_or_else(|| {
            let slot = u32::try_from(self.slots.len()).expect("bounded by MAX_FRAMES");
            self.slots.push(StoredFrame {
                captured_at: Timestamp::MIN,
                id,
                agent: AgentSlot::default(),
                velocities: Vec::new(),
                model: ReportModel::default(),
                look: None,
                source: None,
            });
            self.measurements.push(Vec::new());
            self.compared.push(Vec::new());
            FrameSlot(slot)
        })
    }

    fn compare(&self, a: (Timestamp, FrameSlot), b: (Timestamp, FrameSlot)) -> Ordering {
        a.0.cmp(&b.0).then_with(|| self.get(a.1).id.cmp(&self.get(b.1).id))
    }

    /// The frame in a slot.
    pub fn get(&self, slot: FrameSlot) -> &StoredFrame {
        &self.slots[slot.0 as usize]
    }

    /// What a frame measured, without velocities.
    pub fn measurements(&self, slot: FrameSlot) -> impl Iterator<Item = Measurement> {
        self.compact(slot).iter().map(|compact| compact.expanded(&self.laws))
    }

    fn compact(&self, slot: FrameSlot) -> &[CompactMeasurement] {
        &self.measurements[slot.0 as usize]
    }

    /// The measurement of a piece as it is held, where it is a report.
    #[inline(always)]
    pub fn held(&self, piece: &Piece) -> Option<&CompactMeasurement> {
        self.compact(piece.frame).get(usize::from(piece.index))
    }

    /// The measurement of a piece that is a report, from how it is held.
    #[inline(always)]
    pub fn expanded(&self, piece: &Piece, held: &CompactMeasurement) -> Measurement {
        let mut z = held.expanded(&self.laws);
        if held.has_velocity {
            z.velocity = self.velocity(piece);
        }
        z
    }

    /// A report as registration compares it; `None` where it does not: an unknown sender's, or somebody's track.
    pub fn sighting(&self, piece: &Piece) -> Option<Sighting> {
        let source = self.get(piece.frame).source?;
        let z = self.held(piece)?.expanded(&self.laws);
        let Measurement { position, r, yaw, yaw_variance, is_track, .. } = z;
        let captured_at = piece.captured_at;
        (!is_track).then_some(Sighting { source, captured_at, position, r, yaw, yaw_variance })
    }

    /// Whether a report was compared with one of this agent.
    pub fn was_compared(&self, piece: &Piece, with: Slot) -> bool {
        let compared = self.compared[piece.frame.0 as usize].get(usize::from(piece.index));
        compared.is_some_and(|agents| agents & (1 << with.index()) != 0)
    }

    /// Notes that a report was compared with one of this agent.
    pub fn note_compared(&mut self, piece: &Piece, with: Slot) {
        if let Some(agents) = self.compared[piece.frame.0 as usize].get_mut(usize::from(piece.index)) {
            *agents |= 1 << with.index();
        }
    }

    fn velocity(&self, piece: &Piece) -> Option<Velocity> {
        let velocities = &self.get(piece.frame).velocities;
        let place = velocities.binary_search_by_key(&piece.index, |(index, _)| *index).ok()?;
        Some(velocities[place].1)
    }

    /// Whether one piece of evidence goes before another: by capture time, then by names and numbers, never
    /// by arrival.
    pub fn is_before(&self, a: &Piece, b: &Piece) -> bool {
        let by_time = self.compare((a.captured_at, a.frame), (b.captured_at, b.frame));
        by_time.then(a.index.cmp(&b.index)) == Ordering::Less
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
            let (count, agent) = (self.compact(slot).len(), self.get(slot).agent);
            self.n_measurements -= count;
            self.n_measurements_of[agent.index()] -= count;
            self.free.push(slot);
        }
    }

    /// Whether there is no room for another frame with this many measurements.
    pub fn is_full_for(&self, n_measurements: usize) -> bool {
        self.order.len() >= MAX_FRAMES || self.n_measurements + n_measurements > MAX_MEASUREMENTS
    }

    /// The time before which a quarter of all that is held was captured, by frames and by measurements.
    pub fn first_quarter(&self) -> Option<Timestamp> {
        let mut measurements = 0;
        let is_enough = |place: usize, measurements: usize| {
            4 * place >= self.order.len() && 4 * measurements >= self.n_measurements
        };
        self.order.iter().enumerate().find_map(|(place, (captured_at, slot))| {
            let found = is_enough(place, measurements).then_some(*captured_at);
            measurements += self.compact(*slot).len();
            found
        })
    }

    /// Measurements of an agent that are held.
    pub fn n_measurements_of(&self, agent: AgentSlot) -> usize {
        self.n_measurements_of.get(agent.index()).copied().unwrap_or(0)
    }
}
