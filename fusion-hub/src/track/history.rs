//! A track's evidence, sorted by its own time, with replay of what came after a late piece.

use super::{Contributors, Snapshot};
use crate::agents::Agents;
use crate::filter::{CompactMeasurement, Filter};
use crate::frames::{FrameSlot, FrameStore, LOOK, Piece};
use crate::particles::ParticleSet;
use std::collections::VecDeque;
use v2x_common::id::TrackId;
use v2x_common::time::{Span, Timestamp};

/// Pieces of evidence between two checkpoints: what a late frame replays to know the past, against memory.
const CHECKPOINT_EVERY: usize = 4;
/// Measurements fetched at once before they are replayed: they lie in as many frames, and fetching them one by one
/// would wait for the memory each time.
const GATHERED: usize = 16;
/// Room for pieces of evidence in a new track: ten agents at 10 Hz fill it within Δmax.
const EVIDENCE_AT_FIRST: usize = 64;
/// How much older than the horizon evidence may be kept, so that it is folded at a checkpoint, for nothing.
pub const FOLD_SLACK: Span = Span::from_millis(250);

/// What becomes of measurements that come later than newer ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LateData {
    /// They are applied at their own time, and the newer ones again after them.
    #[default]
    Replay,
    /// They are applied at their own time, and the newer ones are lost, as in the paper's text read literally.
    RollbackOnly,
    /// Their frames are refused: those captured earlier than one that is in, by more than ε_s.
    Drop,
    /// All frames are taken as captured when they arrive, whatever their stamps: what is done where nobody thinks of
    /// delays. There is no Δmax then.
    IgnoreDelay,
}

/// What tracks refer to, and by which rules it is read.
#[derive(Clone, Copy, Debug)]
pub struct Records<'a> {
    /// Measurements and looks.
    pub frames: &'a FrameStore,
    /// Names.
    pub agents: &'a Agents,
    /// ε_s: a report this near to the state's own time is taken as simultaneous.
    pub synchronous: Span,
    /// What becomes of measurements newer than a late one.
    pub late_data: LateData,
    /// Whether tracks remember who reported what is folded: what is told may be older than it.
    pub remembers_folded: bool,
    /// Whether classes tell how objects move.
    pub class_moves: bool,
}

/// What was known after so many pieces of evidence.
#[derive(Clone, Copy, Debug)]
struct Checkpoint<F> {
    /// Number of pieces, of those that are held.
    count: usize,
    snapshot: Snapshot<F>,
}

/// One tracked object.
///
/// Everything it tells is a function of the evidence alone, sorted by time, then names and numbers: the same
/// evidence gives the same bits in any order of arrival. What is older than anything that can still arrive is
/// folded into the first checkpoint, which is the same computation cut at another place.
#[derive(Clone, Debug)]
pub struct Track<F> {
    /// Its number.
    pub id: TrackId,
    /// The association particles that hold it: all of them, where nobody doubts it.
    pub holders: ParticleSet,
    /// When particles last came to hold something else of it.
    pub disputed_at: Timestamp,
    evidence: VecDeque<Piece>,
    /// By count. The first one is after the birth, or after what is folded.
    checkpoints: VecDeque<Checkpoint<F>>,
    /// After all evidence, but without late pieces that are not replayed yet.
    head: Snapshot<F>,
    /// The place of the oldest late piece that is not replayed yet.
    stale_from: Option<usize>,
    /// When the first report was.
    born_at: Timestamp,
    contributors: Contributors,
    /// Each agent's newest report of those that are folded, where these are remembered.
    folded: Contributors,
}

impl<F: Filter> Track<F> {
    /// A track with its first piece of evidence, a report. `spare` is a track that is not needed any more: its
    /// memory is used again.
    pub fn new(id: TrackId, birth: Piece, spare: Option<Self>, records: &Records<'_>) -> Self {
        let head = born(&birth, records).expect("a birth is a report");
        let mut track = match spare {
            Some(spare) => Self {
                id,
                holders: ParticleSet::ALL,
                disputed_at: birth.captured_at,
                head,
                stale_from: None,
                born_at: birth.captured_at,
                ..spare
            },
            None => Self {
                id,
                holders: ParticleSet::ALL,
                disputed_at: birth.captured_at,
                evidence: VecDeque::with_capacity(EVIDENCE_AT_FIRST),
                checkpoints: VecDeque::with_capacity(EVIDENCE_AT_FIRST / CHECKPOINT_EVERY + 1),
                head,
                stale_from: None,
                born_at: birth.captured_at,
                contributors: Contributors::default(),
                folded: Contributors::NONE,
            },
        };
        track.evidence.clear();
        track.checkpoints.clear();
        track.contributors.clear();
        track.folded.clear();
        track.evidence.push_back(birth);
        track.checkpoints.push_back(Checkpoint { count: 1, snapshot: head });
        track.contributors.note(&birth, records.frames.get(birth.frame), records.agents);
        track
    }

