//! Recordings: the samples that one process received, in their order, with the payloads of the wire.
//!
//! A file is the line [`MAGIC`] and then entries, each a 32-bit little-endian length and that many bytes
//! of postcard. A recorder that was killed leaves at most one incomplete entry at the end.

use crate::time::Timestamp;
use serde::{Deserialize, Serialize};
use std::io::{self, Read, Write};

/// The first line of every recording.
pub const MAGIC: &[u8; 8] = b"V2XREC1\n";
/// Longest entry, bytes.
pub const MAX_ENTRY_BYTES: u32 = 64 << 20;

/// One received sample.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// When the recorder received it.
    pub received_at: Timestamp,
    /// Its key.
    pub key: String,
    /// The Zenoh encoding.
    pub encoding: String,
    /// The payload.
    pub payload: Vec<u8>,
}

#[derive(Serialize, Deserialize)]
struct WireEntry<'a>(i64, &'a str, &'a str, &'a [u8]);

/// Why a recording cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be read at all.
    #[error("reading the recording: {0}")]
    Io(#[from] io::Error),
    /// It does not start with [`MAGIC`].
    #[error("not a recording: it does not begin with V2XREC1")]
    NotARecording,
    /// An entry is broken; those before it are complete.
    #[error("entry {index} of the recording is broken: {why}")]
    Broken {
        /// Its index, from 0.
        index: usize,
        /// The cause.
        why: &'static str,
    },
}

/// Writes a recording.
#[derive(Debug)]
pub struct Recorder<W: Write> {
    out: W,
    buffer: Vec<u8>,
}

impl<W: Write> Recorder<W> {
    /// Begins a recording.
    pub fn new(mut out: W) -> io::Result<Self> {
        out.write_all(MAGIC)?;
        Ok(Self { out, buffer: Vec::new() })
    }

    /// Appends one entry.
    pub fn write(&mut self, entry: &Entry) -> io::Result<()> {
        let wire = WireEntry(entry.received_at.as_nanos(), &entry.key, &entry.encoding, &entry.payload);
        self.buffer.clear();
        self.buffer =
            postcard::to_extend(&wire, std::mem::take(&mut self.buffer)).map_err(io::Error::other)?;
        let length = u32::try_from(self.buffer.len()).ok().filter(|length| *length <= MAX_ENTRY_BYTES);
        let length = length.ok_or_else(|| io::Error::other("entry too long for a recording"))?;
        self.out.write_all(&length.to_le_bytes())?;
        self.out.write_all(&self.buffer)
    }

    /// Flushes the output.
    pub fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// Reads a recording, entry by entry.
#[derive(Debug)]
pub struct Recording<R: Read> {
    input: R,
    index: usize,
    ended: bool,
}

impl<R: Read> Recording<R> {
    /// Opens a recording.
    pub fn new(mut input: R) -> Result<Self, RecordingError> {
        let mut magic = [0; MAGIC.len()];
        match input.read_exact(&mut magic) {
            Ok(()) if &magic == MAGIC => Ok(Self { input, index: 0, ended: false }),
            Ok(()) => Err(RecordingError::NotARecording),
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Err(RecordingError::NotARecording),
            Err(error) => Err(error.into()),
        }
    }

    fn broken(&self, why: &'static str) -> RecordingError {
        RecordingError::Broken { index: self.index, why }
    }

    fn read_entry(&mut self) -> Result<Option<Entry>, RecordingError> {
        let mut length = Vec::with_capacity(4);
        (&mut self.input).take(4).read_to_end(&mut length)?;
        if length.is_empty() {
            return Ok(None);
        }
        let length: [u8; 4] = length.try_into().map_err(|_| self.broken("it ends within a length"))?;
        let length = u32::from_le_bytes(length);
        if length > MAX_ENTRY_BYTES {
            return Err(self.broken("its length is beyond the limit"));
        }
        let mut bytes = Vec::new();
        (&mut self.input).take(u64::from(length)).read_to_end(&mut bytes)?;
        if bytes.len() < length as usize {
            return Err(self.broken("it ends early"));
        }
        let WireEntry(nanos, key, encoding, payload) =
            postcard::from_bytes(&bytes).map_err(|_| self.broken("it is not an entry"))?;
        self.index += 1;
        Ok(Some(Entry {
            received_at: Timestamp::from_nanos(nanos),
            key: key.to_owned(),
            encoding: encoding.to_owned(),
            payload: payload.to_vec(),
        }))
    }
}

impl<R: Read> Iterator for Recording<R> {
    type Item = Result<Entry, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            return None;
        }
        let entry = self.read_entry().transpose();
        self.ended = !matches!(entry, Some(Ok(_)));
        entry
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

    fn recorded() -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut recorder = Recorder::new(&mut bytes).unwrap();
        for nanos in 0..3 {
            recorder.write(&entry(nanos)).unwrap();
        }
        bytes
    }

    #[test]
    fn entries_are_read_as_they_were_written() {
        let read: Result<Vec<_>, _> = Recording::new(recorded().as_slice()).unwrap().collect();
        assert_eq!(read.unwrap(), [entry(0), entry(1), entry(2)]);
    }

    #[test]
    fn a_recording_cut_anywhere_gives_the_whole_entries_and_at_most_one_error() {
        let bytes = recorded();
        for end in MAGIC.len()..bytes.len() {
            let results: Vec<_> = Recording::new(&bytes[..end]).unwrap().collect();
            let errors = results.iter().filter(|result| result.is_err()).count();
            assert!(errors <= 1 && results.len() - errors <= 2, "cut at {end}");
        }
        assert!(matches!(Recording::new(&bytes[..5]), Err(RecordingError::NotARecording)));
    }
}
