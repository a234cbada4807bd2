//! What all binary payloads have in common: preamble, postcard values, counts.

use super::error::{VERSION, WireError};
use super::foreign::Foreign;

/// The kind of a payload: its second byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Kind {
    Detections = b'D',
    Sensor = b'S',
    Fused = b'F',
    Delta = b'C',
    Journal = b'J',
}

/// Appends a value to a buffer.
pub(super) fn put<T: serde::Serialize>(value: &T, buffer: &mut Vec<u8>) -> Result<(), WireError> {
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

/// Reads a value from the front of the bytes.
pub(super) fn take<'a, T: serde::Deserialize<'a>>(bytes: &mut &'a [u8]) -> Result<T, WireError> {
    let (value, rest) = postcard::take_from_bytes(bytes)?;
    *bytes = rest;
    Ok(value)
}

/// Reads version and kind from the front.
pub(super) fn take_preamble(bytes: &mut &[u8], kind: Kind) -> Result<(), WireError> {
    let [version, found, rest @ ..] = bytes else { return Err(WireError::Truncated) };
    if *version != VERSION {
        let other = Foreign::of(bytes).map(WireError::OtherFormat);
        return Err(other.unwrap_or(WireError::UnknownVersion(*version)));
    }
    if *found != kind as u8 {
        return Err(WireError::WrongKind(*found, char::from(kind as u8)));
    }
    *bytes = rest;
    Ok(())
}

/// Checks that no bytes remain.
pub(super) fn finish(bytes: &[u8]) -> Result<(), WireError> {
    if bytes.is_empty() { Ok(()) } else { Err(WireError::Trailing(bytes.len())) }
}

/// A count that was read, if it does not exceed its limit.
pub(super) fn checked_count(what: &'static str, count: u32, limit: usize) -> Result<usize, WireError> {
    let count_usize = count as usize;
    if count_usize <= limit {
        Ok(count_usize)
    } else {
        Err(WireError::TooMany { what, count: u64::from(count), limit })
    }
}

/// A length as it is written, if it does not exceed its limit.
pub(super) fn wire_count(what: &'static str, count: usize, limit: usize) -> Result<u32, WireError> {
    let too_many = WireError::TooMany { what, count: count as u64, limit };
    u32::try_from(count).ok().filter(|_| count <= limit).ok_or(too_many)
}
