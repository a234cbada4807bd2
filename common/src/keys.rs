//! Key expressions of a network.
//!
//! | key | what |
//! |---|---|
//! | `v2x/{network}/agent/{agent}/detections` | detection frames |
//! | `v2x/{network}/agent/{agent}/sensor` | the sensor description, at start and every second |
//! | `v2x/{network}/agent/{agent}/alive` | liveliness token |
//! | `v2x/{network}/agent/{agent}/idle/{what}` | liveliness token while what the agent rides on is not in the world |
//! | `v2x/{network}/hub/{hub}/fused` | fused frames, postcard |
//! | `v2x/{network}/hub/{hub}/fused/json` | the same as JSON, only while there is a subscriber |
//! | `v2x/{network}/hub/{hub}/fused/lagged` | the second list, a lag behind, postcard, where the hub has one |
//! | `v2x/{network}/hub/{hub}/fused/lagged/json` | the same as JSON, only while there is a subscriber |
//! | `v2x/{network}/hub/{hub}/fused/delta` | a key frame a second and what changes between, postcard, only while there is a subscriber |
//! | `v2x/{network}/hub/{hub}/fused/delta/json` | the same as JSON, only while there is a subscriber |
//! | `v2x/{network}/hub/{hub}/fused/tile/{digit}/{digit}/…` | the objects of one tile, a chunk for each digit of its quadkey, postcard, only while any tile has a subscriber |
//! | `v2x/{network}/hub/{hub}/fused/json/tile/{digit}/{digit}/…` | the same as JSON |
//! | `v2x/{network}/hub/{hub}/beat` | of a hub with one that stands by: that it publishes, twenty times a second |
//! | `v2x/{network}/hub/{hub}/alive` | liveliness token |
//! | `v2x/{network}/hub/{hub}/status` | queryable, JSON |
//! | `v2x/{network}/hub/{hub}~{lineage}/status` | the same of a hub that stands by for it |
//! | `v2x/{network}/sim/truth/{agent}` | simulation only: the true object of each detection of a frame |
//! | `v2x/{network}/sim/world` | simulation only, of a world that another program drives: where its objects are, JSON |

