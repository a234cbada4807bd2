//! Who has sent a sample that nobody reads, by its key and its payload, and where it belongs.

use super::{detections, is_json};
use crate::id::{AgentId, NetworkId};
use crate::keys::Keys;
use crate::spelling;
use serde::Deserialize;

/// Longest payload that is looked into.
const MAX_BYTES: usize = 256 << 10;

/// What is read of a frame.
#[derive(Deserialize)]
struct Named {
    agent: Option<AgentId>,
}

/// The agent that a sample's payload names, or its key, with whatever mistakes.
pub fn sender(key: &str, payload: &[u8]) -> Option<AgentId> {
    of_payload(payload).or_else(|| of_key(key))
}

fn of_payload(payload: &[u8]) -> Option<AgentId> {
    if payload.len() > MAX_BYTES {
        return None;
    }
    if is_json("", payload) {
        return serde_json::from_slice::<Named>(payload).ok()?.agent;
    }
    detections::decode_as_sent(payload).ok().map(|frame| frame.id.agent)
}

/// The chunk behind one that says `agent`, else the one before or behind one that says `detections`.
fn of_key(key: &str) -> Option<AgentId> {
    let chunks: Vec<_> = key.split('/').collect();
    let is_near = |chunk: &str, words: &[&str]| spelling::nearest(chunk, words.iter().copied()).is_some();
    let says = |words: &[&str]| chunks.iter().position(|chunk| is_near(chunk, words));
    let ours = ["v2x", "agent", "agents", "detections", "sensor"];
    let name = |place: usize| {
        let chunk = chunks.get(place).filter(|chunk| !is_near(chunk, &ours))?;
        // Behind `v2x` is the network.
        let is_network = place > 0 && is_near(chunks[place - 1], &["v2x"]);
        AgentId::new(chunk).ok().filter(|_| !is_network)
    };
    let behind_agent = says(&["agent", "agents"]).and_then(|place| name(place + 1));
    behind_agent.or_else(|| {
        let place = says(&["detections", "sensor"])?;
        place.checked_sub(1).and_then(name).or_else(|| name(place + 1))
    })
}

/// Where the detection frames of this sender belong, in words.
pub fn advice(network: NetworkId, sender: Option<AgentId>) -> String {
    match sender {
        Some(agent) => {
            format!("Detection frames of {agent} belong under `{}`", Keys::new(network).detections(&agent))
        }
        None => format!(
            "Detection frames belong under `v2x/{network}/agent/NAME/detections`, where NAME is the agent's name"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sender_of_a_misplaced_sample_is_found_in_its_payload_or_else_in_its_key() {
        for (key, payload, name) in [
            ("v2x/demo/agent/cam/detection", "", Some("cam")),
            ("V2X/demo/agents/cam/detections", "", Some("cam")),
            ("v2x/demo/agnet/cam/detections", "", Some("cam")),
            ("v2x/demo/agent/cam/detections/json", "", Some("cam")),
            ("v2x/demo/cam/detections", "", Some("cam")),
            ("v2x/demo/detections/cam", "", Some("cam")),
            ("v2x/demo/detections", "", None),
            ("v2x/demo/agent/detections", "", None),
            ("cameras/north", "{\"captured_at\": 1}", None),
            ("cameras/north", "{\"agent\": \"cam\", \"foo\": [1]}", Some("cam")),
            ("v2x/demo/agents/cam/detections", "{\"agent\": \"north\"}", Some("north")),
            ("v2x/demo/agents/c a m/detections", "{\"agent\": 7}", None),
        ] {
            let found = sender(key, payload.as_bytes());
            assert_eq!(found.as_ref().map(AgentId::as_str), name, "{key} {payload}");
        }
    }

    #[test]
    fn where_frames_belong_is_said_with_the_agents_name_where_it_is_known() {
        let advice = |name: Option<&str>| {
            advice(NetworkId::new("demo").unwrap(), name.map(|name| AgentId::new(name).unwrap()))
        };
        assert!(advice(Some("cam")).contains("`v2x/demo/agent/cam/detections`"));
        assert!(advice(None).contains("agent/NAME/detections`, where NAME is"));
    }
}
