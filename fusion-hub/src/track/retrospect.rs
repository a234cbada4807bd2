//! A track as it stood at an earlier time, by everything that is known by now.

use super::history::apply;
use super::{Contributors, Existence, Records, Track};
use crate::filter::Filter;
use v2x_common::class::Class;
use v2x_common::time::{Span, Timestamp};

/// What is known by now of a track at an earlier time.
#[derive(Clone, Copy, Debug)]
pub struct Retrospect<F> {
    /// Its state at that time: the fixed-interval smoother's, from that time to the newest evidence.
    pub state: F,
    /// The probability that it existed then. A report that revived what seemed dead counts as of the same object,
    /// as the track's number says.
    pub existence: f64,
    /// When it had last been measured then.
    pub last_measured_at: Timestamp,
}

/// Looks back at tracks, one after the other, with the same memory.
#[derive(Debug)]
pub struct Retrospection<F> {
    /// What was known before each step to a later time, and of what class it seemed to be.
    states: Vec<(F, Class)>,
    /// The same of existence, and the steps.
    existences: Vec<(Existence, Span)>,
    contributors: Contributors,
}

impl<F> Default for Retrospection<F> {
    fn default() -> Self {
        Self { states: Vec::new(), existences: Vec::new(), contributors: Contributors::NONE }
    }
}

impl<F: Filter> Retrospection<F> {
    /// The track at a time that its history reaches back to; `None` where it was first reported later. Late pieces
    /// must have been replayed.
    ///
    /// From the state of that time the very filter goes through all later evidence, and the smoother comes back from
    /// the last one.
    pub fn look_back(
        &mut self,
        track: &Track<F>,
        at: Timestamp,
        records: &Records<'_>,
    ) -> Option<Retrospect<F>> {
        if track.born_at() > at {
            return None;
        }
        let [until, after] = track.split_at(at);
        let mut known = track.known_at(at, records);
        self.contributors.clear();
        self.contributors.note_until(at, track.folded(), records.agents);
        self.contributors.note_until(at, track.contributors(), records.agents);
        for piece in until.filter(|piece| records.frames.held(piece).is_some()) {
            self.contributors.note(piece, records.frames.get(piece.frame), records.agents);
        }
        let last_measured_at = self.contributors.last_measured_at().max(known.state.at());
        known.predict(at, records.synchronous);
        known.survive_to(at);
        self.states.clear();
        self.existences.clear();
        for piece in after {
            let (state, class) = (known.state, known.moves_as());
            let (existence, since) = (known.existence, known.at);
            apply(&mut known, (piece, records.frames.held(piece)), None, records);
            if known.state.at() != state.at() {
                self.states.push((state, class));
            }
            if known.at != since {
                self.existences.push((existence, known.at - since));
            }
        }
        let states = self.states.iter().rev();
        let state = states.fold(known.state, |later, (state, class)| state.smoothed(*class, &later));
        let existences = self.existences.iter().rev();
        let existence = existences
            .fold(known.existence.probability(), |later, (existence, dt)| existence.existed(*dt, later));
        Some(Retrospect { state, existence, last_measured_at })
    }

    /// Each agent's newest report of the track looked back at last, of those not after that time.
    pub fn contributors(&self) -> &Contributors {
        &self.contributors
    }
}
