//! A track: its evidence in the order of capture times, with rollback and replay of late evidence.

use super::application::{HeldDetection, advance, apply, close, initial, open};
use super::checkpoints::Checkpoints;
use super::context::{Horizon, Rollback, TrackContext};
use super::evidence::{Evidence, FrameSlot};
use super::orientation::Read;
use super::together::Run;
use super::{ClassReports, Contributors, Snapshot};
use crate::filter::{Filter, Holds};
use crate::values::{ParticleSet, PositionInnovation};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use v2x_common::id::TrackId;
use v2x_common::time::{Span, Timestamp};

/// Room for items of evidence in a new track: ten agents at 10 Hz fill it within Δmax.
const EVIDENCE_AT_FIRST: usize = 64;

/// A track: a hypothesis of one object.
///
/// State and existence are functions of the evidence alone, sorted by capture time, then by ids and indices: the same
/// evidence gives the same bits in any order of arrival. Evidence that is older than anything that can still arrive is
/// folded into the first checkpoint; that is the same computation, cut at another place.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Track<F> {
    /// Identity.
    pub id: TrackId,
    /// The association particles that hold it: all of them where they agree.
    pub holders: ParticleSet,
    /// When particles last came to differ about it.
    pub disputed_at: Timestamp,
    pub(super) evidence: VecDeque<Evidence>,
    /// The first one is after the first detection, or after the folded evidence.
    pub(super) checkpoints: Checkpoints<F>,
    /// The estimate after all evidence, without late items that are not replayed yet.
    pub(super) head: Snapshot<F>,
    /// The place of the oldest late item that is not replayed yet.
    pub(super) stale_from: Option<usize>,
    /// When the first detection was captured.
    initiated_at: Timestamp,
    contributors: Contributors,
    /// The classes that were reported, folded evidence included.
    classes: ClassReports,
    /// The newest detection of each agent in the folded evidence, where that is kept.
    folded: Contributors,
}

impl<F> Holds<F> for Track<F> {
    #[inline(always)]
    fn state(&self) -> &F {
        &self.head.state
    }

    #[inline(always)]
    fn state_mut(&mut self) -> &mut F {
        &mut self.head.state
    }
}

impl<F: Filter> Track<F> {
    /// A track with its first evidence, a detection. `spare` is a track that is not needed any more: its memory is
    /// used again.
    pub fn new(id: TrackId, first: Evidence, spare: Option<Self>, context: &TrackContext<'_>) -> Self {
        let head = initial(&first, context).expect("the first evidence is a detection");
        let mut track = match spare {
            Some(spare) => Self {
                id,
                holders: ParticleSet::ALL,
                disputed_at: first.captured_at,
                head,
                stale_from: None,
                initiated_at: first.captured_at,
                ..spare
            },
            None => Self {
                id,
                holders: ParticleSet::ALL,
                disputed_at: first.captured_at,
                evidence: VecDeque::with_capacity(EVIDENCE_AT_FIRST),
                checkpoints: Checkpoints::with_capacity(EVIDENCE_AT_FIRST),
                head,
                stale_from: None,
                initiated_at: first.captured_at,
                contributors: Contributors::default(),
                classes: ClassReports::default(),
                folded: Contributors::NONE,
            },
        };
        track.evidence.clear();
        track.checkpoints.clear();
        track.contributors.clear();
        track.classes.clear();
        track.folded.clear();
        track.evidence.push_back(first);
        track.checkpoints.push((1, first.captured_at), &head, 1);
        track.contributors.note(&first, context.frames.get(first.frame), context.agents);
        track.note_class(&first, context);
        track
    }

    /// Another version of the same track, for these particles. `spare` as in [`Self::new`].
    pub fn copied(&self, holders: ParticleSet, spare: Option<Self>) -> Self {
        let Some(mut copy) = spare else { return Self { holders, ..self.clone() } };
        copy.evidence.clone_from(&self.evidence);
        copy.checkpoints.copy_from(&self.checkpoints);
        copy.contributors.clone_from(&self.contributors);
        copy.classes.clone_from(&self.classes);
        copy.folded.clone_from(&self.folded);
        let Self { id, disputed_at, head, stale_from, initiated_at, .. } = *self;
        Self { id, holders, disputed_at, head, stale_from, initiated_at, ..copy }
    }

