//! Learns from the tracks, epoch after epoch.

use super::agent_learning::{AgentLearning, SETTLED, settled_before};
use super::detection_counts::{Opportunity, ProfilePrior};
use super::epoch::Epoch;
use super::heading_counts::Report;
use super::innovation_counts::{Innovation, InnovationCounts};
use super::pose_counts::{Displaced, SCALES, Stood};
use super::reading::{FrameReading, Prior};
use super::report::LearntSensorReport;
use super::score_counts::{Scored, Witness};
use super::track_memory::{Compared, TrackMemory, WaitingMiss};
use crate::filter::{Filter, Motion};
use crate::track::{Evidence, Snapshot, StoredFrame, Track, TrackContext};
use crate::values::{
    AgentNames, AgentSlot, ClassLaw, ExpectedPlace, HeadingLaw, ScoreModel, SensorAxes, range_bin,
};
use serde::{Deserialize, Serialize};
use v2x_common::class::ClassGroup;
use v2x_common::covariance::Covariance2;
use v2x_common::detection::DetectionFrame;
use v2x_common::id::{AgentId, TrackId};
use v2x_common::time::{Span, Timestamp};

/// A track with so many detections is of something real for learning, whatever others miss.
const PERSISTENT_REPORTS: u32 = 10;
/// Epochs after which it is decided again whether a track is of something real, and where it was; and after which its
/// innovations are looked at, where those of its agents are known well. Each takes a replay.
const DECIDED_EVERY: i64 = 4;
const REAL_CHECKED_EVERY: i64 = 16;
const INNOVATIONS_EVERY: i64 = 32;
/// Where all agents of an epoch are known well, one epoch in so many is learnt from, of each track another one.
const SAMPLED_EVERY: i64 = 4;
/// Tracks that followed an agent whose pose wanders are where others see them so long after that is known.
const RECOVERS_IN: Span = Span::from_millis(3000);
/// An object counts as missed where it is inside of the view by this much, m.
const VIEW_MARGIN_M: f64 = 2.0;

/// Learns of the agents of one hub.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Learner {
    delta_max: Span,
    /// By slot.
    agents: Vec<AgentLearning>,
    /// By id.
    tracks: Vec<(TrackId, TrackMemory)>,
    /// The first epoch that is not learnt yet.
    next: Option<Epoch>,
    /// Whether every agent of the epoch is known well.
    knows_all_well: bool,
    /// Innovations of earlier reports say nothing of them: the tracks followed an agent whose pose was not known to wander.
    innovations_from: Timestamp,
}

/// A frame of an agent, as far as it decides how the frame is read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameSource<'a> {
    pub(crate) agent: AgentSlot,
    pub(crate) frame: &'a DetectionFrame,
    /// How it is read by what the agent declares; `None` where it declares nothing.
    pub(crate) declared: Option<FrameReading>,
}

impl Learner {
    pub(crate) const fn new(delta_max: Span) -> Self {
        Self {
            delta_max,
            agents: Vec::new(),
            tracks: Vec::new(),
            next: None,
            knows_all_well: false,
            innovations_from: Timestamp::MIN,
        }
    }

    /// How a frame is read.
    pub(crate) fn read(
        &mut self,
        source: &FrameSource<'_>,
        prior: &Prior,
        agents: &AgentNames,
    ) -> FrameReading {
        let FrameSource { agent, frame, declared } = *source;
        let settled = settled_before(frame.captured_at, self.delta_max);
        let known = self.agent(agent, agents.name(agent));
        known.is_described = declared.is_some();
        known.prior = declared.map_or(prior.profile, |reading| ProfilePrior {
            probability: reading.model.profile.of_all(0.0),
            correlation: 0.0,
        });
        known.clutter_before = declared.map_or(prior.clutter_per_m2, |reading| reading.model.clutter_per_m2);
        known.declared_area_m2 =
            declared.and_then(|reading| reading.coverage).map(|coverage| coverage.field_of_view.area_m2());
        let learnt = known.as_of(settled).copied().unwrap_or_default();
        let read = learnt.or_shown_by(frame);
        match declared {
            Some(declared) => read.described(&declared),
            None => read.undescribed(prior, frame.sensor_pose, learnt.birth_odds(prior)),
        }
    }

