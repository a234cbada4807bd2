//! The journal of a hub: every call of its core, in order, so that a recording can be computed again to the same bits.
//!
//! A hub publishes batches of items. The first item of a journal is a [`Start`]: the settings, and the state of the core. All
//! others are calls. Items are numbered from the start of the hub, and a batch names the number of its first one, so that a
//! lost batch shows.

use super::error::{VERSION, WireError};
use super::framing::{Kind, put, take, take_preamble};
use crate::id::AgentId;
use crate::time::{Span, Timestamp};
use serde::{Deserialize, Serialize};

/// A payload as it arrived at the hub.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Body<'a> {
    /// The hub takes it for postcard.
    Postcard(&'a [u8]),
    /// The hub takes it for JSON.
    Json(&'a [u8]),
    /// It has this many bytes, and is not read.
    TooLarge(u64),
}

impl<'a> Body<'a> {
    /// A payload by its Zenoh encoding.
    pub fn of(encoding: &str, bytes: &'a [u8]) -> Self {
        if super::is_json(encoding, bytes) { Self::Json(bytes) } else { Self::Postcard(bytes) }
    }

    /// Its bytes; none where it is not read.
    pub const fn bytes(&self) -> &'a [u8] {
        match self {
            Self::Postcard(bytes) | Self::Json(bytes) => bytes,
            Self::TooLarge(_) => &[],
        }
    }
}

/// One call of a hub's core.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Call<'a> {
    /// A detection frame was handled.
    Frame {
        /// The agent of its key.
        agent: AgentId,
        /// When it arrived, by the hub's clock.
        received_at: Timestamp,
        /// Its payload.
        #[serde(borrow)]
        body: Body<'a>,
    },
    /// A sensor description was handled.
    Description {
        /// The agent of its key.
        agent: AgentId,
        /// Its payload.
        body: Body<'a>,
    },
    /// Frames were dropped because their agent's queue was full.
    QueueFull {
        /// The agent.
        agent: AgentId,
        /// Their number.
        count: u64,
    },
    /// The list was made.
    Fused {
        /// As of then.
        now: Timestamp,
    },
    /// The second list was made.
    Lagged {
        /// As of then.
        now: Timestamp,
    },
    /// The system's clock of the hub was set.
    ClockStep {
        /// How far it is ahead of the hub's timeline since then.
        step: Span,
    },
    /// The hub did not run for a while, as one that is stopped by a signal.
    HeldUp {
        /// It runs again since then.
        now: Timestamp,
        /// For so long.
        lasted: Span,
    },
    /// A hub that stands by has heard a list of the hub that publishes.
    Followed {
        /// The list, in postcard.
        list: &'a [u8],
    },
    /// The list was made, and not published: another hub does.
    Unpublished {
        /// As of then.
        now: Timestamp,
    },
}

/// Where a journal starts: what the core is at that moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Start<'a> {
    /// The hub's settings as JSON.
    pub settings: &'a str,
    /// The version of the hub.
    pub version: &'a str,
    /// The commit of its build.
    pub commit: &'a str,
    /// The state of its core; `None` where it knows nothing yet.
    pub state: Option<&'a [u8]>,
    /// Why nothing can be computed from here, where that is so.
    pub not_repeatable: Option<&'a str>,
}

/// An item of a journal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Item<'a> {
    /// The journal starts here, or again.
    Start(#[serde(borrow)] Start<'a>),
    /// A call.
    Call(Call<'a>),
}

/// Begins a batch whose first item has this number.
pub fn begin(lineage: u32, first: u64, buffer: &mut Vec<u8>) -> Result<(), WireError> {
    buffer.extend([VERSION, Kind::Journal as u8]);
    put(&(lineage, first), buffer)
}

/// Appends an item to a batch.
pub fn push(item: &Item<'_>, buffer: &mut Vec<u8>) -> Result<(), WireError> {
    put(item, buffer)
}

/// A batch, and its items one by one.
#[derive(Clone, Copy, Debug)]
pub struct Batch<'a> {
    /// The hub's lineage, new at every start.
    pub lineage: u32,
    /// The number of the first item.
    pub first: u64,
    items: &'a [u8],
}

impl<'a> Batch<'a> {
    /// Reads the head of a batch.
    pub fn decode(mut bytes: &'a [u8]) -> Result<Self, WireError> {
        take_preamble(&mut bytes, Kind::Journal)?;
        let (lineage, first) = take(&mut bytes)?;
        Ok(Self { lineage, first, items: bytes })
    }

    /// The items; after an error there are no more.
    pub fn items(&self) -> impl Iterator<Item = Result<Item<'a>, WireError>> {
        let mut rest = self.items;
        std::iter::from_fn(move || {
            if rest.is_empty() {
                return None;
            }
            let item = take(&mut rest);
            if item.is_err() {
                rest = &[];
            }
            Some(item)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn items(state: &[u8]) -> Vec<Item<'_>> {
        let agent = AgentId::new("ego").unwrap();
        let now = Timestamp::from_nanos(5);
        vec![
            Item::Start(Start {
                settings: "{}",
                version: "1",
                commit: "abc",
                state: Some(state),
                not_repeatable: None,
            }),
            Item::Call(Call::Frame { agent, received_at: now, body: Body::Json(b"{}") }),
            Item::Call(Call::Description { agent, body: Body::TooLarge(7) }),
            Item::Call(Call::QueueFull { agent, count: 3 }),
            Item::Call(Call::Fused { now }),
            Item::Call(Call::Lagged { now }),
            Item::Call(Call::HeldUp { now, lasted: Span::from_millis(5) }),
            Item::Call(Call::ClockStep { step: Span::from_millis(-5) }),
            Item::Call(Call::Followed { list: b"list" }),
            Item::Call(Call::Unpublished { now }),
        ]
    }

    #[test]
    fn the_items_of_a_batch_are_read_as_they_were_written() {
        let state = vec![1; 1000];
        let (items, mut bytes) = (items(&state), Vec::new());
        begin(7, 41, &mut bytes).unwrap();
        items.iter().for_each(|item| push(item, &mut bytes).unwrap());
        let batch = Batch::decode(&bytes).unwrap();
        assert_eq!((batch.lineage, batch.first), (7, 41));
        assert_eq!(batch.items().collect::<Result<Vec<_>, _>>().unwrap(), items);
    }

    #[test]
    fn a_batch_that_is_cut_anywhere_gives_whole_items_and_at_most_one_error() {
        let state = vec![1; 20];
        let (items, mut bytes) = (items(&state), Vec::new());
        begin(7, 41, &mut bytes).unwrap();
        items.iter().for_each(|item| push(item, &mut bytes).unwrap());
        for end in 0..bytes.len() {
            let Ok(batch) = Batch::decode(&bytes[..end]) else { continue };
            let read: Vec<_> = batch.items().collect();
            let whole = read.iter().take_while(|item| item.is_ok()).count();
            assert!(read.len() - whole <= 1, "cut at {end}");
            assert!(read.into_iter().take(whole).map(Result::unwrap).eq(items[..whole].iter().copied()));
        }
    }
}