    /// Inserts evidence at its place in time. `predicted` is the state at that time, if it is known.
    pub fn insert(&mut self, item: Evidence, predicted: Option<&F>, context: &TrackContext<'_>) {
        if item.is_detection() {
            self.note_detection(&item, context);
        }
        if self.is_after_all(&item, context) {
            self.note_class(&item, context);
            self.evidence.push_back(item);
            apply(&mut self.head, (&item, context.frames.held(&item)), predicted, context);
            self.mark_newest(item.captured_at);
            return;
        }
        let place = self.evidence.partition_point(|other| context.frames.is_before(other, &item));
        if self.evidence.get(place) == Some(&item) {
            return;
        }
        self.note_class(&item, context);
        if context.rollback == Rollback::Only && item.is_detection() {
            self.roll_back_to(place, item, context);
        } else {
            self.insert_late(place, item);
        }
    }

    /// Whether a detection is newer than all evidence.
    pub fn is_after_all(&self, item: &Evidence, context: &TrackContext<'_>) -> bool {
        self.evidence.back().is_none_or(|last| context.frames.is_before(last, item))
    }

    /// Takes in a detection that is newer than all evidence, where the state at its time is `predicted`: how it is read, for
    /// its state to be updated by. Then comes [`Self::close`].
    pub(crate) fn open(
        &mut self,
        item: &Evidence,
        predicted: &F,
        context: &TrackContext<'_>,
    ) -> Option<Read> {
        let held = context.frames.held(item)?;
        self.note_detection(item, context);
        self.note_class(item, context);
        self.evidence.push_back(*item);
        self.head.state = *predicted;
        Some(open(&mut self.head, HeldDetection { item, held }, context))
    }

    /// After the update of the state by the last detection, which was opened.
    pub(crate) fn close(&mut self, read: &Read, innovation: &PositionInnovation, context: &TrackContext<'_>) {
        let Some(item) = self.evidence.back() else { return };
        let Some(held) = context.frames.held(item) else { return };
        close(&mut self.head, HeldDetection { item, held }, (read, innovation), context);
        self.mark_newest(item.captured_at);
    }

    /// Keeps a checkpoint after the newest evidence, where that is due.
    fn mark_newest(&mut self, at: Timestamp) {
        let count = self.evidence.len();
        if self.checkpoints.is_due((count, at), count) {
            self.checkpoints.push((count, at), &self.head, count);
        }
    }

    fn note_detection(&mut self, item: &Evidence, context: &TrackContext<'_>) {
        self.initiated_at = self.initiated_at.min(item.captured_at);
        self.contributors.note(item, context.frames.get(item.frame), context.agents);
    }

    fn note_class(&mut self, item: &Evidence, context: &TrackContext<'_>) {
        if let Some(held) = context.frames.held(item) {
            self.classes.add(context.frames.get(item.frame).agent, held.class(), held.score());
        }
    }

    fn retract_class(&mut self, item: &Evidence, context: &TrackContext<'_>) {
        if let Some(held) = context.frames.held(item) {
            self.classes.remove(context.frames.get(item.frame).agent, held.class(), held.score());
        }
    }

    fn insert_late(&mut self, place: usize, item: Evidence) {
        self.evidence.insert(place, item);
        self.checkpoints.note_inserted(place);
        self.mark_stale(place);
    }

    fn mark_stale(&mut self, place: usize) {
        self.stale_from = Some(self.stale_from.map_or(place, |known| known.min(place)));
    }

    /// Drops all evidence from a place on, and continues there with a late item.
    fn roll_back_to(&mut self, place: usize, item: Evidence, context: &TrackContext<'_>) {
        self.evidence.truncate(place);
        self.evidence.push_back(item);
        self.contributors.forget_after(item.captured_at);
        self.mark_stale(place);
        self.replay(context);
    }

    /// Whether late evidence is not replayed yet.
    pub const fn is_stale(&self) -> bool {
        self.stale_from.is_some()
    }

    /// The estimate after the first `count` items; before the first detection, the estimate after that.
    fn after(&self, count: usize, context: &TrackContext<'_>) -> Snapshot<F> {
        let start = self.checkpoints.last_within(count);
        let first = start.map_or(0, |(count, _)| count);
        let mut known = start.map(|(_, snapshot)| *snapshot);
        for (place, item) in self.evidence.iter().enumerate().skip(first) {
            if place >= count && known.is_some() {
                break;
            }
            advance(&mut known, item, context);
        }
        known.unwrap_or(self.head)
    }

    /// The estimate after all evidence; late items count once they are replayed.
    pub fn latest(&self) -> &Snapshot<F> {
        &self.head
    }

