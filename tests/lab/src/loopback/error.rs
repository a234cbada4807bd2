//! What can go wrong in a test network, told so that one need not look further.

use std::fmt;
use std::time::Duration;
use v2x_agent::link::profiles::ProfileError;
use v2x_common::fused::FusedFrame;
use v2x_common::id::{AgentId, NameError};
use v2x_common::wire::WireError;
use v2x_fusion_hub::hub::SettingsError;
use v2x_fusion_hub::hub::{AgentStatus, HubStatus};

/// Objects that an error message tells of.
const MAX_OBJECTS: usize = 8;

/// Why a test network does not do what was asked of it. `Debug` is the message too: tests print that.
#[derive(thiserror::Error)]
pub enum KitError {
    /// Called outside of a runtime.
    #[error(
        "no Tokio runtime here: use #[tokio::test(flavor = \"multi_thread\")], or v2x_lab::loopback::block_on"
    )]
    NoRuntime,
    /// Called in a runtime of one thread, which is the default of `#[tokio::test]`.
    #[error("Zenoh needs a Tokio runtime of several threads: use #[tokio::test(flavor = \"multi_thread\")]")]
    OneThread,
    /// `block_on` in a test that has a runtime.
    #[error("block_on is for tests without a runtime; here there is one: await the test itself")]
    RuntimeInRuntime,
    /// The system has no runtime to give.
    #[error("no Tokio runtime: {0}")]
    Runtime(#[source] std::io::Error),
    /// The hub's settings are no TOML. They are the inside of the `[hub]` table.
    #[error("the hub's settings are no TOML: {0}")]
    Toml(String),
    /// The hub's settings cannot be.
    #[error("the hub's settings: {0}")]
    Settings(#[from] SettingsError),
    /// An agent's name cannot be.
    #[error("no name for an agent, {name:?}: {source}")]
    Name {
        /// What it is.
        name: String,
        /// Why not.
        source: NameError,
    },
    /// A link's name cannot be understood.
    #[error("the link of {agent}: {source}")]
    Link {
        /// Whose.
        agent: AgentId,
        /// Why.
        source: ProfileError,
    },
    /// The hub did not start, or failed.
    #[error("the hub: {0:#}")]
    Hub(anyhow::Error),
    /// The hub ended while something was awaited of it.
    #[error("the hub has ended; Network::end tells why")]
    HubEnded,
    /// Zenoh did not do its part.
    #[error("the network: {0:#}")]
    Zenoh(anyhow::Error),
    /// The hub did not subscribe to an agent's frames.
    #[error("the hub does not listen to {agent}: not within {patience:?}")]
    NotHeard {
        /// Which agent.
        agent: AgentId,
        /// For how long it was waited.
        patience: Duration,
    },
    /// A frame or a sensor description has no form on the wire.
    #[error("{agent} cannot send this: {source}")]
    Frame {
        /// Which agent.
        agent: AgentId,
        /// Why.
        source: WireError,
    },
    /// More frames are on their way than there is room for.
    #[error("{agent} has {count} frames on their way: that is all there is room for")]
    Backlog {
        /// Which agent.
        agent: AgentId,
        /// How many.
        count: usize,
    },
    /// It did not become so.
    #[error("not within {patience:?}; {seen}")]
    TimedOut {
        /// For how long it was waited.
        patience: Duration,
        /// What was seen meanwhile.
        seen: Box<Seen>,
    },
}

impl fmt::Debug for KitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// What was seen until patience ended.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// How many fused frames.
    pub frames: u64,
    /// The last of them.
    pub last: Option<FusedFrame>,
    /// How hub and agents fare, where the hub said so.
    pub status: Option<HubStatus>,
}

impl fmt::Display for Seen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.last {
            None => write!(f, "no fused frame was seen")?,
            Some(last) => write_frame(f, self.frames, last)?,
        }
        let Some(status) = &self.status else { return write!(f, "\nthe hub did not answer how it fares") };
        if status.agents.is_empty() {
            write!(f, "\nthe hub has heard of no agent")?;
        }
        status.agents.iter().try_for_each(|agent| write_agent(f, agent))
    }
}

fn write_frame(f: &mut fmt::Formatter<'_>, frames: u64, last: &FusedFrame) -> fmt::Result {
    let FusedFrame { sequence, objects, .. } = last;
    write!(
        f,
        "{frames} fused frames were seen, the last (number {sequence}) with {} objects",
        objects.len()
    )?;
    for object in objects.iter().take(MAX_OBJECTS) {
        let (bev, (vx, vy)) = (&object.bev, object.velocity);
        write!(f, "\n  {} at ({:.2}, {:.2}) m", object.class, bev.x, bev.y)?;
        write!(f, ", ({vx:.2}, {vy:.2}) m/s, existence {:.3}", object.existence)?;
    }
    if objects.len() > MAX_OBJECTS {
        write!(f, "\n  and {} more", objects.len() - MAX_OBJECTS)
    } else {
        Ok(())
    }
}

fn write_agent(f: &mut fmt::Formatter<'_>, agent: &AgentStatus) -> fmt::Result {
    let left = if agent.alive { "" } else { " (has left)" };
    write!(f, "\nof agent {}{left} the hub accepted {} frames", agent.id, agent.accepted)?;
    for (reason, count) in &agent.refused {
        write!(f, ", refused {count} as {reason}")?;
    }
    agent.last_refusal.as_ref().map_or(Ok(()), |words| write!(f, "; the newest refusal: {words}"))
}
