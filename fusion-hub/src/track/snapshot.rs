//! What a track knows after each piece of evidence.

use super::Existence;
use crate::filter::{Filter, Measurement};
use crate::sensing::Look;
use v2x_common::class::Class;
use v2x_common::time::{Span, Timestamp};

/// Standard deviations of the position by which an object must lie inside a field of view to count as seen.
const VIEW_MARGIN_SIGMAS: f64 = 3.0;
/// And this much more, m: the true borders of a sensor are not sharp.
const VIEW_MARGIN_M: f64 = 0.5;
/// Different classes remembered for one track.
const MAX_CLASSES: usize = 4;

/// State, existence and class after the evidence up to one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Snapshot<F> {
    /// State at the last report.
    pub state: F,
    /// Existence at the last evidence.
    pub existence: Existence,
    /// When the last evidence was.
    pub at: Timestamp,
    /// When the first report was.
    pub born_at: Timestamp,
    /// Number of reports.
    pub n_reports: u32,
    class: Class,
    /// Whether the class tells how it moves.
    class_moves: bool,
    votes: [(Class, u32); MAX_CLASSES],
}

impl<F: Filter> Snapshot<F> {
    /// After the first report. Unless `class_moves`, the object moves as vehicles do, whatever it is.
    pub fn born(at: Timestamp, z: &Measurement, birth_odds: f64, class_moves: bool) -> Self {
        let mut votes = [(Class::Unknown, 0); MAX_CLASSES];
        votes[0] = (z.class, 1);
        Self {
            state: F::born(at, &Measurement { class: moves_as(z.class, class_moves), ..*z }),
            existence: Existence::from_odds(birth_odds),
            at,
            born_at: at,
            n_reports: 1,
            class: z.class,
            class_moves,
            votes,
        }
    }

    /// The state at another time, later or earlier. Within `synchronous` of the state it is the state.
    #[inline]
    pub fn state_at(&self, at: Timestamp, synchronous: Span) -> F {
        if (at - self.state.at()).abs() <= synchronous {
            return self.state;
        }
        self.state.predicted(at, self.moves_as())
    }

    /// The probability that it still exists at another time.
    pub fn existence_at(&self, at: Timestamp) -> f64 {
        self.existence.survived(at - self.at).probability()
    }

    /// Takes in a report, made at the state's own time or taken as simultaneous, with the detection probability
    /// over the clutter density (m²) and the odds that such a report is of something new.
    #[inline(always)]
    pub fn see(
        &mut self,
        at: Timestamp,
        z: &Measurement,
        (detection_over_clutter, birth_odds): (f64, impl FnOnce() -> f64),
    ) {
        self.survive_to(at);
        let innovation = self.state.update(z);
        let is_doubtful = self.existence.is_doubtful();
        self.existence = self.existence.reported(&innovation, detection_over_clutter);
        if is_doubtful {
            self.existence = self.existence.or_born_now(birth_odds());
        }
        self.n_reports += 1;
        self.vote(z.class);
    }

    /// Moves the state to another time. Within `synchronous` of it, it stays.
    #[inline(always)]
    pub fn predict(&mut self, at: Timestamp, synchronous: Span) {
        if (at - self.state.at()).abs() > synchronous {
            self.state.predict(at, self.moves_as());
        }
    }

    /// Takes in a look that did not report it.
    pub fn miss(&mut self, at: Timestamp, look: &Look, synchronous: Span) {
        // A track as dead as can be stays so until somebody reports it.
        if self.existence.is_least() {
            return;
        }
        let held_at = self.state.at();
        let seen_at = if (at - held_at).abs() > synchronous { at } else { held_at };
        let (position, sigma_m) = self.state.place_at(seen_at, self.moves_as());
        if look.covers(position, VIEW_MARGIN_SIGMAS * sigma_m + VIEW_MARGIN_M) {
            self.survive_to(at);
            self.existence = self.existence.missed(look.miss_probability);
        }
    }

    /// Lets it live on to another time, in which it may have gone.
    #[inline(always)]
    pub fn survive_to(&mut self, at: Timestamp) {
        self.existence = self.existence.survived(at - self.at);
        self.at = at;
    }

    #[inline(always)]
    fn vote(&mut self, class: Class) {
        // Nearly always all reports agree.
        if self.votes[0].0 == class && self.class == class {
            self.votes[0].1 = self.votes[0].1.saturating_add(1);
            return;
        }
        let place = self.votes.iter().position(|(known, count)| *known == class || *count == 0);
        // With all places taken, a class never heard of before loses to those with a record.
        if let Some(place) = place {
            self.votes[place] = (class, self.votes[place].1.saturating_add(1));
            if self.class != class {
                self.class = self.most_reported();
            }
        }
    }

    /// The most reported class; a named one goes before `unknown`, of equals the one reported first.
    pub fn class(&self) -> Class {
        self.class
    }

    /// The class by which it moves.
    pub fn moves_as(&self) -> Class {
        moves_as(self.class, self.class_moves)
    }

    fn most_reported(&self) -> Class {
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
}

/// The class by which an object moves.
fn moves_as(class: Class, class_moves: bool) -> Class {
    if class_moves { class } else { Class::Car }
}