    /// Another version of the same track, for these particles. `spare` as in [`Self::new`].
    pub fn copied(&self, holders: ParticleSet, spare: Option<Self>) -> Self {
        let Some(mut copy) = spare else { return Self { holders, ..self.clone() } };
        copy.evidence.clone_from(&self.evidence);
        copy.checkpoints.clone_from(&self.checkpoints);
        copy.contributors.clone_from(&self.contributors);
        copy.folded.clone_from(&self.folded);
        let Self { id, disputed_at, head, stale_from, born_at, .. } = *self;
        Self { id, holders, disputed_at, head, stale_from, born_at, ..copy }
    }

    /// Puts a piece of evidence in its place in time. `predicted` is the state at that time, if it is known.
    pub fn insert(&mut self, piece: Piece, predicted: Option<&F>, records: &Records<'_>) {
        if piece.index != LOOK {
            self.note_report(&piece, records);
        }
        let is_newest = self.evidence.back().is_none_or(|last| records.frames.is_before(last, &piece));
        if is_newest {
            self.evidence.push_back(piece);
            apply(&mut self.head, (&piece, records.frames.held(&piece)), predicted, records);
            let count = self.evidence.len();
            if self.checkpoints.back().is_none_or(|last| count >= last.count + CHECKPOINT_EVERY) {
                self.checkpoints.push_back(Checkpoint { count, snapshot: self.head });
            }
            return;
        }
        let place = self.evidence.partition_point(|other| records.frames.is_before(other, &piece));
        if self.evidence.get(place) == Some(&piece) {
            return;
        }
        if records.late_data == LateData::RollbackOnly && piece.index != LOOK {
            self.roll_back_to(place, piece, records);
        } else {
            self.insert_late(place, piece);
        }
    }

    fn note_report(&mut self, piece: &Piece, records: &Records<'_>) {
        self.born_at = self.born_at.min(piece.captured_at);
        self.contributors.note(piece, records.frames.get(piece.frame), records.agents);
    }

    fn insert_late(&mut self, place: usize, piece: Piece) {
        self.evidence.insert(place, piece);
        for checkpoint in self.checkpoints.iter_mut().rev().take_while(|checkpoint| checkpoint.count > place)
        {
            checkpoint.count += 1;
        }
        self.note_stale(place);
    }

    fn note_stale(&mut self, place: usize) {
        self.stale_from = Some(self.stale_from.map_or(place, |known| known.min(place)));
    }

    /// Drops all evidence from a place on, and goes on from there with a late piece.
    fn roll_back_to(&mut self, place: usize, piece: Piece, records: &Records<'_>) {
        self.evidence.truncate(place);
        self.evidence.push_back(piece);
        self.contributors.forget_after(piece.captured_at);
        self.note_stale(place);
        self.replay(records);
    }

    /// Applies late pieces at their own times, and every later one again after them.
    pub fn replay(&mut self, records: &Records<'_>) {
        let Some(place) = self.stale_from.take() else { return };
        self.checkpoints.truncate(self.checkpoints_within(place));
        let Some(mut count) = self.rewind(records) else { return };
        let mut marked = count;
        let mut gathered = [CompactMeasurement::BLANK; GATHERED];
        while count < self.evidence.len() {
            let block = self.evidence.range(count..self.evidence.len().min(count + GATHERED));
            for (held, piece) in gathered.iter_mut().zip(block.clone()) {
                if let Some(found) = records.frames.held(piece) {
                    *held = *found;
                }
            }
            for (held, piece) in gathered.iter().zip(block) {
                let held = (piece.index != LOOK).then_some(held);
                apply(&mut self.head, (piece, held), None, records);
                count += 1;
                if count >= marked + CHECKPOINT_EVERY {
                    marked = count;
                    self.checkpoints.push_back(Checkpoint { count, snapshot: self.head });
                }
            }
        }
    }

    /// Takes the head back to the last checkpoint, or to the birth; tells of how many pieces that is.
    fn rewind(&mut self, records: &Records<'_>) -> Option<usize> {
        if let Some(last) = self.checkpoints.back() {
            self.head = last.snapshot;
            return Some(last.count);
        }
        let birth = self.evidence.iter().position(|piece| piece.index != LOOK)?;
        self.head = born(&self.evidence[birth], records)?;
        self.checkpoints.push_back(Checkpoint { count: birth + 1, snapshot: self.head });
        Some(birth + 1)
    }

    /// How many checkpoints are of no more than so many pieces.
    fn checkpoints_within(&self, count: usize) -> usize {
        let after = self.checkpoints.iter().rposition(|checkpoint| checkpoint.count <= count);
        after.map_or(0, |place| place + 1)
    }

