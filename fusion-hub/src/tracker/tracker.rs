//! The tracker: frames in, tracks out, in three stages for each frame.

use super::assign::{Assigning, Assignment};
use super::config::{Lifetimes, TrackerConfig};
use super::instant::NewestInstant;
use super::predict::{FrameView, PredictionLimits, Predictions};
use super::store::{KeptTracks, TrackStore};
use super::update::{AssociatedFrame, Opened, initiate, split_versions, update};
use crate::filter::Filter;
use crate::track::{Evidence, FrameSlot, FrameStore, Horizon, SensedFrame, StoredFrame, Track, TrackContext};
use crate::values::{AgentNames, AgentSlot, Measurement, saved};
use v2x_common::id::TrackId;
use v2x_common::time::{Span, Timestamp};

/// A frame is much more accurate than one with this many times its mean variance: twice the standard deviation. Frames
/// of sensors of one kind are never associated again because of each other.
const MORE_ACCURATE: f64 = 4.0;

/// Tracks and frames under one kind of filter.
#[derive(Debug)]
pub(crate) struct Tracker<F> {
    config: TrackerConfig,
    lifetimes: Lifetimes,
    frames: FrameStore,
    tracks: TrackStore<F>,
    /// Measurements of the frame that is being associated.
    measurements: Vec<Measurement>,
    predictions: Predictions<F>,
    assigning: Assigning,
    assignment: Assignment,
    opened: Opened,
    instant: NewestInstant<F>,
    /// Tracks last detected before would be deleted without a lag, but for coasting.
    detected_from: Timestamp,
}

saved!([F: Filter] Tracker<F>, saved { frames, tracks, instant, detected_from }, made_anew {
    config, lifetimes, measurements, predictions, assigning, assignment, opened
});

/// From when on history is held.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Horizons {
    /// Of tracks: nothing that was captured earlier can still arrive, or be asked for.
    pub(crate) tracks: Horizon,
    /// Of evidence, which may be needed for longer; `None` where none is folded now.
    pub(crate) evidence: Option<Horizon>,
}

/// A frame after its association, for readers of the assignment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Assigned<'a, F> {
    /// Slot of the frame.
    pub(crate) slot: FrameSlot,
    /// The frame.
    pub(crate) frame: &'a StoredFrame,
    /// All frames.
    pub(crate) frames: &'a FrameStore,
    /// The predicted tracks.
    pub(crate) predictions: &'a Predictions<F>,
    /// What was assigned to them.
    pub(crate) assignment: &'a Assignment,
    tracks: &'a TrackStore<F>,
    assigning: &'a Assigning,
}

impl<'a, F: Filter> Assigned<'a, F> {
    /// The track at a place of the predictions.
    pub(crate) fn track(&self, place: usize) -> &'a Track<F> {
        self.tracks.get(self.predictions.tracks()[place])
    }

    /// The detection of the track at a place.
    pub(crate) fn detection(&self, place: usize) -> Option<Evidence> {
        let index = self.assignment.detection(place)?;
        Some(Evidence::detection(self.frame.captured_at, self.slot, index))
    }

    /// How many tracks were predicted, before association particles made versions of them.
    pub(crate) fn n_predicted(&self) -> usize {
        self.assigning.n_predicted()
    }

    /// Whether the tracks at two places are of classes that are seldom taken for each other.
    pub(crate) fn are_of_unlike_classes(&self, one: usize, other: usize) -> bool {
        let [one, other] = [one, other].map(|place| self.predictions.measurements()[place].class);
        self.assigning.distinguishes(one, other)
    }

    /// The indices of the detections within the gate of the track at a place, in order.
    pub(crate) fn candidates_of(&self, place: usize) -> &'a [u32] {
        self.assigning.candidates_of(place)
    }

    /// The place of the track that a detection was assigned to; where particles differ, by the leading one.
    pub(crate) fn track_of(&self, detection: u32) -> Option<usize> {
        self.assigning.track_of()[detection as usize].map(|place| place as usize)
    }
}

impl<F: Filter> Tracker<F> {
    pub(crate) fn new(config: TrackerConfig, lifetimes: Lifetimes, lineage: u32) -> Self {
        Self {
            config,
            lifetimes,
            frames: FrameStore::default(),
            tracks: TrackStore::new(lineage),
            measurements: Vec::new(),
            predictions: Predictions::default(),
            assigning: Assigning::new(&config),
            assignment: Assignment::default(),
            opened: Opened::default(),
            instant: NewestInstant::default(),
            detected_from: Timestamp::MIN,
        }
    }