    /// Whether there is no evidence after this time, so that [`Self::latest`] is the estimate at it.
    pub fn is_newest(&self, at: Timestamp) -> bool {
        self.evidence.back().is_none_or(|last| last.captured_at <= at)
    }

    /// The filtered estimate at a time, from the evidence up to and including it; before the first detection, the
    /// estimate after that.
    pub fn filtered_at(&self, at: Timestamp, context: &TrackContext<'_>) -> Snapshot<F> {
        let count = self.evidence.partition_point(|item| item.captured_at <= at);
        if count == self.evidence.len() { self.head } else { self.after(count, context) }
    }

    /// The way to that estimate from the last one that is held; `place` is the track's own.
    pub(super) fn run_to(&self, at: Timestamp, place: usize, context: &TrackContext<'_>) -> Run<F> {
        let end = self.evidence.partition_point(|item| item.captured_at <= at);
        let held = if end == self.evidence.len() {
            Some((end, &self.head))
        } else {
            self.checkpoints.last_within(end).filter(|_| F::TOGETHER)
        };
        match held {
            Some((count, known)) => Run { track: place, count, end, known: *known },
            None => Run { track: place, count: end, end, known: self.after(end, context) },
        }
    }

    /// An item of the evidence that is not folded, by its number.
    #[inline(always)]
    pub(super) fn item(&self, number: usize) -> Option<&Evidence> {
        self.evidence.get(number)
    }

    /// The evidence up to and including a time, and that after it; folded evidence is not held any more.
    pub(super) fn split_at(&self, at: Timestamp) -> [impl Iterator<Item = &Evidence>; 2] {
        let count = self.evidence.partition_point(|item| item.captured_at <= at);
        [self.evidence.range(..count), self.evidence.range(count..)]
    }

    /// The newest detection of each agent in the folded evidence, where that is kept.
    pub(super) fn folded(&self) -> &Contributors {
        &self.folded
    }

    /// The detections within a span of a time, before and after it.
    pub fn detections_near(&self, at: Timestamp, within: Span) -> impl Iterator<Item = &Evidence> {
        let start = self.evidence.partition_point(|item| item.captured_at < at - within);
        let about = self.evidence.range(start..).take_while(move |item| item.captured_at <= at + within);
        about.filter(|item| item.is_detection())
    }

    /// The place of the evidence from this frame, if there is any.
    fn place_of(&self, captured_at: Timestamp, frame: FrameSlot) -> Option<usize> {
        let start = self.evidence.partition_point(|item| item.captured_at < captured_at);
        let mut same_time =
            self.evidence.iter().skip(start).take_while(|item| item.captured_at == captured_at);
        same_time.position(|item| item.frame == frame).map(|offset| start + offset)
    }

    /// Whether it holds evidence from this frame.
    pub fn has_evidence_from(&self, captured_at: Timestamp, frame: FrameSlot) -> bool {
        self.place_of(captured_at, frame).is_some()
    }

    /// When a frame that is not folded last held a detection of each of both tracks: its sensor resolved them.
    pub fn last_detected_with(&self, other: &Self) -> Option<Timestamp> {
        let mut theirs = other.evidence.iter().rev().filter(|item| item.is_detection());
        let beside = theirs.find(|item| {
            let own = self.place_of(item.captured_at, item.frame);
            own.is_some_and(|place| self.evidence[place].is_detection())
        });
        beside.map(|item| item.captured_at)
    }

    /// Takes over the detections of a track of the same object. Of a frame with detections of both, the own one stays;
    /// a missed detection is replaced by the other track's detection.
    pub fn absorb(&mut self, other: &Self, context: &TrackContext<'_>) {
        self.classes.add_all(&other.classes);
        for item in other.evidence.iter().filter(|item| item.is_detection()) {
            let known = self.place_of(item.captured_at, item.frame);
            match known {
                Some(place) if self.evidence[place].is_detection() => self.retract_class(item, context),
                Some(place) => {
                    self.evidence[place] = *item;
                    self.note_detection(item, context);
                    self.mark_stale(place);
                }
                None => {
                    self.note_detection(item, context);
                    let place = self.evidence.partition_point(|other| context.frames.is_before(other, item));
                    self.insert_late(place, *item);
                }
            }
        }
        self.replay(context);
    }