    fn agent(&mut self, slot: AgentSlot, name: AgentId) -> &mut AgentLearning {
        if self.agents.len() <= slot.index() {
            self.agents.resize(slot.index() + 1, AgentLearning::default());
        }
        let known = &mut self.agents[slot.index()];
        if known.name != Some(name) {
            *known = AgentLearning::of(name);
        }
        known
    }

    /// Learns from all epochs that end before `until`, after which nothing older can arrive. Evidence since
    /// [`Self::needs_from`] must still be held, and late evidence must have been replayed.
    pub(crate) fn advance<F: Filter>(
        &mut self,
        tracks: &[Track<F>],
        until: Timestamp,
        context: &TrackContext<'_>,
    ) {
        let end = Epoch::of(until);
        while let Some(epoch) = self.next_with_frames(context).filter(|epoch| *epoch < end) {
            self.learn(epoch, tracks, context);
            self.next = Some(epoch.next());
        }
        self.next = self.next.max(Some(end));
    }

    fn next_with_frames(&self, context: &TrackContext<'_>) -> Option<Epoch> {
        let from = self.next.map_or(Timestamp::MIN, Epoch::begin);
        context.frames.since(from).next().map(|(_, frame)| Epoch::of(frame.captured_at))
    }

    /// Of each agent, by its slot, as known at a time: the variance (m²) of the part of its errors of position that lasts, and
    /// how its classes err.
    pub(crate) fn known_at(&self, at: Timestamp) -> impl Iterator<Item = (f64, ClassLaw)> {
        let settled = settled_before(at, self.delta_max);
        self.agents.iter().map(move |known| {
            known.as_of(settled).map_or((0.0, ClassLaw::UNKNOWN), |learnt| {
                (learnt.errors.lasting + learnt.unseen, learnt.classes)
            })
        })
    }

    /// What is learnt of an agent by now; `None` before its first frame.
    pub(crate) fn report(&self, agent: AgentSlot) -> Option<LearntSensorReport> {
        let known = self.agents.get(agent.index()).filter(|known| known.name.is_some())?;
        Some(known.report())
    }

    /// Evidence captured before this is not needed any more.
    pub(crate) fn needs_from(&self) -> Timestamp {
        self.next.map_or(Timestamp::MIN, Epoch::begin)
    }

    fn learn<F: Filter>(&mut self, epoch: Epoch, tracks: &[Track<F>], context: &TrackContext<'_>) {
        self.fade(epoch);
        let (begin, end) = (epoch.begin(), epoch.next().begin());
        self.knows_all_well = true;
        for (slot, frame) in context.frames.since(begin).take_while(|(_, frame)| frame.captured_at < end) {
            let known = self.agent(frame.agent, frame.id.agent);
            let is_known_well = known.is_known_well();
            let statistics = &mut known.statistics;
            statistics.add_frame(frame.captured_at);
            let mut detections = 0;
            let axes = frame.pose.as_ref().filter(|_| !known.is_described).map(SensorAxes::of);
            for position in context.frames.positions(slot) {
                detections += 1;
                let [x, y] = position;
                known.detected_at = known.detected_at.max(Some(frame.captured_at));
                statistics.add_detection(frame.pose.map(|pose| pose.distance_to(x, y)));
                if let Some(axes) = &axes {
                    known.places.note(frame.captured_at, axes, position);
                }
            }
            known.clutter.add_frame(detections);
            known.scores.add_frame(frame.scores);
            self.knows_all_well &= is_known_well;
        }
        for track in tracks.iter().filter(|track| track.holders.leads()) {
            self.learn_from(epoch, track, context);
        }
        let mut begins_to_wander = false;
        for agent in &mut self.agents {
            agent.pose.settle();
            begins_to_wander |= agent.begins_to_wander();
        }
        if begins_to_wander {
            self.innovations_from = end + self.delta_max + SETTLED + RECOVERS_IN;
            self.agents.iter_mut().for_each(|agent| agent.innovations = InnovationCounts::default());
        }
        for agent in &mut self.agents {
            agent.settle(epoch.next(), self.delta_max);
        }
        self.tracks.retain(|(id, _)| tracks.binary_search_by_key(id, |track| track.id).is_ok());
    }