    /// Stores a frame.
    pub(crate) fn store(&mut self, frame: &SensedFrame<'_>) -> FrameSlot {
        let slot = self.frames.insert(frame);
        let captured_at = frame.frame.captured_at;
        let is_first = self.frames.since(captured_at).nth(1).is_none();
        self.instant.begin(captured_at, is_first && self.config.reassociate, &mut self.tracks);
        slot
    }

    /// Associates a stored frame with the tracks, and updates them: predict, assign, update, initiate.
    pub(crate) fn associate(&mut self, slot: FrameSlot, agents: &AgentNames) {
        let Self { config, frames, tracks, predictions, assigning, assignment, opened, instant, .. } = self;
        let context = context(config, frames, agents);
        self.measurements.clear();
        self.measurements.extend(frames.measurements(slot));
        frames.get(slot).model.errors.add_lasting(&mut self.measurements);
        let frame = FrameView { slot, stored: frames.get(slot), measurements: &self.measurements };
        let limits = PredictionLimits::new(config, &self.lifetimes, self.detected_from);
        predictions.predict(tracks, &frame, &limits, &context);
        assigning.assign(&frame, tracks, predictions, assignment);
        if assigning.has_particles() {
            instant.copy_changing(tracks, predictions, assigning);
            split_versions(tracks, predictions, assigning, assignment);
        }
        let associated = AssociatedFrame { frame, predictions, assignment };
        update(tracks, &associated, (instant.retracted(), opened), &context);
        initiate(tracks, &associated, instant, &context);
    }

