//! Another hub that publishes under this hub's name. Consumers would get the lists of both in turn.
//!
//! A hub that joins a network in which one of its name answers does not begin. Two that come together later, because their
//! routers are joined, report each other as a finding. Neither of them yields: without certificates anybody can claim the name of
//! a hub, and could silence it that way. Only a hub that is started to stand by follows the lists of another one
//! (`run/following.rs`).

use super::status::HubStatus;
use crate::standby::{Beat, MAX_BEAT_BYTES};
use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;
use v2x_common::clock;
use v2x_common::id::HubId;
use v2x_common::keys::Keys;
use v2x_common::net::session::MAX_MESSAGE_OF_HUB;
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire;
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::sample::Locality;

/// How long another hub has for its answer.
const ANSWER_WITHIN: Duration = Duration::from_millis(500);
/// A list is looked into this often at most: anybody can publish some.
const LOOKED_AT_EVERY: Span = Span::from_millis(500);
/// Another hub is reported for so long after its last list.
const REPORTED_FOR: Span = Span::from_millis(5_000);

/// Of lists that come faster those between are left out by a hub that follows them.
const FOLLOWED_EVERY: Span = Span::from_millis(20);
/// Lists, and beats, that may wait for the hub.
const MAX_LISTS: usize = 32;

/// What was heard under this hub's own key.
#[derive(Debug, Default)]
pub(super) struct Twin(Mutex<Heard>);

/// A list that another session put under this hub's key, and when it came.
pub(super) type HeardList = (Vec<u8>, Timestamp);

#[derive(Debug, Default)]
struct Heard {
    /// Of a hub that follows: the lists that it has not taken in yet, the oldest first, and what is said beside them.
    lists: VecDeque<HeardList>,
    beats: VecDeque<(Beat, Timestamp)>,
    listed_at: Option<Timestamp>,
    looked_at: Option<Timestamp>,
    /// The lineage of another hub's list, and when it came.
    other: Option<(u32, Timestamp)>,
}

impl Twin {
    /// Takes in a list that another session put under this hub's key.
    fn note(&self, payload: &[u8], now: Timestamp) {
        let mut heard = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if heard.looked_at.is_some_and(|at| now - at < LOOKED_AT_EVERY) {
            return;
        }
        heard.looked_at = Some(now);
        if let Ok(frame) = wire::fused::decode(payload) {
            heard.other = Some((frame.lineage, now));
        }
    }

    /// Keeps a list for the hub, which follows it. With too many of them the oldest are left out.
    fn keep(&self, payload: &[u8], now: Timestamp) {
        let mut heard = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if payload.len() as u64 > MAX_MESSAGE_OF_HUB
            || heard.listed_at.is_some_and(|at| now - at < FOLLOWED_EVERY)
        {
            return;
        }
        heard.listed_at = Some(now);
        if heard.lists.len() == MAX_LISTS {
            heard.lists.pop_front();
        }
        heard.lists.push_back((payload.to_vec(), now));
    }

    /// Keeps what another hub says beside its lists; with too many of them the oldest are left out.
    fn keep_beat(&self, payload: &[u8], now: Timestamp) {
        let Some(beat) = Beat::decode(payload) else { return };
        let mut heard = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if heard.beats.len() == MAX_LISTS {
            heard.beats.pop_front();
        }
        heard.beats.push_back((beat, now));
    }

    /// What was said beside lists since the last call.
    pub(super) fn take_beats(&self) -> VecDeque<(Beat, Timestamp)> {
        std::mem::take(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner).beats)
    }

    /// The lists that were kept since the last call.
    pub(super) fn take_lists(&self) -> VecDeque<HeardList> {
        std::mem::take(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner).lists)
    }

    /// The lineage of another hub of this name, while it publishes.
    pub(super) fn lineage(&self, now: Timestamp) -> Option<u32> {
        let heard = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        heard.other.filter(|(_, at)| now - *at < REPORTED_FOR).map(|(lineage, _)| lineage)
    }
}

