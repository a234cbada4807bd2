//! The engine: frames in, one list of objects out. Pure: time is an argument, and the same calls give the same bits.

use super::admission::{Admission, Admitted};
use super::agents::AgentRegistry;
use super::config::EngineConfig;
use super::held_up::HeldUp;
use super::history::{History, MAX_MEASUREMENTS_OF_AGENT};
use super::output::Outputs;
use super::refusal::{Disposition, Refusal};
use super::sieve::Sieve;
use super::statistics::DroppedDetections;
use crate::fusion::{AdmittedFrame, FusionMethod, LateFrames, ObjectList, TrackCounts};
use crate::learning::LearntSensorReport;
use crate::registration::{AgentRegistration, Bias, Registrar, Registration, Source, correct};
use crate::track::{FOLD_SLACK, Horizon};
use crate::values::{PoseErrors, Saved, SensingDefaults, SensorModel, StateError, saved};
use std::collections::BTreeMap;
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::{FusedFrame, FusedObject, Inclusion};
use v2x_common::id::AgentId;
use v2x_common::sensor::{Accuracy, InvalidDescription, SensorDescription};
use v2x_common::time::{Span, Timestamp};
use v2x_common::unmapped_names::UnmappedNames;
use v2x_common::wire::WireError;

/// Without a call for objects, history is maintained this often.
const MAINTENANCE_INTERVAL: Span = Span::from_millis(200);
/// Most frames waiting to be named as included in the next fused frame.
const MAX_PENDING: usize = 65_536;

/// Which of the lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum List {
    First,
    Second,
}

/// The fusion engine of one hub.
#[derive(Debug)]
pub struct Engine {
    config: EngineConfig,
    admission: Admission,
    agents: AgentRegistry,
    history: History,
    registrar: Registrar,
    method: Box<dyn FusionMethod>,
    /// How detections are read of agents that describe no sensor.
    undescribed: SensorModel,
    /// The same for single agents.
    assumed: BTreeMap<AgentId, SensorModel>,
    sieve: Sieve,
    /// A frame, corrected for its agent's errors; its buffers are used again.
    corrected: Option<DetectionFrame>,
    /// The newest time that any call named.
    now: Timestamp,
    maintained_at: Timestamp,
    /// Not long ago it did not run for a while.
    held_up: Option<HeldUp>,
    pending: Vec<Inclusion>,
    outputs: Outputs,
    spare_objects: Vec<FusedObject>,
}

saved!([] Engine, saved {
    admission, agents, history, registrar, sieve, now, maintained_at, held_up, pending, outputs, method
}, made_anew { config, undescribed, assumed, corrected, spare_objects });

impl Saved for Box<dyn FusionMethod> {
    fn save(&self, out: &mut Vec<u8>) -> Result<(), StateError> {
        self.as_ref().save(out)
    }

    fn load(&mut self, bytes: &mut &[u8]) -> Result<(), StateError> {
        self.as_mut().load(bytes)
    }
}

/// The past is not held, or not at all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HistoryError {
    /// It is no longer held.
    #[error("objects as of {at} are asked for, but history begins at {begins}")]
    Forgotten {
        /// The time that is asked for.
        at: Timestamp,
        /// The oldest time that can be asked for: Δmax or the lag ago, whichever is longer; later under overload.
        begins: Timestamp,
    },
    /// It lies in the future.
    #[error("objects as of {at} are asked for, which is after the present, {now}")]
    InFuture {
        /// The time that is asked for.
        at: Timestamp,
        /// The present.
        now: Timestamp,
    },
    /// The method keeps no history.
    #[error(transparent)]
    NoMemory(#[from] crate::fusion::NoMemory),
}

/// A frame on its way through the engine.
#[derive(Clone, Copy)]
struct Arrival<'a> {
    /// With the capture time and places that the hub takes it to have.
    frame: &'a DetectionFrame,
    source: Option<Source>,
    /// The agent's own stamp.
    stamped_at: Timestamp,
    received_at: Timestamp,
}

impl Engine {
    /// An engine that knows nothing yet.
    pub fn new(config: EngineConfig) -> Self {
        Self::around(
            config,
            config.fusion.start(config.lifetimes(), config.lineage),
            config.fusion.registration(),
        )
    }

