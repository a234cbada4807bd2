//! The world of an agent where another program drives it: the steps that the network brings.

use crate::scenario::Scenario;
use crate::trajectories::{StepError, Window, WorldStep};
use crate::world::{Course, Station, World, WorldConfig, WorldParameters};
use anyhow::anyhow;
use std::sync::Arc;
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::clock;
use v2x_common::keys::Keys;
use v2x_common::net::queue::DropOldestQueue;
use v2x_common::time::{Span, Timestamp};
use zenoh::Session;
use zenoh::pubsub::Subscriber;

/// Steps that may wait.
const WAITING: usize = 64;
/// After this time without a first step the log says what is waited for.
const PATIENCE: Duration = Duration::from_secs(3);
/// A world of which nothing was heard for longer, and for longer than three of its steps take, may have ended.
const SILENCE: Span = Span::from_millis(5000);

/// The steps of a world, as they come.
#[derive(Debug)]
pub struct Steps {
    queue: Arc<DropOldestQueue<Vec<u8>>>,
    /// None in tests.
    _subscriber: Option<Subscriber<()>>,
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
        Ok(Self { queue, _subscriber: Some(subscriber) })
    }

    /// The next step. Cancelling does not lose one.
    async fn next(&self, said: &mut Said) -> WorldStep {
        loop {
            match serde_json::from_slice(&self.queue.pop().await) {
                Ok(step) => return step,
                Err(error) => said.unreadable(&error),
            }
        }
    }
}

/// What the log has said: anybody on the network could fill it.
#[derive(Debug, Default)]
struct Said {
    unreadable: bool,
    refused: bool,
    other: bool,
}

impl Said {
    fn unreadable(&mut self, error: &serde_json::Error) {
        if !std::mem::replace(&mut self.unreadable, true) {
            tracing::warn!(%error, "a step of the world is unreadable; more of them are not said");
        }
    }

    fn refused(&mut self, error: &StepError) {
        if !std::mem::replace(&mut self.refused, true) {
            tracing::warn!(%error, "a step of the world is not used; more of them are not said");
        }
    }

    fn other(&mut self, expected_us: i64, found_us: i64) {
        if !std::mem::replace(&mut self.other, true) {
            tracing::warn!(
                expected_us,
                found_us,
                "there is another world on this network, which began at another time; it is not used"
            );
        }
    }
}

/// What is known of the world so far.
#[derive(Debug)]
pub struct LiveWorld {
    steps: Steps,
    window: Window,
    start: Timestamp,
    /// Whether the start was given: then no other world is this one.
    is_fixed: bool,
    ridden: Vec<String>,
    parameters: WorldParameters,
    seed: u64,
    /// When its last step came.
    heard_at: Timestamp,
    /// Time between its last two steps.
    pace: Span,
    said: Said,
}

impl LiveWorld {
    /// The world that began at this time, or the first one of which a step comes; `None` where shutdown comes first.
    pub async fn begin(
        steps: Steps,
        (scenario, seed): (&Scenario, u64),
        start: Option<Timestamp>,
        shutdown: &CancellationToken,
    ) -> Option<Self> {
        let ridden = scenario.agents.iter().filter_map(|agent| match &agent.station {
            Station::Riding(name) => Some(name.clone()),
            _ => None,
        });
        let mut live = Self {
            steps,
            window: Window::new(0, Vec::new()),
            start: start.unwrap_or(Timestamp::EPOCH),
            is_fixed: start.is_some(),
            ridden: ridden.collect(),
            parameters: scenario.world_parameters(),
            seed,
            heard_at: clock::now(),
            pace: Span::ZERO,
            said: Said::default(),
        };
        let began = async {
            if tokio::time::timeout(PATIENCE, live.first()).await.is_err() {
                tracing::warn!("no world yet: v2x up starts SUMO for a scenario with it, v2x sumo alone");
                live.first().await;
            }
        };
        let has_begun = tokio::select! {
            () = began => true,
            () = shutdown.cancelled() => false,
        };
        has_begun.then_some(live)
    }

    /// Waits for a first step that can be used. Cancelling does not lose one.
    async fn first(&mut self) {
        loop {
            let step = self.steps.next(&mut self.said).await;
            if self.is_fixed && step.start() != Some(self.start) {
                self.said.other(self.start.as_micros(), step.start_us);
            } else if self.begin_with(step) {
                return;
            }
        }
    }

