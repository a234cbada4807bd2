//! What is published beside the expected keys: in another network, under a misspelt key, under no key of ours at all.

use crate::served::Served;
use serde::de::IgnoredAny;
use std::collections::{BTreeMap, BTreeSet};
use v2x_common::id::{AgentId, NetworkId};
use v2x_common::keys;
use v2x_common::wire::{self, stray};
use v2x_fusion_hub::diagnosis::{Code, Finding};

/// Keys that are kept: they come from outside.
const MAX_KEYS: usize = 64;
/// Longest payload that is looked into.
const MAX_BYTES: usize = 256 << 10;

/// The keys that were heard.
#[derive(Clone, Debug)]
pub(super) struct Strays {
    network: NetworkId,
    keys: BTreeMap<String, Stray>,
    /// The hubs that publish.
    pub(super) hubs: Served,
}

/// The samples of one key.
#[derive(Clone, Copy, Debug)]
struct Stray {
    count: u64,
    /// The greatest of one of them.
    resemblance: Resemblance,
    /// By the first one.
    sender: Option<AgentId>,
}

/// How much a payload, or a key, resembles one of ours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Resemblance {
    /// Nothing of ours.
    Foreign,
    /// Detections in whatever format; there are many programs that detect something.
    LikeDetections,
    /// Ours.
    Ours,
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
    pub(super) fn new(network: NetworkId) -> Self {
        Self { network, keys: BTreeMap::new(), hubs: Served::default() }
    }

    /// Takes in a sample; what belongs to the network is none.
    pub(super) fn note(&mut self, key: &str, payload: &[u8]) {
        self.hubs.note(key);
        if place(key, self.network) == Place::Own {
            return;
        }
        let has_room = self.keys.len() < MAX_KEYS;
        if let Some(Stray { count, resemblance, .. }) = self.keys.get_mut(key) {
            *count += 1;
            if *resemblance < Resemblance::Ours {
                *resemblance = resemblance_of_payload(payload).max(*resemblance);
            }
        } else if has_room {
            let resemblance = resemblance_of_payload(payload).max(resemblance_of_key(key));
            let stray = Stray { count: 1, resemblance, sender: stray::sender(key, payload) };
            self.keys.insert(key.to_owned(), stray);
        }
    }

    /// What is wrong with them; `served` are the networks that have a hub.
    pub(super) fn findings(&self, served: &BTreeSet<NetworkId>) -> Vec<Finding> {
        let network = self.network;
        let findings = self.keys.iter().filter_map(|(key, stray)| match place(key, network) {
            Place::Own => None,
            Place::OtherNetwork(other) => {
                let is_served = NetworkId::new(other).is_ok_and(|other| served.contains(&other));
                (!is_served).then(|| other_network(key, other, network, stray.count))
            }
            Place::Nobody => match stray.resemblance {
                Resemblance::Foreign => None,
                Resemblance::LikeDetections => Some(wrong_key(key, network, stray).as_note()),
                Resemblance::Ours => Some(wrong_key(key, network, stray)),
            },
        });
        findings.collect()
    }
}

fn other_network(key: &str, other: &str, network: NetworkId, count: u64) -> Finding {
    let says = format!("{count} samples under `{key}`: no hub serves network {other:?}");
    let change = format!("Publish in network {network}, or start the hub with `--network {other}`");
    Finding::of_network(Code::WrongNetwork, says, change)
}