    /// An engine that leaves fusing to a method of your own: it admits frames and keeps the statistics as ever.
    /// [`EngineConfig::fusion`] is without effect.
    pub fn with_fusion(config: EngineConfig, method: Box<dyn FusionMethod>) -> Self {
        Self::around(config, method, Registration::Off)
    }

    /// An engine of these settings that goes on where another one was saved by [`Saved::save`].
    ///
    /// # Errors
    /// Where the bytes are no state that this build saved under such settings.
    pub fn restored(config: EngineConfig, mut bytes: &[u8]) -> Result<Self, StateError> {
        let mut engine = Self::new(config);
        engine.load(&mut bytes)?;
        match bytes.len() {
            0 => Ok(engine),
            left => Err(StateError::LeftOver(left)),
        }
    }

    fn around(config: EngineConfig, method: Box<dyn FusionMethod>, registration: Registration) -> Self {
        // Without stamps a delay would look like a clock that is behind.
        let ignores_stamps = config.late_frames == LateFrames::IgnoreDelay;
        let registration = if ignores_stamps { Registration::Off } else { registration };
        Self {
            config,
            admission: Admission::new(&config),
            agents: AgentRegistry::new(config.coast.longest() + config.delta_max + config.memory()),
            history: History::new(config.memory(), config.delta_max),
            registrar: Registrar::new(registration),
            method,
            undescribed: SensorModel::undescribed(&config.sensing),
            assumed: BTreeMap::new(),
            sieve: Sieve::default(),
            corrected: None,
            now: Timestamp::MIN,
            maintained_at: Timestamp::MIN,
            held_up: None,
            pending: Vec::new(),
            outputs: Outputs::new(&config),
            spare_objects: Vec::new(),
        }
    }

    /// What is assumed about an agent as long as it describes no sensor: its detection probability and its clutter.
    pub fn assume(&mut self, agent: AgentId, sensing: &SensingDefaults) {
        self.assumed.insert(agent, SensorModel::undescribed(sensing));
    }

    /// Takes in an agent's sensor description.
    ///
    /// # Errors
    /// Names the field and its value where it is invalid. That is counted, and the description before it holds.
    pub fn handle_description(
        &mut self,
        agent: AgentId,
        description: SensorDescription,
    ) -> Result<(), InvalidDescription> {
        if let Err(invalid) = description.validate() {
            self.note_refused_description(agent, WireError::from(invalid.clone()).into());
            return Err(invalid);
        }
        let size_noise = description.size_noise.filter(|_| self.config.debias_sizes);
        let read = SensorDescription { size_noise, ..description };
        let sensor = SensorModel::described(&read, &self.config.sensing);
        if let Some((_, record)) = self.agents.heard(agent, self.now) {
            record.description = Some(description);
            record.sensor = sensor;
            self.registrar.describe(agent, description.accuracy, self.now);
        } else {
            self.agents.note_beyond_limit();
        }
        Ok(())
    }

    /// Takes in the accuracy of an agent's pose and clock, of which nothing else is known: its clock and pose are
    /// estimated, but what it misses counts as before.
    pub fn declare_accuracy(&mut self, agent: AgentId, accuracy: Accuracy) {
        self.registrar.describe(agent, accuracy, self.now);
    }

    /// Counts a frame that was refused before it was decoded.
    pub fn note_refusal(&mut self, agent: AgentId, refusal: Refusal) {
        self.note_refusals(agent, refusal, 1);
    }

    /// Counts several frames that were refused for one reason before they were decoded.
    pub fn note_refusals(&mut self, agent: AgentId, refusal: Refusal, count: u64) {
        self.agents.note_refusals(agent, refusal, count, self.now);
    }

    /// Counts a sensor description that was refused.
    pub fn note_refused_description(&mut self, agent: AgentId, refusal: Refusal) {
        if let Some((_, record)) = self.agents.heard(agent, self.now) {
            record.statistics.descriptions_refused += 1;
            record.statistics.last_refused_description = Some(refusal.clone());
            record.statistics.last_refusal = Some(refusal);
        } else {
            self.agents.note_beyond_limit();
        }
    }