    /// Removes the evidence from a frame, as if the frame had not arrived yet.
    pub fn retract(&mut self, frame: FrameSlot, context: &TrackContext<'_>) {
        let stored = context.frames.get(frame);
        let Some(place) = self.place_of(stored.captured_at, frame) else { return };
        self.checkpoints.truncate(place);
        let Some(item) = self.evidence.remove(place) else { return };
        self.mark_stale(place);
        if item.is_detection() {
            self.retract_class(&item, context);
            self.contributors.forget_agent(stored.agent);
            let reports = self.evidence.iter().filter(|item| item.is_detection());
            for earlier in reports.filter(|item| context.frames.get(item.frame).agent == stored.agent) {
                self.contributors.note(earlier, context.frames.get(earlier.frame), context.agents);
            }
        }
        if !self.has_no_detections() {
            self.replay(context);
        }
    }

    /// Whether no detection is left, held or folded.
    pub fn has_no_detections(&self) -> bool {
        self.checkpoints.is_empty() && self.evidence.iter().all(|item| !item.is_detection())
    }

    /// The newest detection of each agent.
    pub fn contributors(&self) -> &Contributors {
        &self.contributors
    }

    /// The classes that were reported.
    pub fn classes(&self) -> &ClassReports {
        &self.classes
    }

    /// Capture time of its first detection.
    pub fn initiated_at(&self) -> Timestamp {
        self.initiated_at
    }

    /// Capture time of its newest detection.
    pub fn last_measured_at(&self) -> Timestamp {
        self.contributors.last_measured_at()
    }

    /// Forgets contributors that have not detected it since `oldest`, except the newest.
    pub fn forget_contributors(&mut self, oldest: Timestamp) {
        self.contributors.forget_before(oldest);
        self.folded.forget_before(oldest);
    }

    /// Folds evidence older than the horizon; up to a checkpoint if there is one within the slack, which needs no
    /// replay. Late items must have been replayed.
    pub fn fold(&mut self, horizon: &Horizon, context: &TrackContext<'_>) {
        let Horizon { at: horizon, slack } = *horizon;
        debug_assert!(self.stale_from.is_none(), "folded before late items were replayed");
        if self.evidence.front().is_none_or(|oldest| oldest.captured_at >= horizon) {
            return;
        }
        let old = self.evidence.partition_point(|item| item.captured_at < horizon);
        // Evidence begins with a detection or after the folded evidence, so there is a checkpoint.
        let Some(folded) = self.checkpoints.begin_within(old) else { return };
        self.forget_front(folded, context);
        if self.evidence.front().is_some_and(|oldest| oldest.captured_at < horizon - slack) {
            let snapshot = self.after(old - folded, context);
            self.forget_front(old - folded, context);
            self.checkpoints.replace_first(0, &snapshot);
        }
    }

    /// Keeps few checkpoints of times before the horizon, where nothing can come any more.
    pub fn thin_checkpoints(&mut self, horizon: Timestamp) {
        self.checkpoints.thin_before(horizon);
    }

    fn forget_front(&mut self, count: usize, context: &TrackContext<'_>) {
        let items = self.evidence.drain(..count);
        if context.keeps_folded {
            for item in items.filter(|item| item.is_detection()) {
                self.folded.note(&item, context.frames.get(item.frame), context.agents);
            }
        } else {
            drop(items);
        }
        self.checkpoints.note_forgotten(count);
    }

    /// The evidence that is not folded, in order.
    pub fn evidence(&self) -> impl Iterator<Item = &Evidence> {
        self.evidence.iter()
    }

    /// The evidence that is not folded, captured at a time or later, in order.
    pub fn evidence_since(&self, at: Timestamp) -> impl Iterator<Item = &Evidence> {
        self.evidence.range(self.evidence.partition_point(|item| item.captured_at < at)..)
    }

    /// The filtered estimate by the evidence before a time; `None` before the first detection.
    pub fn before(&self, at: Timestamp, context: &TrackContext<'_>) -> Option<Snapshot<F>> {
        let count = self.evidence.partition_point(|item| item.captured_at < at);
        (self.initiated_at < at).then(|| self.after(count, context))
    }

    /// Calls `visit` with each detection captured from `begin` on and before `end`, and with the estimate before it.
    pub fn visit_detections(
        &self,
        [begin, end]: [Timestamp; 2],
        context: &TrackContext<'_>,
        mut visit: impl FnMut(&Snapshot<F>, &Evidence),
    ) {
        let mut known = self.before(begin, context);
        for item in self.evidence_since(begin).take_while(|item| item.captured_at < end) {
            if let Some(known) = &known
                && item.is_detection()
            {
                visit(known, item);
            }
            advance(&mut known, item, context);
        }
    }

    /// The oldest evidence that is not folded.
    pub fn oldest(&self) -> Option<&Evidence> {
        self.evidence.front()
    }
}
