//! A hub in this process and a consumer of its fused frames.

use crate::loopback::access::Access;
use crate::loopback::agent::NewAgent;
use crate::loopback::consumer::{Consumer, Subscription, Traffic};
use crate::loopback::error::{KitError, Seen};
use crate::loopback::task_group::TaskGroup;
use crate::loopback::{hub_status, runtime};
use anyhow::anyhow;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;
use tokio_util::sync::{CancellationToken, DropGuard};
use v2x_common::clock;
use v2x_common::fused::FusedFrame;
use v2x_common::id::NetworkId;
use v2x_common::net::session::SessionOptions;
use v2x_common::time::Timestamp;
use v2x_common::wire;
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::hub::HubSettings;
use v2x_fusion_hub::hub::{HubError, HubSetup, HubStatus, serve};

/// Capacity of the queue of fused frames: half a minute at the highest publishing rate.
const CAPACITY: usize = 1 << 14;
/// Time limit for the consumer to reach the hub in this process.
const CONNECT_PATIENCE: Duration = Duration::from_secs(20);

/// A hub on a free port of this machine, for one test. [`Network::end`] ends it and its agents in order; dropping it
/// ends them too.
#[must_use = "it ends when it is dropped"]
pub struct Network {
    id: NetworkId,
    locator: String,
    started_at: Timestamp,
    consumer: Consumer,
    hub: JoinHandle<Result<HubStatus, HubError>>,
    hub_ended: CancellationToken,
    /// The tasks of all agents.
    tasks: TaskGroup,
    // Dropping these handles ends the agents and the hub.
    agents: DropGuard,
    shutdown: DropGuard,
}

impl Network {
    /// Starts a hub with default settings.
    pub async fn start() -> Result<Self, KitError> {
        Self::start_with("").await
    }

    /// Starts a hub with settings in TOML, as in the `[hub]` table of a scenario, such as `delta_max_ms = 1000`.
    pub async fn start_with(hub_toml: &str) -> Result<Self, KitError> {
        runtime::check()?;
        let table: toml::Table = hub_toml
            .parse()
            .map_err(|error: toml::de::Error| KitError::Toml(error.to_string().trim().replace('\n', " ")))?;
        let settings = HubSettings::from_table(table)?;
        let id = unique_id();
        let listen = vec!["tcp/127.0.0.1:0".to_owned()];
        let session = SessionOptions { listen, ..SessionOptions::default() };
        let setup = HubSetup { network: id, settings, session, record: None, monitor: None, began_again: 0 };
        let shutdown = CancellationToken::new();
        // From here on, dropping `self` ends the hub, also after an error.
        let guard = shutdown.clone().drop_guard();
        let hub_ended = CancellationToken::new();
        let (ready_sender, ready) = oneshot::channel();
        let hub = tokio::spawn(run_hub(setup, shutdown.clone(), ready_sender, hub_ended.clone()));
        let Ok(locator) = ready.await else { return Err(hub_failure(hub).await) };
        let consumer = connect(&locator, id).await?;
        let agents = CancellationToken::new().drop_guard();
        let (started_at, tasks) = (clock::now(), TaskGroup::new());
        Ok(Self { id, locator, started_at, consumer, hub, hub_ended, tasks, agents, shutdown: guard })
    }

    /// Name of the network, for keys such as `v2x/{network}/hub/hub/fused`. It is unique.
    pub const fn id(&self) -> NetworkId {
        self.id
    }

    /// Endpoint of the hub, such as `tcp/127.0.0.1:40123`, for your own clients in any language.
    pub fn locator(&self) -> &str {
        &self.locator
    }

    /// Time zero of scripts.
    pub const fn started_at(&self) -> Timestamp {
        self.started_at
    }

    /// A new agent over a link without delay; [`NewAgent::join`] connects it.
    pub fn agent(&self, name: &str) -> NewAgent {
        let connect = vec![self.locator.clone()];
        let session = SessionOptions { connect, ..SessionOptions::default() };
        let access = Access {
            network: self.id,
            session,
            started_at: self.started_at,
            ended: self.agents.token().child_token(),
            token: self.tasks.token(),
        };
        NewAgent::new(name, access)
    }

    /// The first fused frame that fulfils a condition. It consumes the frames up to this one. For one reader: two
    /// concurrent calls share the frames.
    pub async fn await_fused(
        &self,
        mut is_so: impl FnMut(&FusedFrame) -> bool,
        patience: Duration,
    ) -> Result<FusedFrame, KitError> {
        let mut seen = Seen::default();
        let awaited = async {
            loop {
                let frame = self.next_fused().await?;
                if is_so(&frame) {
                    return Ok(frame);
                }
                seen.frames += 1;
                seen.last = Some(frame);
            }
        };
        let outcome = self.within(patience, awaited).await;
        self.or_seen(outcome, patience, seen).await
    }