/// Listens to the hub's own key; what it puts itself is left out.
pub(super) async fn listen(
    session: &Session,
    keys: &Keys,
    hub: &HubId,
    (twin, follows): (std::sync::Arc<Twin>, bool),
) -> zenoh::Result<Subscriber<()>> {
    let others = session.declare_subscriber(keys.fused(hub)).allowed_origin(Locality::Remote);
    let heard = move |payload: &[u8]| {
        twin.note(payload, clock::now());
        if follows {
            twin.keep(payload, clock::now());
        }
    };
    others.callback(move |sample| heard(&sample.payload().to_bytes())).await
}

/// Listens to what another hub of this name says beside its lists.
pub(super) async fn listen_to_beats(
    session: &Session,
    keys: &Keys,
    hub: &HubId,
    twin: std::sync::Arc<Twin>,
) -> zenoh::Result<Subscriber<()>> {
    let others = session.declare_subscriber(keys.beat(hub)).allowed_origin(Locality::Remote);
    let others = others.callback(move |sample| {
        if sample.payload().len() <= MAX_BEAT_BYTES {
            twin.keep_beat(&sample.payload().to_bytes(), clock::now());
        }
    });
    others.await
}

/// The hub of this name that answers in the network, if there is one.
pub(super) async fn running(session: &Session, keys: &Keys, hub: &HubId) -> Option<HubStatus> {
    let replies = session.get(keys.status(hub)).timeout(ANSWER_WITHIN).await.ok()?;
    while let Ok(reply) = replies.recv_async().await {
        if let Ok(sample) = reply.into_result()
            && let Ok(status) = serde_json::from_slice(&sample.payload().to_bytes())
        {
            return Some(status);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::fused::FusedFrame;

    #[test]
    fn a_list_that_spoofs_this_hub_is_reported_while_it_comes_and_rubbish_is_not() {
        let twin = Twin::default();
        let at = |ms: i64| Timestamp::EPOCH + Span::from_millis(ms);
        twin.note(b"rubbish", at(0));
        assert_eq!(twin.lineage(at(1)), None);
        let list = FusedFrame {
            hub: HubId::new("hub").unwrap(),
            lineage: 7,
            sequence: 1,
            fused_at: at(0),
            map_frame: None,
            objects: Vec::new(),
            agents: Vec::new(),
            includes: Vec::new(),
        };
        let mut bytes = Vec::new();
        wire::fused::encode(&list, &mut bytes).unwrap();
        twin.note(&bytes, at(1000));
        assert_eq!((twin.lineage(at(5999)), twin.lineage(at(6000))), (Some(7), None));
    }

    #[test]
    fn a_standby_has_the_newest_lists_and_not_all_of_those_that_come_fast() {
        let twin = Twin::default();
        let at = |ms: i64| Timestamp::EPOCH + Span::from_millis(ms);
        (0..100).for_each(|ms| twin.keep(&[1], at(ms)));
        let times: Vec<_> = twin.take_lists().into_iter().map(|(_, at)| at).collect();
        assert_eq!(times, [0, 20, 40, 60, 80].map(at));
        (1..=100).for_each(|n| twin.keep(&[1], at(1000 * n)));
        let lists = twin.take_lists();
        assert_eq!((lists.len(), lists[MAX_LISTS - 1].1), (MAX_LISTS, at(100_000)));
        assert!(twin.take_lists().is_empty());
    }

    #[test]
    fn a_flood_of_beats_is_bounded_for_a_standby_and_rubbish_is_none() {
        let twin = Twin::default();
        let at = |ms: i64| Timestamp::EPOCH + Span::from_millis(ms);
        for k in 0..1000 {
            twin.keep_beat(&Beat::new(7, 1, k, at(0)).encode(), at(1));
            twin.keep_beat(b"rubbish", at(1));
        }
        let beats = twin.take_beats();
        assert_eq!((beats.len(), beats[MAX_LISTS - 1].0.sequence), (MAX_LISTS, 999));
        assert!(twin.take_beats().is_empty());
    }
}
