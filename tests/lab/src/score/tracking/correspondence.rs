//! CLEAR MOT's matching: an object keeps its track as long as that is within the gate, the rest is assigned.
//!
//! Bernardin & Stiefelhagen, "Evaluating multiple object tracking performance", EURASIP JIVP 2008, as
//! py-motmetrics does it (`MOTAccumulator.update`): an object keeps its last track through absence and misses; where two
//! objects have the same last track, the first in the list keeps it; the rest is assigned to give the most pairs and,
//! among those, the least total distance.

use crate::score::tracking::clear::Clear;
use crate::score::tracking::indexed::{Indexed, IndexedInstant};
use crate::score::tracking::sequence::Sequence;
use v2x_fusion_hub::association::assignment::{Assigner, Candidate};

/// An object and a track that correspond at an instant.
#[derive(Clone, Copy, Debug)]
pub(super) struct Correspondence {
    /// Number of the instant in the sequence.
    pub instant: usize,
    /// Places in the instant's lists.
    pub object: usize,
    pub reported: usize,
    /// Whether the object had another track before.
    pub is_switch: bool,
}

/// The state of an object.
#[derive(Clone, Copy, Debug, Default)]
struct Followed {
    last_track: Option<u32>,
    /// Whether it has lost its track since.
    is_lost: bool,
}

struct Matcher {
    /// Reported boxes with a lower score are left out.
    min_score: f64,
    gate_m: f64,
    followed: Vec<Followed>,
    /// By place in the instant: the reported box of an object with the distance, and whether a reported box is taken.
    found: Vec<Option<(u32, f64)>>,
    is_taken: Vec<bool>,
    candidates: Vec<Candidate>,
    assigner: Assigner,
}

/// Counts, and calls `visit` with every correspondence. `indexed` has the pairs nearer than `gate_m`.
pub(super) fn correspond(
    indexed: &Indexed,
    gate_m: f64,
    min_score: f64,
    mut visit: impl FnMut(Correspondence),
) -> Clear {
    let mut matcher = Matcher {
        min_score,
        gate_m,
        followed: vec![Followed::default(); indexed.n_objects],
        found: vec![],
        is_taken: vec![],
        candidates: vec![],
        assigner: Assigner::default(),
    };
    let mut counts = Clear::default();
    for instant in &indexed.instants {
        matcher.keep(instant);
        matcher.assign(instant);
        matcher.count(instant, &mut counts, &mut visit);
    }
    counts
}

impl Clear {
    /// The counts of a scene. Pairs nearer than `gate_m` may correspond ([`GATE_M`](super::GATE_M)).
    pub fn of(sequence: &Sequence, gate_m: f64) -> Self {
        correspond(&Indexed::of(sequence, gate_m), gate_m, f64::NEG_INFINITY, |_| ())
    }
}

impl Matcher {
    /// Earlier correspondences first.
    fn keep(&mut self, instant: &IndexedInstant) {
        self.found.clear();
        self.found.resize(instant.objects.len(), None);
        self.is_taken.clear();
        self.is_taken.resize(instant.reported.len(), false);
        for pair in &instant.pairs {
            let reported = &instant.reported[pair.reported as usize];
            let last_track = self.followed[instant.objects[pair.object as usize] as usize].last_track;
            if last_track == Some(reported.track)
                && reported.score >= self.min_score
                && !self.is_taken[pair.reported as usize]
            {
                self.is_taken[pair.reported as usize] = true;
                self.found[pair.object as usize] = Some((pair.reported, pair.distance_m));
            }
        }
    }

    /// The rest: most pairs, then least distance.
    fn assign(&mut self, instant: &IndexedInstant) {
        self.candidates.clear();
        for pair in &instant.pairs {
            let is_open =
                self.found[pair.object as usize].is_none() && !self.is_taken[pair.reported as usize];
            if is_open && instant.reported[pair.reported as usize].score >= self.min_score {
                self.candidates.push(Candidate {
                    row: pair.object,
                    col: pair.reported,
                    cost: pair.distance_m,
                });
            }
        }
        if self.candidates.is_empty() {
            return;
        }
        // One object without a pair costs more than any other pairs can save.
        #[expect(clippy::cast_precision_loss, reason = "counts of objects")]
        let alone = self.gate_m * (instant.objects.len() + 1) as f64;
        let columns =
            self.assigner.solve(instant.objects.len(), instant.reported.len(), &self.candidates, alone);
        for candidate in &self.candidates {
            if columns[candidate.row as usize] == Some(candidate.col) {
                self.found[candidate.row as usize] = Some((candidate.col, candidate.cost));
            }
        }
    }

    fn count(
        &mut self,
        instant: &IndexedInstant,
        counts: &mut Clear,
        visit: &mut impl FnMut(Correspondence),
    ) {
        let mut n_found = 0;
        for (object, (number, found)) in instant.objects.iter().zip(&self.found).enumerate() {
            let followed = &mut self.followed[*number as usize];
            let Some((reported, distance_m)) = *found else {
                followed.is_lost = followed.last_track.is_some();
                continue;
            };
            let track = instant.reported[reported as usize].track;
            let is_switch = followed.last_track.is_some_and(|last| last != track);
            n_found += 1;
            counts.switches += u64::from(is_switch);
            counts.fragmentations += u64::from(followed.is_lost);
            counts.distance_sum_m += distance_m;
            *followed = Followed { last_track: Some(track), is_lost: false };
            visit(Correspondence { instant: instant.number, object, reported: reported as usize, is_switch });
        }
        let n_reported =
            instant.reported.iter().filter(|reported| reported.score >= self.min_score).count() as u64;
        counts.objects += instant.objects.len() as u64;
        counts.found += n_found;
        counts.false_positives += n_reported - n_found;
    }
}
