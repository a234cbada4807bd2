//! The world of an agent where another program drives it: the steps that the network brings.

use crate::scenario::Scenario;
use crate::trajectories::{Window, WorldStep};
use crate::world::{Course, Station, World, WorldConfig, WorldParameters};
use anyhow::{Context, anyhow};
use std::sync::Arc;
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::keys::Keys;
use v2x_common::net::queue::DropOldestQueue;
use v2x_common::time::{Span, Timestamp};
use zenoh::Session;
use zenoh::pubsub::Subscriber;

/// Steps that may wait.
const WAITING: usize = 64;
/// After this time without a first step the log says what is waited for.
const PATIENCE: Duration = Duration::from_secs(3);

/// The steps of a world, as they come.
#[derive(Debug)]
pub struct Steps {
    queue: Arc<DropOldestQueue<Vec<u8>>>,
    _subscriber: Subscriber<()>,
}

impl Steps {
    /// Subscribes to them.
    pub async fn subscribe(session: &Session, keys: &Keys) -> anyhow::Result<Self> {
        let queue = Arc::new(DropOldestQueue::new(WAITING));
        let into = Arc::clone(&queue);
        let subscriber = session
            .declare_subscriber(keys.world())
            .callback(move |sample| into.push(sample.payload().to_bytes().into_owned()));
        let subscriber = subscriber.await.map_err(|error| anyhow!("subscribing to the world: {error}"))?;
        Ok(Self { queue, _subscriber: subscriber })
    }

    /// The next step. Cancelling does not lose one.
    async fn next(&self) -> WorldStep {
        loop {
            match serde_json::from_slice(&self.queue.pop().await) {
                Ok(step) => return step,
                Err(error) => tracing::warn!(%error, "a step of the world is unreadable"),
            }
        }
    }

    /// The first step; `None` where shutdown comes first.
    pub async fn first(&self, shutdown: &CancellationToken) -> Option<WorldStep> {
        let first = self.next();
        tokio::pin!(first);
        tokio::select! {
            step = &mut first => return Some(step),
            () = shutdown.cancelled() => return None,
            () = tokio::time::sleep(PATIENCE) => {}
        }
        tracing::warn!("no world yet: v2x up starts SUMO for a scenario with it, v2x sumo alone");
        tokio::select! {
            step = first => Some(step),
            () = shutdown.cancelled() => None,
        }
    }
}

/// What is known of the world so far.
#[derive(Debug)]
pub struct LiveWorld {
    steps: Steps,
    window: Window,
    parameters: WorldParameters,
    seed: u64,
}

impl LiveWorld {
    /// The world that begins with a step, and when its scenario time is 0.
    pub fn begin(
        steps: Steps,
        first: WorldStep,
        scenario: &Scenario,
        seed: u64,
    ) -> anyhow::Result<(Self, Timestamp)> {
        let start = first.start().context("the world's start is out of range")?;
        let ridden = scenario.agents.iter().filter_map(|agent| match &agent.station {
            Station::Riding(name) => Some(name.clone()),
            _ => None,
        });
        let mut window = Window::new(first.start_us, ridden.collect());
        window.push(first).context("the world's first step")?;
        Ok((Self { steps, window, parameters: scenario.world_parameters(), seed }, start))
    }

    /// Waits for the next step that changes the world. Cancelling does not lose one.
    pub async fn advance(&mut self) {
        let step = self.steps.next().await;
        if let Err(error) = self.window.push(step) {
            tracing::warn!(%error, "a step of the world is not used");
        }
    }

    /// The scenario times at which it is known where everything is.
    pub fn known(&self) -> Option<(Span, Span)> {
        self.window.known()
    }

    /// Whether it is known where everything is at a scenario time.
    pub fn covers(&self, t: Span) -> bool {
        self.window.covers(t)
    }

    /// The world as far as it is known.
    pub fn world(&self) -> anyhow::Result<World> {
        let mut parameters = self.parameters.clone();
        if let WorldConfig::Recorded(world) = &mut parameters.config {
            let (traffic, numbers) = self.window.traffic();
            world.traffic = Arc::new(traffic);
            world.course = Course::Live { numbers };
        }
        Ok(World::new(&parameters, self.seed)?)
    }
}
