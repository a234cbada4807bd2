//! A track's evidence, sorted by its own time, with replay of what came after a late piece.

use super::{Evidence, EvidenceKey, Snapshot};
use crate::filter::Measurement;
use std::collections::VecDeque;
use v2x_common::id::{FrameId, MeasurementId, TrackId};
use v2x_common::time::Timestamp;

/// Most pieces of evidence that one track holds; beyond it the oldest are folded early.
const MAX_EVIDENCE: usize = 4096;

/// One tracked object.
///
/// Everything it tells is a function of the evidence alone, sorted by [`EvidenceKey`]: the same evidence
/// gives the same bits in any order of arrival. What is older than anything that can still arrive is
/// folded into `base`, which is the same computation cut at another place.
#[derive(Clone, Debug)]
pub struct Track {
    /// Its number.
    pub id: TrackId,
    base: Option<Snapshot>,
    evidence: VecDeque<(EvidenceKey, Evidence)>,
    /// What was known after each piece, as far as it is computed: rolled back to the place of a late piece,
    /// and replayed from there when somebody asks.
    replayed: VecDeque<Option<Snapshot>>,
    contributors: Vec<(Timestamp, MeasurementId)>,
}

impl Track {
    /// A track with its first piece of evidence.
    pub fn new(id: TrackId, key: EvidenceKey, evidence: Evidence) -> Self {
        let mut track = Self {
            id,
            base: None,
            evidence: VecDeque::new(),
            replayed: VecDeque::new(),
            contributors: Vec::new(),
        };
        track.insert(key, evidence);
        track
    }

    /// Puts a piece of evidence in its place in time. `false` where that very piece was there already.
    pub fn insert(&mut self, key: EvidenceKey, evidence: Evidence) -> bool {
        let place = self.place_after(|other| *other < key);
        if self.evidence.get(place).is_some_and(|(other, _)| *other == key) {
            return false;
        }
        self.evidence.insert(place, (key, evidence));
        self.replayed.truncate(place);
        if matches!(evidence, Evidence::Sighting(_)) {
            self.note_contributor(key);
        }
        if self.evidence.len() > MAX_EVIDENCE {
            self.fold_front();
        }
        true
    }

    /// The place after the last piece that is before something. From the end: what comes is mostly new, and
    /// what is old need not be touched.
    fn place_after(&self, is_before: impl Fn(&EvidenceKey) -> bool) -> usize {
        let last = self.evidence.iter().rposition(|(key, _)| is_before(key));
        last.map_or(0, |place| place + 1)
    }

    fn note_contributor(&mut self, key: EvidenceKey) {
        let entry = (key.captured_at, key.measurement());
        match self.contributors.binary_search_by_key(&key.frame.agent, |(_, id)| id.frame.agent) {
            Ok(place) => self.contributors[place] = self.contributors[place].max(entry),
            Err(place) => self.contributors.insert(place, entry),
        }
    }

    /// Where the evidence of this frame stands, if there is any.
    fn place_of(&self, captured_at: Timestamp, frame: &FrameId) -> Option<usize> {
        let start = self.place_after(|key| key.captured_at < captured_at);
        let same_time =
            self.evidence.iter().skip(start).take_while(|(key, _)| key.captured_at == captured_at);
        same_time.into_iter().position(|(key, _)| key.frame == *frame).map(|offset| start + offset)
    }

    /// Whether it holds evidence of this frame.
    pub fn has_evidence_of(&self, captured_at: Timestamp, frame: &FrameId) -> bool {
        self.place_of(captured_at, frame).is_some()
    }

    /// The report of it in this frame, if there is one.
    pub fn sighting_in(&self, captured_at: Timestamp, frame: &FrameId) -> Option<&Measurement> {
        match &self.evidence[self.place_of(captured_at, frame)?].1 {
            Evidence::Sighting(sighting) => Some(&sighting.z),
            Evidence::Look(_) => None,
        }
    }

