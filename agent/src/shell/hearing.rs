//! Whether anybody reads what an agent sends. Zenoh tells no sender that the access control denies its messages; but of a hub that denies
//! all of them its clients hear of no subscriber.

use v2x_common::time::{Span, Timestamp};

/// A hub that is started again, or opens its session anew, is back before.
const PATIENCE: Span = Span::from_millis(10_000);

/// What is to be said.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Said {
    /// For some time nobody has read anything.
    Unheard,
    /// Somebody reads it again.
    HeardAgain,
}

/// Since when nobody reads.
#[derive(Debug, Default)]
pub(super) struct Hearing {
    unheard_since: Option<Timestamp>,
    is_said: bool,
}

impl Hearing {
    /// Notes whether somebody reads at `now`; what is to be said, once each time.
    pub(super) fn note(&mut self, is_heard: bool, now: Timestamp) -> Option<Said> {
        if is_heard {
            self.unheard_since = None;
            return std::mem::take(&mut self.is_said).then_some(Said::HeardAgain);
        }
        let since = *self.unheard_since.get_or_insert(now);
        let is_due = now - since >= PATIENCE && !self.is_said;
        self.is_said |= is_due;
        is_due.then_some(Said::Unheard)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_agent_that_the_acl_silences_says_so_once_and_a_restart_of_the_hub_is_none_of_that() {
        let mut hearing = Hearing::default();
        let mut at = |seconds: i64, is_heard: bool| {
            hearing.note(is_heard, Timestamp::EPOCH + Span::from_millis(1000 * seconds))
        };
        assert_eq!((0..5).find_map(|second| at(second, false)), None, "the hub is started again");
        assert_eq!(at(5, true), None);
        let said: Vec<_> =
            (6..60).filter_map(|second| at(second, false).map(|said| (second, said))).collect();
        assert_eq!(said, [(16, Said::Unheard)]);
        assert_eq!((at(60, true), at(61, true)), (Some(Said::HeardAgain), None));
    }
}
