//! Key expressions of a network.
//!
//! | key | what |
//! |---|---|
//! | `v2x/{network}/agent/{agent}/detections` | detection frames |
//! | `v2x/{network}/agent/{agent}/sensor` | the sensor description, at start and every second |
//! | `v2x/{network}/agent/{agent}/alive` | liveliness token |
//! | `v2x/{network}/hub/{hub}/fused` | fused frames, postcard |
//! | `v2x/{network}/hub/{hub}/fused/json` | the same as JSON, only while there is a subscriber |
//! | `v2x/{network}/hub/{hub}/fused/lagged` | the second list, a lag behind, postcard, where the hub has one |
//! | `v2x/{network}/hub/{hub}/fused/lagged/json` | the same as JSON, only while there is a subscriber |
//! | `v2x/{network}/hub/{hub}/alive` | liveliness token |
//! | `v2x/{network}/hub/{hub}/status` | queryable, JSON |
//! | `v2x/{network}/sim/truth/{agent}` | simulation only: the true object of each detection of a frame |

use crate::id::{AgentId, HubId, NameError, NetworkId};

/// The keys of one network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Keys {
    network: NetworkId,
}

impl Keys {
    /// Of this network.
    pub const fn new(network: NetworkId) -> Self {
        Self { network }
    }

    /// Where an agent publishes its detection frames.
    pub fn detections(&self, agent: &AgentId) -> String {
        format!("v2x/{}/agent/{agent}/detections", self.network)
    }

    /// Every agent's detection frames.
    pub fn all_detections(&self) -> String {
        format!("v2x/{}/agent/*/detections", self.network)
    }

    /// Every agent's detection frames, those included whose name takes several chunks of the key or none: such names are
    /// not valid, but a hub can say so.
    pub fn any_detections(&self) -> String {
        format!("v2x/{}/agent/**/detections", self.network)
    }

    /// Where an agent publishes its sensor description.
    pub fn sensor(&self, agent: &AgentId) -> String {
        format!("v2x/{}/agent/{agent}/sensor", self.network)
    }

    /// Every agent's sensor description.
    pub fn all_sensors(&self) -> String {
        format!("v2x/{}/agent/*/sensor", self.network)
    }

    /// The same as [`Self::any_detections`] of sensor descriptions.
    pub fn any_sensors(&self) -> String {
        format!("v2x/{}/agent/**/sensor", self.network)
    }

    /// An agent's liveliness token.
    pub fn agent_alive(&self, agent: &AgentId) -> String {
        format!("v2x/{}/agent/{agent}/alive", self.network)
    }

    /// Every agent's liveliness token.
    pub fn all_agents_alive(&self) -> String {
        format!("v2x/{}/agent/*/alive", self.network)
    }

    /// The same as [`Self::any_detections`] of liveliness tokens.
    pub fn any_agents_alive(&self) -> String {
        format!("v2x/{}/agent/**/alive", self.network)
    }

    /// Where a hub publishes its fused frames.
    pub fn fused(&self, hub: &HubId) -> String {
        format!("v2x/{}/hub/{hub}/fused", self.network)
    }

    /// Every hub's fused frames.
    pub fn all_fused(&self) -> String {
        format!("v2x/{}/hub/*/fused", self.network)
    }

    /// Where a hub publishes its fused frames as JSON.
    pub fn fused_json(&self, hub: &HubId) -> String {
        format!("v2x/{}/hub/{hub}/fused/json", self.network)
    }

    /// Where a hub publishes its second list, which is a lag behind.
    pub fn lagged(&self, hub: &HubId) -> String {
        format!("v2x/{}/hub/{hub}/fused/lagged", self.network)
    }

    /// Every hub's second list.
    pub fn all_lagged(&self) -> String {
        format!("v2x/{}/hub/*/fused/lagged", self.network)
    }

    /// Where a hub publishes its second list as JSON.
    pub fn lagged_json(&self, hub: &HubId) -> String {
        format!("v2x/{}/hub/{hub}/fused/lagged/json", self.network)
    }

    /// A hub's liveliness token.
    pub fn hub_alive(&self, hub: &HubId) -> String {
        format!("v2x/{}/hub/{hub}/alive", self.network)
    }

    /// Where a hub answers queries for its status.
    pub fn status(&self, hub: &HubId) -> String {
        format!("v2x/{}/hub/{hub}/status", self.network)
    }

    /// Every hub's status.
    pub fn all_status(&self) -> String {
        format!("v2x/{}/hub/*/status", self.network)
    }

    /// Where a simulated agent publishes the true objects of its detections.
    pub fn truth(&self, agent: &AgentId) -> String {
        format!("v2x/{}/sim/truth/{agent}", self.network)
    }