    /// Takes over the sightings of a track that turned out to be of the same object. Of frames in which both
    /// were sighted, the own sighting stays; looks that found only the other one are no evidence against.
    pub fn absorb(&mut self, other: Self) {
        for (key, evidence) in other.evidence {
            let known = self.place_of(key.captured_at, &key.frame);
            match (evidence, known.map(|place| (place, self.evidence[place].1))) {
                (Evidence::Sighting(_), Some((place, Evidence::Look(_)))) => {
                    self.evidence.remove(place);
                    self.replayed.truncate(place);
                    self.insert(key, evidence);
                }
                (Evidence::Sighting(_), None) => {
                    self.insert(key, evidence);
                }
                (Evidence::Sighting(_), Some((_, Evidence::Sighting(_)))) | (Evidence::Look(_), _) => {}
            }
        }
    }

    /// What was known after the first `count` pieces; `None` before the first sighting.
    fn after(&mut self, count: usize) -> Option<&Snapshot> {
        while self.replayed.len() < count {
            let before = match self.replayed.back() {
                Some(before) => before.as_ref(),
                None => self.base.as_ref(),
            };
            let (key, evidence) = &self.evidence[self.replayed.len()];
            let snapshot = match (before, evidence) {
                (Some(before), evidence) => Some(before.after(key.captured_at, evidence)),
                (None, Evidence::Sighting(sighting)) => Some(Snapshot::born(key.captured_at, sighting)),
                (None, Evidence::Look(_)) => None,
            };
            self.replayed.push_back(snapshot);
        }
        if count == 0 { self.base.as_ref() } else { self.replayed[count - 1].as_ref() }
    }

    /// What is known after all evidence. A track has at least one sighting.
    pub fn latest(&mut self) -> &Snapshot {
        self.after(self.evidence.len()).expect("a track begins with a sighting")
    }

    /// What was known at a time, from the evidence up to and including it; before the first sighting, what
    /// the first sighting tells.
    pub fn known_at(&mut self, at: Timestamp) -> &Snapshot {
        let known = self.place_after(|key| key.captured_at <= at);
        let count = known.max(self.count_to_first_sighting());
        self.after(count).expect("a track begins with a sighting")
    }

    /// How many pieces of evidence it takes to know anything.
    fn count_to_first_sighting(&self) -> usize {
        if self.base.is_some() {
            return 0;
        }
        let first = self.evidence.iter().position(|(_, evidence)| matches!(evidence, Evidence::Sighting(_)));
        first.map_or(0, |place| place + 1)
    }

    /// The newest measurement of each agent, by agent.
    pub fn contributors(&self) -> impl Iterator<Item = MeasurementId> {
        self.contributors.iter().map(|(_, measurement)| *measurement)
    }

    /// When it was last sighted.
    pub fn last_measured_at(&self) -> Timestamp {
        self.contributors.iter().map(|(at, _)| *at).max().unwrap_or(Timestamp::MIN)
    }

    /// Folds what is older than `horizon`: nothing older can still arrive.
    pub fn fold(&mut self, horizon: Timestamp) {
        while self.evidence.front().is_some_and(|(key, _)| key.captured_at < horizon) {
            self.fold_front();
        }
    }

    /// Forgets contributors that have not measured it since `oldest`, but for the newest.
    pub fn forget_contributors(&mut self, oldest: Timestamp) {
        let newest = self.last_measured_at();
        self.contributors.retain(|(at, _)| *at >= oldest || *at == newest);
    }

    fn fold_front(&mut self) {
        self.base = self.after(1).copied();
        self.evidence.pop_front();
        self.replayed.pop_front();
    }

    /// The key of the oldest piece that is not folded, where there is one.
    pub fn oldest_key(&self) -> Option<EvidenceKey> {
        self.evidence.front().map(|(key, _)| *key)
    }
}
