//! Tracking as a fusion method: the tracker, readers of its assignments, and publishing.

use super::config::{Births, TrackingConfig};
use super::method::{AdmittedFrame, FrameOutcome, FusionMethod, NoMemory, TrackCounts};
use crate::association::ClassRule;
use crate::duplicates::{Duplicates, Exclusion};
use crate::filter::Filter;
use crate::learning::{FrameReading, FrameSource, Learner, LearntSensorReport, Prior};
use crate::publish::{AgentReading, ObjectList, PastTracks, PublishConfig, Publisher, Readings, TrackList};
use crate::registration::PairFinder;
use crate::track::{FixedLagSmoother, FrameSlot, Horizon, PreMergeTracks, SensedFrame};
use crate::tracker::{Horizons, Lifetimes, Tracker};
use crate::values::{AgentNames, AgentSlot, HeadingLaw, PoseErrors, Saved, StateError, saved};
use v2x_common::id::TrackId;
use v2x_common::time::{Span, Timestamp};

/// Learning from evidence, and folding it, look at all that is held: they need not come with each of many lists.
const FOLDED_EVERY: Span = Span::from_millis(100);

/// Tracks under one kind of filter.
#[derive(Debug)]
pub(super) struct Tracking<F> {
    config: TrackingConfig,
    tracker: Tracker<F>,
    pairs: PairFinder,
    duplicates: Duplicates,
    exclusion: Exclusion,
    found: Vec<(TrackId, TrackId)>,
    delta_max: Span,
    /// When evidence was last folded.
    folded_at: Timestamp,
    merges: u64,
    /// With a lag: merged tracks, as they were before.
    pre_merge: PreMergeTracks<F>,
    learner: Option<Learner>,
    /// What is unknown of the pose of each agent, by slot.
    pose_errors: Vec<PoseErrors>,
    /// What is known of each agent, for the list that is being written.
    readings: Vec<AgentReading>,
    publisher: Publisher<F>,
    smoother: FixedLagSmoother<F>,
}

saved!([F: Filter] Tracking<F>, saved {
    tracker, pairs, duplicates, exclusion, folded_at, merges, pre_merge, learner, pose_errors, publisher
}, made_anew { config, found, delta_max, readings, smoother });

impl<F: Filter> Tracking<F> {
    /// A method without tracks yet. Its track ids are of this lineage.
    pub(super) fn new(config: TrackingConfig, lifetimes: Lifetimes, lineage: u32) -> Self {
        let publish = PublishConfig {
            existence: config.publish_existence,
            coast: lifetimes.coast,
            class_size_priors: config.class_size_priors,
            synchronous: config.tracker.synchronous,
        };
        Self {
            config,
            tracker: Tracker::new(config.tracker, lifetimes, lineage),
            pairs: PairFinder::default(),
            duplicates: Duplicates::default(),
            exclusion: Exclusion::default(),
            found: Vec::new(),
            delta_max: lifetimes.delta_max,
            folded_at: Timestamp::MIN,
            merges: 0,
            pre_merge: PreMergeTracks::default(),
            learner: config.learning.then(|| Learner::new(lifetimes.delta_max)),
            pose_errors: Vec::new(),
            readings: Vec::new(),
            publisher: Publisher::new(publish),
            smoother: FixedLagSmoother::default(),
        }
    }

    /// Associates a less accurate frame of the newest instant again, after a more accurate one.
    fn reassociate(&mut self, frames: &[FrameSlot], agents: &AgentNames) {
        self.tracker.retract(frames, agents);
        while let Some(slot) = self.tracker.next_retracted() {
            self.tracker.associate(slot, agents);
            self.observe_duplicates(slot);
        }
    }

