//! Errors of a test network, with all details that explain a failed test.

use std::fmt;
use std::time::Duration;
use v2x_agent::link::profiles::ProfileError;
use v2x_common::fused::FusedFrame;
use v2x_common::id::{AgentId, NameError};
use v2x_common::wire::WireError;
use v2x_fusion_hub::hub::SettingsError;
use v2x_fusion_hub::hub::{AgentStatus, HubStatus};

/// Number of objects that an error message lists.
const MAX_OBJECTS: usize = 8;

/// An error of a test network. `Debug` prints the message too, since tests print `Debug`.
#[derive(thiserror::Error)]
pub enum KitError {
    /// The call was outside of a runtime.
    #[error(
        "no Tokio runtime here: use #[tokio::test(flavor = \"multi_thread\")], or v2x_lab::loopback::block_on"
    )]
    NoRuntime,
    /// The call was in a runtime of one thread, which is the default of `#[tokio::test]`.
    #[error("Zenoh needs a Tokio runtime of several threads: use #[tokio::test(flavor = \"multi_thread\")]")]
    OneThread,
    /// `block_on` was called inside a runtime.
    #[error("block_on is for tests without a runtime; here there is one: await the test itself")]
    RuntimeInRuntime,
    /// The runtime could not be started.
    #[error("no Tokio runtime: {0}")]
    Runtime(#[source] std::io::Error),
    /// The settings of the hub are not valid TOML. They are the contents of a `[hub]` table.
    #[error("the hub's settings are no TOML: {0}")]
    Toml(String),
    /// The settings of the hub are invalid.
    #[error("the hub's settings: {0}")]
    Settings(#[from] SettingsError),
    /// The name of an agent is invalid.
    #[error("invalid agent name {name:?}: {source}")]
    Name {
        /// The name.
        name: String,
        /// The reason.
        source: NameError,
    },
    /// A link cannot be parsed.
    #[error("the link of {agent}: {source}")]
    Link {
        /// Name of the agent.
        agent: AgentId,
        /// The reason.
        source: ProfileError,
    },
    /// The hub did not start or failed.
    #[error("the hub: {0:#}")]
    Hub(anyhow::Error),
    /// The hub ended during a wait.
    #[error("the hub has ended; Network::end returns the reason")]
    HubEnded,
    /// An error of Zenoh.
    #[error("the network: {0:#}")]
    Zenoh(anyhow::Error),
    /// The hub did not subscribe to an agent's frames.
    #[error("the hub did not subscribe to {agent} within {patience:?}")]
    NotHeard {
        /// Name of the agent.
        agent: AgentId,
        /// The time limit.
        patience: Duration,
    },
    /// A frame or a sensor description cannot be encoded.
    #[error("{agent} cannot send this: {source}")]
    Frame {
        /// Name of the agent.
        agent: AgentId,
        /// The reason.
        source: WireError,
    },
    /// The delay queue is full.
    #[error("{agent} has {count} frames in transit: the queue is full")]
    Backlog {
        /// Name of the agent.
        agent: AgentId,
        /// Number of frames in the queue.
        count: usize,
    },
    /// The awaited condition did not become true in time.
    #[error("timed out after {patience:?}; {seen}")]
    TimedOut {
        /// The time limit.
        patience: Duration,
        /// The messages received during the wait.
        seen: Box<Seen>,
    },
}

impl fmt::Debug for KitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// The messages received before a time limit.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// Number of fused frames.
    pub frames: u64,
    /// The last fused frame.
    pub last: Option<FusedFrame>,
    /// The status of the hub, if it replied.
    pub status: Option<HubStatus>,
}

impl fmt::Display for Seen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.last {
            None => write!(f, "no fused frame was seen")?,
            Some(last) => write_frame(f, self.frames, last)?,
        }
        let Some(status) = &self.status else {
            return write!(f, "\nthe hub did not answer the status query");
        };
        if status.agents.is_empty() {
            write!(f, "\nthe hub has received no frame of any agent")?;
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