    /// What was known after the first `count` pieces; before the first report, what that tells.
    fn after(&self, count: usize, records: &Records<'_>) -> Snapshot<F> {
        let start = self.checkpoints_within(count).checked_sub(1).map(|place| self.checkpoints[place]);
        let first = start.map_or(0, |checkpoint| checkpoint.count);
        let mut known = start.map(|checkpoint| checkpoint.snapshot);
        for (place, piece) in self.evidence.iter().enumerate().skip(first) {
            if place >= count && known.is_some() {
                break;
            }
            advance(&mut known, piece, records);
        }
        known.unwrap_or(self.head)
    }

    /// What is known after all evidence; late pieces count once they are replayed.
    pub fn latest(&self) -> &Snapshot<F> {
        &self.head
    }

    /// Whether there is no evidence after this time, so that [`Self::latest`] is what is known.
    pub fn is_newest(&self, at: Timestamp) -> bool {
        self.evidence.back().is_none_or(|last| last.captured_at <= at)
    }

    /// What was known at a time, from the evidence up to and including it; before the first report, what the
    /// first report tells.
    pub fn known_at(&self, at: Timestamp, records: &Records<'_>) -> Snapshot<F> {
        let count = self.evidence.partition_point(|piece| piece.captured_at <= at);
        if count == self.evidence.len() { self.head } else { self.after(count, records) }
    }

    /// The evidence up to and including a time, and that after it; what is folded is not held any more.
    pub(super) fn split_at(&self, at: Timestamp) -> [impl Iterator<Item = &Piece>; 2] {
        let count = self.evidence.partition_point(|piece| piece.captured_at <= at);
        [self.evidence.range(..count), self.evidence.range(count..)]
    }

    /// Each agent's newest report of those that are folded, where these are remembered.
    pub(super) fn folded(&self) -> &Contributors {
        &self.folded
    }

    /// The reports within a span of a time, either way.
    pub fn reports_about(&self, at: Timestamp, within: Span) -> impl Iterator<Item = &Piece> {
        let start = self.evidence.partition_point(|piece| piece.captured_at < at - within);
        let about = self.evidence.range(start..).take_while(move |piece| piece.captured_at <= at + within);
        about.filter(|piece| piece.index != LOOK)
    }

    /// Where the evidence of this frame stands, if there is any.
    fn place_of(&self, captured_at: Timestamp, frame: FrameSlot) -> Option<usize> {
        let start = self.evidence.partition_point(|piece| piece.captured_at < captured_at);
        let mut same_time =
            self.evidence.iter().skip(start).take_while(|piece| piece.captured_at == captured_at);
        same_time.position(|piece| piece.frame == frame).map(|offset| start + offset)
    }

    /// Whether it holds evidence of this frame.
    pub fn has_evidence_of(&self, captured_at: Timestamp, frame: FrameSlot) -> bool {
        self.place_of(captured_at, frame).is_some()
    }

    /// When a frame that is not folded last reported both: its sensor told them apart.
    pub fn last_beside(&self, other: &Self) -> Option<Timestamp> {
        let mut theirs = other.evidence.iter().rev().filter(|piece| piece.index != LOOK);
        let beside = theirs.find(|piece| {
            let own = self.place_of(piece.captured_at, piece.frame);
            own.is_some_and(|place| self.evidence[place].index != LOOK)
        });
        beside.map(|piece| piece.captured_at)
    }

    /// Takes over the reports of a track that turned out to be of the same object. Of frames in which both were
    /// reported, the own report stays; looks that found only the other one are no evidence against.
    pub fn absorb(&mut self, other: &Self, records: &Records<'_>) {
        for piece in other.evidence.iter().filter(|piece| piece.index != LOOK) {
            let known = self.place_of(piece.captured_at, piece.frame);
            match known.map(|place| (place, self.evidence[place].index)) {
                Some((place, LOOK)) => {
                    self.evidence[place] = *piece;
                    self.note_report(piece, records);
                    self.note_stale(place);
                }
                Some(_) => {}
                None => {
                    self.note_report(piece, records);
                    let place = self.evidence.partition_point(|other| records.frames.is_before(other, piece));
                    self.insert_late(place, *piece);
                }
            }
        }
        self.replay(records);
    }

    /// Forgets what the frame told, as if it had not come yet.
    pub fn take_back(&mut self, frame: FrameSlot, records: &Records<'_>) {
        let stored = records.frames.get(frame);
        let Some(place) = self.place_of(stored.captured_at, frame) else { return };
        self.checkpoints.truncate(self.checkpoints_within(place));
        let Some(piece) = self.evidence.remove(place) else { return };
        self.note_stale(place);
        if piece.index != LOOK {
            self.contributors.take_back(stored.agent);
            let reports = self.evidence.iter().filter(|piece| piece.index != LOOK);
            for earlier in reports.filter(|piece| records.frames.get(piece.frame).agent == stored.agent) {
                self.contributors.note(earlier, records.frames.get(earlier.frame), records.agents);
            }
        }
        if !self.is_without_reports() {
            self.replay(records);
        }
    }

