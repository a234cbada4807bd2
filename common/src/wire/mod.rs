//! The wire: how frames become bytes.
//!
//! Version 1 is postcard behind a version byte and a kind byte. Positions are fixed-point (1 mm),
//! headings 0.1 mrad, standard deviations one byte each on a logarithmic scale that rounds up. What is
//! decoded has been validated: no non-finite value and no value beyond its limits passes, and nothing may trail.
//! [`json`] is the twin for people and for other languages.

pub mod detections;
pub mod fused;
pub mod json;
mod kinematic;
mod quantity;
pub mod sensor;
mod sigma;
mod varint;

use crate::detection::InvalidValue;
use crate::id::NameError;
use crate::sensor::InvalidDescription;

/// The version that this code writes. A hub reads this one and the one before, where there is one.
pub const VERSION: u8 = 1;

/// The Zenoh encoding of a postcard payload.
pub const ENCODING_POSTCARD: &str = "application/vnd.v2x.postcard";
/// The Zenoh encoding of a JSON payload.
pub const ENCODING_JSON: &str = "application/json";

/// Whether a payload is JSON: by its Zenoh encoding, or where that says nothing, by its first character.
pub fn is_json(encoding: &str, bytes: &[u8]) -> bool {
    match encoding {
        ENCODING_JSON | "text/json" => true,
        ENCODING_POSTCARD => false,
        _ => bytes.trim_ascii_start().first() == Some(&b'{'),
    }
}

/// What a payload is: its second byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
enum Kind {
    Detections = b'D',
    Sensor = b'S',
    Fused = b'F',
}

/// Why bytes are no frame, or a frame cannot become bytes.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum WireError {
    /// The payload ends too early.
    #[error("truncated payload")]
    Truncated,
    /// Bytes are left over.
    #[error("{0} bytes trail the payload")]
    Trailing(usize),
    /// Not a version that we read.
    #[error("wire version {0}, this end reads version {VERSION}")]
    UnknownVersion(u8),
    /// Another kind of payload than this key carries.
    #[error("payload kind {0:#04x} where {1:?} was expected")]
    WrongKind(u8, char),
    /// A flag that this version does not know.
    #[error("unknown flags {0:#04x}")]
    UnknownFlags(u8),
    /// A class byte beyond the table.
    #[error("unknown class byte {0}")]
    UnknownClass(u8),
    /// postcard could not read an integer or a text.
    #[error("malformed postcard: {0}")]
    Postcard(postcard::Error),
    /// Not a legal name.
    #[error(transparent)]
    Name(#[from] NameError),
    /// A list longer than allowed.
    #[error("{count} {what}, at most {limit}")]
    TooMany {
        /// Of what.
        what: &'static str,
        /// How many.
        count: u64,
        /// How many are allowed.
        limit: usize,
    },
    /// A number that no sensor could have meant.
    #[error(transparent)]
    InvalidValue(#[from] InvalidValue),
    /// A number in a sensor description that cannot be.
    #[error(transparent)]
    Description(#[from] InvalidDescription),
    /// A reference to an agent that the frame does not list.
    #[error("reference to an agent that the frame does not list")]
    UnlistedAgent,
    /// JSON that is none, or lacks or misnames a field.
    #[error("JSON: {0}")]
    Json(String),
    /// A value that the wire has no room for.
    #[error("{field} = {value} does not fit on the wire")]
    NotEncodable {
        /// The field's name.
        field: &'static str,
        /// What it holds.
        value: f64,
    },
}

impl WireError {
    /// A short name for counting, one per cause.
    pub const fn reason(&self) -> &'static str {
        match self {
            Self::Truncated => "truncated",
            Self::Trailing(_) => "trailing_bytes",
            Self::UnknownVersion(_) => "unknown_version",
            Self::WrongKind(..) => "wrong_kind",
            Self::UnknownFlags(_) => "unknown_flags",
            Self::UnknownClass(_) => "unknown_class",
            Self::Postcard(_) => "malformed",
            Self::Name(_) => "bad_name",
            Self::TooMany { .. } => "too_many",
            Self::InvalidValue(_) => "absurd_value",
            Self::Description(_) => "bad_description",
            Self::UnlistedAgent => "unlisted_agent",
            Self::Json(_) => "bad_json",
            Self::NotEncodable { .. } => "not_encodable",
        }
    }
}

impl From<postcard::Error> for WireError {
    fn from(error: postcard::Error) -> Self {
        match error {
            postcard::Error::DeserializeUnexpectedEnd => Self::Truncated,
            other => Self::Postcard(other),
        }
    }
}

/// Appends a value to a buffer.
fn put<T: serde::Serialize>(value: &T, buffer: &mut Vec<u8>) -> Result<(), WireError> {
    postcard::to_extend(value, Appending(buffer))?;
    Ok(())
}

/// Lets postcard append to a borrowed buffer.
struct Appending<'a>(&'a mut Vec<u8>);

impl Extend<u8> for Appending<'_> {
    fn extend<I: IntoIterator<Item = u8>>(&mut self, bytes: I) {
        self.0.extend(bytes);
    }
}

/// Takes a value off the front of the bytes.
fn take<'a, T: serde::Deserialize<'a>>(bytes: &mut &'a [u8]) -> Result<T, WireError> {
    let (value, rest) = postcard::take_from_bytes(bytes)?;
    *bytes = rest;
    Ok(value)
}

/// Takes version and kind off the front.
fn take_preamble(bytes: &mut &[u8], kind: Kind) -> Result<(), WireError> {
    let [version, found, rest @ ..] = bytes else { return Err(WireError::Truncated) };
    if *version != VERSION {
        return Err(WireError::UnknownVersion(*version));
    }
    if *found != kind as u8 {
        return Err(WireError::WrongKind(*found, char::from(kind as u8)));
    }
    *bytes = rest;
    Ok(())
}

/// Nothing may be left.
fn finish(bytes: &[u8]) -> Result<(), WireError> {
    if bytes.is_empty() { Ok(()) } else { Err(WireError::Trailing(bytes.len())) }
}

/// A count that must not exceed its limit.
fn checked_count(what: &'static str, count: u32, limit: usize) -> Result<usize, WireError> {
    let count_usize = count as usize;
    if count_usize <= limit {
        Ok(count_usize)
    } else {
        Err(WireError::TooMany { what, count: u64::from(count), limit })
    }
}

/// A length as it stands on the wire.
fn wire_count(what: &'static str, count: usize, limit: usize) -> Result<u32, WireError> {
    let too_many = WireError::TooMany { what, count: count as u64, limit };
    u32::try_from(count).ok().filter(|_| count <= limit).ok_or(too_many)
}
