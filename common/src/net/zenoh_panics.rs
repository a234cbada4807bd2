//! Panics in Zenoh's own code.
//!
//! Zenoh's router takes what a client says for what its own clients say. Whoever writes its protocol by hand, with any certificate, can
//! make its threads panic. Most often that ends the connection of whoever did it, and nothing else. But a lock that was held then is
//! poisoned: each further thread that needs it panics, too, nobody is let in any more and no query is answered, while the
//! process seems well.

use super::{zenoh_breakers, zenoh_speakers};
use std::panic::{self, PanicHookInfo};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;

/// Threads of Zenoh's runtimes, `rx-0` and so on: what others' code panics of there is Zenoh's, too.
const THREADS: [&str; 5] = ["acc", "app", "net", "rx", "tx"];
/// In the words of a thread that needs a lock which another one has poisoned.
const POISONED: &str = "PoisonError";
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
            let speaks = zenoh_speakers::speaking();
            let is_new = zenoh_breakers::note_panicked(speaks.clone());
            if is_new || count.is_power_of_two() {
                let whose = speaks.map_or_else(|| "somebody".to_owned(), |peer| peer.to_string());
                tracing::error!(count, "Zenoh's code has panicked by a message of {whose}: {words}");
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