    /// How a frame is read as evidence of existence.
    fn read(&mut self, admitted: &AdmittedFrame<'_>) -> FrameReading {
        let AdmittedFrame { frame, sensor, coverage, is_described, agent, agents, .. } = *admitted;
        let mut model = sensor.model();
        if self.config.tracker.association.turned_headings {
            model.headings = HeadingLaw::UNKNOWN;
        }
        let declared = FrameReading { model, coverage };
        let Some(learner) = &mut self.learner else { return self.at_birth(declared, is_described) };
        let source = FrameSource { agent, frame, declared: is_described.then_some(declared) };
        let mut reading = learner.read(&source, &Prior::of(&sensor.model()), agents);
        if !self.config.tracker.association.turned_headings {
            reading.model.headings = HeadingLaw::AsReported;
        }
        self.at_birth(reading, is_described)
    }

    /// With the odds of a new object.
    fn at_birth(&self, mut reading: FrameReading, is_described: bool) -> FrameReading {
        if self.config.births == Births::AtOnce && !is_described {
            reading.model.birth_odds = f64::INFINITY;
        }
        reading
    }

    /// A frame is read with the errors of its agent's pose: those declared, or those learnt where none are. What was learnt of
    /// errors that last includes them.
    fn with_pose_errors(&mut self, mut reading: FrameReading, admitted: &AdmittedFrame<'_>) -> FrameReading {
        let AdmittedFrame { agent, pose_errors, .. } = *admitted;
        if self.pose_errors.len() <= agent.index() {
            self.pose_errors.resize(agent.index() + 1, PoseErrors::NONE);
        }
        let pose_errors = if pose_errors.are_none() { reading.model.pose } else { pose_errors };
        self.pose_errors[agent.index()] = pose_errors;
        reading.model.pose = pose_errors;
        let lasting = &mut reading.model.errors.lasting;
        *lasting = (*lasting - pose_errors.position).max(0.0);
        reading
    }

    /// Notes what is known of each agent at a time.
    fn read_agents(&mut self, at: Timestamp) {
        let Self { learner, pose_errors, readings, .. } = self;
        readings.clear();
        let pose = |slot: usize| pose_errors.get(slot).map_or(0.0, |errors| errors.position);
        if let Some(learner) = learner {
            readings.extend((0..).zip(learner.known_at(at)).map(|(slot, (lasting, classes))| AgentReading {
                lasting: (lasting - pose(slot)).max(0.0),
                pose: pose(slot),
                classes,
            }));
        }
    }

    /// Whether the agents' beliefs of classes are combined; else the shares of reported classes are published.
    fn believes(&self) -> bool {
        self.config.tracker.association.classes == ClassRule::Evidence
    }

    fn observe_duplicates(&mut self, slot: FrameSlot) {
        if self.config.resolve_duplicates {
            self.duplicates.observe(&self.tracker.assigned(slot));
        }
    }

    /// Learns from what cannot change any more; from when on evidence is still needed.
    fn learn(&mut self, now: Timestamp, horizon: &Horizon, agents: &AgentNames) -> Horizon {
        let Some(learner) = &mut self.learner else { return *horizon };
        self.tracker.replay(agents);
        let final_before = horizon.at.max(now - self.delta_max);
        learner.advance(self.tracker.tracks().all(), final_before, &self.tracker.context(agents));
        Horizon { at: horizon.at.min(learner.needs_from()), ..*horizon }
    }

    fn merge_duplicates(&mut self, captured_at: Timestamp, agents: &AgentNames) {
        let Self { config, tracker, duplicates, exclusion, found, pre_merge, .. } = self;
        duplicates.take_found(found);
        if config.tracker.exclusion {
            exclusion.observe(captured_at, tracker.tracks().all(), found);
        }
        for pair in found.drain(..) {
            let is_merged = tracker.merge(pair, agents, |older, younger| {
                if config.tracker.hypotheses.longest_lag() > Span::ZERO {
                    pre_merge.note(older, younger, captured_at);
                }
            });
            self.merges += u64::from(is_merged);
        }
    }
}

