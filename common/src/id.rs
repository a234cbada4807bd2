//! Names of agents, hubs, networks and map frames, and numbers of tracks and measurements.

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::str::FromStr;

/// Longest name, in bytes.
pub const MAX_NAME_LEN: usize = 32;

/// Why a text is not a valid name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NameError {
    /// No text.
    #[error("a name must not be empty")]
    Empty,
    /// More than [`MAX_NAME_LEN`] bytes.
    #[error("name {0:?} is longer than {MAX_NAME_LEN} bytes")]
    TooLong(String),
    /// `.` or `..`, which as the name of a folder would be another one: that of a certificate, say.
    #[error("{0:?} is no name: as the name of a folder it means another one")]
    Dots(String),
    /// A character that is not allowed in a key expression.
    #[error("name {name:?} holds {character:?}; allowed are letters, digits, '-', '_', '.' and ':'")]
    Character {
        /// The whole name.
        name: String,
        /// The first such character.
        character: char,
    },
}

/// A short text that can be one chunk of a Zenoh key expression. Stored inline: copying it allocates nothing.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Name {
    bytes: [u8; MAX_NAME_LEN],
    len: u8,
}

impl Name {
    /// A checked name.
    pub fn new(text: &str) -> Result<Self, NameError> {
        if text.is_empty() {
            return Err(NameError::Empty);
        }
        if text.len() > MAX_NAME_LEN {
            return Err(NameError::TooLong(text.chars().take(MAX_NAME_LEN).collect()));
        }
        let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.' | ':');
        if let Some(character) = text.chars().find(|c| !allowed(*c)) {
            return Err(NameError::Character { name: text.to_owned(), character });
        }
        if matches!(text, "." | "..") {
            return Err(NameError::Dots(text.to_owned()));
        }
        let mut bytes = [0; MAX_NAME_LEN];
        bytes[..text.len()].copy_from_slice(text.as_bytes());
        let len = u8::try_from(text.len()).expect("checked against MAX_NAME_LEN");
        Ok(Self { bytes, len })
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        std::str::from_utf8(&self.bytes[..usize::from(self.len)]).expect("only ASCII is let in")
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

impl fmt::Debug for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.as_str(), f)
    }
}

macro_rules! names {
    ($($(#[$doc:meta])* $name:ident;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(Name);

        impl $name {
            /// A checked name.
            pub fn new(text: &str) -> Result<Self, NameError> {
                Name::new(text).map(Self)
            }

            /// The text.
            pub fn as_str(&self) -> &str {
                self.0.as_str()
            }
        }

        impl FromStr for $name {
            type Err = NameError;
            fn from_str(text: &str) -> Result<Self, NameError> {
                Self::new(text)
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }

        impl fmt::Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                fmt::Debug::fmt(&self.0, f)
            }
        }

        impl Serialize for $name {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_str(self.as_str())
            }
        }

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let text = <std::borrow::Cow<'de, str>>::deserialize(deserializer)?;
                Self::new(&text).map_err(serde::de::Error::custom)
            }
        }
    )*};
}

names! {
    /// An agent: publishes detections. Unique in a network.
    AgentId;
    /// A hub: fuses detections. Unique in a network.
    HubId;
    /// One network of agents and hubs; networks on one router are separate.
    NetworkId;
    /// The coordinate frame of positions: an EPSG code (`EPSG:32632`) or any agreed text.
    MapFrame;
}

/// The number of a track: the hub's lineage (new at every start) in the high half, a counter in the low half. So an id
/// is not used again after a restart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct TrackId(pub u64);

impl TrackId {
    /// From the hub's lineage and the track's counter in it.
    pub const fn new(lineage: u32, counter: u32) -> Self {
        Self((lineage as u64) << 32 | counter as u64)
    }

    /// The hub's lineage.
    pub const fn lineage(self) -> u32 {
        (self.0 >> 32) as u32
    }

    /// The track's counter within the lineage.
    #[expect(clippy::cast_possible_truncation, reason = "the low half is the counter")]
    pub const fn counter(self) -> u32 {
        self.0 as u32
    }
}

impl fmt::Display for TrackId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:08x}-{}", self.lineage(), self.counter())
    }
}

/// One frame of one agent: the agent's boot epoch and its number within it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct FrameId {
    /// The sender.
    pub agent: AgentId,
    /// The agent's boot: any number that increases from boot to boot (this implementation: µs since the Unix epoch).
    pub epoch: u64,
    /// The frame's number in this epoch.
    pub sequence: u64,
}

/// One detection of one frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct MeasurementId {
    /// The frame.
    pub frame: FrameId,
    /// Place in the frame's list of detections.
    pub index: u16,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_are_not_valid_in_a_key_expression_are_refused() {
        assert!(AgentId::new("rsu-north_2.a:b").is_ok());
        for bad in ["a/b", "a*", "$x", "a#b", "a?b", "ä", "a b"] {
            assert!(matches!(AgentId::new(bad), Err(NameError::Character { .. })), "{bad}");
        }
        assert_eq!(AgentId::new(""), Err(NameError::Empty));
        assert!(["...", ".a", "a.."].iter().all(|name| AgentId::new(name).is_ok()));
        assert!([".", ".."].iter().all(|name| matches!(AgentId::new(name), Err(NameError::Dots(_)))));
        assert!(matches!(AgentId::new(&"x".repeat(33)), Err(NameError::TooLong(_))));
    }

    #[test]
    fn track_ids_hold_lineage_and_counter() {
        let id = TrackId::new(0xdead_beef, 7);
        assert_eq!((id.lineage(), id.counter()), (0xdead_beef, 7));
        assert_eq!(id.to_string(), "deadbeef-7");
    }
}