use crate::id::{AgentId, HubId, NameError, NetworkId};
use crate::tile::Tile;

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

    /// Where detection frames end up whose key is misspelt. What is published rightly is there, too, and no list of a hub.
    pub fn beside_agents(&self) -> [String; 3] {
        ["agent/**", "agents/**", "detections/**"].map(|rest| format!("v2x/{}/{rest}", self.network))
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

    /// An agent's liveliness token while what it rides on is not in the world.
    pub fn agent_idle(&self, agent: &AgentId, rides_on: &str) -> String {
        format!("v2x/{}/agent/{agent}/idle/{}", self.network, chunk(rides_on))
    }

    /// Every agent's token of this kind.
    pub fn all_agents_idle(&self) -> String {
        format!("v2x/{}/agent/*/idle/*", self.network)
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

    /// Where a hub publishes key frames and what changes between them.
    pub fn delta(&self, hub: &HubId) -> String {
        format!("v2x/{}/hub/{hub}/fused/delta", self.network)
    }

    /// Every hub's key frames and what changes between them.
    pub fn all_deltas(&self) -> String {
        format!("v2x/{}/hub/*/fused/delta", self.network)
    }

    /// Where a hub publishes key frames and what changes between them as JSON.
    pub fn delta_json(&self, hub: &HubId) -> String {
        format!("v2x/{}/hub/{hub}/fused/delta/json", self.network)
    }

    /// Where a hub publishes the objects of a tile.
    pub fn tile(&self, hub: &HubId, tile: Tile) -> String {
        with_digits(format!("v2x/{}/hub/{hub}/fused/tile", self.network), tile)
    }

    /// Every tile of a hub.
    pub fn all_tiles(&self, hub: &HubId) -> String {
        format!("v2x/{}/hub/{hub}/fused/tile/**", self.network)
    }

    /// Every hub's tiles within an area: this tile and its parts.
    pub fn area(&self, area: Tile) -> String {
        with_digits(format!("v2x/{}/hub/*/fused/tile", self.network), area) + "/**"
    }

    /// Where a hub publishes the objects of a tile as JSON: a tree of its own, so that a subscriber to an area gets one codec.
    pub fn tile_json(&self, hub: &HubId, tile: Tile) -> String {
        with_digits(format!("v2x/{}/hub/{hub}/fused/json/tile", self.network), tile)
    }

    /// Every tile of a hub as JSON.
    pub fn all_tiles_json(&self, hub: &HubId) -> String {
        format!("v2x/{}/hub/{hub}/fused/json/tile/**", self.network)
    }

    /// Where a hub says that it publishes, to one that stands by for it.
    pub fn beat(&self, hub: &HubId) -> String {
        format!("v2x/{}/hub/{hub}/beat", self.network)
    }

    /// A hub's liveliness token.
    pub fn hub_alive(&self, hub: &HubId) -> String {
        format!("v2x/{}/hub/{hub}/alive", self.network)
    }

    /// Every hub's liveliness token.
    pub fn all_hubs_alive(&self) -> String {
        format!("v2x/{}/hub/*/alive", self.network)
    }

    /// Where a hub answers queries for its status.
    pub fn status(&self, hub: &HubId) -> String {
        format!("v2x/{}/hub/{hub}/status", self.network)
    }

    /// Where a hub that stands by answers queries for its status; its lineage has eight hexadecimal digits. No name of a hub
    /// holds a `~`.
    pub fn standby_status(&self, hub: &HubId, lineage: u32) -> String {
        format!("v2x/{}/hub/{hub}~{lineage:08x}/status", self.network)
    }

    /// The status of each hub that stands by for this one.
    pub fn all_standby_status(&self, hub: &HubId) -> String {
        format!("v2x/{}/hub/{hub}~$*/status", self.network)
    }

    /// Whether a key is one under which this hub answers, the one that publishes or one that stands by for it.
    pub fn is_status_of(&self, hub: &HubId, key: &str) -> bool {
        let standby = format!("v2x/{}/hub/{hub}~", self.network);
        key == self.status(hub)
            || (key.starts_with(&standby) && key.ends_with("/status") && !key.contains('*'))
    }

    /// Every hub's status, of those that stand by, too.
    pub fn all_status(&self) -> String {
        format!("v2x/{}/hub/*/status", self.network)
    }

    /// Where a hub publishes its journal, and answers queries that ask it to start one.
    pub fn journal(&self, hub: &HubId) -> String {
        format!("v2x/{}/hub/{hub}/journal", self.network)
    }

    /// Every hub's journal.
    pub fn all_journals(&self) -> String {
        format!("v2x/{}/hub/*/journal", self.network)
    }

    /// Where a simulated agent publishes the true objects of its detections.
    pub fn truth(&self, agent: &AgentId) -> String {
        format!("v2x/{}/sim/truth/{agent}", self.network)
    }

    /// Where a world that another program drives is published, step by step.
    pub fn world(&self) -> String {
        format!("v2x/{}/sim/world", self.network)
    }

    /// Every simulated agent's truth.
    pub fn all_truth(&self) -> String {
        format!("v2x/{}/sim/truth/*", self.network)
    }
}

/// Longest text that is a chunk of a key, in characters.
const MOST_CHARS: usize = 64;

/// A text as one chunk of a key: what has a meaning there, or cannot be shown, becomes `_`.
fn chunk(text: &str) -> String {
    let is_plain = |c: &char| !(c.is_control() || matches!(c, '/' | '*' | '$' | '?' | '#' | '@' | '~'));
    let chunk: String = text.chars().take(MOST_CHARS).map(|c| if is_plain(&c) { c } else { '_' }).collect();
    if chunk.is_empty() { "_".to_owned() } else { chunk }
}

/// The agent of a key of [`Keys::agent_idle`], and what it rides on.
pub fn idle_of(key: &str) -> Option<(AgentId, String)> {
    let mut chunks = key.split('/');
    let (v2x, _network, role) = (chunks.next()?, chunks.next()?, chunks.next()?);
    let (agent, what, rides_on) = (chunks.next()?, chunks.next()?, chunks.next()?);
    let is_one = v2x == "v2x" && role == "agent" && what == "idle" && chunks.next().is_none();
    Some((AgentId::new(agent).ok().filter(|_| is_one)?, chunk(rides_on)))
}

/// The key with a chunk for each digit of a tile's quadkey.
fn with_digits(mut key: String, tile: Tile) -> String {
    for digit in tile.digits() {
        key.push('/');
        key.push(char::from(b'0' + digit));
    }
    key
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
    /// Key frames of this hub, and what changes between them.
    Delta(HubId),
    /// The objects of a tile by this hub.
    Tile(HubId, Tile),
    /// The journal of this hub.
    Journal(HubId),
    /// Simulation truth of this agent.
    Truth(AgentId),
}

impl Topic {
    /// The topic of a key of any network.
    pub fn of(key: &str) -> Option<Self> {
        let (v2x, rest) = key.split_once('/')?;
        let (_network, rest) = rest.split_once('/')?;
        if v2x != "v2x" {
            return None;
        }
        let mut chunks = rest.splitn(4, '/');
        let (role, who, what) = (chunks.next()?, chunks.next()?, chunks.next()?);
        if let Some(more) = chunks.next() {
            return if (role, what) == ("hub", "fused") {
                Self::of_list(HubId::new(who).ok()?, more)
            } else {
                None
            };
        }
        match (role, who, what) {
            ("agent", agent, "detections") => Some(Self::Detections(AgentId::new(agent).ok()?)),
            ("agent", agent, "sensor") => Some(Self::Sensor(AgentId::new(agent).ok()?)),
            ("agent", agent, "alive") => Some(Self::AgentAlive(AgentId::new(agent).ok()?)),
            ("hub", hub, "fused") => Some(Self::Fused(HubId::new(hub).ok()?)),
            ("hub", hub, "journal") => Some(Self::Journal(HubId::new(hub).ok()?)),
            ("sim", "truth", agent) => Some(Self::Truth(AgentId::new(agent).ok()?)),
            _ => None,
        }
    }

    /// The hub that says it; `None` of what agents say.
    pub const fn hub(&self) -> Option<HubId> {
        match self {
            Self::Fused(hub)
            | Self::Lagged(hub)
            | Self::Delta(hub)
            | Self::Tile(hub, _)
            | Self::Journal(hub) => Some(*hub),
            Self::Detections(_) | Self::Sensor(_) | Self::AgentAlive(_) | Self::Truth(_) => None,
        }
    }

    /// The topic of what stands behind `fused/` in a hub's key.
    fn of_list(hub: HubId, chunks: &str) -> Option<Self> {
        match chunks.split_once('/') {
            None if chunks == "lagged" => Some(Self::Lagged(hub)),
            None if chunks == "delta" => Some(Self::Delta(hub)),
            Some(("tile", digits)) => {
                let is_one = |chunk: &str| chunk.len() == 1;
                let quadkey: String = digits.split('/').filter(|chunk| is_one(chunk)).collect();
                let is_whole = digits.split('/').all(is_one);
                quadkey.parse().ok().filter(|_| is_whole).map(|tile| Self::Tile(hub, tile))
            }
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
    fn what_an_agent_rides_on_is_one_chunk_of_its_key_whatever_its_name() {
        let keys = Keys::new(NetworkId::new("n").unwrap());
        let ego = AgentId::new("ego").unwrap();
        for (name, chunk) in [("veh 7", "veh 7"), ("a/b*c", "a_b_c"), ("", "_"), ("x\n\u{1b}[1m", "x__[1m")] {
            assert_eq!(idle_of(&keys.agent_idle(&ego, name)), Some((ego, chunk.to_owned())));
        }
        assert_eq!(
            keys.agent_idle(&ego, &"x".repeat(1000)).len(),
            "v2x/n/agent/ego/idle/".len() + MOST_CHARS
        );
        for other in [
            "v2x/n/agent/ego/alive",
            "v2x/n/agent/ego/idle/a/b",
            "v2x/n/agent/ego/idle",
            "v2x/n/agent/?/idle/a",
        ] {
            assert_eq!(idle_of(other), None, "{other}");
        }
    }

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
        assert_eq!(Topic::of(&keys.delta(&hub)), Some(Topic::Delta(hub)));
        assert_eq!(Topic::of(&keys.delta_json(&hub)), None);
        assert_eq!(Topic::of(&keys.journal(&hub)), Some(Topic::Journal(hub)));
        assert_eq!(Topic::of(&keys.truth(&agent)), Some(Topic::Truth(agent)));
        assert_eq!(Topic::of("v2x/demo/agent/ego"), None);
        assert_eq!(Topic::of("v2x/demo/agent/ego/detections/x"), None);
    }

    #[test]
    fn the_keys_of_a_hubs_status_are_those_of_no_other_hub() {
        let keys = Keys::new(NetworkId::new("demo").unwrap());
        let [hub, other] = ["hub", "hub-2"].map(|name| HubId::new(name).unwrap());
        for key in [keys.status(&hub), keys.standby_status(&hub, 7)] {
            assert!(keys.is_status_of(&hub, &key) && !keys.is_status_of(&other, &key), "{key}");
        }
        for key in [keys.all_status(), keys.all_standby_status(&hub), keys.fused(&hub)] {
            assert!(!keys.is_status_of(&hub, &key), "{key}");
        }
        assert_eq!(Topic::of(&keys.fused(&hub)).and_then(|topic| topic.hub()), Some(hub));
        assert_eq!(Topic::of(&keys.all_fused()).and_then(|topic| topic.hub()), None);
    }

    #[test]
    fn a_tile_has_a_chunk_for_each_digit_so_that_the_key_of_an_area_begins_those_of_its_parts() {
        let keys = Keys::new(NetworkId::new("demo").unwrap());
        let hub = HubId::new("hub").unwrap();
        let tile: Tile = "1203".parse().unwrap();
        assert_eq!(keys.tile(&hub, tile), "v2x/demo/hub/hub/fused/tile/1/2/0/3");
        assert_eq!(keys.tile_json(&hub, tile), "v2x/demo/hub/hub/fused/json/tile/1/2/0/3");
        assert_eq!(keys.area("12".parse().unwrap()), "v2x/demo/hub/*/fused/tile/1/2/**");
        assert_eq!(Topic::of(&keys.tile(&hub, tile)), Some(Topic::Tile(hub, tile)));
        assert_eq!(Topic::of(&keys.tile_json(&hub, tile)), None);
        for bad in ["", "/", "/1/4", "/12", "/1//2", "/1/2/"] {
            assert_eq!(Topic::of(&format!("v2x/demo/hub/hub/fused/tile{bad}")), None, "{bad}");
        }
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