    fn fade(&mut self, epoch: Epoch) {
        let since = self.next.map_or(epoch, |next| next.min(epoch));
        let passed_s = (epoch.next().begin() - since.begin()).as_secs_f64();
        self.agents.iter_mut().for_each(|agent| agent.fade(passed_s));
    }

    fn learn_from<F: Filter>(&mut self, epoch: Epoch, track: &Track<F>, context: &TrackContext<'_>) {
        let (begin, end) = (epoch.begin(), epoch.next().begin());
        let mut items = track.evidence_since(begin).take_while(|item| item.captured_at < end).peekable();
        if items.peek().is_none() {
            return;
        }
        let place = self.tracks.binary_search_by_key(&track.id, |(id, _)| *id);
        let place = place.unwrap_or_else(|place| {
            self.tracks.insert(place, (track.id, TrackMemory::default()));
            place
        });
        let begun = Epoch::of(track.initiated_at());
        let known = &mut self.tracks[place].1;
        if self.knows_all_well && known.counts() && !epoch.is_turn(begun, SAMPLED_EVERY) {
            known.leave_gap();
            self.count_real(items, context);
            return;
        }
        let mut memory = std::mem::take(known);
        let decided_every = if memory.is_real { REAL_CHECKED_EVERY } else { DECIDED_EVERY };
        if epoch.is_turn(begun, decided_every) || memory.is_new() {
            // Its existence is no measure of those whose misses reduce it: what is reported persistently counts, too.
            let estimate = track.before(begin, context);
            memory.stands = estimate.as_ref().is_some_and(|estimate| estimate.stands());
            memory.group = estimate.as_ref().map_or(ClassGroup::Unknown, |estimate| estimate.class().group());
            memory.is_real = estimate.is_some_and(|estimate| {
                let is_persistent = estimate.n_reports >= PERSISTENT_REPORTS;
                let is_supported =
                    || memory.is_seen_from_elsewhere() || estimate.support.is_for_a_real_object_by_itself();
                estimate.is_rather_real_by_itself() || (is_persistent && is_supported())
            });
        }
        let is_due =
            epoch.is_turn(begun, INNOVATIONS_EVERY) || self.needs_innovations(track, [begin, end], context);
        if memory.counts() && is_due {
            track.visit_detections([begin, end], context, |before, item| {
                self.observe_innovation(&mut memory, before, item, context);
            });
        }
        for item in items {
            self.observe(&mut memory, item, context);
        }
        self.tracks[place].1 = memory;
    }

