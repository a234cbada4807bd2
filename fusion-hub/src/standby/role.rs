//! Whether a hub publishes or stands by, by the lists of its name that it hears.

use v2x_common::time::{Span, Timestamp};

/// After so long without a list a hub that stands by takes over.
const SILENCE: Span = Span::from_millis(300);
/// Where lists come more rarely it waits for so many of them.
const SILENT_LISTS: i64 = 3;
/// A hub that has just started, and hears no list, publishes after this.
const ALONE_AFTER: Span = Span::from_millis(1_000);
/// One that was asked for nothing for so long did not run; what others have sent meanwhile is still on its way.
const PAUSE: Span = Span::from_millis(150);
/// So long it takes at most.
const ARRIVES_WITHIN: Span = Span::from_millis(100);
/// A hub that did not run for so long, while it published, may have been replaced.
const REPLACED_AFTER: Span = Span::from_millis(1_000);
/// Another hub that publishes on for so long has no rule by which it yields, or does not hear this one.
const STUBBORN_AFTER: Span = Span::from_millis(2_000);
/// Where lists come more rarely, after so many of them.
const STUBBORN_LISTS: i64 = 6;
/// Lists with longer pauses between them are not of a hub that publishes on, where they do not come more rarely.
const CONTINUOUS: Span = Span::from_millis(500);
/// A hub that comes back within this was not gone: it has too much to do.
const RARE: Span = Span::from_millis(1_000);
/// One that started later than this before has nothing yet that would be lost: it yields to one that has run for longer. In
/// tenths of a second, which lineages count.
const YOUNG_TENTHS: u32 = 600;
/// It is to be asked this often at least.
const ASKED_EVERY: Span = Span::from_millis(50);

/// The role of one of two hubs of a name.
#[derive(Debug)]
pub(crate) struct Role {
    lineage: u32,
    /// The longest time between two lists by the settings.
    interval: Span,
    state: State,
    asked_at: Timestamp,
}

#[derive(Clone, Copy, Debug)]
enum State {
    StandsBy(Silence),
    Publishes {
        /// Another hub that publishes, too: since when, and when it was heard last.
        rival: Option<(Timestamp, Timestamp)>,
        /// The hub that it replaced: its lineage, the mean time between its lists, and when the last one came.
        replaced: Option<(u32, Span, Timestamp)>,
    },
}

/// What a hub that stands by hears.
#[derive(Clone, Copy, Debug)]
struct Silence {
    since: Timestamp,
    /// The lineage of the hub that it follows, and the mean time between its lists; `None` before it has heard any.
    follows: Option<(u32, Span)>,
    /// It has just started.
    is_new: bool,
    /// Not before this it takes over, where it did not run for a moment since it heard a list.
    not_before: Option<Timestamp>,
}

/// What a list means to the hub that hears it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Heard {
    /// It is followed.
    Followed,
    /// It changes nothing.
    Ignored,
    /// It is of a hub that publishes on: this one stands by from now on.
    Yields,
    /// Another hub has this hub's lineage, so that their ids would be the same.
    SameLineage,
}

impl Role {
    /// Of a hub that starts at `now` and stands by, for the time being.
    pub(crate) const fn new(lineage: u32, interval: Span, now: Timestamp) -> Self {
        let state = State::StandsBy(Silence { since: now, follows: None, is_new: true, not_before: None });
        Self { lineage, interval, state, asked_at: now }
    }

    /// Whether it publishes.
    pub(crate) const fn publishes(&self) -> bool {
        matches!(self.state, State::Publishes { .. })
    }

    /// The lineage of the hub that it follows.
    pub(crate) fn follows(&self) -> Option<u32> {
        match self.state {
            State::StandsBy(silence) => silence.follows.map(|(lineage, _)| lineage),
            State::Publishes { .. } => None,
        }
    }

    /// Its session was opened at `now`, for the first time or anew: nobody can have been heard, whoever publishes.
    pub(crate) fn listens_from(&mut self, now: Timestamp) {
        match &mut self.state {
            State::StandsBy(silence) => (silence.since, silence.is_new) = (now, true),
            State::Publishes { .. } if now - self.asked_at >= SILENCE => {
                let silence = Silence { since: now, follows: None, is_new: true, not_before: None };
                self.state = State::StandsBy(silence);
            }
            State::Publishes { .. } => {}
        }
        self.asked_at = now;
    }

    /// It publishes, and so does one of the same lineage, whose lists go before its own.
    pub(crate) fn give_way(&mut self, at: Timestamp) {
        let follows = Some((self.lineage, Span::ZERO));
        self.state = State::StandsBy(Silence { since: at, follows, is_new: false, not_before: None });
    }

    /// Whether it is this one of the two that yields.
    fn yields_to(&self, lineage: u32, at: Timestamp) -> bool {
        let is_young = |lineage: u32| lineage_at(at).wrapping_sub(lineage) < YOUNG_TENTHS;
        match (is_young(self.lineage), is_young(lineage)) {
            (true, false) => true,
            (false, true) => false,
            _ => lineage > self.lineage,
        }
    }

    /// Whether another hub publishes at `now` although this one does.
    pub(crate) fn has_rival(&self, now: Timestamp) -> bool {
        matches!(self.state, State::Publishes { rival: Some((_, last)), .. } if now - last < self.continuous())
    }

