//! Reads the samples of an MCAP file, in the order in which they were written.

use super::entry::{Entry, RecordingError};
use super::mcap_writer::ZENOH_ENCODING;
use super::scene::SCENE_SUFFIX;
use crate::time::Timestamp;
use mcap::McapError;
use mcap::records::{Channel, MessageHeader, Record};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::BTreeMap;
use std::io::Read;

/// Longest record: a chunk holds at least one message, which can be the state of a hub.
const MAX_RECORD_BYTES: usize = 1 << 30;

/// Reads a recording; its first bytes have been read.
pub(super) struct McapReader<R> {
    input: R,
    reader: LinearReader,
    channels: BTreeMap<u16, Source>,
    /// What the recording says of itself.
    facts: BTreeMap<String, String>,
    attachments: BTreeMap<String, Vec<u8>>,
    n_read: usize,
    is_ended: bool,
}

/// Where the messages of a channel came from.
struct Source {
    key: String,
    encoding: String,
}

impl<R: Read> McapReader<R> {
    pub(super) fn new(input: R) -> Self {
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_record_length_limit(MAX_RECORD_BYTES);
        Self {
            input,
            reader: LinearReader::new_with_options(options),
            channels: BTreeMap::new(),
            facts: BTreeMap::new(),
            attachments: BTreeMap::new(),
            n_read: 0,
            is_ended: false,
        }
    }

    /// What the recording says of itself, as far as it was read.
    pub(super) const fn facts(&self) -> &BTreeMap<String, String> {
        &self.facts
    }

    /// The files that belong to it, as far as it was read.
    pub(super) const fn attachments(&self) -> &BTreeMap<String, Vec<u8>> {
        &self.attachments
    }

    /// The next sample; `None` at the end.
    pub(super) fn read(&mut self) -> Result<Option<Entry>, RecordingError> {
        loop {
            let Some(event) = self.reader.next_event() else { return Ok(None) };
            match event {
                Ok(LinearReadEvent::ReadRequest(wanted)) => {
                    let read = self.input.read(self.reader.insert(wanted))?;
                    if read == 0 {
                        return self.end();
                    }
                    self.reader.notify_read(read);
                }
                Ok(LinearReadEvent::Record { data, opcode }) => {
                    let record =
                        mcap::parse_record(opcode, data).map_err(|error| broken(self.n_read, &error))?;
                    match record {
                        Record::Channel(channel) => {
                            self.channels.insert(channel.id, Source::of(channel));
                        }
                        Record::Metadata(metadata) if metadata.name == "v2x" => {
                            self.facts = metadata.metadata;
                        }
                        Record::Attachment { header, data, .. } => {
                            self.attachments.insert(header.name, data.into_owned());
                        }
                        Record::Message { header, data } => {
                            if let Some(entry) = entry(&self.channels, &header, &data) {
                                self.n_read += 1;
                                return Ok(Some(entry));
                            }
                        }
                        Record::DataEnd(_) => self.is_ended = true,
                        _ => {}
                    }
                }
                Err(_) if self.is_ended => return Ok(None),
                Err(McapError::UnexpectedEof | McapError::UnexpectedEoc) => return self.end(),
                Err(error) => return Err(broken(self.n_read, &error)),
            }
        }
    }

    /// The input has ended.
    const fn end(&self) -> Result<Option<Entry>, RecordingError> {
        if self.is_ended { Ok(None) } else { Err(RecordingError::Unfinished { index: self.n_read }) }
    }
}

impl Source {
    fn of(channel: Channel) -> Self {
        let encoding = channel.metadata.get(ZENOH_ENCODING).cloned();
        Self { encoding: encoding.unwrap_or(channel.message_encoding), key: channel.topic }
    }
}

/// The sample of a message; `None` of what was added for viewers.
fn entry(channels: &BTreeMap<u16, Source>, header: &MessageHeader, payload: &[u8]) -> Option<Entry> {
    let source = channels.get(&header.channel_id)?;
    if source.key.ends_with(SCENE_SUFFIX) {
        return None;
    }
    Some(Entry {
        received_at: Timestamp::from_nanos(i64::try_from(header.log_time).unwrap_or(i64::MAX)),
        key: source.key.clone(),
        encoding: source.encoding.clone(),
        payload: payload.to_vec(),
    })
}

fn broken(index: usize, error: &McapError) -> RecordingError {
    RecordingError::Broken { index, why: error.to_string() }
}
