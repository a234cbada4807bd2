//! The hub's declarations on the network.

use super::fair_queue::{FairQueue, QueueLimits};
use super::intake::Received;
use super::on_demand::{OnDemand, Parts, declare_publisher};
use super::twin::{self, Twin};
use super::unnamed::Unnamed;
use anyhow::anyhow;
use std::sync::Arc;
use v2x_common::fused::FusedFrame;
use v2x_common::id::{AgentId, HubId};
use v2x_common::keys::{self, Keys};
use v2x_common::net::queue::DropOldestQueue;
use v2x_common::wire::{self, ENCODING_JSON, ENCODING_POSTCARD};
use zenoh::Session;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::query::{Query, Queryable};
use zenoh::sample::SampleKind;

/// Descriptions, liveliness changes and queries that may wait.
const CONTROL_QUEUE: usize = 4096;
/// Samples and queries that are not detection frames.
pub(super) enum Control {
    Description(Received),
    Alive(AgentId, bool),
    StatusQuery(Query),
    /// A recorder asks for a start of the journal.
    JournalQuery(Query),
}

/// The publishers of one list.
pub(super) struct List {
    postcard: Publisher<'static>,
    json: OnDemand,
}

impl List {
    async fn declare(session: &Session, key: String, json_key: String) -> zenoh::Result<Self> {
        let postcard = declare_publisher(session, key, ENCODING_POSTCARD).await?;
        let json = OnDemand::declare(session, json_key, ENCODING_JSON).await?;
        Ok(Self { postcard, json })
    }

    /// Puts the bytes of a frame.
    pub(super) async fn put(&self, bytes: &[u8]) -> anyhow::Result<()> {
        self.postcard.put(bytes).await.map_err(|error| anyhow!("{error}"))
    }

    /// Puts a frame as JSON, where that is wanted.
    pub(super) async fn put_json(&self, frame: &FusedFrame) -> anyhow::Result<()> {
        if self.json.is_wanted() {
            self.json.put(wire::json::encode_fused(frame)?).await?;
        }
        Ok(())
    }
}

/// A hub's declarations: publishers, and two queues that subscribers fill.
pub(super) struct Network {
    /// Detection frames.
    pub(super) frames: Arc<FairQueue<Received>>,
    /// Everything else.
    pub(super) control: Arc<DropOldestQueue<Control>>,
    /// Fused frames.
    pub(super) fused: List,
    /// The second list, which is a lag behind.
    pub(super) lagged: Option<List>,
    /// The lists that cost less.
    pub(super) parts: Parts,
    /// Samples under keys without a valid agent's name.
    pub(super) unnamed: Arc<Unnamed>,
    /// Another hub of this name.
    pub(super) twin: Arc<Twin>,
    // Dropping these undeclares them.
    _subscribers: [Subscriber<()>; 4],
    _queryables: [Queryable<()>; 2],
    _alive: LivelinessToken,
}

/// What the subscribers fill.
struct Queues {
    frames: Arc<FairQueue<Received>>,
    control: Arc<DropOldestQueue<Control>>,
    unnamed: Arc<Unnamed>,
}

impl Network {
    pub(super) async fn declare(
        session: &Session,
        keys: &Keys,
        hub: &HubId,
        has_lagged: bool,
    ) -> zenoh::Result<Self> {
        let queues = Queues {
            frames: Arc::new(FairQueue::new(QueueLimits::DEFAULT)),
            control: Arc::new(DropOldestQueue::new(CONTROL_QUEUE)),
            unnamed: Arc::new(Unnamed::default()),
        };
        Self::declare_with(session, keys, hub, (has_lagged, queues)).await
    }

    /// The same declarations in another session: what waits, and what was counted, stays.
    pub(super) async fn rejoin(&mut self, session: &Session, keys: &Keys, hub: &HubId) -> zenoh::Result<()> {
        let queues = Queues {
            frames: self.frames.clone(),
            control: self.control.clone(),
            unnamed: self.unnamed.clone(),
        };
        *self = Self::declare_with(session, keys, hub, (self.lagged.is_some(), queues)).await?;
        Ok(())
    }

    async fn declare_with(
        session: &Session,
        keys: &Keys,
        hub: &HubId,
        (has_lagged, Queues { frames, control, unnamed }): (bool, Queues),
    ) -> zenoh::Result<Self> {
        let fused = List::declare(session, keys.fused(hub), keys.fused_json(hub)).await?;
        let lagged = match has_lagged {
            true => Some(List::declare(session, keys.lagged(hub), keys.lagged_json(hub)).await?),
            false => None,
        };
        // The callbacks run on Zenoh's threads: they only stamp and enqueue.
        let named = {
            let unnamed = unnamed.clone();
            move |sample| Received::stamp(sample).inspect_err(|invalid| unnamed.note(invalid, false)).ok()
        };
        let (queue, stamp) = (frames.clone(), named.clone());
        let detections = session.declare_subscriber(keys.any_detections()).callback(move |sample| {
            if let Some(received) = stamp(sample) {
                queue.push((received.agent, received.received_at), received.bytes(), received);
            }
        });
        let (queue, stamp) = (control.clone(), named);
        let sensors = session.declare_subscriber(keys.any_sensors()).callback(move |sample| {
            if let Some(received) = stamp(sample) {
                queue.push(Control::Description(received));
            }
        });
        let (queue, nameless) = (control.clone(), unnamed.clone());
        let roster = session.liveliness().declare_subscriber(keys.any_agents_alive()).history(true);
        let roster = roster.callback(move |sample| {
            let is_alive = sample.kind() == SampleKind::Put;
            match keys::agent_of(sample.key_expr().as_str()) {
                Ok(agent) => queue.push(Control::Alive(agent, is_alive)),
                Err(invalid) if is_alive => nameless.note(&invalid, true),
                Err(_) => {}
            }
        });
        let queue = control.clone();
        let status = session
            .declare_queryable(keys.status(hub))
            .callback(move |query| queue.push(Control::StatusQuery(query)));
        let queue = control.clone();
        let journal = session
            .declare_queryable(keys.journal(hub))
            .callback(move |query| queue.push(Control::JournalQuery(query)));
        let twin = Arc::new(Twin::default());
        let lists_of_others = twin::listen(session, keys, hub, twin.clone()).await?;
        Ok(Self {
            frames,
            control,
            fused,
            lagged,
            parts: Parts::declare(session, *keys, *hub).await?,
            unnamed,
            twin,
            _subscribers: [detections.await?, sensors.await?, roster.await?, lists_of_others],
            _queryables: [status.await?, journal.await?],
            _alive: session.liveliness().declare_token(keys.hub_alive(hub)).await?,
        })
    }
}
