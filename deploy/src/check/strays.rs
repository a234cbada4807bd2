//! What is published beside the expected keys: in another network, under a misspelt key, under no key of ours at all.

use serde::de::IgnoredAny;
use std::collections::{BTreeMap, BTreeSet};
use v2x_common::id::NetworkId;
use v2x_common::keys;
use v2x_fusion_hub::diagnosis::{Code, Finding};

/// Keys that are kept: they come from outside.
const MAX_KEYS: usize = 64;
/// Longest payload that is looked into.
const MAX_BYTES: usize = 256 << 10;

/// The keys that were heard.
#[derive(Debug)]
pub(super) struct Strays {
    network: NetworkId,
    /// Each with its number of samples, and whether one of them looks like a frame of detections.
    keys: BTreeMap<String, (u64, bool)>,
}

/// What a key is to a network.
#[derive(Debug, PartialEq, Eq)]
enum Place<'a> {
    /// One of its own.
    Own,
    /// One that another network would read.
    OtherNetwork(&'a str),
    /// Nobody reads it.
    Nobody,
}

impl Strays {
    /// Beside the keys of this network.
    pub(super) const fn new(network: NetworkId) -> Self {
        Self { network, keys: BTreeMap::new() }
    }

    /// Takes in a sample; what belongs to the network is none.
    pub(super) fn note(&mut self, key: &str, payload: &[u8]) {
        if place(key, self.network) == Place::Own {
            return;
        }
        let has_room = self.keys.len() < MAX_KEYS;
        if let Some((count, looks_like_frames)) = self.keys.get_mut(key) {
            *count += 1;
            *looks_like_frames = *looks_like_frames || is_like_frame(payload);
        } else if has_room {
            self.keys.insert(key.to_owned(), (1, is_like_frame(payload)));
        }
    }

    /// What is wrong with them; `served` are the networks that have a hub.
    pub(super) fn findings(&self, served: &BTreeSet<NetworkId>) -> Vec<Finding> {
        let network = self.network;
        let findings =
            self.keys.iter().filter_map(|(key, (count, looks_like_frames))| match place(key, network) {
                Place::Own => None,
                Place::OtherNetwork(other) => {
                    let is_served = NetworkId::new(other).is_ok_and(|other| served.contains(&other));
                    (!is_served).then(|| other_network(key, other, network, *count))
                }
                Place::Nobody => {
                    (*looks_like_frames || resembles(key)).then(|| wrong_key(key, network, *count))
                }
            });
        findings.collect()
    }
}

fn other_network(key: &str, other: &str, network: NetworkId, count: u64) -> Finding {
    let says = format!("{count} samples under `{key}`: no hub serves network {other:?}");
    let change = format!("Publish in network {network}, or start the hub with `--network {other}`");
    Finding::of_network(Code::WrongNetwork, says, change)
}

fn wrong_key(key: &str, network: NetworkId, count: u64) -> Finding {
    if let Err(invalid) = keys::agent_of(key)
        && key.starts_with(&format!("v2x/{network}/agent/"))
        && key.ends_with("/detections")
    {
        let says = format!("{count} samples under `{key}`: {invalid}");
        return Finding::of_network(Code::InvalidName, says, "Give the agent another name");
    }
    let says = format!("{count} samples under `{key}`, which nobody reads");
    let change = format!("Detection frames belong under `v2x/{network}/agent/NAME/detections`");
    Finding::of_network(Code::WrongKey, says, change)
}

fn place(key: &str, network: NetworkId) -> Place<'_> {
    let chunks: Vec<_> = key.split('/').collect();
    let is_agents = |what: &str| matches!(what, "detections" | "sensor" | "alive");
    let is_read = match chunks[..] {
        ["v2x", _, "agent", _, what] => is_agents(what),
        ["v2x", _, "hub", ..] | ["v2x", _, "sim", "truth", _] | ["v2x", _, "sim", "world"] => true,
        _ => false,
    };
    match chunks[..] {
        ["v2x", of, ..] if is_read && of == network.as_str() => Place::Own,
        ["v2x", of, "agent", ..] if is_read => Place::OtherNetwork(of),
        // A hub or a simulation of another network is no mistake.
        ["v2x", ..] if is_read => Place::Own,
        _ => Place::Nobody,
    }
}

/// Whether a key seems to be meant for us.
fn resembles(key: &str) -> bool {
    let folded = key.to_lowercase();
    ["v2x", "detection", "bev"].iter().any(|word| folded.contains(word))
}

/// Whether a payload is a JSON object that looks like a frame of detections.
fn is_like_frame(payload: &[u8]) -> bool {
    let is_object = payload.iter().find(|byte| !byte.is_ascii_whitespace()) == Some(&b'{');
    if !is_object || payload.len() > MAX_BYTES {
        return false;
    }
    let fields: BTreeMap<String, IgnoredAny> = serde_json::from_slice(payload).unwrap_or_default();
    fields.contains_key("detections")
        || (fields.contains_key("captured_at") && fields.contains_key("objects"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn findings(samples: &[(&str, &str)], served: &[&str]) -> Vec<Finding> {
        let mut strays = Strays::new(NetworkId::new("demo").unwrap());
        samples.iter().for_each(|(key, payload)| strays.note(key, payload.as_bytes()));
        let served = served.iter().map(|name| NetworkId::new(name).unwrap()).collect();
        strays.findings(&served)
    }

    #[test]
    fn what_a_hub_or_nobody_of_ours_publishes_is_no_stray() {
        let sound = [
            ("v2x/demo/agent/cam/detections", "{\"detections\": []}"),
            ("v2x/demo/agent/cam/sensor", "{}"),
            ("v2x/demo/sim/world", "{\"objects\": []}"),
            ("v2x/demo/hub/hub/fused/json", "{\"objects\": []}"),
            ("v2x/other/agent/cam/detections", "{}"),
            ("weather/today", "{\"rain\": 1, \"objects\": []}"),
            ("robot/pose", "no json"),
        ];
        assert_eq!(findings(&sound, &["demo", "other"]), []);
    }

    #[test]
    fn another_network_a_misspelt_key_a_foreign_key_and_a_name_are_told_apart() {
        let cases = [
            ("v2x/dmeo/agent/cam/detections", "", Code::WrongNetwork, "--network dmeo"),
            ("v2x/demo/agent/cam/detection", "", Code::WrongKey, "agent/NAME/detections"),
            ("V2X/demo/agents/cam/detections", "", Code::WrongKey, "agent/NAME/detections"),
            (
                "cameras/north",
                "{\"captured_at\": 1, \"detections\": []}",
                Code::WrongKey,
                "which nobody reads",
            ),
            ("v2x/demo/agent/cam/north/detections", "", Code::InvalidName, "another name"),
        ];
        for (key, payload, code, words) in cases {
            let found = findings(&[(key, payload)], &["demo"]);
            let [one] = &found[..] else { panic!("{key}: {found:?}") };
            assert_eq!(one.code, code, "{one}");
            assert!(one.to_string().contains(words) && one.is_fault(), "{one}");
        }
    }

    #[test]
    fn keys_from_outside_are_bounded() {
        let mut strays = Strays::new(NetworkId::new("demo").unwrap());
        (0..1000).for_each(|k| strays.note(&format!("v2x/x{k}"), b""));
        assert_eq!(strays.keys.len(), MAX_KEYS);
    }
}
