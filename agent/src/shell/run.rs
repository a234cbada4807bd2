//! The agent's loop: captures at the sensor's times, publishes at the link's times of arrival.

use super::args::AgentArgs;
use super::publisher::AgentPublisher;
use crate::link::Outbox;
use crate::scenario::Scenario;
use crate::sending::{Fate, Sender};
use crate::sensor::{Boot, Observation};
use anyhow::{Context, anyhow};
use serde::Serialize;
use std::sync::Arc;
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::clock;
use v2x_common::id::AgentId;
use v2x_common::keys::Keys;
use v2x_common::net::{events, session};
use v2x_common::time::{Span, Timestamp};

/// Frames in transit at once: seconds of delay at any sensible rate.
const MAX_IN_TRANSIT: usize = 4096;
/// How long to wait for the first subscriber before capturing begins.
const SUBSCRIBER_PATIENCE: Duration = Duration::from_secs(2);
/// Time between two sensor descriptions.
const DESCRIPTION_INTERVAL: Duration = Duration::from_secs(1);
/// How far capturing may fall behind before frames are skipped.
const MAX_LAG: Span = Span::from_millis(1000);
/// How long frames in transit are still delivered after the end.
const DRAIN: Span = Span::from_millis(1000);

/// What an agent has done.
#[derive(Clone, Copy, Debug, Default, Serialize)]
struct Counts {
    frames_captured: u64,
    frames_sent: u64,
    frames_withheld: u64,
    frames_lost_on_link: u64,
    frames_dropped: u64,
    frames_skipped: u64,
    put_errors: u64,
}

/// Runs an agent until shutdown.
pub async fn run(args: AgentArgs, shutdown: CancellationToken) -> anyhow::Result<()> {
    let mut agent = Agent::new(&args)?;
    let config = session::client_config(&args.session_options())?;
    let Some(session) = session::open_patiently(config, None, &shutdown).await? else { return Ok(()) };
    let keys = Keys::new(args.network);
    let publisher = AgentPublisher::declare(&session, &keys, &args.id, args.format).await;
    let publisher = publisher.map_err(|error| anyhow!("declaring agent {}: {error}", args.id))?;
    tracing::info!(agent = %args.id, network = %args.network, "agent is connected");
    if args.events {
        events::emit("ready", &serde_json::json!({ "agent": args.id }));
    }
    let matched = publisher.wait_for_subscriber(SUBSCRIBER_PATIENCE).await;
    if !matched.map_err(|error| anyhow!("waiting for a subscriber: {error}"))? {
        tracing::info!(agent = %args.id, "no subscriber yet; sending anyway");
    }
    let counts = agent.serve(&publisher, &shutdown).await;
    tracing::info!(agent = %args.id, sent = counts.frames_sent, lost = counts.frames_lost_on_link, "agent ends");
    if args.events {
        events::emit("stopped", &counts);
    }
    drop(publisher);
    session::close(session).await
}

struct Agent {
    sender: Sender,
}

impl Agent {
    fn new(args: &AgentArgs) -> anyhow::Result<Self> {
        let scenario = Scenario::load(&args.scenario)?;
        let now = clock::now();
        let start = match args.start {
            Some(micros) => Timestamp::from_micros(micros).context("--start is out of range")?,
            None => now.floor_to(scenario.loop_length),
        };
        let seed = args.seed.unwrap_or(scenario.seed);
        let epoch = u64::try_from(now.as_micros()).unwrap_or(0);
        let index = scenario.agent_index(&args.id).ok_or_else(|| no_such_agent(&scenario, &args.id))?;
        let boot = Boot { seed, epoch, start };
        let sender = scenario.agents[index].sender(Arc::new(scenario.world(seed)), boot)?;
        Ok(Self { sender })
    }

    async fn serve(&mut self, publisher: &AgentPublisher, shutdown: &CancellationToken) -> Counts {
        let mut counts = Counts::default();
        // Both in true time, which is the machine's: the simulated clock affects only the time stamps.
        let mut outbox = Outbox::new(MAX_IN_TRANSIT, self.sender.link().config().reorder);
        let mut descriptions = tokio::time::interval(DESCRIPTION_INTERVAL);
        let mut next = self.sender.sensor().sequence_at_or_after(clock::now());
        loop {
            let capture_at = self.sender.sensor().capture_time(next);
            let wake_at = outbox.next_due().map_or(capture_at, |due| due.min(capture_at));
            tokio::select! {
                biased;
                () = shutdown.cancelled() => break,
                () = sleep_until(wake_at) => {}
                _ = descriptions.tick() => self.describe(publisher, &mut counts).await,
            }
            let now = clock::now();
            next = self.skip_if_behind(next, now, &mut counts);
            while self.sender.sensor().capture_time(next) <= now {
                counts.frames_captured += 1;
                match self.sender.send(next) {
                    Fate::Withheld => counts.frames_withheld += 1,
                    Fate::Lost => counts.frames_lost_on_link += 1,
                    Fate::Arrives { at, observation } => drop(outbox.push(at, observation)),
                }
                next += 1;
            }
            send_due(&mut outbox, now, publisher, &mut counts).await;
        }
        let end = clock::now() + DRAIN;
        while let Some(due) = outbox.next_due().filter(|due| *due <= end) {
            sleep_until(due).await;
            send_due(&mut outbox, due, publisher, &mut counts).await;
        }
        counts.frames_dropped = outbox.dropped() + outbox.len() as u64;
        counts
    }

    async fn describe(&self, publisher: &AgentPublisher, counts: &mut Counts) {
        if let Err(error) = publisher.put_description(&self.sender.description()).await {
            counts.put_errors += 1;
            tracing::warn!(%error, "sensor description not sent");
        }
    }

    /// A process that was stopped for a while does not catch up: the missed captures are skipped.
    fn skip_if_behind(&self, next: u64, now: Timestamp, counts: &mut Counts) -> u64 {
        if now - self.sender.sensor().capture_time(next) <= MAX_LAG {
            return next;
        }
        let resumed = self.sender.sensor().sequence_at_or_after(now);
        counts.frames_skipped += resumed - next;
        tracing::warn!(skipped = resumed - next, "capturing fell behind");
        resumed
    }
}

async fn send_due(
    outbox: &mut Outbox<Observation>,
    now: Timestamp,
    publisher: &AgentPublisher,
    counts: &mut Counts,
) {
    while let Some((_, observation)) = outbox.pop_due(now) {
        match publisher.put_observation(&observation).await {
            Ok(()) => counts.frames_sent += 1,
            Err(error) => {
                counts.put_errors += 1;
                tracing::warn!(%error, "frame not sent");
            }
        }
    }
}

async fn sleep_until(at: Timestamp) {
    tokio::time::sleep((at - clock::now()).to_duration()).await;
}

fn no_such_agent(scenario: &Scenario, id: &AgentId) -> anyhow::Error {
    let known: Vec<_> = scenario.agents.iter().map(|agent| agent.id().to_string()).collect();
    anyhow!("scenario {:?} has no agent {id}; it has {}", scenario.name, known.join(", "))
}