    /// Whether nothing is left that it was reported by.
    pub fn is_without_reports(&self) -> bool {
        self.checkpoints.is_empty() && self.evidence.iter().all(|piece| piece.index == LOOK)
    }

    /// The newest measurement of each agent.
    pub fn contributors(&self) -> &Contributors {
        &self.contributors
    }

    /// When it was first reported.
    pub fn born_at(&self) -> Timestamp {
        self.born_at
    }

    /// When it was last reported.
    pub fn last_measured_at(&self) -> Timestamp {
        self.contributors.last_measured_at()
    }

    /// Forgets contributors that have not measured it since `oldest`, but for the newest.
    pub fn forget_contributors(&mut self, oldest: Timestamp) {
        self.contributors.forget_before(oldest);
        self.folded.forget_before(oldest);
    }

    /// Folds what is older than `horizon`, since nothing older can still arrive; down to a checkpoint if there
    /// is one within `slack` (at most [`FOLD_SLACK`]), which costs nothing. Late pieces must have been replayed.
    pub fn fold(&mut self, horizon: Timestamp, slack: Span, records: &Records<'_>) {
        debug_assert!(self.stale_from.is_none(), "folded before late pieces were replayed");
        if self.evidence.front().is_none_or(|oldest| oldest.captured_at >= horizon) {
            return;
        }
        let old = self.evidence.partition_point(|piece| piece.captured_at < horizon);
        // Evidence begins with the birth or after what is folded, so there is a checkpoint. Few are as old as that.
        let within = self.checkpoints.iter().take_while(|checkpoint| checkpoint.count <= old).count();
        let Some(place) = within.checked_sub(1) else { return };
        self.checkpoints.drain(..place);
        let folded = self.checkpoints[0].count;
        self.forget_front(folded, records);
        if self.evidence.front().is_some_and(|oldest| oldest.captured_at < horizon - slack) {
            let snapshot = self.after(old - folded, records);
            self.checkpoints[0].snapshot = snapshot;
            self.forget_front(old - folded, records);
            self.checkpoints[0].count = 0;
        }
    }

    fn forget_front(&mut self, count: usize, records: &Records<'_>) {
        let pieces = self.evidence.drain(..count);
        if records.remembers_folded {
            for piece in pieces.filter(|piece| piece.index != LOOK) {
                self.folded.note(&piece, records.frames.get(piece.frame), records.agents);
            }
        } else {
            drop(pieces);
        }
        for checkpoint in &mut self.checkpoints {
            checkpoint.count = checkpoint.count.saturating_sub(count);
        }
    }

    /// The evidence that is not folded, in order.
    pub fn evidence(&self) -> impl Iterator<Item = &Piece> {
        self.evidence.iter()
    }

    /// The oldest piece that is not folded, where there is one.
    pub fn oldest(&self) -> Option<&Piece> {
        self.evidence.front()
    }
}

/// Adds a piece to what is known; nothing is known before the first report.
#[inline]
fn advance<F: Filter>(known: &mut Option<Snapshot<F>>, piece: &Piece, records: &Records<'_>) {
    match known {
        Some(known) => apply(known, (piece, records.frames.held(piece)), None, records),
        None => *known = born(piece, records),
    }
}

fn born<F: Filter>(piece: &Piece, records: &Records<'_>) -> Option<Snapshot<F>> {
    let z = records.frames.expanded(piece, records.frames.held(piece)?);
    let birth_odds = records.frames.get(piece.frame).model.birth_odds;
    Some(Snapshot::born(piece.captured_at, &z, birth_odds, records.class_moves))
}

/// Adds a piece, with its measurement as it is held where it is a report.
#[inline(always)]
pub(super) fn apply<F: Filter>(
    known: &mut Snapshot<F>,
    (piece, held): (&Piece, Option<&CompactMeasurement>),
    predicted: Option<&F>,
    records: &Records<'_>,
) {
    let at = piece.captured_at;
    if let Some(held) = held {
        match predicted {
            Some(predicted) => known.state = *predicted,
            None => known.predict(at, records.synchronous),
        }
        let birth_odds = || records.frames.get(piece.frame).model.birth_odds;
        known.see(at, &records.frames.expanded(piece, held), (held.detection_over_clutter(), birth_odds));
    } else if let Some(look) = &records.frames.get(piece.frame).look {
        known.miss(at, look, records.synchronous);
    }
}
