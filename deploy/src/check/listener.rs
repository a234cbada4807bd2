//! What is heard: everything for a while, and the frames of the network as a hub would take them in.

use super::strays::Strays;
use anyhow::anyhow;
use std::pin::pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::clock;
use v2x_common::id::{AgentId, NetworkId};
use v2x_common::keys::{self, Keys};
use v2x_common::net::liveliness;
use v2x_common::net::queue::DropOldestQueue;
use v2x_common::time::Timestamp;
use v2x_common::wire::journal::Body;
use v2x_fusion_hub::Engine;
use v2x_fusion_hub::diagnosis::Tokens;
use v2x_fusion_hub::hub::{Core, HubSettings};
use zenoh::Session;
use zenoh::sample::Sample;

/// Everything is subscribed to for this long only: hubs publish streams for such a subscriber that nobody else reads.
const EVERYTHING_FOR: Duration = Duration::from_secs(3);
/// How long all tokens have for their answer.
const TOKENS_WITHIN: Duration = Duration::from_secs(2);
/// Frames that may wait.
const WAITING: usize = 4096;
/// How often the core makes a list, and how often it judges what it has.
const LIST_EVERY: Duration = Duration::from_millis(100);
const LISTS_TO_A_DIAGNOSIS: u32 = 10;

/// A sample of an agent with its time of arrival.
struct Heard {
    agent: AgentId,
    is_frame: bool,
    received_at: Timestamp,
    sample: Sample,
}

/// What was heard.
pub(super) struct Listener {
    /// A core of its own, for where no hub says what it found.
    pub(super) core: Core,
    pub(super) strays: Arc<Mutex<Strays>>,
    /// Frames of the network.
    pub(super) frames: u64,
    pub(super) tokens: Tokens,
}

impl Listener {
    pub(super) fn new(settings: HubSettings, network: NetworkId) -> Self {
        Self {
            core: Core::new(settings, Engine::new),
            strays: Arc::new(Mutex::new(Strays::new(network))),
            frames: 0,
            tokens: Tokens::default(),
        }
    }

    /// Listens until `duration` is over or shutdown is requested.
    pub(super) async fn listen(
        &mut self,
        session: &Session,
        network: NetworkId,
        duration: Duration,
        shutdown: &CancellationToken,
    ) -> anyhow::Result<()> {
        let queue = Arc::new(DropOldestQueue::new(WAITING));
        let keys = Keys::new(network);
        let mut subscribers = Vec::new();
        for (key, is_frame) in [(keys.any_detections(), true), (keys.any_sensors(), false)] {
            let queue = queue.clone();
            let subscriber = session.declare_subscriber(key).callback(move |sample| {
                // A name that is not valid is a stray.
                if let Ok(agent) = keys::agent_of(sample.key_expr().as_str()) {
                    queue.push(Heard { agent, is_frame, received_at: clock::now(), sample });
                }
            });
            subscribers.push(subscriber.await.map_err(|error| anyhow!("{error}"))?);
        }
        let strays = self.strays.clone();
        let everything = session.declare_subscriber("**").callback(move |sample| {
            let mut strays = strays.lock().unwrap_or_else(PoisonError::into_inner);
            strays.note(sample.key_expr().as_str(), &sample.payload().to_bytes());
        });
        let mut everything = Some(everything.await.map_err(|error| anyhow!("{error}"))?);
        let (mut is_over, mut is_enough) =
            (pin!(tokio::time::sleep(duration)), pin!(tokio::time::sleep(EVERYTHING_FOR)));
        let mut tick = tokio::time::interval(LIST_EVERY);
        let mut ticks = 0_u32;
        loop {
            tokio::select! {
                biased;
                () = shutdown.cancelled() => break,
                () = &mut is_over => break,
                () = &mut is_enough, if everything.is_some() => everything = None,_ = tick.tick() => {
                    self.core.fused(clock::now());
                    ticks += 1;
                    if ticks.is_multiple_of(LISTS_TO_A_DIAGNOSIS) {
                        self.tokens = agents_tokens(session, network).await;
                        self.core.diagnose(&self.tokens, clock::now());
                    }
                }
                () = queue.wait() => {
                    while let Some(heard) = queue.try_pop() {
                        self.take(&heard);
                    }
                }
            }
        }
        self.core.conclude(&self.tokens);
        Ok(())
    }

    fn take(&mut self, heard: &Heard) {
        let payload = heard.sample.payload().to_bytes();
        let body = Body::of(&heard.sample.encoding().to_string(), &payload);
        if heard.is_frame {
            self.frames += 1;
            self.core.handle_frame(heard.agent, heard.received_at, &body);
        } else {
            // A refused one is counted.
            let _ = self.core.handle_description(heard.agent, &body);
        }
    }
}

/// The agents' liveliness tokens.
async fn agents_tokens(session: &Session, network: NetworkId) -> Tokens {
    let keys = Keys::new(network);
    let (alive, idle) =
        tokio::join!(tokens(session, keys.all_agents_alive()), tokens(session, keys.all_agents_idle()));
    Tokens {
        alive: alive.iter().filter_map(|key| keys::agent_of(key).ok()).collect(),
        idle: idle.iter().filter_map(|key| keys::idle_of(key)).collect(),
    }
}

/// Their keys, as far as they come in time.
async fn tokens(session: &Session, key: String) -> Vec<String> {
    let keys = Arc::new(Mutex::new(Vec::new()));
    let into = keys.clone();
    let take = move |key: &str| into.lock().unwrap_or_else(PoisonError::into_inner).push(key.to_owned());
    // What came before an error counts.
    let _ = liveliness::each_token(session, &key, TOKENS_WITHIN, take).await;
    std::mem::take(&mut *keys.lock().unwrap_or_else(PoisonError::into_inner))
}
