//! Errors and warnings that Zenoh logs for each message that somebody sends: the first of each kind are printed, the others counted
//! and summed up once a minute, so that nobody fills a log.

use crate::clock;
use crate::time::{Span, Timestamp};
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};
use tracing::level_filters::LevelFilter;
use tracing::subscriber::Interest;
use tracing::{Event, Level, Metadata};
use tracing_subscriber::layer::{Context, Filter};

/// Lines of one kind that are printed each minute.
const PRINTED: u64 = 4;
/// After this the others are summed up, and all begin anew.
const SUMMED_UP_EVERY: Span = Span::from_millis(60_000);

/// Where in its code Zenoh logs: there are as many as there are such places.
type Place = (&'static str, u32);

#[derive(Debug)]
struct State {
    since: Option<Timestamp>,
    of_this_minute: BTreeMap<Place, u64>,
    unprinted: BTreeMap<Place, u64>,
    summed_up_at: Option<Timestamp>,
}

static STATE: Mutex<State> = Mutex::new(State::NEW);

fn with_state<T>(change: impl FnOnce(&mut State) -> T) -> T {
    // Counts are at worst off by one after a panic: a poisoned lock is safe to use.
    change(&mut STATE.lock().unwrap_or_else(PoisonError::into_inner))
}

impl State {
    const NEW: Self =
        Self { since: None, of_this_minute: BTreeMap::new(), unprinted: BTreeMap::new(), summed_up_at: None };

    /// Whether a line of this place is printed; counts it.
    fn is_printed(&mut self, place: Place, now: Timestamp) -> bool {
        if now - *self.since.get_or_insert(now) >= SUMMED_UP_EVERY {
            self.since = Some(now);
            self.of_this_minute.clear();
        }
        let count = self.of_this_minute.entry(place).or_default();
        *count += 1;
        let is_printed = *count <= PRINTED;
        if !is_printed {
            *self.unprinted.entry(place).or_default() += 1;
        }
        is_printed
    }

    /// What was not printed, in words.
    fn take_sum(&mut self, now: Timestamp) -> Option<String> {
        let is_due = now - *self.summed_up_at.get_or_insert(now) >= SUMMED_UP_EVERY;
        if self.unprinted.is_empty() || !is_due {
            return None;
        }
        self.summed_up_at = Some(now);
        let unprinted = std::mem::take(&mut self.unprinted);
        let count: u64 = unprinted.values().sum();
        let ((target, line), most) = unprinted.into_iter().max_by_key(|(_, count)| *count)?;
        Some(format!(
            "Zenoh has logged {count} more errors and warnings lately, most often those of {target}, line {line} ({most})"
        ))
    }
}

/// What was not printed lately, in words; once a minute at most.
pub fn take_sum(now: Timestamp) -> Option<String> {
    with_state(|state| state.take_sum(now))
}

/// Lets pass all but the lines of Zenoh of which there are too many.
pub(super) struct FewOfEach;

impl<S> Filter<S> for FewOfEach {
    fn enabled(&self, _: &Metadata<'_>, _: &Context<'_, S>) -> bool {
        true
    }

    fn callsite_enabled(&self, _: &'static Metadata<'static>) -> Interest {
        Interest::always()
    }

    fn max_level_hint(&self) -> Option<LevelFilter> {
        Some(LevelFilter::TRACE)
    }

    fn event_enabled(&self, event: &Event<'_>, _: &Context<'_, S>) -> bool {
        let metadata = event.metadata();
        let is_zenohs = *metadata.level() <= Level::WARN && metadata.target().starts_with("zenoh");
        let place = (metadata.target(), metadata.line().unwrap_or_default());
        !is_zenohs || with_state(|state| state.is_printed(place, clock::now()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_of_lines_of_one_kind_is_printed_a_few_times_a_minute_and_summed_up_and_hides_no_other() {
        let mut state = State::NEW;
        let at = |ms: i64| Timestamp::EPOCH + Span::from_millis(ms);
        let (flood, quiet) = (("zenoh::flood", 7), ("zenoh::quiet", 9));
        assert_eq!(state.take_sum(at(0)), None);
        assert_eq!((0..1000).filter(|ms| state.is_printed(flood, at(*ms))).count(), 4);
        assert!(state.is_printed(quiet, at(1000)));
        assert_eq!(state.take_sum(at(59_999)), None);
        let sum = state.take_sum(at(60_000)).unwrap();
        assert!(sum.contains("996 more") && sum.contains("zenoh::flood, line 7 (996)"), "{sum}");
        assert_eq!(state.take_sum(at(200_000)), None);
        assert_eq!((0..120).filter(|s| state.is_printed(flood, at(200_000 + 1000 * s))).count(), 8);
        assert!(state.take_sum(at(320_000)).is_some_and(|sum| sum.contains("112 more")));
    }
}