    /// Every simulated agent's truth.
    pub fn all_truth(&self) -> String {
        format!("v2x/{}/sim/truth/*", self.network)
    }
}

/// The kind of data under a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    /// Detection frames of this agent.
    Detections(AgentId),
    /// The sensor description of this agent.
    Sensor(AgentId),
    /// Liveliness of this agent.
    AgentAlive(AgentId),
    /// Fused frames of this hub.
    Fused(HubId),
    /// The second list of this hub.
    Lagged(HubId),
    /// Simulation truth of this agent.
    Truth(AgentId),
}

impl Topic {
    /// The topic of a key of any network.
    pub fn of(key: &str) -> Option<Self> {
        let mut chunks = key.split('/');
        let (v2x, _network) = (chunks.next()?, chunks.next()?);
        let (role, who, what) = (chunks.next()?, chunks.next()?, chunks.next()?);
        let more = chunks.next();
        if v2x != "v2x" || chunks.next().is_some() {
            return None;
        }
        if let Some(more) = more {
            let is_lagged = (role, what, more) == ("hub", "fused", "lagged");
            return is_lagged.then(|| HubId::new(who).ok().map(Self::Lagged)).flatten();
        }
        match (role, who, what) {
            ("agent", agent, "detections") => Some(Self::Detections(AgentId::new(agent).ok()?)),
            ("agent", agent, "sensor") => Some(Self::Sensor(AgentId::new(agent).ok()?)),
            ("agent", agent, "alive") => Some(Self::AgentAlive(AgentId::new(agent).ok()?)),
            ("hub", hub, "fused") => Some(Self::Fused(HubId::new(hub).ok()?)),
            ("sim", "truth", agent) => Some(Self::Truth(AgentId::new(agent).ok()?)),
            _ => None,
        }
    }
}

/// A key of an agent whose name is not valid.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{error}")]
pub struct InvalidAgent {
    /// The name, with the `/` between its chunks.
    pub name: String,
    /// Why it is not valid.
    pub error: NameError,
}

/// The agent of one of the keys `v2x/{network}/agent/{agent}/{what}`. What stands between `agent` and the last chunk is
/// taken for its name, in an error even where it takes several chunks or none.
pub fn agent_of(key: &str) -> Result<AgentId, InvalidAgent> {
    let name = key.splitn(4, '/').nth(3).and_then(|rest| rest.rsplit_once('/')).map_or("", |(name, _)| name);
    AgentId::new(name).map_err(|error| InvalidAgent { name: name.to_owned(), error })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_topic_of_a_key_is_the_one_that_the_key_was_made_for() {
        let keys = Keys::new(NetworkId::new("demo").unwrap());
        let agent = AgentId::new("ego").unwrap();
        let hub = HubId::new("hub").unwrap();
        assert_eq!(keys.detections(&agent), "v2x/demo/agent/ego/detections");
        assert_eq!(Topic::of(&keys.detections(&agent)), Some(Topic::Detections(agent)));
        assert_eq!(Topic::of(&keys.sensor(&agent)), Some(Topic::Sensor(agent)));
        assert_eq!(Topic::of(&keys.agent_alive(&agent)), Some(Topic::AgentAlive(agent)));
        assert_eq!(Topic::of(&keys.fused(&hub)), Some(Topic::Fused(hub)));
        assert_eq!(Topic::of(&keys.lagged(&hub)), Some(Topic::Lagged(hub)));
        assert_eq!(Topic::of(&keys.fused_json(&hub)), None);
        assert_eq!(Topic::of(&keys.truth(&agent)), Some(Topic::Truth(agent)));
        assert_eq!(Topic::of("v2x/demo/agent/ego"), None);
        assert_eq!(Topic::of("v2x/demo/agent/ego/detections/x"), None);
    }

    #[test]
    fn a_name_that_is_not_valid_is_taken_whole_from_the_key() {
        assert_eq!(agent_of("v2x/demo/agent/ego/detections"), Ok(AgentId::new("ego").unwrap()));
        for (key, name, reason) in [
            ("v2x/demo/agent/cam/north/detections", "cam/north", "holds '/'"),
            ("v2x/demo/agent/kamera-süd/sensor", "kamera-süd", "holds 'ü'"),
            ("v2x/demo/agent/cam north/alive", "cam north", "holds ' '"),
            ("v2x/demo/agent/detections", "", "must not be empty"),
            ("v2x", "", "must not be empty"),
        ] {
            let invalid = agent_of(key).unwrap_err();
            assert_eq!(invalid.name, name);
            assert!(invalid.to_string().contains(reason), "{invalid}");
        }
    }
}
