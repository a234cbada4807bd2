//! The hub's declarations on the network.

use super::beats::Beats;
use super::control_queue::{Asked, Control, ControlQueue};
use super::encoding::encode_list;
use super::fair_queue::{FairQueue, QueueLimits};
use super::intake::Received;
use super::on_demand::{OnDemand, Parts, declare_publisher};
use super::strays::Strays;
use super::token_changes::{Token, TokenSet};
use super::twin::{self, Twin};
use super::unnamed::Unnamed;
use anyhow::anyhow;
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use v2x_common::fused::FusedFrame;
use v2x_common::id::HubId;
use v2x_common::keys::{self, Keys};
use v2x_common::net::{liveliness, zenoh_peers};
use v2x_common::wire::{self, ENCODING_JSON, ENCODING_POSTCARD, stray};
use zenoh::Session;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::query::Queryable;
use zenoh::sample::{Sample, SampleKind};

/// How long all tokens have for their answer.
const TOKENS_WITHIN: Duration = Duration::from_millis(200);

/// What the declarations are for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Declared {
    pub(super) hub: HubId,
    /// Whether there is a second list.
    pub(super) has_lagged: bool,
    /// The lineage of a hub that stands by while another one of its name publishes, and the number of its settings.
    pub(super) standby: Option<(u32, u64)>,
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

    /// Puts a frame, which is in the buffer then; what was put of it.
    pub(super) async fn put_frame<'a>(
        &self,
        frame: &'a FusedFrame,
        buffer: &mut Vec<u8>,
    ) -> anyhow::Result<Cow<'a, FusedFrame>> {
        let encoded = encode_list(frame, buffer)?;
        self.postcard.put(&buffer[..]).await.map_err(|error| anyhow!("{error}"))?;
        Ok(encoded)
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
    pub(super) control: Arc<ControlQueue>,
    /// Fused frames.
    pub(super) fused: List,
    /// The second list, which is a lag behind.
    pub(super) lagged: Option<List>,
    /// The lists that cost less.
    pub(super) parts: Parts,
    /// Samples under keys without a valid agent's name.
    pub(super) unnamed: Arc<Unnamed>,
    /// Samples beside the keys that are read.
    pub(super) strays: Arc<Strays>,
    /// Another hub of this name.
    pub(super) twin: Arc<Twin>,
    /// Of a hub that stands by while another one publishes: what says that it does not.
    pub(super) beats: Option<Beats>,
    // Dropping these undeclares them.
    _subscribers: Vec<Subscriber<()>>,
    _queryables: Vec<Queryable<()>>,
    session: Session,
    declared: Declared,
    /// While this hub is the one that publishes.
    alive: Option<LivelinessToken>,
}

/// What the subscribers fill.
struct Queues {
    frames: Arc<FairQueue<Received>>,
    control: Arc<ControlQueue>,
    unnamed: Arc<Unnamed>,
}

impl Network {
    pub(super) async fn declare(session: &Session, keys: &Keys, declared: Declared) -> zenoh::Result<Self> {
        let queues = Queues {
            frames: Arc::new(FairQueue::new(QueueLimits::DEFAULT)),
            control: Arc::new(ControlQueue::new()),
            unnamed: Arc::new(Unnamed::default()),
        };
        zenoh_peers::follow(session).await?;
        let mut network = Self::declare_with(session, keys, declared, queues).await?;
        if declared.standby.is_none() {
            network.announce(keys).await?;
        }
        Ok(network)
    }

    /// The same declarations in another session: what waits, and what was counted, stays.
    pub(super) async fn rejoin(&mut self, session: &Session, keys: &Keys) -> zenoh::Result<()> {
        let queues = Queues {
            frames: self.frames.clone(),
            control: self.control.clone(),
            unnamed: self.unnamed.clone(),
        };
        // Zenoh does not report tokens that went meanwhile.
        self.control.doubt_tokens();
        let is_alive = self.alive.is_some();
        zenoh_peers::follow(session).await?;
        *self = Self::declare_with(session, keys, self.declared, queues).await?;
        if is_alive {
            self.announce(keys).await?;
        }
        Ok(())
    }

    /// All tokens of agents that there are. What changes meanwhile is in the queue.
    pub(super) fn tokens(
        &self,
        keys: &Keys,
    ) -> impl Future<Output = anyhow::Result<BTreeSet<Token>>> + Send + use<> {
        let (session, kinds) = (self.session.clone(), [keys.any_agents_alive(), keys.all_agents_idle()]);
        async move {
            let tokens = Arc::new(Mutex::new(TokenSet::default()));
            for all in kinds {
                let into = tokens.clone();
                let take = move |key: &str| {
                    let mut tokens = into.lock().unwrap_or_else(PoisonError::into_inner);
                    token_of(key).into_iter().for_each(|token| tokens.insert(token));
                };
                liveliness::each_token(&session, &all, TOKENS_WITHIN, take).await?;
            }
            let tokens = std::mem::take(&mut *tokens.lock().unwrap_or_else(PoisonError::into_inner));
            Ok(tokens.into_inner())
        }
    }

