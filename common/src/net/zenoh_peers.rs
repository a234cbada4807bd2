//! Who is connected to a hub by Zenoh, by the name in the certificate and the address.

use super::zenoh_refusals::printable;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::sync::{Mutex, MutexGuard, PoisonError};
use zenoh::Session;
use zenoh::sample::SampleKind;
use zenoh::session::{Link, ZenohId};

/// In a list of who holds most sessions there are at most so many names, with at most so many addresses each.
const MAX_LISTED: usize = 16;
const MAX_ADDRESSES: usize = 4;

/// Somebody who is connected.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Peer {
    /// Common name of the certificate, such as `agent:ego`; `None` without TLS or without a certificate.
    pub name: Option<String>,
    /// Where it connects from, without the port.
    pub address: String,
}

impl fmt::Display for Peer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, address } = self;
        match name {
            Some(name) => write!(f, "{name} at {address}"),
            None => write!(f, "somebody without a certificate at {address}"),
        }
    }
}

/// The sessions of one name, or without certificates of one address.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SessionsOf {
    /// Common name of the certificate; `None` without one.
    pub name: Option<String>,
    /// Where it connects from, without ports; at most four.
    pub addresses: Vec<String>,
    /// How many sessions it holds.
    pub sessions: usize,
}

/// All sessions of this process.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sessions {
    /// How many there are.
    pub total: usize,
    /// How many there can be.
    pub limit: usize,
    /// How many were not let in since the start, because all places were taken.
    pub refused: u64,
    /// Who holds most of them, at most 16.
    pub most: Vec<SessionsOf>,
}

#[derive(Debug, Default)]
struct State {
    /// By the session and the far end of its link.
    links: BTreeMap<(String, String), Linked>,
    refused: u64,
}

#[derive(Debug)]
struct Linked {
    /// How Zenoh shortens the session's id in its spans.
    short: String,
    peer: Peer,
}

static STATE: Mutex<Option<State>> = Mutex::new(None);

fn with_state<T>(change: impl FnOnce(&mut State) -> T) -> T {
    // The entries are consistent between any two statements: a poisoned lock is safe to use.
    let mut state: MutexGuard<'_, Option<State>> = STATE.lock().unwrap_or_else(PoisonError::into_inner);
    change(state.get_or_insert_default())
}

/// Follows who is connected to this session, in place of one before, until it is closed.
pub async fn follow(session: &Session) -> zenoh::Result<()> {
    with_state(|state| state.links.clear());
    let note = |event: zenoh::session::LinkEvent| note(event.kind(), event.link());
    session.info().link_events_listener().history(true).callback(note).background().await
}

fn note(kind: SampleKind, link: &Link) {
    let place = (link.zid().to_string(), link.dst().to_string());
    let linked = || {
        let name = link.auth_identifier().map(printable);
        let peer = Peer { name, address: without_port(link.dst().address().as_str()) };
        Linked { short: shortened(link.zid()), peer }
    };
    with_state(|state| match kind {
        SampleKind::Put => drop(state.links.insert(place, linked())),
        SampleKind::Delete => drop(state.links.remove(&place)),
    });
}

/// Who holds the sessions of this process, of which there can be `limit`.
pub fn sessions(limit: usize) -> Sessions {
    with_state(|state| {
        let peers: Vec<_> = state.links.values().map(|linked| &linked.peer).collect();
        Sessions { total: peers.len(), limit, refused: state.refused, most: most(&peers) }
    })
}

/// The name of a certificate; of who has none, the address.
type Holder<'a> = (Option<&'a str>, &'a str);
/// How many sessions somebody holds, and from where.
type Held<'a> = (usize, BTreeSet<&'a str>);

fn most(peers: &[&Peer]) -> Vec<SessionsOf> {
    let mut by_name: BTreeMap<Holder<'_>, Held<'_>> = BTreeMap::new();
    for Peer { name, address } in peers {
        let apart = if name.is_some() { "" } else { address.as_str() };
        let (count, addresses) = by_name.entry((name.as_deref(), apart)).or_default();
        *count += 1;
        addresses.insert(address);
    }
    let of = |((name, _), (sessions, addresses)): (Holder<'_>, Held<'_>)| SessionsOf {
        name: name.map(str::to_owned),
        addresses: addresses.into_iter().take(MAX_ADDRESSES).map(str::to_owned).collect(),
        sessions,
    };
    let mut most: Vec<_> = by_name.into_iter().map(of).collect();
    most.sort_by_key(|one| std::cmp::Reverse(one.sessions));
    most.truncate(MAX_LISTED);
    most
}

/// Counts one who was not let in because all places are taken.
pub(super) fn note_refused() {
    with_state(|state| state.refused += 1);
}

/// Whose session it is, by its id as Zenoh shortens that. It is called when a thread panics, too, which may hold the lock: then nobody
/// is known.
pub(super) fn of_session(short: &str) -> Option<Peer> {
    let state = STATE.try_lock().ok()?;
    let mut peers = state.as_ref()?.links.values().filter(|linked| linked.short == short);
    peers.next().map(|linked| linked.peer.clone())
}

/// As Zenoh shortens an id: its four highest bytes that are not all zero.
fn shortened(id: &ZenohId) -> String {
    let bytes = id.to_le_bytes();
    let size = bytes.iter().rposition(|byte| *byte != 0).map_or(0, |last| last + 1);
    let start = size.saturating_sub(4);
    let highest: [u8; 4] = std::array::from_fn(|k| bytes[start + k]);
    format!("{:x}", u32::from_le_bytes(highest))
}

fn without_port(address: &str) -> String {
    address.rsplit_once(':').map_or(address, |(host, _)| host).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn peer(name: Option<&str>, address: &str) -> Peer {
        Peer { name: name.map(str::to_owned), address: address.to_owned() }
    }

    #[test]
    fn a_flood_of_sessions_is_listed_by_the_name_of_its_cert_and_without_one_by_its_address() {
        let eve: Vec<_> = (0..100).map(|k| peer(Some("agent:eve"), &format!("10.0.0.{}", k % 9))).collect();
        let others = [peer(Some("agent:ego"), "10.0.0.9"), peer(None, "10.0.0.1"), peer(None, "10.0.0.2")];
        let all: Vec<_> = others.iter().chain(&eve).collect();
        let listed = most(&all);
        assert_eq!((listed[0].name.as_deref(), listed[0].sessions), (Some("agent:eve"), 100));
        assert_eq!((listed.len(), listed[0].addresses.len()), (4, MAX_ADDRESSES));
        let strangers: Vec<_> = (0..50).map(|k| peer(None, &format!("10.0.1.{k}"))).collect();
        assert_eq!(most(&strangers.iter().collect::<Vec<_>>()).len(), MAX_LISTED);
    }

    #[test]
    fn a_peer_is_named_without_port() {
        assert_eq!(without_port("[fe80::1]:7447"), "[fe80::1]");
    }
}
