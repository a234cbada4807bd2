//! Who is there: the liveliness tokens of hubs and agents.

use std::collections::BTreeSet;
use std::sync::Arc;
use v2x_common::id::NetworkId;
use v2x_common::keys::Keys;
use v2x_common::net::queue::DropOldestQueue;
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::sample::SampleKind;

/// Changes that may wait.
const CAPACITY: usize = 4096;
/// Names that are kept: the page lists no more.
const MAX_NAMES: usize = 1024;

/// A subscription to liveliness tokens, and the names that hold one.
pub(super) struct Tokens {
    changes: Arc<DropOldestQueue<Change>>,
    names: [BTreeSet<String>; 2],
    // Dropping these undeclares them.
    _subscribers: [Subscriber<()>; 2],
}

struct Change {
    is_hub: bool,
    name: String,
    is_alive: bool,
}

impl Tokens {
    /// Subscribes, and is told of those that are there already.
    pub(super) async fn subscribe(session: &Session, network: NetworkId) -> zenoh::Result<Self> {
        let keys = Keys::new(network);
        let changes = Arc::new(DropOldestQueue::new(CAPACITY));
        let declare = |expression: String, is_hub: bool| {
            let queue = changes.clone();
            let declared = session.liveliness().declare_subscriber(expression).history(true);
            declared.callback(move |sample| {
                let is_alive = sample.kind() == SampleKind::Put;
                if let Some(name) = sample.key_expr().as_str().split('/').nth_back(1) {
                    queue.push(Change { is_hub, name: name.to_owned(), is_alive });
                }
            })
        };
        let agents = declare(keys.all_agents_alive(), false);
        let hubs = declare(keys.all_hubs_alive(), true);
        let _subscribers = [agents.await?, hubs.await?];
        Ok(Self { changes, names: Default::default(), _subscribers })
    }

    /// Waits for a change. Cancel-safe.
    pub(super) async fn changed(&mut self) {
        let mut change = Some(self.changes.pop().await);
        while let Some(Change { is_hub, name, is_alive }) = change {
            let names = &mut self.names[usize::from(is_hub)];
            if !is_alive {
                names.remove(&name);
            } else if names.len() < MAX_NAMES {
                names.insert(name);
            }
            change = self.changes.try_pop();
        }
    }

    /// The names of the agents, and of the hubs, sorted.
    pub(super) fn names(&self) -> [Vec<String>; 2] {
        self.names.each_ref().map(|names| names.iter().cloned().collect())
    }
}