fn wrong_key(key: &str, network: NetworkId, Stray { count, sender, .. }: &Stray) -> Finding {
    if let Err(invalid) = keys::agent_of(key)
        && key.starts_with(&format!("v2x/{network}/agent/"))
        && key.ends_with("/detections")
    {
        let says = format!("{count} samples under `{key}`: {invalid}");
        return Finding::of_network(Code::InvalidName, says, "Give the agent another name");
    }
    let says = format!("{count} samples under `{key}`, which nobody reads");
    Finding::of_network(Code::WrongKey, says, stray::advice(network, *sender))
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

/// A key with our first chunk, or with the chunks of an agent, is nearly ours; one whose last chunk speaks of detections may be.
fn resemblance_of_key(key: &str) -> Resemblance {
    let folded = key.to_lowercase();
    let chunks: Vec<_> = folded.split('/').collect();
    let speaks_of_them = |chunk: &str| matches!(chunk, "detections" | "detection" | "bev");
    let last = chunks.last().copied().unwrap_or_default();
    match chunks[..] {
        ["v2x", _, ..] => Resemblance::Ours,
        [.., "agent" | "agents", _, what] if speaks_of_them(what) => Resemblance::Ours,
        _ if speaks_of_them(last) => Resemblance::LikeDetections,
        _ => Resemblance::Foreign,
    }
}

/// What is compact and can be read is ours, and JSON with the fields that each frame has, whether the rest of it can be read or not.
fn resemblance_of_payload(payload: &[u8]) -> Resemblance {
    if payload.len() > MAX_BYTES {
        return Resemblance::Foreign;
    }
    if payload.iter().find(|byte| !byte.is_ascii_whitespace()) != Some(&b'{') {
        let is_frame = wire::detections::decode_as_sent(payload).is_ok();
        return if is_frame { Resemblance::Ours } else { Resemblance::Foreign };
    }
    let fields: BTreeMap<String, IgnoredAny> = serde_json::from_slice(payload).unwrap_or_default();
    let has = |field: &str| fields.contains_key(field);
    match has("detections") || has("objects") {
        true if has("captured_at") => Resemblance::Ours,
        true if has("detections") => Resemblance::LikeDetections,
        _ => Resemblance::Foreign,
    }
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
            ("robot/intrusion_detection/state", "{\"armed\": true}"),
            ("maps/v2x_sites", "{}"),
            ("line/bevel", "7"),
        ];
        assert_eq!(findings(&sound, &["demo", "other"]), []);
    }

    #[test]
    fn what_other_programs_detect_is_no_fault() {
        let foreign = [
            ("factory/bottles/detections", "{\"bottles\": 3}"),
            ("yolo/out", "{\"detections\": [{\"label\": \"cat\"}]}"),
        ];
        let found = findings(&foreign, &["demo"]);
        assert!(found.len() == 2 && found.iter().all(|one| !one.is_fault()), "{found:#?}");
    }

    #[test]
    fn a_frame_in_the_compact_format_under_any_key_is_a_fault() {
        use v2x_common::detection::DetectionFrame;
        use v2x_common::id::{AgentId, FrameId};
        use v2x_common::time::Timestamp;
        let id = FrameId { agent: AgentId::new("cam").unwrap(), epoch: 1, sequence: 1 };
        let mut payload = Vec::new();
        wire::detections::encode(&DetectionFrame::empty(id, Timestamp::EPOCH), &mut payload).unwrap();
        let mut strays = Strays::new(NetworkId::new("demo").unwrap());
        strays.note("cameras/north", &payload);
        strays.note("cameras/south", &payload[..payload.len() - 1]);
        let found = strays.findings(&BTreeSet::new());
        assert!(
            found.len() == 1 && found[0].is_fault() && found[0].says.contains("cameras/north"),
            "{found:?}"
        );
    }

    #[test]
    fn another_network_a_misspelt_key_a_foreign_key_and_a_name_are_distinguished() {
        let cases = [
            ("v2x/dmeo/agent/cam/detections", "", Code::WrongNetwork, "--network dmeo"),
            ("v2x/demo/agent/cam/detection", "", Code::WrongKey, "v2x/demo/agent/cam/detections"),
            ("V2X/demo/agents/cam/detections", "", Code::WrongKey, "v2x/demo/agent/cam/detections"),
            (
                "cameras/north",
                "{\"captured_at\": 1, \"detections\": []}",
                Code::WrongKey,
                "which nobody reads. Detection frames belong under `v2x/demo/agent/NAME/",
            ),
            (
                "cameras/north",
                "{\"captured_at\": 1, \"agent\": \"cam\", \"detections\": []}",
                Code::WrongKey,
                "`v2x/demo/agent/cam/detections`",
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
