//! The agent's loop: captures at the sensor's times, publishes at the link's times of arrival.

use super::args::AgentArgs;
use super::hearing::{Hearing, Said};
use super::live_world::{LiveWorld, Steps};
use super::publisher::AgentPublisher;
use crate::link::Outbox;
use crate::scenario::{AgentConfig, Scenario};
use crate::sending::{Fate, Sender};
use crate::sensor::{Boot, Observation};
use crate::world::Station;
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
use zenoh::Session;

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
    /// Captures at which a world that is driven elsewhere was not known.
    #[serde(skip_serializing_if = "is_zero")]
    frames_without_world: u64,
    put_errors: u64,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde asks for it")]
const fn is_zero(count: &u64) -> bool {
    *count == 0
}

/// Runs an agent until shutdown.
pub async fn run(args: AgentArgs, shutdown: CancellationToken) -> anyhow::Result<()> {
    let scenario = match &args.world {
        Some(world) => Scenario::load_in(&args.scenario, world)?,
        None => Scenario::load(&args.scenario)?,
    };
    // A mistake is said before the network is there.
    let index = scenario.agent_index(&args.id).ok_or_else(|| no_such_agent(&scenario, &args.id))?;
    let config = session::client_config(&args.session_options())?;
    let Some(session) = session::open_patiently(config, None, &shutdown).await? else { return Ok(()) };
    let keys = Keys::new(args.network);
    let publisher = AgentPublisher::declare(&session, &keys, &args.id, args.format).await;
    let mut publisher = publisher.map_err(|error| anyhow!("declaring agent {}: {error}", args.id))?;
    tracing::info!(agent = %args.id, network = %args.network, "agent is connected");
    if args.events {
        events::emit("ready", &serde_json::json!({ "agent": args.id }));
    }
    let agent = Agent::begin(&args, (&scenario, index), &session, &shutdown).await?;
    let Some(mut agent) = agent else {
        if args.events {
            events::emit("stopped", &Counts::default());
        }
        return session::close(session).await;
    };
    let matched = publisher.wait_for_subscriber(SUBSCRIBER_PATIENCE).await;
    if !matched.map_err(|error| anyhow!("waiting for a subscriber: {error}"))? {
        tracing::info!(agent = %args.id, "no subscriber yet; sending anyway");
    }
    let counts = agent.serve(&mut publisher, &shutdown).await?;
    tracing::info!(agent = %args.id, sent = counts.frames_sent, lost = counts.frames_lost_on_link, "agent ends");
    if args.events {
        events::emit("stopped", &counts);
    }
    drop(publisher);
    session::close(session).await
}

struct Agent {
    sender: Sender,
    /// Where another program drives the world.
    live: Option<LiveWorld>,
    config: AgentConfig,
    seed: u64,
    /// Where it rides on something: the key that says that this is not there, and its name.
    idle_key: Option<(String, String)>,
    is_idle: bool,
    hearing: Hearing,
}

impl Agent {
    /// The agent of this index; `None` where shutdown comes before the world. A live world brings its start with it.
    async fn begin(
        args: &AgentArgs,
        (scenario, index): (&Scenario, usize),
        session: &Session,
        shutdown: &CancellationToken,
    ) -> anyhow::Result<Option<Self>> {
        let now = clock::now();
        let seed = args.seed.unwrap_or(scenario.seed);
        let start =
            args.start.map(|micros| Timestamp::from_micros(micros).context("--start is out of range"));
        let start = start.transpose()?;
        let (start, world, live) = if scenario.world.is_live() {
            let steps = Steps::subscribe(session, &Keys::new(args.network)).await?;
            let live = LiveWorld::begin(steps, (scenario, seed), start, shutdown).await;
            let Some(live) = live else { return Ok(None) };
            (live.start(), live.world()?, Some(live))
        } else {
            (start.unwrap_or_else(|| now.floor_to(scenario.loop_length)), scenario.world(seed), None)
        };
        let config = scenario.agents[index].clone();
        let sender = config.sender(Arc::new(world), boot(seed, now, start))?;
        let idle_key = match &config.station {
            Station::Riding(name) => Some((Keys::new(args.network).agent_idle(&args.id, name), name.clone())),
            _ => None,
        };
        Ok(Some(Self { sender, live, config, seed, idle_key, is_idle: false, hearing: Hearing::default() }))
    }

