//! The engine: frames in, one list of objects out. Pure: time is an argument, and the same calls give the
//! same bits.

use crate::engine::inbox::Inbox;
use crate::engine::{Disposition, Refusal};
use crate::engine::{EngineConfig, MotionModel};
use crate::filter::{ImmState, State};
use crate::fusion::{FusionMethod, Plugged, WindowFusion};
use crate::registration::{AgentRegistration, Bias, Registrar, Registration, Source, correct};
use crate::track::MAX_MEASUREMENTS_OF_AGENT;
use crate::track::{FOLD_SLACK, LateData};
use crate::tracker::HistoryError;
use crate::tracker::{Counts, Innovations, Tracker};
use crate::values::SensorModel;
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::{FusedFrame, Inclusion};
use v2x_common::id::AgentId;
use v2x_common::sensor::SensorDescription;
use v2x_common::time::{Span, Timestamp};

/// Where nobody asks for objects, tracks are settled this often.
const SETTLE_INTERVAL: Span = Span::from_millis(200);
/// Most frames waiting to be named as included in the next fused frame.
const MAX_PENDING: usize = 65_536;

/// The fusion engine of one hub.
#[derive(Debug)]
pub struct Engine {
    config: EngineConfig,
    inbox: Inbox,
    registrar: Registrar,
    /// A frame with its sender's errors taken out; its buffers are used again.
    corrected: Option<DetectionFrame>,
    tracks: Tracks,
    newest_now: Timestamp,
    settled_at: Timestamp,
    pending: Vec<Inclusion>,
    sequence: u64,
    /// The newest fused frame; its buffers are used again.
    fused: FusedFrame,
}

/// The tracks, under the filter that was asked for, or another method in their place.
#[derive(Debug)]
enum Tracks {
    Cv(Tracker<State>),
    Imm(Tracker<ImmState>),
    Plugged(Plugged),
}

impl Tracks {
    fn new(config: EngineConfig) -> Self {
        if let Some(window) = config.window {
            let fusion = WindowFusion::new(window, config.lineage, config.coast);
            return Self::Plugged(Plugged::new(Box::new(fusion), &config.sensing));
        }
        match config.motion {
            MotionModel::Cv => Self::Cv(Tracker::new(config)),
            MotionModel::Imm => Self::Imm(Tracker::new(config)),
        }
    }
}

/// Does the same with the tracks of any filter or method.
macro_rules! with_tracks {
    ($tracks:expr, $tracker:ident => $body:expr) => {
        match $tracks {
            Tracks::Cv($tracker) => $body,
            Tracks::Imm($tracker) => $body,
            Tracks::Plugged($tracker) => $body,
        }
    };
}

impl Engine {
    /// An engine that knows nothing yet.
    pub fn new(config: EngineConfig) -> Self {
        Self::with_tracks(config, Tracks::new(config))
    }

    /// An engine that leaves the fusing to a method of your own: it checks frames and keeps the books as ever. Of
    /// the settings, those about filter and association are without effect.
    pub fn with_fusion(config: EngineConfig, method: Box<dyn FusionMethod>) -> Self {
        Self::with_tracks(config, Tracks::Plugged(Plugged::new(method, &config.sensing)))
    }

    fn with_tracks(config: EngineConfig, tracks: Tracks) -> Self {
        // Without tracks nothing is shared, and without stamps a delay would be a clock that is behind.
        let is_blind = matches!(tracks, Tracks::Plugged(_)) || config.late_data == LateData::IgnoreDelay;
        let registration = if is_blind { Registration::Off } else { config.registration };
        Self {
            config,
            inbox: Inbox::new(&config),
            registrar: Registrar::new(registration),
            corrected: None,
            tracks,
            newest_now: Timestamp::MIN,
            settled_at: Timestamp::MIN,
            pending: Vec::new(),
            sequence: 0,
            fused: FusedFrame {
                hub: config.hub,
                lineage: config.lineage,
                sequence: 0,
                fused_at: Timestamp::EPOCH,
                map_frame: config.map_frame,
                objects: Vec::new(),
                agents: Vec::new(),
                includes: Vec::new(),
            },
        }
    }

    /// Takes in an agent's sensor description.
    pub fn handle_description(&mut self, agent: AgentId, description: SensorDescription) {
        let size_noise = description.size_noise.filter(|_| self.config.debias_sizes);
        let read = SensorDescription { size_noise, ..description };
        let sensing = SensorModel::described(&read, &self.config.sensing);
        if let Some(record) = self.inbox.record_mut(agent) {
            record.description = Some(description);
            record.sensing = sensing;
            self.registrar.describe(agent, description.accuracy, self.newest_now);
        }
    }

