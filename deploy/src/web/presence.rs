//! Who is there: the liveliness tokens of hubs and agents.

use std::collections::BTreeSet;
use std::sync::Arc;
use v2x_common::id::{AgentId, HubId, NetworkId};
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
    /// Subscribes, and receives those that are there already; only those of one hub where one is given.
    pub(super) async fn subscribe(
        session: &Session,
        network: NetworkId,
        hub: Option<HubId>,
    ) -> zenoh::Result<Self> {
        let keys = Keys::new(network);
        let changes = Arc::new(DropOldestQueue::new(CAPACITY));
        let declare = |expression: String, is_hub: bool| {
            let queue = changes.clone();
            let declared = session.liveliness().declare_subscriber(expression).history(true);
            declared.callback(move |sample| {
                if let Some(change) = change(sample.key_expr(), is_hub, sample.kind() == SampleKind::Put) {
                    queue.push(change);
                }
            })
        };
        let agents = declare(keys.all_agents_alive(), false);
        let hubs = declare(hub.map_or_else(|| keys.all_hubs_alive(), |hub| keys.hub_alive(&hub)), true);
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

/// What a token says; nothing where the name in its key is not valid. The hub's status lists such names with the reason.
fn change(key: &str, is_hub: bool, is_alive: bool) -> Option<Change> {
    let name = key.split('/').nth_back(1)?;
    let is_valid = if is_hub { HubId::new(name).is_ok() } else { AgentId::new(name).is_ok() };
    is_valid.then(|| Change { is_hub, name: name.to_owned(), is_alive })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_valid_names_are_listed() {
        for is_hub in [false, true] {
            let named = |key| change(key, is_hub, true).map(|change| change.name);
            assert_eq!(named("v2x/demo/agent/ego/alive"), Some("ego".to_owned()));
            assert_eq!(named("v2x/demo/agent/<img src=x>/alive"), None);
            assert_eq!(named("v2x/demo/agent/a-name-of-more-than-thirty-two-bytes/alive"), None);
            assert_eq!(named("alive"), None);
        }
    }
}
