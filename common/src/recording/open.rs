//! Opens a recording of either format.

use super::entry::{Entry, RecordingError};
use super::legacy::{self, LegacyReader};
use super::mcap_reader::McapReader;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

/// The bytes with which an MCAP file begins.
const MCAP_MAGIC: &[u8; 8] = b"\x89MCAP0\r\n";

/// Reads a recording, entry by entry.
pub struct Recording<R> {
    reader: Reader<R>,
    is_ended: bool,
}

enum Reader<R> {
    Mcap(Box<McapReader<R>>),
    Legacy(LegacyReader<R>),
}

impl Recording<BufReader<File>> {
    /// Opens the recording of a file.
    ///
    /// # Errors
    /// Where it cannot be read, or is no recording.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        Self::new(BufReader::with_capacity(1 << 18, File::open(path)?))
    }
}

impl<R: Read> Recording<R> {
    /// Opens a recording.
    ///
    /// # Errors
    /// Where it cannot be read, or is no recording.
    pub fn new(mut input: R) -> Result<Self, RecordingError> {
        let mut magic = [0; 8];
        match input.read_exact(&mut magic) {
            Err(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => {
                return Err(RecordingError::NotARecording);
            }
            read => read?,
        }
        let reader = match &magic {
            MCAP_MAGIC => Reader::Mcap(Box::new(McapReader::new(input))),
            legacy::MAGIC => Reader::Legacy(LegacyReader::new(input)),
            _ => return Err(RecordingError::NotARecording),
        };
        Ok(Self { reader, is_ended: false })
    }

    /// What the recording says of itself, as far as it was read: version, commit, and what its recorder knew.
    pub fn facts(&self) -> BTreeMap<String, String> {
        match &self.reader {
            Reader::Mcap(reader) => reader.facts().clone(),
            Reader::Legacy(_) => BTreeMap::new(),
        }
    }

    /// The files that belong to the recording by name, as far as it was read: all of them, once a sample was.
    pub fn attachments(&self) -> BTreeMap<String, Vec<u8>> {
        match &self.reader {
            Reader::Mcap(reader) => reader.attachments().clone(),
            Reader::Legacy(_) => BTreeMap::new(),
        }
    }
}

impl<R: Read> Iterator for Recording<R> {
    type Item = Result<Entry, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_ended {
            return None;
        }
        let read = match &mut self.reader {
            Reader::Mcap(reader) => reader.read(),
            Reader::Legacy(reader) => reader.read(),
        };
        let entry = read.transpose();
        self.is_ended = !matches!(entry, Some(Ok(_)));
        entry
    }
}