    /// Counts detections whose class name was not known.
    pub fn note_unmapped_classes(&mut self, agent: AgentId, names: &UnmappedNames) {
        if let Some((_, record)) = self.agents.heard(agent, self.now) {
            record.statistics.unmapped_classes.merge(names);
        }
    }

    /// The hub did not run for a while until `now`, and nothing of that while was taken in: tracks are kept until agents had
    /// time to report what is still there.
    pub fn note_held_up(&mut self, now: Timestamp, lasted: Span) {
        self.held_up = Some(HeldUp::new(now, lasted));
    }

    /// The clock of the hub's system was set: it is so far ahead of the hub's own timeline, which nobody sets. Agents on the same
    /// system, and those that follow it, have stamps by that clock now.
    pub const fn note_clock_step(&mut self, step: Span) {
        self.admission.clock_step = step;
    }

    /// Takes in a frame that was received at `now` by the hub's clock. It is refused as a whole where the frame itself has
    /// an invalid value (its pose, the number of detections); a detection with one is dropped and counted.
    pub fn handle_frame(&mut self, frame: &DetectionFrame, now: Timestamp) -> Disposition {
        // The age of a frame includes its waiting time: history may have been folded meanwhile.
        self.now = self.now.max(now);
        let shift = self.admission.shift_of(frame.captured_at, self.now);
        if shift == Span::ZERO {
            return self.handle_stamped(frame, now, shift);
        }
        let shifted = DetectionFrame { captured_at: frame.captured_at + shift, ..frame.clone() };
        self.handle_stamped(&shifted, now, shift)
    }

    /// Takes in a frame whose stamp is by the hub's timeline; `shift` was added to it.
    fn handle_stamped(&mut self, frame: &DetectionFrame, now: Timestamp, shift: Span) -> Disposition {
        if let Err(invalid) = frame.validate_head() {
            return self.refuse(frame.id.agent, WireError::from(invalid).into());
        }
        let mut dropped = DroppedDetections::default();
        let Some(thin) = self.sieve.thin(frame, |invalid| dropped.note(invalid)) else {
            return self.handle_possible(frame, now, shift);
        };
        let disposition = self.handle_possible(&thin.0, now, shift);
        let is_accepted = matches!(disposition, Disposition::Accepted { .. });
        if is_accepted && let Some((_, record)) = self.agents.heard(frame.id.agent, self.now) {
            record.statistics.dropped.merge(dropped);
        }
        self.sieve.give_back(thin, is_accepted.then_some(self.now));
        disposition
    }

    /// Takes in a frame without impossible values.
    fn handle_possible(&mut self, frame: &DetectionFrame, now: Timestamp, shift: Span) -> Disposition {
        let stamped_at = frame.captured_at - shift;
        let arrival = Arrival { frame, source: None, stamped_at, received_at: now };
        if self.config.late_frames == LateFrames::IgnoreDelay {
            let arrived = DetectionFrame { captured_at: self.now, ..frame.clone() };
            return self.handle(&Arrival { frame: &arrived, ..arrival });
        }
        let source = self.registrar.source_of(frame, self.now);
        let Some(bias) = source.map(|source| source.applied).filter(|bias| *bias != Bias::ZERO) else {
            return self.handle(&Arrival { source, ..arrival });
        };
        let blank = || DetectionFrame::empty(frame.id, frame.captured_at);
        let mut corrected = self.corrected.take().unwrap_or_else(blank);
        correct(frame, &bias, &mut corrected);
        let disposition = self.handle(&Arrival { frame: &corrected, source, ..arrival });
        self.corrected = Some(corrected);
        disposition
    }

    fn handle(&mut self, arrival: &Arrival<'_>) -> Disposition {
        match self.admit(arrival.frame) {
            Ok(admitted) => {
                self.fuse(arrival, admitted);
                Disposition::Accepted { out_of_sequence: admitted.out_of_sequence }
            }
            Err(refusal) => self.refuse(arrival.frame.id.agent, refusal),
        }
    }

    fn refuse(&mut self, agent: AgentId, refusal: Refusal) -> Disposition {
        self.agents.note_refusals(agent, refusal.clone(), 1, self.now);
        Disposition::Refused(refusal)
    }

