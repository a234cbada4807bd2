//! A consumer of a network: its subscriptions and its samples, stamped on arrival.

use crate::loopback::connection_error::ConnectionError;
use std::sync::Arc;
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::clock;
use v2x_common::id::{HubId, NetworkId};
use v2x_common::keys::{Keys, Topic};
use v2x_common::net::queue::DropOldestQueue;
use v2x_common::net::session::{self, SessionOptions};
use v2x_common::recording::Entry;
use v2x_common::tile::Tile;
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::sample::Sample;

/// The messages that a consumer subscribes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Traffic {
    /// Fused frames.
    Fused,
    /// Fused frames of the second list, which is a lag behind.
    Lagged,
    /// Key frames, and what changes between them.
    Delta,
    /// The fused frames of the tiles of an area.
    Area(Tile),
    /// All messages that the scoring of a run needs: also detections, sensor descriptions and ground truth.
    Everything,
    /// The same, the second lists, and the journals of hubs that were asked for one ([`Consumer::ask_for_journal`]).
    Recording,
}

/// The subscription of a consumer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Subscription {
    /// Name of the network.
    pub network: NetworkId,
    /// The messages.
    pub traffic: Traffic,
    /// The one hub whose messages these are; `None`: those of all hubs.
    pub hub: Option<HubId>,
    /// Capacity of the queue of samples. A full queue drops the oldest sample and counts it.
    pub capacity: usize,
}

/// A connected consumer.
pub struct Consumer {
    session: Session,
    keys: Keys,
    queue: Arc<DropOldestQueue<Entry>>,
    // Dropping these undeclares them.
    subscribers: Vec<Subscriber<()>>,
}

impl Consumer {
    /// Connects and subscribes; waits up to `patience` for a hub. `None` after a shutdown.
    pub async fn connect(
        options: &SessionOptions,
        subscription: Subscription,
        patience: Duration,
        shutdown: &CancellationToken,
    ) -> Result<Option<Self>, ConnectionError> {
        let Subscription { network, traffic, hub, capacity } = subscription;
        let config = session::client_config(options).map_err(ConnectionError::Session)?;
        let opened = session::open_patiently(config, Some(patience), shutdown).await;
        let Some(session) = opened.map_err(ConnectionError::Session)? else {
            return Ok(None);
        };
        let keys = Keys::new(network);
        let queue = Arc::new(DropOldestQueue::new(capacity));
        let expressions = match traffic {
            Traffic::Fused => vec![keys.all_fused()],
            Traffic::Lagged => vec![keys.all_lagged()],
            Traffic::Delta => vec![keys.all_deltas()],
            Traffic::Area(tile) => vec![keys.area(tile)],
            Traffic::Everything => everything(&keys),
            Traffic::Recording => {
                let mut expressions = everything(&keys);
                expressions.extend([keys.all_lagged(), keys.all_journals()]);
                expressions
            }
        };
        let mut subscribers = Vec::new();
        for expression in expressions {
            let (expression, only) = of_hub(expression, hub);
            let queue = queue.clone();
            let subscriber = session
                .declare_subscriber(expression.as_str())
                .callback(move |sample| {
                    if is_of(only, sample.key_expr()) {
                        queue.push(stamped(&sample));
                    }
                })
                .await
                .map_err(|source| ConnectionError::Subscription { expression: expression.clone(), source })?;
            subscribers.push(subscriber);
        }
        Ok(Some(Self { session, keys, queue, subscribers }))
    }

    /// The next sample. Cancel-safe.
    pub async fn next(&self) -> Entry {
        self.queue.pop().await
    }

    /// Waits until there is a sample and leaves it in the queue.
    pub async fn wait(&self) {
        self.queue.wait().await;
    }

    /// The next sample, if there is one.
    pub fn try_next(&self) -> Option<Entry> {
        self.queue.try_pop()
    }

    /// Number of samples that a full queue dropped.
    pub fn dropped(&self) -> u64 {
        self.queue.dropped()
    }

    /// Asks a hub to start its journal, which comes as samples while this consumer is there.
    pub async fn ask_for_journal(&self, hub: &HubId) -> Result<(), ConnectionError> {
        let key = self.keys.journal(hub);
        // The answer says nothing that the journal does not.
        self.session.get(key).callback(drop).await.map_err(ConnectionError::Query)
    }

    /// The session, for queries.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Leaves the network.
    pub async fn close(self) -> Result<(), ConnectionError> {
        drop(self.subscribers);
        session::close(self.session).await.map_err(ConnectionError::Session)
    }
}

fn everything(keys: &Keys) -> Vec<String> {
    vec![keys.all_fused(), keys.all_detections(), keys.all_sensors(), keys.all_truth()]
}

/// The expression for one hub alone, and that hub, where it is one of what hubs say.
fn of_hub(expression: String, hub: Option<HubId>) -> (String, Option<HubId>) {
    const ALL: &str = "/hub/*/";
    match hub.filter(|_| expression.contains(ALL)) {
        Some(hub) => (expression.replacen(ALL, &format!("/hub/{hub}/"), 1), Some(hub)),
        None => (expression, None),
    }
}

/// Whether what comes under a key is of the one hub. A put on a key with wildcards reaches subscribers of all hubs.
fn is_of(only: Option<HubId>, key: &str) -> bool {
    only.is_none_or(|hub| Topic::of(key).and_then(|topic| topic.hub()) == Some(hub))
}

fn stamped(sample: &Sample) -> Entry {
    Entry {
        received_at: clock::now(),
        key: sample.key_expr().to_string(),
        encoding: sample.encoding().to_string(),
        payload: sample.payload().to_bytes().into_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_consumer_of_one_hub_takes_nothing_that_another_hub_or_a_wildcard_says() {
        let keys = Keys::new(NetworkId::new("demo").unwrap());
        let [north, south] = ["north", "south"].map(|name| HubId::new(name).unwrap());
        let (expression, only) = of_hub(keys.all_fused(), Some(north));
        assert_eq!((expression, only), (keys.fused(&north), Some(north)));
        assert!(is_of(only, &keys.fused(&north)) && is_of(only, &keys.delta(&north)));
        for other in [keys.fused(&south), keys.all_fused(), "v2x/demo/hub/**".to_owned()] {
            assert!(!is_of(only, &other), "{other}");
        }
        let (expression, only) = of_hub(keys.all_detections(), Some(north));
        assert_eq!((expression, only), (keys.all_detections(), None));
        assert!(is_of(None, &keys.fused(&south)));
    }
}