    /// The frame that was associated last, as it was assigned.
    pub(crate) fn assigned(&self, slot: FrameSlot) -> Assigned<'_, F> {
        Assigned {
            slot,
            frame: self.frames.get(slot),
            frames: &self.frames,
            predictions: &self.predictions,
            assignment: &self.assignment,
            tracks: &self.tracks,
            assigning: &self.assigning,
        }
    }

    /// After a frame: restores the order of tracks.
    pub(crate) fn finish(&mut self) {
        if self.assigning.has_particles() {
            self.tracks.order();
        }
        self.tracks.trim_spare();
    }

    /// The frames that are to be associated again after a frame of the same capture time that is much more accurate,
    /// in this order; none where newer frames build on them, or particles cannot be set back.
    ///
    /// Detections of a less accurate frame are associated better with tracks that a more accurate one has updated. With
    /// particles all frames of the instant are associated again, the less accurate ones last: resampling cannot be
    /// undone for one of several.
    pub(crate) fn to_reassociate(&self, slot: FrameSlot) -> Vec<FrameSlot> {
        let captured_at = self.frames.get(slot).captured_at;
        let can_go_back = !self.assigning.has_particles() || self.instant.is_whole();
        let since = || self.frames.since(captured_at);
        if !self.config.reassociate || !can_go_back || since().nth(1).is_none() {
            return Vec::new();
        }
        if since().any(|(_, frame)| frame.captured_at > captured_at) {
            return Vec::new();
        }
        let Some(own) = self.mean_variance(slot) else { return Vec::new() };
        let is_less_accurate = |other: &FrameSlot| {
            self.mean_variance(*other).is_some_and(|variance| variance > MORE_ACCURATE * own)
        };
        let (less_accurate, others): (Vec<_>, Vec<_>) =
            since().map(|(other, _)| other).partition(is_less_accurate);
        if less_accurate.is_empty() || !self.assigning.has_particles() {
            return less_accurate;
        }
        [others, less_accurate].concat()
    }

    /// Mean variance of a frame's positions along an axis, m².
    fn mean_variance(&self, slot: FrameSlot) -> Option<f64> {
        let variances = self.frames.measurements(slot).map(|z| (z.r.xx + z.r.yy) / 2.0);
        let (sum, count) = variances.fold((0.0, 0.0), |(sum, count), variance| (sum + variance, count + 1.0));
        (count > 0.0).then(|| sum / count)
    }

    /// Removes all evidence from frames of the newest instant, which are then to be associated again
    /// ([`Self::next_retracted`]).
    pub(crate) fn retract(&mut self, frames: &[FrameSlot], agents: &AgentNames) {
        self.tracks.order();
        self.instant.retract(frames, &self.tracks);
        self.instant.restore(&mut self.tracks);
        let context = context(&self.config, &self.frames, agents);
        for track in self.tracks.iter_mut() {
            frames.iter().for_each(|frame| track.retract(*frame, &context));
        }
        self.tracks.delete_where(Track::has_no_detections);
        self.instant.forget_ids_in_use(&self.tracks);
    }

    /// Takes back what an agent has reported of times after `after`, and the tracks that it alone has reported then: where they
    /// are its reports of earlier times do not say either.
    pub(crate) fn take_back(&mut self, agent: AgentSlot, after: Timestamp, agents: &AgentNames) {
        let Self { config, frames, tracks, instant, .. } = self;
        let context = context(config, frames, agents);
        let is_its_alone = |track: &Track<F>| {
            track.last_measured_at() > after
                && track.contributors().iter().all(|newest| newest.agent() == agent)
        };
        instant.forget_where(is_its_alone);
        tracks.delete_where(is_its_alone);
        let its = frames.since(after).filter(|(_, frame)| frame.agent == agent && frame.captured_at > after);
        let its: Vec<_> = its.map(|(slot, _)| slot).collect();
        for slot in &its {
            tracks.iter_mut().for_each(|track| track.retract(*slot, &context));
        }
        tracks.delete_where(Track::has_no_detections);
        its.iter().for_each(|slot| self.frames.withdraw_coverage(*slot));
    }

    /// The next retracted frame that is to be associated again.
    pub(crate) fn next_retracted(&mut self) -> Option<FrameSlot> {
        self.tracks.order();
        self.instant.next_retracted()
    }

    /// Merges the younger of two tracks into the older one. `before` is called with both first. Whether there were
    /// both.
    pub(crate) fn merge(
        &mut self,
        (older, younger): (TrackId, TrackId),
        agents: &AgentNames,
        before: impl FnOnce(&Track<F>, &Track<F>),
    ) -> bool {
        self.instant.forget([older, younger]);
        if self.assigning.has_particles() {
            self.tracks.keep_leading(older);
            self.tracks.keep_leading(younger);
        }
        let Some((older, absorbed)) = self.tracks.split_off(older, younger) else { return false };
        before(self.tracks.get(older), &absorbed);
        let context = context(&self.config, &self.frames, agents);
        self.tracks.get_mut(older).absorb(&absorbed, &context);
        self.tracks.recycle([absorbed]);
        true
    }

    /// Replays late evidence.
    pub(crate) fn replay(&mut self, agents: &AgentNames) {
        let context = context(&self.config, &self.frames, agents);
        self.tracks.replay(&context);
    }

    /// Replays late evidence, folds what is older than the horizon, and deletes tracks that no admitted detection can
    /// match any more. `on_deleted` is called with each of these first.
    pub(crate) fn maintain(
        &mut self,
        now: Timestamp,
        horizons: &Horizons,
        agents: &AgentNames,
        on_deleted: impl FnMut(&Track<F>),
    ) {
        let Lifetimes { delta_max, coast } = self.lifetimes;
        let Horizons { tracks: horizon, evidence: held } = horizons;
        let context = context(&self.config, &self.frames, agents);
        self.detected_from = horizon.at.max(now - delta_max);
        let kept = KeptTracks { evidence: *held, detected_from: horizon.at, coast };
        self.tracks.maintain(&kept, &context, on_deleted);
        self.instant.maintain(&kept, &context);
    }

    /// Forgets frames that no track refers to any more.
    pub(crate) fn forget_frames(&mut self, horizon: &Horizon) {
        self.frames.forget_before(horizon.at - horizon.slack);
    }

    /// All tracks.
    pub(crate) const fn tracks(&self) -> &TrackStore<F> {
        &self.tracks
    }

    /// Pairs of a detection and a track that were near enough to be weighed, since it was made.
    pub(crate) const fn candidates_weighed(&self) -> u64 {
        self.assigning.candidates_weighed()
    }

    /// How many hypotheses of association there are.
    pub(crate) fn n_hypotheses(&self) -> u32 {
        self.assigning.n_hypotheses()
    }

    /// What the evidence of the tracks refers to.
    pub(crate) fn context<'a>(&'a self, agents: &'a AgentNames) -> TrackContext<'a> {
        context(&self.config, &self.frames, agents)
    }
}

fn context<'a>(config: &TrackerConfig, frames: &'a FrameStore, agents: &'a AgentNames) -> TrackContext<'a> {
    let TrackerConfig { synchronous, rollback, class_motion, exclusion, hypotheses, .. } = *config;
    TrackContext {
        frames,
        agents,
        synchronous,
        rollback,
        keeps_folded: hypotheses.longest_lag() > Span::ZERO,
        class_motion,
        exclusion,
    }
}
