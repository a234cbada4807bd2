//! Places for sessions that are taken: by all together, or many of them by one.
//!
//! Zenoh has a limit for all sessions and none for those of one certificate, and closes none at a program's request: what a hub can do is
//! to say who it is, before others are not let in.

use crate::diagnosis::{Code, Finding};
use v2x_common::net::zenoh_peers::{Sessions, SessionsOf};
use v2x_common::time::{Span, Timestamp};

/// An agent has one session, and two while it connects anew; so many are no agent's, and no consumer's that is meant well.
const MANY: usize = 32;
/// Others will soon not be let in where no more than this part of all places is free: one of ten.
const NEARLY_FULL_BUT: usize = 10;
/// That somebody was not let in is reported for so long.
const LATELY: Span = Span::from_millis(60_000);

/// What was seen of refused sessions before.
#[derive(Debug, Default)]
pub(super) struct Crowding {
    refused: u64,
    refused_at: Option<Timestamp>,
}

impl Crowding {
    /// What is found of the sessions that there are at `now`.
    pub(super) fn finding(&mut self, sessions: &Sessions, now: Timestamp) -> Option<Finding> {
        if sessions.refused > self.refused {
            self.refused_at = Some(now);
        }
        self.refused = sessions.refused;
        let are_refused = self.refused_at.is_some_and(|at| now - at < LATELY);
        let Sessions { total, limit, refused, most } = sessions;
        let largest = most.first();
        let holds = largest.map(|one| in_words(one, *limit)).unwrap_or_default();
        let change = "Keep out who holds them: a firewall can limit the connections of one address, as in the guide of an intersection, \
                      and `v2x certs revoke` takes rights away; revoking alone leaves sessions open";
        let is_nearly_full = *total > 0 && *total >= limit - limit / NEARLY_FULL_BUT;
        if are_refused || is_nearly_full {
            let turned_away = if are_refused {
                format!(", and {refused} were not let in since the start")
            } else {
                String::new()
            };
            let says = format!("{total} of {limit} places for sessions are taken{turned_away}; {holds}");
            return Some(Finding::of_network(Code::Sessions, says, change));
        }
        let is_much = largest.is_some_and(|one| one.name.is_some() && one.sessions >= MANY);
        is_much.then(|| Finding::of_network(Code::Sessions, holds, change).as_note())
    }
}

fn in_words(one: &SessionsOf, limit: usize) -> String {
    let SessionsOf { name, addresses, sessions } = one;
    let who = name.as_deref().unwrap_or("somebody without a certificate");
    format!("{who} holds {sessions} of {limit}, from {}", addresses.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: i64) -> Timestamp {
        Timestamp::EPOCH + Span::from_millis(1000 * seconds)
    }

    fn sessions(total: usize, of_eve: usize, refused: u64) -> Sessions {
        let eve = SessionsOf {
            name: Some("agent:eve".to_owned()),
            addresses: vec!["10.0.0.7".to_owned()],
            sessions: of_eve,
        };
        Sessions { total, limit: 1024, refused, most: vec![eve] }
    }

    #[test]
    fn a_flood_of_sessions_by_one_cert_is_a_note_that_names_it_and_a_fault_when_others_lack_places() {
        let mut crowding = Crowding::default();
        assert_eq!(crowding.finding(&sessions(50, 2, 0), at(0)), None);
        let note = crowding.finding(&sessions(90, 40, 0), at(1)).unwrap();
        assert!(!note.is_fault() && note.says == "agent:eve holds 40 of 1024, from 10.0.0.7", "{note}");
        let fault = crowding.finding(&sessions(922, 900, 0), at(2)).unwrap();
        assert!(fault.is_fault() && fault.says.contains("agent:eve holds 900"), "{fault}");
        assert!(!crowding.finding(&sessions(900, 900, 0), at(3)).unwrap().is_fault());
        // They come and go faster than they are looked at.
        let refused = crowding.finding(&sessions(50, 2, 7), at(4)).unwrap();
        assert!(refused.is_fault() && refused.says.contains("7 were not let in"), "{refused}");
        assert_eq!(crowding.finding(&sessions(50, 2, 7), at(65)), None);
    }

    #[test]
    fn a_flood_of_agents_without_certs_on_one_machine_is_no_finding_as_long_as_there_are_places() {
        let many = SessionsOf { name: None, addresses: vec!["127.0.0.1".to_owned()], sessions: 100 };
        let sessions = Sessions { total: 100, limit: 1024, refused: 0, most: vec![many] };
        assert_eq!(Crowding::default().finding(&sessions, at(0)), None);
        assert_eq!(Crowding::default().finding(&Sessions::default(), at(0)), None);
    }
}
