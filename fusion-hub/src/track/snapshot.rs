//! What a track knows after each piece of evidence.

use super::{Evidence, Existence, Look, Sighting};
use crate::filter::{MotionParams, State};
use v2x_common::class::Class;
use v2x_common::time::Timestamp;

/// Standard deviations of the position by which an object must lie inside a field of view to count as seen.
const VIEW_MARGIN_SIGMAS: f64 = 3.0;
/// And this much more, m: the true borders of a sensor are not sharp.
const VIEW_MARGIN_M: f64 = 0.5;
/// Different classes remembered for one track.
const MAX_CLASSES: usize = 4;

/// State, existence and class after the evidence up to one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Snapshot {
    /// State at the last sighting.
    pub state: State,
    /// Existence at the last evidence.
    pub existence: Existence,
    /// When the last evidence was.
    pub at: Timestamp,
    /// When the first sighting was.
    pub born_at: Timestamp,
    /// Number of sightings.
    pub n_sightings: u32,
    votes: [(Class, u32); MAX_CLASSES],
}

impl Snapshot {
    /// After the first sighting.
    pub fn born(at: Timestamp, sighting: &Sighting) -> Self {
        let mut votes = [(Class::Unknown, 0); MAX_CLASSES];
        votes[0] = (sighting.z.class, 1);
        Self {
            state: State::born(at, &sighting.z),
            existence: Existence::from_odds(sighting.birth_odds),
            at,
            born_at: at,
            n_sightings: 1,
            votes,
        }
    }

    /// After one more piece of evidence, at its own time.
    #[must_use]
    pub fn after(&self, at: Timestamp, evidence: &Evidence) -> Self {
        let mut next = *self;
        next.at = at;
        next.existence = self.existence.survived(at - self.at);
        match evidence {
            Evidence::Sighting(sighting) => next.see(at, sighting),
            Evidence::Look(look) => next.miss(at, look),
        }
        next
    }

    fn see(&mut self, at: Timestamp, sighting: &Sighting) {
        let z = &sighting.z;
        self.state = self.state.predicted(at, &self.motion());
        let innovation = self.state.kinematic.innovation(z.position, &z.r);
        let ratio = innovation.ln_likelihood + sighting.ln_detection_over_clutter;
        self.existence = self.existence.reported(ratio);
        self.state.update(z);
        self.n_sightings += 1;
        self.vote(z.class);
    }

    fn miss(&mut self, at: Timestamp, look: &Look) {
        let state = self.state.predicted(at, &self.motion());
        let [x, y] = state.kinematic.position;
        let margin_m = VIEW_MARGIN_SIGMAS * state.kinematic.pp.max_sigma() + VIEW_MARGIN_M;
        if look.covers(x, y, margin_m) {
            self.existence = self.existence.missed(look.miss_probability);
        }
    }

    fn vote(&mut self, class: Class) {
        let place = self.votes.iter().position(|(known, count)| *known == class || *count == 0);
        // With all places taken, a class never heard of before loses to those with a record.
        if let Some(place) = place {
            self.votes[place] = (class, self.votes[place].1.saturating_add(1));
        }
    }

    /// The most reported class; a named one goes before `unknown`, of equals the one reported first.
    pub fn class(&self) -> Class {
        let weight = |(class, count): (Class, u32)| (class != Class::Unknown && count > 0, count);
        let mut best = self.votes[0];
        for vote in self.votes {
            if weight(vote) > weight(best) {
                best = vote;
            }
        }
        best.0
    }

    /// Every reported class with its share of the reports, most reported first.
    pub fn class_shares(&self) -> impl Iterator<Item = (Class, f64)> {
        let mut votes = self.votes;
        let best = self.class();
        votes.sort_by_key(|(class, count)| (*class != best, std::cmp::Reverse(*count), *class));
        let total: u32 = votes.iter().map(|(_, count)| count).sum();
        let share = move |count| f64::from(count) / f64::from(total.max(1));
        votes.into_iter().filter(|(_, count)| *count > 0).map(move |(class, count)| (class, share(count)))
    }

    /// How objects of its class move.
    pub fn motion(&self) -> MotionParams {
        MotionParams::of(self.class())
    }

    /// The state at another time, later or earlier.
    pub fn state_at(&self, at: Timestamp) -> State {
        self.state.predicted(at, &self.motion())
    }
}