    /// The first status of the hub that fulfils a condition. It is queried after each fused frame.
    pub async fn await_status(
        &self,
        mut is_so: impl FnMut(&HubStatus) -> bool,
        patience: Duration,
    ) -> Result<HubStatus, KitError> {
        let mut seen = Seen::default();
        let awaited = async {
            loop {
                let status = self.status().await?;
                if is_so(&status) {
                    return Ok(status);
                }
                seen.last = Some(self.next_fused().await?);
                seen.frames += 1;
            }
        };
        let outcome = self.within(patience, awaited).await;
        self.or_seen(outcome, patience, seen).await
    }

    /// The status of the hub: accepted frames and, by reason, refused frames of each agent.
    pub async fn status(&self) -> Result<HubStatus, KitError> {
        let statuses = hub_status::query(self.consumer.session(), self.id)
            .await
            .map_err(|error| KitError::Zenoh(error.into()))?;
        statuses.into_iter().next().ok_or_else(|| KitError::Zenoh(anyhow!("the hub did not answer")))
    }

    /// Ends the agents, the hub and the consumer. Returns the last status of the hub.
    pub async fn end(self) -> Result<HubStatus, KitError> {
        let Self { consumer, hub, tasks, agents, shutdown, .. } = self;
        drop(agents);
        tasks.gone().await;
        drop(shutdown);
        consumer.close().await.map_err(|error| KitError::Zenoh(error.into()))?;
        match hub.await {
            Ok(status) => status.map_err(|error| KitError::Hub(error.into())),
            Err(panic) => Err(KitError::Hub(panic.into())),
        }
    }

    async fn next_fused(&self) -> Result<FusedFrame, KitError> {
        let entry = self.consumer.next().await;
        wire::fused::decode(&entry.payload)
            .map_err(|error| KitError::Zenoh(anyhow!("a fused frame that cannot be read: {error}")))
    }

    /// `None` after the time limit.
    async fn within<T>(
        &self,
        patience: Duration,
        awaited: impl Future<Output = Result<T, KitError>>,
    ) -> Option<Result<T, KitError>> {
        tokio::select! {
            biased;
            outcome = tokio::time::timeout(patience, awaited) => outcome.ok(),
            () = self.hub_ended.cancelled() => Some(Err(KitError::HubEnded)),
        }
    }

    async fn or_seen<T>(
        &self,
        outcome: Option<Result<T, KitError>>,
        patience: Duration,
        seen: Seen,
    ) -> Result<T, KitError> {
        match outcome {
            Some(outcome) => outcome,
            None => {
                let seen = Box::new(Seen { status: self.status().await.ok(), ..seen });
                Err(KitError::TimedOut { patience, seen })
            }
        }
    }
}

async fn run_hub(
    setup: HubSetup,
    shutdown: CancellationToken,
    ready_sender: oneshot::Sender<String>,
    ended: CancellationToken,
) -> Result<HubStatus, HubError> {
    let _ended = ended.drop_guard();
    let on_ready = |_, locators: &[String]| {
        // The receiver is gone if the test was cancelled.
        let _ = locators.first().map(|locator| ready_sender.send(locator.clone()));
    };
    Box::pin(serve(setup, shutdown, Engine::new, on_ready)).await
}

/// Why a hub has failed before it was ready.
async fn hub_failure(hub: JoinHandle<Result<HubStatus, HubError>>) -> KitError {
    match hub.await {
        Ok(Ok(_)) => KitError::Hub(anyhow!("it listens nowhere")),
        Ok(Err(error)) => KitError::Hub(error.into()),
        Err(panic) => KitError::Hub(panic.into()),
    }
}

async fn connect(locator: &str, network: NetworkId) -> Result<Consumer, KitError> {
    let options = SessionOptions { connect: vec![locator.to_owned()], ..SessionOptions::default() };
    let subscription = Subscription { network, traffic: Traffic::Fused, hub: None, capacity: CAPACITY };
    let never = CancellationToken::new();
    let consumer = Consumer::connect(&options, subscription, CONNECT_PATIENCE, &never).await;
    consumer
        .map_err(|error| KitError::Zenoh(error.into()))?
        .ok_or_else(|| KitError::Zenoh(anyhow!("no shutdown was requested")))
}

/// A name that is unique on this machine.
fn unique_id() -> NetworkId {
    static NUMBER: AtomicU32 = AtomicU32::new(0);
    let number = NUMBER.fetch_add(1, Ordering::Relaxed);
    NetworkId::new(&format!("kit-{}-{number}", std::process::id())).expect("short, and of legal characters")
}