impl<F: Filter + Send> FusionMethod for Tracking<F> {
    fn handle_frame(&mut self, admitted: &AdmittedFrame<'_>) -> FrameOutcome<'_> {
        let AdmittedFrame { frame, sensor, agent, agents, source, .. } = *admitted;
        let reading = self.read(admitted);
        let FrameReading { model, coverage } = self.with_pose_errors(reading, admitted);
        let slot = self.tracker.store(&SensedFrame { frame, agent, sensor, model: &model, coverage });
        self.pairs.begin_frame(slot, source, frame.detections.len());
        self.tracker.associate(slot, agents);
        self.pairs.observe(&self.tracker.assigned(slot));
        let innovations = self.tracker.assigned(slot).assignment.innovations();
        let again = self.tracker.to_reassociate(slot);
        for other in &again {
            self.duplicates.retract(*other, frame.captured_at);
        }
        if !again.contains(&slot) {
            self.observe_duplicates(slot);
        }
        if !again.is_empty() {
            self.reassociate(&again, agents);
        }
        self.tracker.finish();
        self.merge_duplicates(frame.captured_at, agents);
        FrameOutcome { innovations, shared: self.pairs.shared() }
    }

    fn write_objects(&mut self, now: Timestamp, agents: &AgentNames, objects: &mut ObjectList<'_>) {
        self.read_agents(now);
        let (tracks, n_hypotheses) = (self.tracker.tracks().all(), self.tracker.n_hypotheses());
        let hidden = &|track| self.exclusion.hides(track);
        let readings = &Readings { hidden, agents: &self.readings, combines_beliefs: self.believes() };
        let list = TrackList { tracks, n_hypotheses, agents, readings };
        self.publisher.write(objects, &list, now);
    }

    fn write_objects_as_of(
        &mut self,
        at: Timestamp,
        agents: &AgentNames,
        objects: &mut ObjectList<'_>,
    ) -> Result<(), NoMemory> {
        self.read_agents(at);
        let context = self.tracker.context(agents);
        let tracks = self.pre_merge.with_present(self.tracker.tracks().all(), at);
        let hidden = &|track| self.exclusion.hides(track);
        let readings = &Readings { hidden, agents: &self.readings, combines_beliefs: self.believes() };
        let past = PastTracks { tracks: &tracks, at, context: &context, readings };
        self.publisher.write_as_of(objects, &past, &mut self.smoother);
        Ok(())
    }

    fn maintain(&mut self, now: Timestamp, horizon: &Horizon, agents: &AgentNames) {
        let is_due = horizon.slack == Span::ZERO || now - self.folded_at > FOLDED_EVERY;
        let held = if is_due { Some(self.learn(now, horizon, agents)) } else { None };
        let publisher = &mut self.publisher;
        let horizons = Horizons { tracks: *horizon, evidence: held };
        self.tracker.maintain(now, &horizons, agents, |track| publisher.note_deleted(track));
        let Some(held) = held else { return };
        self.folded_at = now;
        self.pre_merge.maintain(&held, &self.tracker.context(agents));
        self.tracker.forget_frames(&held);
        self.duplicates.maintain(now, self.tracker.tracks());
    }

    fn take_back(&mut self, agent: AgentSlot, after: Timestamp, agents: &AgentNames) {
        self.tracker.take_back(agent, after, agents);
    }

    fn learnt(&self, agent: AgentSlot) -> Option<LearntSensorReport> {
        self.learner.as_ref()?.report(agent)
    }

    fn save(&self, out: &mut Vec<u8>) -> Result<(), StateError> {
        Saved::save(self, out)
    }

    fn load(&mut self, bytes: &mut &[u8]) -> Result<(), StateError> {
        Saved::load(self, bytes)
    }

    fn counts(&self) -> TrackCounts {
        let tracks = self.tracker.tracks();
        TrackCounts {
            tracks: tracks.n_leading(),
            births_refused: tracks.initiations_refused(),
            merges: self.merges,
            candidates: self.tracker.candidates_weighed(),
        }
    }
}