    /// Counts a frame that was refused before it was one.
    pub fn note_refusal(&mut self, agent: AgentId, refusal: Refusal) {
        self.inbox.refuse(agent, refusal);
    }

    /// Counts a sensor description that cannot be.
    pub fn note_refused_description(&mut self, agent: AgentId, refusal: Refusal) {
        if let Some(record) = self.inbox.record_mut(agent) {
            record.descriptions_refused += 1;
            record.last_refusal = Some(refusal);
        }
    }

    /// Counts detections whose class name was not known.
    pub fn note_unmapped_classes(&mut self, agent: AgentId, count: u64) {
        if let Some(record) = self.inbox.record_mut(agent) {
            record.unmapped_classes += count;
        }
    }

    /// Takes in a frame, received at `now` by the hub's clock.
    pub fn handle_frame(&mut self, frame: &DetectionFrame, now: Timestamp) -> Disposition {
        // A frame that waited while the hub published is as old as it is now: what it is older than may be
        // folded already.
        self.newest_now = self.newest_now.max(now);
        let stamps = (frame.captured_at, now);
        if self.config.late_data == LateData::IgnoreDelay {
            let arrived = DetectionFrame { captured_at: self.newest_now, ..frame.clone() };
            return self.handle_stamped(&arrived, None, stamps);
        }
        let source = self.registrar.source_of(frame, self.newest_now);
        let Some(bias) = source.map(|source| source.applied).filter(|bias| *bias != Bias::ZERO) else {
            return self.handle_stamped(frame, source, stamps);
        };
        let blank = || DetectionFrame::empty(frame.id, frame.captured_at);
        let mut corrected = self.corrected.take().unwrap_or_else(blank);
        correct(frame, &bias, &mut corrected);
        let disposition = self.handle_stamped(&corrected, source, stamps);
        self.corrected = Some(corrected);
        disposition
    }

    /// Takes in a frame with the capture time and places that the hub takes it to have; the agent's own stamp is only
    /// passed on.
    fn handle_stamped(
        &mut self,
        frame: &DetectionFrame,
        source: Option<Source>,
        (stamp, now): (Timestamp, Timestamp),
    ) -> Disposition {
        let verdict = self.inbox.examine(frame, self.newest_now).and_then(|()| self.make_room(frame));
        if let Err(refusal) = verdict {
            self.inbox.refuse(frame.id.agent, refusal.clone());
            return Disposition::Refused(refusal);
        }
        let out_of_sequence = self.inbox.admit(frame, self.newest_now);
        if self.newest_now - self.settled_at > SETTLE_INTERVAL {
            self.settle(FOLD_SLACK);
        }
        self.note_pending(Inclusion { frame: frame.id, captured_at: stamp, received_at: now });
        let innovations = self.track(frame, source);
        if let Some(record) = self.inbox.record_mut(frame.id.agent) {
            record.nis_sum += innovations.nis_sum;
            record.nis_count += innovations.count;
        }
        // By the frames' own arrivals, so that it does not matter how often the hub publishes.
        self.registrar.advance(now);
        Disposition::Accepted { out_of_sequence }
    }

    fn track(&mut self, frame: &DetectionFrame, source: Option<Source>) -> Innovations {
        let Some((agent, record)) = self.inbox.entry(&frame.id.agent) else { return Innovations::default() };
        let names = self.inbox.names();
        with_tracks!(&mut self.tracks, tracker => {
            let innovations = tracker.handle(frame, (agent, record, source), names);
            self.registrar.observe(tracker.shared());
            innovations
        })
    }

    fn note_pending(&mut self, inclusion: Inclusion) {
        if self.pending.len() < MAX_PENDING {
            self.pending.push(inclusion);
        }
    }