    fn admit(&mut self, frame: &DetectionFrame) -> Result<Admitted, Refusal> {
        self.admission.note_map_frame(frame, self.now);
        let admitted = self.admission.admit(frame, self.now, &self.agents, &self.history)?;
        self.make_room(frame)?;
        Ok(admitted)
    }

    /// Where frames come faster than they can be held, the oldest quarter of history is given up.
    fn make_room(&mut self, frame: &DetectionFrame) -> Result<(), Refusal> {
        let count = frame.detections.len();
        if let Some((agent, _)) = self.agents.entry(&frame.id.agent)
            && self.history.is_full_of(agent, count)
        {
            return Err(Refusal::TooManyDetections { limit: MAX_MEASUREMENTS_OF_AGENT });
        }
        if !self.history.is_full_for(count) {
            return Ok(());
        }
        self.history.give_up_quarter(self.now);
        self.maintain(Span::ZERO);
        if self.history.is_full_for(count) || frame.captured_at < self.history.admits_from(self.now) {
            return Err(Refusal::Overloaded { age: self.now - frame.captured_at });
        }
        Ok(())
    }

    fn fuse(&mut self, arrival: &Arrival<'_>, admitted: Admitted) {
        let Arrival { frame, source, stamped_at, received_at } = *arrival;
        self.admission.note(frame, self.now);
        let Some((slot, record)) = self.agents.heard(frame.id.agent, self.now) else { return };
        record.note_accepted(frame, self.now - self.config.delta_max, self.now);
        record.statistics.accepted += 1;
        record.statistics.synchronous += u64::from(admitted.is_synchronous);
        record.statistics.out_of_sequence += u64::from(admitted.out_of_sequence);
        record.statistics.ahead_of_time += u64::from(admitted.ahead_of_time);
        let is_set_back = record.is_set_back(frame, admitted.ahead_of_time, self.now);
        record.statistics.clock_set_back += u64::from(is_set_back);
        if self.now - self.maintained_at > MAINTENANCE_INTERVAL {
            self.maintain(FOLD_SLACK);
        }
        self.history.note(slot, frame.captured_at, frame.detections.len());
        if self.pending.len() < MAX_PENDING {
            self.pending.push(Inclusion { frame: frame.id, captured_at: stamped_at, received_at });
        }
        if is_set_back {
            self.method.take_back(slot, frame.captured_at, self.agents.names());
        }
        let Some((agent, record)) = self.agents.entry(&frame.id.agent) else { return };
        let declared = || record.description.map(|description| PoseErrors::declared(&description.accuracy));
        let estimated = self.registrar.pose_errors(frame.id.agent);
        let pose_errors = estimated.or_else(declared).unwrap_or(PoseErrors::NONE);
        let assumed = self.assumed.get(&frame.id.agent).unwrap_or(&self.undescribed);
        let outcome = self.method.handle_frame(&AdmittedFrame {
            frame,
            received_at: self.now,
            sensor: if record.description.is_some() { &record.sensor } else { assumed },
            is_described: record.description.is_some(),
            pose_errors,
            coverage: record.coverage(frame),
            agent,
            agents: self.agents.names(),
            source,
        });
        self.registrar.observe(outcome.shared);
        let innovations = outcome.innovations;
        if let Some((_, record)) = self.agents.heard(frame.id.agent, self.now) {
            record.statistics.note_innovations(&innovations, self.now);
        }
        // By the arrivals of frames, so that it does not matter how often the hub publishes.
        self.registrar.advance(received_at);
    }

    /// Replays late data, and forgets what can no longer matter.
    fn maintain(&mut self, slack: Span) {
        self.maintained_at = self.now;
        let more = self.held_up.map_or(Span::ZERO, |held_up| held_up.keeps(self.now));
        let horizon = Horizon { at: self.history.begins(self.now) - more, slack };
        self.method.maintain(self.now, &horizon, self.agents.names());
        self.history.forget_before(&horizon);
    }