    fn observe(&mut self, memory: &mut TrackMemory, item: &Evidence, context: &TrackContext<'_>) {
        let frame = context.frames.get(item.frame);
        let Some(held) = context.frames.held(item) else {
            self.observe_missed(memory, frame);
            return;
        };
        let position = held.position();
        memory.position = Some(position);
        let place = memory.place_of(frame.agent);
        if !held.class().is_immobile() {
            self.compare_heading(
                memory,
                (frame.agent, place),
                Report { at: item.captured_at, position, yaw: frame.model.headings.reported(held.yaw()) },
            );
        }
        let stood = Stood { at: item.captured_at, position, side: held.longer_side() };
        let displaced = memory.displaced(place, stood);
        if displaced != [None; SCALES]
            && let Some(known) = self.agents.get_mut(frame.agent.index())
        {
            known.pose.add(item.captured_at, &displaced);
            if let [Some(Displaced { turned: Some([turned, declared]), .. }), _] = displaced {
                known.headings.add_standing(turned, declared);
            }
        }
        self.follow(memory, place, (frame, position), true);
        self.ask(memory, Some(place), (frame, position), true);
        if let Some(pose) = frame.pose.filter(|_| frame.model.scores != ScoreModel::Ignored) {
            memory.note_score(
                place,
                Scored { band: held.band(), at: item.captured_at, sensor: [pose.x, pose.y] },
            );
        }
        let compared = memory.classes.compare(place, held.class());
        let before = memory.note(place, true);
        memory.see(place, frame.pose.map(|pose| [pose.x, pose.y]));
        if !memory.counts() {
            memory.doubt(place);
            memory.waiting.clear();
            return;
        }
        if let Some(compared) = &compared
            && let Some(known) = self.agents.get_mut(frame.agent.index())
        {
            known.classes.add(compared);
        }
        memory.confirm(place, |agent, detections| {
            if let Some(known) = self.agents.get_mut(agent.index()) {
                known.clutter.add_real(detections);
            }
        });
        for WaitingMiss { agent, opportunity } in memory.waiting.drain(..) {
            if let Some(known) = self.agents.get_mut(agent.index()) {
                known.counts.add(memory.group, opportunity, false);
            }
        }
        if let Some(coverage) = &frame.coverage
            && let Some(known) = self.agents.get_mut(frame.agent.index())
        {
            let opportunity = Opportunity { range_bin: range_bin(coverage.range_to(position)), before };
            known.counts.add(memory.group, opportunity, true);
        }
    }

