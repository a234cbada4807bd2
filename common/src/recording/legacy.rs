//! The format of recordings before MCAP, for reading.
//!
//! A file is the line [`MAGIC`] and then entries, each a 32-bit little-endian length and that many bytes
//! of postcard. A recorder that was killed left at most one incomplete entry at the end.

use super::entry::{Entry, RecordingError};
use crate::time::Timestamp;
use serde::Deserialize;
use std::io::Read;

/// The first line of every such recording.
pub(super) const MAGIC: &[u8; 8] = b"V2XREC1\n";
/// Longest entry, bytes.
const MAX_ENTRY_BYTES: u32 = 64 << 20;

#[derive(Deserialize)]
struct WireEntry<'a>(i64, &'a str, &'a str, &'a [u8]);

/// Reads such a recording, entry by entry; its first line has been read.
#[derive(Debug)]
pub(super) struct LegacyReader<R> {
    input: R,
    index: usize,
}

impl<R: Read> LegacyReader<R> {
    pub(super) const fn new(input: R) -> Self {
        Self { input, index: 0 }
    }

    fn broken(&self, why: &str) -> RecordingError {
        RecordingError::Broken { index: self.index, why: why.to_owned() }
    }

    /// The next entry; `None` at the end.
    pub(super) fn read(&mut self) -> Result<Option<Entry>, RecordingError> {
        let mut length = Vec::with_capacity(4);
        (&mut self.input).take(4).read_to_end(&mut length)?;
        if length.is_empty() {
            return Ok(None);
        }
        let length: [u8; 4] = length.try_into().map_err(|_| self.broken("it ends within a length"))?;
        let length = u32::from_le_bytes(length);
        if length > MAX_ENTRY_BYTES {
            return Err(self.broken("the length of an entry is beyond the limit"));
        }
        let mut bytes = Vec::new();
        (&mut self.input).take(u64::from(length)).read_to_end(&mut bytes)?;
        if bytes.len() < length as usize {
            return Err(self.broken("an entry ends early"));
        }
        let WireEntry(nanos, key, encoding, payload) =
            postcard::from_bytes(&bytes).map_err(|_| self.broken("what follows is no entry"))?;
        self.index += 1;
        Ok(Some(Entry {
            received_at: Timestamp::from_nanos(nanos),
            key: key.to_owned(),
            encoding: encoding.to_owned(),
            payload: payload.to_vec(),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(nanos: i64) -> Entry {
        Entry {
            received_at: Timestamp::from_nanos(nanos),
            key: "v2x/demo/agent/ego/detections".into(),
            encoding: "application/json".into(),
            payload: vec![1, 2, 3],
        }
    }

    /// Three entries, as the recorder before wrote them.
    fn recorded() -> Vec<u8> {
        let mut bytes = Vec::new();
        for nanos in 0..3 {
            let Entry { key, encoding, payload, .. } = entry(nanos);
            let one = postcard::to_allocvec(&(nanos, key, encoding, payload)).unwrap();
            bytes.extend(u32::try_from(one.len()).unwrap().to_le_bytes());
            bytes.extend(one);
        }
        bytes
    }

    fn read_all(bytes: &[u8]) -> (Vec<Entry>, Option<RecordingError>) {
        let mut reader = LegacyReader::new(bytes);
        let mut entries = Vec::new();
        loop {
            match reader.read() {
                Ok(Some(entry)) => entries.push(entry),
                Ok(None) => return (entries, None),
                Err(error) => return (entries, Some(error)),
            }
        }
    }

    #[test]
    fn entries_are_read_as_they_were_written() {
        let (read, error) = read_all(&recorded());
        assert!(error.is_none());
        assert_eq!(read, [entry(0), entry(1), entry(2)]);
    }

    #[test]
    fn a_recording_cut_anywhere_gives_the_whole_entries_and_at_most_one_error() {
        let bytes = recorded();
        for end in 0..bytes.len() {
            let (entries, error) = read_all(&bytes[..end]);
            assert!(entries.len() <= 2, "cut at {end}");
            assert_eq!(error.is_none(), end % (bytes.len() / 3) == 0, "cut at {end}");
        }
    }
}