    /// Says that this hub is the one that publishes under its name.
    pub(super) async fn announce(&mut self, keys: &Keys) -> zenoh::Result<()> {
        let key = keys.hub_alive(&self.declared.hub);
        self.alive = Some(self.session.liveliness().declare_token(key).await?);
        Ok(())
    }

    /// Takes that back.
    pub(super) async fn withdraw(&mut self) -> zenoh::Result<()> {
        match self.alive.take() {
            Some(token) => token.undeclare().await,
            None => Ok(()),
        }
    }

    async fn declare_with(
        session: &Session,
        keys: &Keys,
        declared: Declared,
        Queues { frames, control, unnamed }: Queues,
    ) -> zenoh::Result<Self> {
        let Declared { hub, has_lagged, standby } = declared;
        let hub = &hub;
        let fused = List::declare(session, keys.fused(hub), keys.fused_json(hub)).await?;
        let lagged = match has_lagged {
            true => Some(List::declare(session, keys.lagged(hub), keys.lagged_json(hub)).await?),
            false => None,
        };
        // The callbacks run on Zenoh's threads: they only stamp and enqueue.
        let named = {
            let unnamed = unnamed.clone();
            move |sample: &Sample| {
                Received::stamp(sample).inspect_err(|invalid| unnamed.note(invalid, false)).ok()
            }
        };
        let (queue, stamp) = (frames.clone(), named.clone());
        let detections = session.declare_subscriber(keys.any_detections()).callback(move |sample| {
            if let Some(received) = stamp(&sample) {
                queue.push((received.agent, received.received_at), received.bytes(), received);
            }
        });
        let (queue, stamp) = (control.clone(), named);
        let sensors = session.declare_subscriber(keys.any_sensors()).callback(move |sample| {
            if let Some(received) = stamp(&sample) {
                queue.push(Control::Description(received));
            }
        });
        let roster = follow_roster(session, keys, (control.clone(), unnamed.clone())).await?;
        let idle = follow_idle(session, keys, control.clone()).await?;
        let queryables = answering(session, keys, declared, &control).await?;
        let twin = Arc::new(Twin::default());
        let lists_of_others = twin::listen(session, keys, hub, (twin.clone(), standby.is_some())).await?;
        let mut subscribers = vec![detections.await?, sensors.await?, roster, idle, lists_of_others];
        let strays = Arc::new(Strays::default());
        for key in keys.beside_agents() {
            let strays = strays.clone();
            let beside = session.declare_subscriber(key);
            let note = move |sample: Sample| {
                let key = sample.key_expr().as_str();
                strays.note(key, || stray::sender(key, &sample.payload().to_bytes()));
            };
            subscribers.push(beside.callback(note).await?);
        }
        let mut beats = None;
        if let Some(own) = standby {
            subscribers.push(twin::listen_to_beats(session, keys, hub, twin.clone()).await?);
            beats = Some(Beats::declare(session, keys.beat(hub), own).await?);
        }
        Ok(Self {
            frames,
            control,
            fused,
            lagged,
            parts: Parts::declare(session, *keys, *hub).await?,
            unnamed,
            strays,
            twin,
            beats,
            _subscribers: subscribers,
            _queryables: queryables,
            session: session.clone(),
            declared,
            alive: None,
        })
    }
}

/// Queues what the hub is asked.
async fn answering(
    session: &Session,
    keys: &Keys,
    Declared { hub, standby, .. }: Declared,
    control: &Arc<ControlQueue>,
) -> zenoh::Result<Vec<Queryable<()>>> {
    let standby_status = standby.map(|(lineage, _)| (keys.standby_status(&hub, lineage), Asked::Standby));
    let statuses = [Some((keys.status(&hub), Asked::Hub)), standby_status];
    let mut queryables = Vec::new();
    for (key, asked) in statuses.into_iter().flatten() {
        let queue = control.clone();
        let status = session.declare_queryable(key);
        let status = status.callback(move |query| queue.push(Control::StatusQuery(query, asked)));
        queryables.push(status.await?);
    }
    let queue = control.clone();
    let journal = session
        .declare_queryable(keys.journal(&hub))
        .callback(move |query| queue.push(Control::JournalQuery(query)));
    queryables.push(journal.await?);
    Ok(queryables)
}

/// The token of a key; `None` where the agent's name is not valid.
fn token_of(key: &str) -> Option<Token> {
    match keys::idle_of(key) {
        Some((agent, rides_on)) => Some(Token::idle(agent, rides_on)),
        None => keys::agent_of(key).ok().map(Token::alive),
    }
}