    async fn serve(
        &mut self,
        publisher: &mut AgentPublisher,
        shutdown: &CancellationToken,
    ) -> anyhow::Result<Counts> {
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
                _ = descriptions.tick() => {
                    self.describe(publisher, &mut counts).await;
                    self.say_whether_heard(publisher).await;
                }
                is_another = advance(self.live.as_mut()) => {
                    if self.renew_world(is_another)? {
                        next = self.sender.sensor().sequence_at_or_after(clock::now());
                    }
                }
            }
            let now = clock::now();
            next = self.skip_if_behind(next, now, &mut counts);
            next = self.capture_due(next, now, &mut outbox, &mut counts);
            self.say_whether_idle(publisher).await;
            send_due(&mut outbox, now, publisher, &mut counts).await;
        }
        let end = clock::now() + DRAIN;
        while let Some(due) = outbox.next_due().filter(|due| *due <= end) {
            sleep_until(due).await;
            send_due(&mut outbox, due, publisher, &mut counts).await;
        }
        counts.frames_dropped = outbox.dropped() + outbox.len() as u64;
        Ok(counts)
    }

    /// Captures what is due; the number of the next frame.
    fn capture_due(
        &mut self,
        mut next: u64,
        now: Timestamp,
        outbox: &mut Outbox<Observation>,
        counts: &mut Counts,
    ) -> u64 {
        while self.sender.sensor().capture_time(next) <= now {
            if self.knows_the_world(next) {
                counts.frames_captured += 1;
                self.is_idle = self.idle_key.is_some() && !self.sender.sensor().is_present(next);
                match self.sender.send(next) {
                    Fate::Withheld => counts.frames_withheld += 1,
                    Fate::Lost => counts.frames_lost_on_link += 1,
                    Fate::Arrives { at, observation } => drop(outbox.push(at, observation)),
                }
            } else {
                counts.frames_without_world += 1;
                // Whether it would be there nobody knows.
                self.is_idle = false;
            }
            next += 1;
        }
        next
    }

    /// Says that what it rides on is not in the world, or that it is again: hubs would miss its frames.
    async fn say_whether_idle(&self, publisher: &mut AgentPublisher) {
        let key = self.idle_key.as_ref().filter(|_| self.is_idle);
        if key.is_some() != publisher.is_idle() {
            match key {
                Some((_, name)) => tracing::info!("idle: {name}, on which it rides, is not in the world"),
                None => tracing::info!("no longer idle: what it rides on is in the world"),
            }
        }
        if let Err(error) = publisher.say_idle(key.map(|(key, _)| key.as_str())).await {
            tracing::warn!(%error, "it is not said that the agent is idle");
        }
    }

    /// Says that nobody reads what the agent sends, which Zenoh keeps to itself, or that somebody does again.
    async fn say_whether_heard(&mut self, publisher: &AgentPublisher) {
        // Of a session that is closed there is nothing to say.
        let Ok(is_heard) = publisher.is_heard().await else { return };
        match self.hearing.note(is_heard, clock::now()) {
            Some(Said::Unheard) => tracing::warn!(
                "nobody reads what this agent sends: no hub is there, or it serves another --network, or the certificate was revoked, \
                 or is for another --id (`v2x certs list`, where the authority is)"
            ),
            Some(Said::HeardAgain) => tracing::info!("what this agent sends is read again"),
            None => {}
        }
    }

    /// Whether the world at the capture of this frame is known; a world that is driven elsewhere may be late.
    fn knows_the_world(&self, sequence: u64) -> bool {
        let sensor = self.sender.sensor();
        let t = sensor.capture_time(sequence) - sensor.boot().start;
        self.live.as_ref().is_none_or(|live| live.covers(t))
    }

    /// Takes over what is known of the world. Where that is another world, the agent begins again, which it says.
    fn renew_world(&mut self, is_another: bool) -> anyhow::Result<bool> {
        let Some(live) = &self.live else { return Ok(false) };
        let world = Arc::new(live.world()?);
        if is_another {
            self.sender = self.config.sender(world, boot(self.seed, clock::now(), live.start()))?;
        } else {
            self.sender.sensor_mut().set_world(world);
        }
        Ok(is_another)
    }

    async fn describe(&self, publisher: &AgentPublisher, counts: &mut Counts) {
        if !self.sender.sensor().has_body() {
            return;
        }
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

fn boot(seed: u64, now: Timestamp, start: Timestamp) -> Boot {
    Boot { seed, epoch: u64::try_from(now.as_micros()).unwrap_or(0), start }
}

/// Waits for more of a world that is driven elsewhere; says whether it is another one.
async fn advance(live: Option<&mut LiveWorld>) -> bool {
    match live {
        Some(live) => live.advance().await,
        None => std::future::pending().await,
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