    /// A list of a hub of this name was heard at `at`. Of two hubs that publish the one with the lower lineage yields, but one
    /// that has just started to one that has not; and also the other one where that does not.
    pub(crate) fn hear(&mut self, lineage: u32, at: Timestamp) -> Heard {
        let yields = self.yields_to(lineage, at);
        let (continuous, stubborn_after) =
            (self.continuous(), STUBBORN_AFTER.max(times(self.interval, STUBBORN_LISTS)));
        match &mut self.state {
            State::StandsBy(silence) if silence.follows.is_some_and(|(followed, _)| followed == lineage) => {
                silence.hear(lineage, at);
                Heard::Followed
            }
            State::StandsBy(silence) if lineage == self.lineage => {
                // Later such a list is a forged one, which is to end no hub.
                if silence.is_new { Heard::SameLineage } else { Heard::Ignored }
            }
            State::StandsBy(silence) => {
                // Of two that publish the one with the lower lineage is about to yield.
                let is_below = silence.follows.is_some_and(|(followed, _)| lineage < followed);
                if is_below && at - silence.since < SILENCE {
                    return Heard::Ignored;
                }
                silence.hear(lineage, at);
                Heard::Followed
            }
            State::Publishes { rival, replaced } => {
                let since = rival.filter(|(_, last)| at - *last <= continuous).map_or(at, |(since, _)| since);
                *rival = Some((since, at));
                let is_stubborn = lineage != self.lineage && at - since >= stubborn_after;
                if yields || is_stubborn {
                    // Where its lists are merely rare, it is waited for them longer from now on.
                    let mean = match *replaced {
                        Some((of, mean, last)) if yields && of == lineage && at - last < RARE => {
                            mean.max(at - last)
                        }
                        _ => Span::ZERO,
                    };
                    let follows = Some((lineage, mean));
                    self.state =
                        State::StandsBy(Silence { since: at, follows, is_new: false, not_before: None });
                    return Heard::Yields;
                }
                Heard::Ignored
            }
        }
    }

    /// Since it was asked last the hub has computed for so long: for that long it did run.
    pub(crate) fn note_busy(&mut self, busy: Span) {
        self.asked_at += busy;
    }

    /// Decides, after everything that was heard by `now`, whether it takes over or stops to publish; `true` where something
    /// changes.
    pub(crate) fn decide(&mut self, now: Timestamp) -> bool {
        let pause = now - self.asked_at;
        self.asked_at = now;
        let patience = self.patience();
        match &mut self.state {
            State::Publishes { .. } if pause >= REPLACED_AFTER => {
                let silence = Silence { since: now, follows: None, is_new: false, not_before: None };
                self.state = State::StandsBy(silence);
                true
            }
            State::Publishes { .. } => false,
            State::StandsBy(silence) => {
                if pause >= PAUSE && silence.not_before.is_none() {
                    silence.not_before = Some(now + ARRIVES_WITHIN);
                }
                let takes_over = now - silence.since >= patience
                    && silence.not_before.is_none_or(|not_before| now >= not_before);
                if takes_over {
                    let replaced = silence.follows.map(|(lineage, mean)| (lineage, mean, silence.since));
                    self.state = State::Publishes { rival: None, replaced };
                }
                takes_over
            }
        }
    }

    /// When it is to be asked again.
    pub(crate) fn next_deadline(&self) -> Timestamp {
        let soon = self.asked_at + ASKED_EVERY;
        match self.state {
            State::StandsBy(silence) => {
                let due = silence.since + self.patience();
                soon.min(due.max(silence.not_before.unwrap_or(due)))
            }
            State::Publishes { .. } => soon,
        }
    }

    /// The longest pause between two lists of a hub that publishes on.
    fn continuous(&self) -> Span {
        CONTINUOUS.max(times(self.interval, SILENT_LISTS))
    }

    /// After so long without a list it takes over.
    fn patience(&self) -> Span {
        let State::StandsBy(Silence { follows, is_new, .. }) = self.state else { return SILENCE };
        let lists = |interval: Span| times(interval, SILENT_LISTS);
        let by_settings = SILENCE.max(lists(self.interval));
        match follows {
            Some((_, interval)) if !is_new => by_settings.max(lists(interval)),
            _ if is_new => ALONE_AFTER.max(by_settings),
            _ => by_settings,
        }
    }
}

fn times(interval: Span, count: i64) -> Span {
    Span::from_nanos(interval.as_nanos().saturating_mul(count))
}

/// The lineage of a hub that starts now: tenths of a second since the Unix epoch, cut to 32 bits. New at every start, for 13
/// years.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it is cut")]
pub(crate) const fn lineage_at(now: Timestamp) -> u32 {
    (now.as_nanos() / 100_000_000) as u32
}

impl Silence {
    fn hear(&mut self, lineage: u32, at: Timestamp) {
        let interval = match self.follows {
            Some((followed, mean)) if followed == lineage => {
                // One pause alone, as of a link that was lost, makes no rare lists.
                let most = SILENCE.max(mean + mean);
                let more = (at - self.since).min(most) - mean;
                mean + Span::from_nanos(more.as_nanos() / 8)
            }
            // Until more is known.
            _ => Span::ZERO,
        };
        *self = Self {
            since: self.since.max(at),
            follows: Some((lineage, interval)),
            is_new: false,
            not_before: None,
        };
    }
}

#[cfg(test)]
mod tests;