/// Queues who is alive, and who no longer is; notes names that are not valid.
async fn follow_roster(
    session: &Session,
    keys: &Keys,
    (queue, nameless): (Arc<ControlQueue>, Arc<Unnamed>),
) -> zenoh::Result<Subscriber<()>> {
    let roster = session.liveliness().declare_subscriber(keys.any_agents_alive()).history(true);
    let roster = roster.callback(move |sample| {
        let is_alive = sample.kind() == SampleKind::Put;
        // What an agent rides on may be called `alive`, too.
        if keys::idle_of(sample.key_expr().as_str()).is_some() {
            return;
        }
        match keys::agent_of(sample.key_expr().as_str()) {
            Ok(agent) => queue.push_token(Token::alive(agent), is_alive),
            Err(invalid) if is_alive => nameless.note(&invalid, true),
            Err(_) => {}
        }
    });
    roster.await
}

/// Queues who becomes idle, and who no longer is.
async fn follow_idle(
    session: &Session,
    keys: &Keys,
    queue: Arc<ControlQueue>,
) -> zenoh::Result<Subscriber<()>> {
    let idle = session.liveliness().declare_subscriber(keys.all_agents_idle()).history(true);
    let idle = idle.callback(move |sample| {
        if let Some((agent, rides_on)) = keys::idle_of(sample.key_expr().as_str()) {
            queue.push_token(Token::idle(agent, rides_on), sample.kind() == SampleKind::Put);
        }
    });
    idle.await
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::id::{AgentId, NetworkId};
    use v2x_common::net::session::{self, SessionOptions};

    /// Reads until the tokens are these: a client gets no notice when the hub has its token.
    async fn until(network: &Network, keys: &Keys, expected: &BTreeSet<Token>) {
        let read = async { while network.tokens(keys).await.ok().as_ref() != Some(expected) {} };
        tokio::time::timeout(Duration::from_secs(60), read).await.expect("the tokens are read");
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn after_a_flood_all_tokens_that_there_are_can_be_read_again() {
        let listen = vec!["tcp/127.0.0.1:0".to_owned()];
        let options = SessionOptions { listen, ..SessionOptions::default() };
        let session = session::open(session::hub_config(&options).unwrap()).await.unwrap();
        let (keys, ego) = (Keys::new(NetworkId::new("tokens").unwrap()), AgentId::new("ego").unwrap());
        let declared = Declared { hub: HubId::new("hub").unwrap(), has_lagged: false, standby: None };
        let network = Network::declare(&session, &keys, declared).await.unwrap();

        let connect = session::locators(&session).await;
        let options = SessionOptions { connect, ..SessionOptions::default() };
        let client = session::open(session::client_config(&options).unwrap()).await.unwrap();
        let token = |key| client.liveliness().declare_token(key);
        let alive = token(keys.agent_alive(&ego)).await.unwrap();
        let _idle = token(keys.agent_idle(&ego, "veh 1")).await.unwrap();
        let of_idle = Token::idle(ego, "veh 1".to_owned());
        until(&network, &keys, &[Token::alive(ego), of_idle.clone()].into()).await;
        alive.undeclare().await.unwrap();
        until(&network, &keys, &[of_idle].into()).await;
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_flood_of_more_tokens_than_a_channel_holds_is_read_again_and_holds_up_no_hub() {
        const FLOOD: usize = 600;
        let listen = vec!["tcp/127.0.0.1:0".to_owned()];
        let options = SessionOptions { listen, ..SessionOptions::default() };
        let session = session::open(session::hub_config(&options).unwrap()).await.unwrap();
        let keys = Keys::new(NetworkId::new("many-tokens").unwrap());
        let declared = Declared { hub: HubId::new("hub").unwrap(), has_lagged: false, standby: None };
        let network = Network::declare(&session, &keys, declared).await.unwrap();

        let connect = session::locators(&session).await;
        let options = SessionOptions { connect, ..SessionOptions::default() };
        let client = session::open(session::client_config(&options).unwrap()).await.unwrap();
        let agent = |k: usize| AgentId::new(&format!("a{k}")).unwrap();
        let mut flood = Vec::new();
        for k in 0..FLOOD {
            flood.push(client.liveliness().declare_token(keys.agent_alive(&agent(k))).await.unwrap());
            flood.push(
                client.liveliness().declare_token(keys.agent_idle(&agent(0), &format!("{k}"))).await.unwrap(),
            );
        }
        // Of one agent's idle tokens a few are enough.
        let is_all = |tokens: &BTreeSet<Token>| {
            let alive = tokens.iter().filter(|token| token.rides_on.is_none()).count();
            alive == FLOOD && (1..=8).contains(&(tokens.len() - alive))
        };
        let read = async { while !network.tokens(&keys).await.is_ok_and(|tokens| is_all(&tokens)) {} };
        tokio::time::timeout(Duration::from_secs(60), read).await.expect("the tokens are read");
    }
}