    /// Of a track that is known to be real, where nothing else is looked at.
    fn count_real<'a>(&mut self, items: impl Iterator<Item = &'a Evidence>, context: &TrackContext<'_>) {
        for item in items.filter(|item| item.is_detection()) {
            if let Some(known) = self.agents.get_mut(context.frames.get(item.frame).agent.index()) {
                known.clutter.add_real(1);
            }
        }
    }

    /// Whether an agent that detected a track in an epoch is not known well enough: then every epoch is evaluated.
    fn needs_innovations<F: Filter>(
        &self,
        track: &Track<F>,
        [begin, end]: [Timestamp; 2],
        context: &TrackContext<'_>,
    ) -> bool {
        let items = track.evidence_since(begin).take_while(|item| item.captured_at < end);
        items.filter(|item| item.is_detection()).any(|item| {
            let agent = context.frames.get(item.frame).agent;
            self.agents.get(agent.index()).is_some_and(|known| known.innovations.are_few())
        })
    }

    fn observe_innovation<F: Filter>(
        &mut self,
        memory: &mut TrackMemory,
        before: &Snapshot<F>,
        item: &Evidence,
        context: &TrackContext<'_>,
    ) {
        let at = item.captured_at;
        if at < self.innovations_from {
            return;
        }
        let frame = context.frames.get(item.frame);
        let Some(z) = context.frames.measurement(item) else { return };
        let state = before.state_at(at, context.synchronous);
        let predicted = state.predicted_measurement(before.class());
        let from = |[x, y]: [f64; 2]| [z.position[0] - x, z.position[1] - y];
        // Where headings are as reported, nothing is known by positions alone.
        let path = if frame.model.headings == HeadingLaw::AsReported {
            ExpectedPlace { position: predicted.position, covariance: predicted.position_covariance }
        } else {
            before.expected_by_positions(at)
        };
        let mean = |covariance: &Covariance2| (covariance.xx + covariance.yy) / 2.0;
        let declared = mean(&z.r) / frame.model.errors.scale;
        let of_pose = before.shared_error.apart(frame.agent, frame.pose_variance(z.position));
        let place = memory.place_of(frame.agent);
        let own = Innovation {
            at,
            difference: from(predicted.position),
            predicted: mean(&predicted.position_covariance) + of_pose,
            declared,
            by_positions: from(path.position),
            predicted_by_positions: mean(&path.covariance) + of_pose,
            bent: bent(&state.motion()),
            is_alone: memory.is_of_one(place),
        };
        if let Some(known) = self.agents.get_mut(frame.agent.index()) {
            known.innovations.add(&own, memory.last_innovation(place));
        }
    }

    fn compare_heading(
        &mut self,
        memory: &mut TrackMemory,
        (agent, place): (AgentSlot, usize),
        report: Report,
    ) {
        if let Some(Compared { heading, pair }) = memory.compare_heading(place, report)
            && memory.counts()
            && let Some(known) = self.agents.get_mut(agent.index())
        {
            known.headings.add(heading);
            pair.into_iter().for_each(|pair| known.headings.add_pair(pair));
        }
    }

    /// What a frame says of its own agent's last detection of a track, where it covers the place.
    fn follow(
        &mut self,
        memory: &mut TrackMemory,
        place: usize,
        (frame, position): (&StoredFrame, [f64; 2]),
        is_detected: bool,
    ) {
        let Some(scored) = memory.take_followed(place) else { return };
        let Some(coverage) = &frame.coverage else { return };
        let profile = &coverage.profile;
        let probability = profile.probability(coverage.range_for_profile(position), memory.group);
        let again = profile.given(probability, Some(true));
        if let Some(known) = self.agents.get_mut(frame.agent.index()) {
            known.scores.add_followed(&scored, frame.captured_at, again, is_detected);
        }
    }

    /// What a frame says of other agents' last detections of a track, where it covers the place.
    fn ask(
        &mut self,
        memory: &mut TrackMemory,
        place: Option<usize>,
        (frame, position): (&StoredFrame, [f64; 2]),
        is_detected: bool,
    ) {
        if !memory.has_scored() {
            return;
        }
        let Some(coverage) =
            frame.coverage.as_ref().filter(|coverage| coverage.covers(position, VIEW_MARGIN_M))
        else {
            return;
        };
        let witness = Witness {
            at: frame.captured_at,
            position: [coverage.pose.x, coverage.pose.y],
            probability: coverage.detection_probability(position, memory.group),
            is_detected,
        };
        memory.witnessed(place, &witness, |agent, band| {
            if let Some(known) = self.agents.get_mut(agent.index()) {
                known.scores.add(band, &witness);
            }
        });
    }

    /// A miss waits until the object is detected again: before that it may have gone. Where the agent may see nothing, it is none.
    fn observe_missed(&mut self, memory: &mut TrackMemory, frame: &StoredFrame) {
        let (Some(coverage), Some(position)) = (&frame.coverage, memory.position) else { return };
        if !coverage.covers(position, VIEW_MARGIN_M) {
            return;
        }
        self.ask(memory, memory.known_place_of(frame.agent), (frame, position), false);
        if coverage.is_known_to_see(position) {
            let place = memory.place_of(frame.agent);
            let before = memory.note(place, false);
            self.follow(memory, place, (frame, position), false);
            let range_bin = range_bin(coverage.range_to(position));
            memory.wait(WaitingMiss { agent: frame.agent, opportunity: Opportunity { range_bin, before } });
        }
    }
}

/// Acceleration of an object across its path, m/s².
fn bent(motion: &Motion) -> f64 {
    let [x, y] = motion.velocity;
    (motion.turn_rate * libm::hypot(x, y)).abs()
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    vec![
        ("learning.persistent_reports", PERSISTENT_REPORTS.to_string()),
        (
            "learning.turns",
            format!(
                "{DECIDED_EVERY}, {REAL_CHECKED_EVERY}, {INNOVATIONS_EVERY}; {SAMPLED_EVERY} where known well; recovers in {} s",
                RECOVERS_IN.as_secs_f64()
            ),
        ),
    ]
}
