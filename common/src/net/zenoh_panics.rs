//! Panics in Zenoh's own code.
//!
//! Zenoh's router takes what a client says for what its own clients say. Whoever writes its protocol by hand, with any certificate, can
//! make its threads panic. Most often that ends the connection of whoever did it, and nothing else. But a lock that was held then is
//! poisoned: each further thread that needs it panics, too, nobody is let in any more and no query is answered, while the
//! process seems well.

use super::zenoh_peers::{self, Peer};
use serde::{Deserialize, Serialize};
use std::panic::{self, PanicHookInfo};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

/// Threads of Zenoh's runtimes, `rx-0` and so on: what others' code panics of there is Zenoh's, too.
const THREADS: [&str; 5] = ["acc", "app", "net", "rx", "tx"];
/// In the words of a thread that needs a lock which another one has poisoned.
const POISONED: &str = "PoisonError";
/// Of whom it is known that his messages made Zenoh's code panic, at most so many.
const MAX_BREAKERS: usize = 8;

/// Somebody by whose messages Zenoh's code has panicked.
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

/// By whose messages Zenoh's code has panicked, the newest last, at most eight.
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

/// Calls this when a lock in Zenoh's code is poisoned and needed, with the words of that panic, before anything unwinds. It is expected not
/// to return: other threads that panic by that wait for ever. Other panics in Zenoh's code are printed ever more rarely, so that nobody fills
/// a log by them, and those of other code as before.
pub fn when_broken(act: impl Fn(&str) + Send + Sync + 'static) {
    let (has_begun, harmless) = (AtomicBool::new(false), AtomicU64::new(0));
    let print = panic::take_hook();
    panic::set_hook(Box::new(move |panicked| {
        if !is_in_zenoh(panicked) {
            return print(panicked);
        }
        let words = panicked.to_string();
        if !words.contains(POISONED) {
            let count = harmless.fetch_add(1, Ordering::Relaxed) + 1;
            // It is the thread of whoever sent it; by a poisoned lock it is anybody's.
            let speaks = zenoh_peers::speaking();
            let is_new = speaks.clone().is_some_and(|peer| with_breakers(|breakers| note(breakers, peer)));
            if is_new || count.is_power_of_two() {
                let who = speaks.map_or_else(|| "somebody".to_owned(), |peer| peer.to_string());
                tracing::error!(
                    count,
                    "Zenoh's code has panicked: {who} sends what no client of Zenoh does: {words}"
                );
            }
            return;
        }
        while has_begun.swap(true, Ordering::SeqCst) {
            thread::park();
        }
        act(&words);
    }));
}

fn is_in_zenoh(panicked: &PanicHookInfo<'_>) -> bool {
    let file = panicked.location().map_or("", panic::Location::file);
    is_of_zenoh(file, thread::current().name().unwrap_or_default())
}

/// Whether it is Zenoh that panics in this file, on a thread of this name.
fn is_of_zenoh(file: &str, thread: &str) -> bool {
    let is_crate = |part: &std::ffi::OsStr| part.to_string_lossy().starts_with("zenoh-");
    let is_thread = thread.rsplit_once('-').is_some_and(|(runtime, n)| {
        THREADS.contains(&runtime) && !n.is_empty() && n.bytes().all(|digit| digit.is_ascii_digit())
    });
    is_thread || Path::new(file).iter().any(is_crate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_causes_a_fault_of_zenohs_code_again_and_again_is_counted_and_a_flood_of_others_is_bounded() {
        let peer = |k: usize| Peer { name: Some("agent:eve".to_owned()), address: format!("10.0.0.{k}") };
        let mut breakers = Vec::new();
        assert!(note(&mut breakers, peer(0)) && !note(&mut breakers, peer(0)));
        (1..MAX_BREAKERS).for_each(|k| drop(note(&mut breakers, peer(k))));
        assert!(!note(&mut breakers, peer(0)), "he is the newest now");
        assert!((20..20 + MAX_BREAKERS - 1).all(|k| note(&mut breakers, peer(k))));
        assert_eq!((breakers.len(), breakers[0].peer.clone(), breakers[0].times), (MAX_BREAKERS, peer(0), 3));
    }

    #[test]
    fn a_fault_of_zenohs_code_is_distinguished_from_ours_by_its_file_or_its_thread() {
        assert!(is_of_zenoh("/registry/src/index/zenoh-1.10.2/src/net/routing/gateway.rs", "main"));
        assert!(is_of_zenoh("/registry/src/index/zenoh-transport-1.10.2/src/common/pipeline.rs", ""));
        assert!(is_of_zenoh("/rustc/library/alloc/src/vec/mod.rs", "rx-12"));
        for (file, thread) in [
            ("common/src/net/zenoh_panics.rs", "main"),
            ("fusion-hub/src/hub/run.rs", "tokio-runtime-worker"),
            ("fusion-hub/src/hub/run.rs", "tx-"),
            ("", ""),
        ] {
            assert!(!is_of_zenoh(file, thread), "{file} {thread}");
        }
    }
}
