//! By whose messages Zenoh's code is broken.
//!
//! A key that is none is a mine: Zenoh takes it into its tables, and panics when it compares another one with it, on the thread of whoever
//! declares that. So who declares one is told, and who has only stepped on it is not.

use super::zenoh_peers::Peer;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// Of whom that is known, at most so many.
const MAX_BREAKERS: usize = 8;

/// Somebody by whose messages Zenoh's code is broken.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Breaker {
    /// Who, and from where.
    #[serde(flatten)]
    pub peer: Peer,
    /// How often.
    pub times: u64,
}

static BREAKERS: Mutex<Vec<Breaker>> = Mutex::new(Vec::new());

fn with_breakers<T>(change: impl FnOnce(&mut Vec<Breaker>) -> T) -> T {
    // Each change of it is whole: a poisoned lock is safe to use.
    change(&mut BREAKERS.lock().unwrap_or_else(PoisonError::into_inner))
}

/// By whose messages Zenoh's code is broken, the newest last, at most eight.
pub fn breakers() -> Vec<Breaker> {
    with_breakers(|breakers| breakers.clone())
}

/// The same in words, the newest first: `what agent:eve at 10.0.0.7 sends (3 times)`; `None` where nobody is known.
pub fn breakers_in_words() -> Option<String> {
    let of = |Breaker { peer, times }: &Breaker| match times {
        1 => format!("what {peer} sends"),
        _ => format!("what {peer} sends ({times} times)"),
    };
    let words: Vec<_> = breakers().iter().rev().map(of).collect();
    (!words.is_empty()).then(|| words.join(", "))
}

/// Goes on from what was known before this process began again.
pub fn recall(mut known: Vec<Breaker>) {
    known.truncate(MAX_BREAKERS);
    with_breakers(|breakers| *breakers = known);
}

/// Counts one; whether he is new. The one of longest ago gives way.
fn note(breakers: &mut Vec<Breaker>, peer: Peer) -> bool {
    let known = breakers.iter().position(|one| one.peer == peer);
    let times = known.map_or(0, |place| breakers.remove(place).times);
    if breakers.len() == MAX_BREAKERS {
        breakers.remove(0);
    }
    breakers.push(Breaker { peer, times: times.saturating_add(1) });
    known.is_none()
}

/// Whether a key that is none has got into the tables of this process: after that a panic is not the fault of whose message is handled.
static IS_MINED: AtomicBool = AtomicBool::new(false);
static DECLARED: AtomicU64 = AtomicU64::new(0);

/// Notes and tells that somebody has declared a key that is none.
pub(super) fn note_declared(peer: Option<Peer>, key: &str) {
    IS_MINED.store(true, Ordering::Relaxed);
    let count = DECLARED.fetch_add(1, Ordering::Relaxed) + 1;
    let who = peer.as_ref().map_or_else(|| "somebody".to_owned(), Peer::to_string);
    let is_new = peer.is_some_and(|peer| with_breakers(|breakers| note(breakers, peer)));
    if is_new || count.is_power_of_two() {
        tracing::error!(
            count,
            "{who} has declared the key `{key}`, which is none: Zenoh's code will break by it"
        );
    }
}

/// Notes a panic while a message of somebody was handled; whether it is laid to his door for the first time.
pub(super) fn note_panicked(peer: Option<Peer>) -> bool {
    let is_his = !IS_MINED.load(Ordering::Relaxed);
    peer.filter(|_| is_his).is_some_and(|peer| with_breakers(|breakers| note(breakers, peer)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_causes_a_fault_of_zenohs_code_again_and_again_is_counted_and_a_flood_of_others_is_bounded() {
        let peer = |k: usize| Peer { name: Some("agent:eve".to_owned()), address: format!("10.0.0.{k}") };
        let mut breakers = Vec::new();
        assert!(note(&mut breakers, peer(0)) && !note(&mut breakers, peer(0)));
        assert!((1..MAX_BREAKERS).all(|k| note(&mut breakers, peer(k))));
        assert!(!note(&mut breakers, peer(0)), "he is the newest now");
        assert!((20..20 + MAX_BREAKERS - 1).all(|k| note(&mut breakers, peer(k))));
        assert_eq!((breakers.len(), breakers[0].peer.clone(), breakers[0].times), (MAX_BREAKERS, peer(0), 3));
    }

    #[test]
    fn who_steps_on_a_key_that_is_none_is_not_told_as_the_fault_of_zenohs_code() {
        let peer = |name: &str| Peer { name: Some(format!("agent:{name}")), address: "10.0.0.1".to_owned() };
        let is_told = |name: &str| breakers().iter().any(|one| one.peer == peer(name));
        assert!(note_panicked(Some(peer("mallory"))) && is_told("mallory"), "nobody else can have done it");
        note_declared(Some(peer("eve")), "v2x/$*");
        assert!(!note_panicked(Some(peer("rsu"))) && !is_told("rsu") && is_told("eve"));
        assert!(
            breakers_in_words().is_some_and(|words| words.starts_with("what agent:eve at 10.0.0.1 sends"))
        );
    }
}
