//! What is published beside the keys that a hub reads: under the name of its network, or nearly, with a chunk that is wrong.

use crate::diagnosis::{Code, Finding};
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};
use v2x_common::clock;
use v2x_common::id::{AgentId, NetworkId};
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::stray;

/// Keys that are kept: they come from outside; and most characters of one.
const MAX_KEYS: usize = 16;
const MAX_CHARACTERS: usize = 128;
/// What was heard within this is reported.
const LATELY: Span = Span::from_millis(20_000);

/// Samples by key. Zenoh's threads count, the hub reads.
#[derive(Debug, Default)]
pub(super) struct Strays(Mutex<BTreeMap<String, Stray>>);

/// The samples of one key.
#[derive(Debug)]
struct Stray {
    count: u64,
    newest_at: Timestamp,
    /// By the first one.
    sender: Option<AgentId>,
}

impl Strays {
    /// Counts a sample, unless its key is one that the hub reads; of the first one of a key it asks who has sent it.
    pub(super) fn note(&self, key: &str, sender: impl FnOnce() -> Option<AgentId>) {
        let is_read = key.split('/').nth(2) == Some("agent")
            && key.rsplit('/').next().is_some_and(|what| matches!(what, "detections" | "sensor"));
        if is_read {
            return;
        }
        let mut keys = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let kept: String = key.chars().take(MAX_CHARACTERS).collect();
        let now = clock::now();
        if let Some(Stray { count, newest_at, .. }) = keys.get_mut(&kept) {
            (*count, *newest_at) = (*count + 1, now);
            return;
        }
        if keys.len() >= MAX_KEYS {
            keys.retain(|_, stray| now - stray.newest_at < LATELY);
        }
        if keys.len() < MAX_KEYS {
            keys.insert(kept, Stray { count: 1, newest_at: now, sender: sender() });
        }
    }

    /// What is wrong with those that were heard lately.
    pub(super) fn findings(&self, network: NetworkId, now: Timestamp) -> Vec<Finding> {
        let keys = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let lately = keys.iter().filter(|(_, stray)| now - stray.newest_at < LATELY);
        lately
            .map(|(key, Stray { count, sender, .. })| {
                let says = format!("{count} samples under `{key}`, which nobody reads");
                Finding::of_network(Code::WrongKey, says, stray::advice(network, *sender))
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelt_key_is_a_finding_for_some_seconds_and_a_right_one_is_none() {
        let (strays, demo) = (Strays::default(), NetworkId::new("demo").unwrap());
        ["v2x/demo/agent/cam/detections", "v2x/demo/agent/cam/sensor", "v2x/demo/agent/a/b/detections"]
            .iter()
            .for_each(|key| strays.note(key, || stray::sender(key, b"{}")));
        assert_eq!(strays.findings(demo, clock::now()), []);
        ["v2x/demo/agent/cam/detection", "v2x/demo/agent/cam/detection", "v2x/demo/agents/cam/detections"]
            .iter()
            .for_each(|key| strays.note(key, || stray::sender(key, b"{}")));
        let found = strays.findings(demo, clock::now());
        let [one, other] = &found[..] else { panic!("{found:?}") };
        assert!(
            one.is_fault()
                && one.says == "2 samples under `v2x/demo/agent/cam/detection`, which nobody reads",
            "{one}"
        );
        assert!(other.says.contains("agents/cam"), "{other}");
        assert!(one.change.contains("`v2x/demo/agent/cam/detections`"), "{one}");
        assert_eq!(strays.findings(demo, clock::now() + LATELY), []);
        (0..100).for_each(|k| strays.note(&format!("v2x/demo/agent/cam/x{k}"), || None));
        assert_eq!(strays.findings(demo, clock::now()).len(), MAX_KEYS);
    }
}