    /// The list of objects as of `now`, and what is new in it since the last call. Times never go back: an earlier `now`
    /// than that of another call counts as that.
    ///
    /// With a lag, the list holds the objects as they were that long before, by all later evidence, and `fused_at` is that
    /// time. Under overload history can be shorter than the lag; then the list is as old as history. Frames that are new
    /// in the list can have been captured after `fused_at`.
    pub fn fused(&mut self, now: Timestamp) -> &FusedFrame {
        self.advance(now);
        let lag = self.config.fusion.lag();
        if lag > Span::ZERO {
            let at = (self.now - lag).max(self.history.begins(self.now));
            if self.write_as_of(at, List::First).is_ok() {
                return &self.outputs.first.frame;
            }
        }
        let Self { outputs, pending, agents, .. } = self;
        outputs.first.begin(self.now, self.admission.map_frame(), agents, pending);
        let frame = &mut outputs.first.frame;
        let objects = ObjectList::new(&mut frame.objects, &mut self.spare_objects);
        let mut objects = objects.naming(self.config.contributors);
        self.method.write_objects(self.now, agents.names(), &mut objects);
        drop(objects);
        self.sieve.name_as_sent(&mut frame.objects);
        frame
    }

    /// The second list: the same objects by the same tracks, as they stood a lag before `now`, by all that is known by now.
    /// `None` where the settings have no second list. It names no frames as new.
    pub fn lagged(&mut self, now: Timestamp) -> Option<&FusedFrame> {
        let lag = self.config.fusion.second_lag()?;
        self.advance(now);
        let at = (self.now - lag).max(self.history.begins(self.now));
        self.write_as_of(at, List::Second).ok()?;
        Some(&self.outputs.second.frame)
    }

    /// The list of objects as they stood at `at`, by everything known by `now`; `fused_at` is `at`. What is new since
    /// the last call is named as by [`Self::fused`].
    ///
    /// History reaches back for Δmax or the lag, whichever is longer. What was folded before a longer lag was asked for
    /// is gone.
    ///
    /// # Errors
    /// Where the past is not held.
    pub fn fused_as_of(&mut self, at: Timestamp, now: Timestamp) -> Result<&FusedFrame, HistoryError> {
        self.advance(now);
        let begins = self.history.begins(self.now);
        if at > self.now {
            return Err(HistoryError::InFuture { at, now: self.now });
        }
        if at < begins {
            return Err(HistoryError::Forgotten { at, begins });
        }
        self.write_as_of(at, List::First)?;
        Ok(&self.outputs.first.frame)
    }

    fn advance(&mut self, now: Timestamp) {
        self.now = self.now.max(now);
        self.maintain(FOLD_SLACK);
    }

    fn write_as_of(&mut self, at: Timestamp, list: List) -> Result<(), HistoryError> {
        let Self { outputs, pending, agents, .. } = self;
        let output = match list {
            List::First => &mut outputs.first,
            List::Second => &mut outputs.second,
        };
        let objects = ObjectList::new(&mut output.frame.objects, &mut self.spare_objects);
        let mut objects = objects.naming(self.config.contributors);
        self.method.write_objects_as_of(at, agents.names(), &mut objects)?;
        drop(objects);
        self.sieve.name_as_sent(&mut output.frame.objects);
        let mut none = Vec::new();
        let new = if list == List::First { pending } else { &mut none };
        output.begin(at, self.admission.map_frame(), agents, new);
        Ok(())
    }

    /// The estimated clock and pose errors of every agent that describes its accuracy.
    pub fn registration(&self) -> impl Iterator<Item = AgentRegistration> {
        self.registrar.report()
    }

    /// Agents that describe their accuracy, and of which the errors are not estimated for want of a place.
    pub fn unregistered(&self) -> impl Iterator<Item = AgentId> {
        self.registrar.left_out(self.now)
    }

    /// The agents, and what is counted of them.
    pub const fn agents(&self) -> &AgentRegistry {
        &self.agents
    }

    /// What is learnt of an agent's sensor; `None` where nothing is.
    pub fn learnt(&self, agent: &AgentId) -> Option<LearntSensorReport> {
        self.method.learnt(self.agents.names().slot(agent)?)
    }

    /// The newest time that any call named.
    pub const fn now(&self) -> Timestamp {
        self.now
    }

    /// Tracks, and what happened to them.
    pub fn counts(&self) -> TrackCounts {
        self.method.counts()
    }
}