    /// Where frames come faster than they can be remembered, the oldest quarter is folded early: late data as
    /// old as that is then refused as `overloaded`. No agent can fill the room alone.
    fn make_room(&mut self, frame: &DetectionFrame) -> Result<(), Refusal> {
        let count = frame.detections.len();
        if let Some((agent, _)) = self.inbox.entry(&frame.id.agent) {
            let held = with_tracks!(&self.tracks, tracker => tracker.n_measurements_of(agent));
            if held + count > MAX_MEASUREMENTS_OF_AGENT {
                return Err(Refusal::TooManyDetections { limit: MAX_MEASUREMENTS_OF_AGENT });
            }
        }
        if !with_tracks!(&self.tracks, tracker => tracker.is_full_for(count)) {
            return Ok(());
        }
        if let Some(begin) = with_tracks!(&self.tracks, tracker => tracker.first_quarter()) {
            self.inbox.begin_history_at(begin.min(self.newest_now));
            self.settle(Span::ZERO);
        }
        let is_full = with_tracks!(&self.tracks, tracker => tracker.is_full_for(count));
        if is_full || frame.captured_at < self.inbox.horizon() {
            return Err(Refusal::Overloaded { age: self.newest_now - frame.captured_at });
        }
        Ok(())
    }

    /// Replays late data and forgets what can no longer matter.
    fn settle(&mut self, slack: Span) {
        self.settled_at = self.newest_now;
        self.inbox.tell_time(self.newest_now);
        let horizon = self.inbox.history_begins(self.config.memory());
        let (now, names) = (self.newest_now, self.inbox.names());
        with_tracks!(&mut self.tracks, tracker => tracker.settle(now, (horizon, slack), names));
    }

    /// The list of objects as of `now`, and what is new in it since the last call.
    ///
    /// With a lag, as they stood so long before `now`, by everything known by now, and `fused_at` says when that was
    /// (under overload history may be shorter than the lag: then it is as old as history). What is new in the list
    /// may then have been captured after `fused_at`.
    pub fn fused(&mut self, now: Timestamp) -> &FusedFrame {
        if self.config.lag > Span::ZERO {
            self.look_around(now);
            let begins = self.inbox.history_begins(self.config.memory());
            return self.tell_as_of((now - self.config.lag).max(begins));
        }
        self.look_around(now);
        let (fused, inbox, tracks) = self.begin_frame(now);
        with_tracks!(tracks, tracker => tracker.tell(&mut fused.objects, now, inbox.names()));
        fused
    }

    /// The list of objects as they stood at `at`, by everything known by `now`; `fused_at` is `at`. What is new
    /// since the last call is named as by [`Self::fused`].
    ///
    /// History reaches back for Δmax or the lag, whichever is longer. What was folded before a longer lag was asked for
    /// is gone.
    pub fn fused_as_of(&mut self, at: Timestamp, now: Timestamp) -> Result<&FusedFrame, HistoryError> {
        self.look_around(now);
        let begins = self.inbox.history_begins(self.config.memory());
        if at > self.newest_now {
            return Err(HistoryError::InFuture { at, now: self.newest_now });
        }
        if at < begins {
            return Err(HistoryError::Forgotten { at, begins });
        }
        Ok(self.tell_as_of(at))
    }

    fn look_around(&mut self, now: Timestamp) {
        self.newest_now = self.newest_now.max(now);
        self.settle(FOLD_SLACK);
    }

    fn tell_as_of(&mut self, at: Timestamp) -> &FusedFrame {
        let (fused, inbox, tracks) = self.begin_frame(at);
        with_tracks!(tracks, tracker => tracker.tell_as_of(&mut fused.objects, at, inbox.names()));
        fused
    }

    /// A fused frame but for its objects.
    fn begin_frame(&mut self, fused_at: Timestamp) -> (&mut FusedFrame, &Inbox, &mut Tracks) {
        let Self { fused, pending, inbox, tracks, .. } = self;
        fused.sequence = self.sequence;
        self.sequence += 1;
        fused.fused_at = fused_at;
        fused.map_frame = inbox.map_frame();
        fused.agents.clear();
        fused.agents.extend(inbox.agents().map(|(agent, record)| record.health(*agent)));
        fused.includes.clear();
        fused.includes.append(pending);
        (fused, inbox, tracks)
    }

    /// What is believed of the clock and pose errors of every agent that describes its accuracy.
    pub fn registration(&self) -> impl Iterator<Item = AgentRegistration> {
        self.registrar.report()
    }

    /// The books on every agent.
    pub fn inbox(&self) -> &Inbox {
        &self.inbox
    }

    /// Number of tracks, published or not.
    pub fn n_tracks(&self) -> usize {
        with_tracks!(&self.tracks, tracker => tracker.n_tracks())
    }

    /// What happened to tracks.
    pub fn counts(&self) -> Counts {
        with_tracks!(&self.tracks, tracker => tracker.counts())
    }
}