    /// Begins the world with a step, if it can be used.
    fn begin_with(&mut self, step: WorldStep) -> bool {
        let Some(start) = step.start() else { return false };
        let mut window = Window::new(step.start_us, self.ridden.clone());
        if let Err(error) = window.push(step, clock::now()) {
            self.said.refused(&error);
            return false;
        }
        (self.window, self.start) = (window, start);
        (self.heard_at, self.pace) = (clock::now(), Span::ZERO);
        true
    }

    /// Waits for the next step that changes the world, and says whether that is another world which begins, since nothing is
    /// heard of the one before. Cancelling does not lose a step.
    pub async fn advance(&mut self) -> bool {
        loop {
            let step = self.steps.next(&mut self.said).await;
            let silence = clock::now() - self.heard_at;
            if step.start() == Some(self.start) {
                match self.window.push(step, clock::now()) {
                    Ok(()) => {
                        (self.heard_at, self.pace) = (clock::now(), silence);
                        return false;
                    }
                    Err(error) => self.said.refused(&error),
                }
            } else if self.is_fixed || silence < SILENCE.max(self.pace + self.pace + self.pace) {
                self.said.other(self.start.as_micros(), step.start_us);
            } else if self.begin_with(step) {
                tracing::warn!("nothing is heard of the world any more, and another one begins");
                return true;
            }
        }
    }

    /// When its scenario time is 0.
    pub const fn start(&self) -> Timestamp {
        self.start
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

#[cfg(test)]
mod tests {
    use super::*;

    const SCENARIO: &str = r#"
        name = "live"
        [world]
        kind = "sumo"
        file = "none.sumocfg"
        [[agents]]
        id = "rsu"
        kind = "roadside-unit"
        pose = { x = 0, y = -8 }
    "#;

    /// A step of the world that began at a time, as long after it as now is.
    fn step(start: Timestamp) -> Vec<u8> {
        let t_us = (clock::now() - start).as_nanos() / 1000;
        serde_json::to_vec(&WorldStep { start_us: start.as_micros(), t_us, objects: Vec::new() }).unwrap()
    }

    fn ago(seconds: i64) -> Timestamp {
        Timestamp::from_micros((clock::now() - Span::from_millis(1000 * seconds)).as_micros()).unwrap()
    }

    async fn begin(start: Option<Timestamp>, first: Vec<Vec<u8>>) -> LiveWorld {
        let queue = Arc::new(DropOldestQueue::new(WAITING));
        first.into_iter().for_each(|step| queue.push(step));
        let steps = Steps { queue, _subscriber: None };
        let scenario = Scenario::from_toml(SCENARIO).unwrap();
        LiveWorld::begin(steps, (&scenario, 1), start, &CancellationToken::new()).await.unwrap()
    }

    #[tokio::test]
    async fn an_agent_of_a_run_waits_for_the_world_of_the_run() {
        let (ours, foreign) = (ago(10), ago(20));
        let mut live = begin(Some(ours), vec![step(foreign), step(ours)]).await;
        assert_eq!(live.start(), ours);
        live.heard_at = live.heard_at - SILENCE - SILENCE;
        live.steps.queue.push(step(foreign));
        live.steps.queue.push(step(ours));
        assert!(!live.advance().await && live.start() == ours);
    }

    #[tokio::test]
    async fn an_agent_begins_with_the_first_step_that_can_be_and_goes_on_with_another_world_after_silence() {
        let (first, second) = (ago(10), ago(5));
        let far = WorldStep { start_us: 7, t_us: i64::MAX, objects: Vec::new() };
        let wrong = vec![b"no step".to_vec(), serde_json::to_vec(&far).unwrap(), step(first)];
        let mut live = begin(None, wrong).await;
        assert_eq!(live.start(), first);
        live.steps.queue.push(step(second));
        live.steps.queue.push(step(first));
        assert!(!live.advance().await && live.start() == first, "it is still there");
        live.pace = Span::ZERO;
        live.heard_at = live.heard_at - SILENCE - SILENCE;
        live.steps.queue.push(step(second));
        assert!(live.advance().await && live.start() == second);
    }
}
