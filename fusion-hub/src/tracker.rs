//! Tracks and frames: which report is of which track, what begins and what ends.

mod associate;
mod evidence;
mod expect;
mod instant;
mod merging;
mod reconsider;
mod settle;
mod shared;

use crate::agents::{AgentSlot, Agents};
use crate::association::{Associator, Expected};
use crate::config::EngineConfig;
use crate::duplicates::Duplicates;
use crate::filter::{Filter, Measurement};
use crate::frames::{FrameSlot, FrameStore};
use crate::inbox::AgentRecord;
use crate::particles::{ParticleSet, Particles, versions};
use crate::publish::Publisher;
use crate::registration::{Shared, Source};
use crate::sensing::Sensing;
use crate::track::{Former, Records, Retrospection, Track};
use instant::Instant;
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::FusedObject;
use v2x_common::id::TrackId;
use v2x_common::time::{Span, Timestamp};

/// Most tracks, published or not.
const MAX_TRACKS: usize = 65_536;
/// Most dropped tracks of which the memory is kept.
const MAX_SPARE: usize = 4096;

/// All tracks under one kind of filter.
#[derive(Debug)]
pub(crate) struct Tracker<F> {
    config: EngineConfig,
    undescribed: Sensing,
    frames: FrameStore,
    /// By id.
    tracks: Vec<Track<F>>,
    spare: Vec<Track<F>>,
    next_counter: u32,
    duplicates: Duplicates,
    duplicates_forgotten_at: Timestamp,
    /// What can be taken back of the newest frames.
    instant: Instant<F>,
    associator: Associator,
    particles: Option<Particles>,
    /// Tracks at the time of a frame: their places, their states, and what association needs of these.
    places: Vec<usize>,
    predicted: Vec<F>,
    expected: Vec<Expected>,
    /// For each of them the report of it in the frame.
    reports: Vec<Option<u16>>,
    /// The reports of nothing known, and the particles to which they are that.
    births: Vec<(u16, ParticleSet)>,
    measurements: Vec<Measurement>,
    merges_due: Vec<(TrackId, TrackId)>,
    /// Objects of the newest frame that others report, too.
    shared: Vec<Shared>,
    publisher: Publisher,
    retrospection: Retrospection<F>,
    /// With a lag: what was merged, as it was before.
    former: Former<F>,
    /// Without a lag, tracks last measured before are gone: they may be told of, and are of no frame any more.
    gone_before: Timestamp,
    counts: Counts,
}

/// What happened to tracks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Objects that were not tracked for lack of room.
    pub births_refused: u64,
    /// Tracks that were merged into an older one of the same object.
    pub merges: u64,
}

/// Innovations of one frame: sum of the normalised squares, 2 degrees of freedom each, and their number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Innovations {
    pub(crate) nis_sum: f64,
    pub(crate) count: u64,
}

impl<F: Filter> Tracker<F> {
    pub(crate) fn new(config: EngineConfig) -> Self {
        Self {
            config,
            undescribed: Sensing::undescribed(&config.sensing),
            frames: FrameStore::default(),
            tracks: Vec::new(),
            spare: Vec::new(),
            next_counter: 0,
            duplicates: Duplicates::default(),
            duplicates_forgotten_at: Timestamp::MIN,
            instant: Instant::default(),
            associator: Associator::default(),
            particles: Particles::new(config.association_particles),
            places: Vec::new(),
            predicted: Vec::new(),
            expected: Vec::new(),
            reports: Vec::new(),
            births: Vec::new(),
            measurements: Vec::new(),
            merges_due: Vec::new(),
            shared: Vec::new(),
            publisher: Publisher::new(&config),
            retrospection: Retrospection::default(),
            former: Former::default(),
            gone_before: Timestamp::MIN,
            counts: Counts::default(),
        }
    }

    /// Takes in an accepted frame.
    pub(crate) fn handle(
        &mut self,
        frame: &DetectionFrame,
        (agent, record, source): (AgentSlot, &AgentRecord, Option<Source>),
        agents: &Agents,
    ) -> Innovations {
        let look = record.look(frame);
        let sensing = if record.description.is_some() { &record.sensing } else { &self.undescribed };
        let slot = self.frames.insert(frame, agent, sensing, look);
        if let Some(source) = source {
            self.frames.note_source(slot, source);
        }
        self.begin_instant(slot);
        self.merges_due.clear();
        let innovations = self.take_in(slot, agents);
        self.find_shared(slot);
        let again = self.blurred_before(slot);
        if again.is_empty() {
            self.find_duplicates(slot);
            self.order();
        } else {
            self.reconsider((slot, again), agents);
        }
        self.spare.truncate(MAX_SPARE);
        self.merge(slot, agents);
        innovations
    }

    /// Finds out what a stored frame's reports are of.
    fn take_in(&mut self, slot: FrameSlot, agents: &Agents) -> Innovations {
        self.measurements.clear();
        self.measurements.extend(self.frames.measurements(slot));
        self.expect_tracks(slot, agents);
        let innovations = self.associate(slot);
        self.add_evidence(slot, agents);
        self.give_births(slot, agents);
        innovations
    }

    /// With particles: drops versions that nobody holds, and puts the others in order.
    fn order(&mut self) {
        if self.particles.is_some() {
            versions::order(&mut self.tracks, &mut self.spare);
        }
    }

    fn records<'a>(config: &EngineConfig, frames: &'a FrameStore, agents: &'a Agents) -> Records<'a> {
        let EngineConfig { filter_synchronous: synchronous, late_data, lag, class_priors, .. } = *config;
        let remembers_folded = lag > Span::ZERO;
        Records { frames, agents, synchronous, late_data, remembers_folded, class_moves: class_priors }
    }

    /// Whether there is no room for a frame with so many measurements.
    pub(crate) fn is_full_for(&self, n_measurements: usize) -> bool {
        self.frames.is_full_for(n_measurements)
    }

    /// The time before which the oldest quarter of history ends.
    pub(crate) fn first_quarter(&self) -> Option<Timestamp> {
        self.frames.first_quarter()
    }

    /// Measurements of an agent that are held.
    pub(crate) fn n_measurements_of(&self, agent: AgentSlot) -> usize {
        self.frames.n_measurements_of(agent)
    }

    /// Writes down the objects as of `now`; what the list held is overwritten.
    pub(crate) fn tell(&mut self, objects: &mut Vec<FusedObject>, now: Timestamp, agents: &Agents) {
        let n_particles = self.particles.as_ref().map_or(1, Particles::n);
        self.publisher.fill(objects, (&self.tracks, n_particles), (now, agents), &self.config);
    }

    /// Writes down the objects as of `at`, by all that is known by now; history must reach back so far.
    pub(crate) fn tell_as_of(&mut self, objects: &mut Vec<FusedObject>, at: Timestamp, agents: &Agents) {
        let records = Self::records(&self.config, &self.frames, agents);
        let tracks = self.former.with_present(&self.tracks, at);
        let tracks = (tracks.as_slice(), &mut self.retrospection);
        self.publisher.fill_as_of(objects, tracks, (at, &records), &self.config);
    }

    /// The objects of the newest frame that others report, too.
    pub(crate) fn shared(&self) -> &[Shared] {
        &self.shared
    }

    pub(crate) fn n_tracks(&self) -> usize {
        self.tracks.iter().filter(|track| track.holders.leads()).count()
    }

    pub(crate) fn counts(&self) -> Counts {
        self.counts
    }
}
