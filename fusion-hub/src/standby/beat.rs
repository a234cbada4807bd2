//! What a hub that publishes says beside its lists, for one that stands by for it.

use serde::{Deserialize, Serialize};
use v2x_common::time::Timestamp;

/// Bytes of the largest one that is read.
pub(crate) const MAX_BEAT_BYTES: usize = 512;

/// That a hub publishes: tiny, so that it is on time whatever its lists weigh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Beat {
    /// Of the hub.
    pub(crate) lineage: u32,
    /// How many lists it has published.
    pub(crate) sequence: u64,
    /// When it was sent, by that hub's clock, µs.
    at: i64,
    /// A number for the settings that decide its lists: another one for others.
    pub(crate) settings: u64,
}

impl Beat {
    /// Sent at this time.
    pub(crate) const fn new(lineage: u32, settings: u64, sequence: u64, at: Timestamp) -> Self {
        Self { lineage, sequence, at: at.as_micros(), settings }
    }

    /// When it was sent, by the clock of who sent it; `None` where that is no time.
    pub(crate) fn sent_at(&self) -> Option<Timestamp> {
        Timestamp::from_micros(self.at)
    }

    pub(crate) fn encode(&self) -> Vec<u8> {
        serde_json::to_vec(self).unwrap_or_default()
    }

    /// `None` where it is none.
    pub(crate) fn decode(bytes: &[u8]) -> Option<Self> {
        let beat = (bytes.len() <= MAX_BEAT_BYTES).then(|| serde_json::from_slice::<Self>(bytes).ok())??;
        beat.sent_at().map(|_| beat)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_standby_reads_a_beat_as_it_was_sent_and_nothing_else() {
        let beat = Beat::new(7, u64::MAX, 9, Timestamp::EPOCH);
        let bytes = beat.encode();
        assert!(bytes.len() < MAX_BEAT_BYTES / 2);
        assert_eq!(Beat::decode(&bytes), Some(beat));
        for rubbish in [&b"{}"[..], b"", &[bytes.as_slice(), &[b' '; MAX_BEAT_BYTES]].concat()] {
            assert_eq!(Beat::decode(rubbish), None);
        }
        let far = String::from_utf8(bytes).unwrap().replace("\"at\":0", "\"at\":9223372036854775807");
        assert_eq!(Beat::decode(far.as_bytes()), None, "a time that is none");
    }
}
