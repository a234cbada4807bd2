//! Writes samples into an MCAP file: a channel for each key and codec.

use super::entry::Entry;
use super::scene::{SCENE_SCHEMA, SCENE_SCHEMA_NAME};
use crate::keys::Topic;
use crate::schemas;
use crate::time::Timestamp;
use crate::wire::{ENCODING_JSON, ENCODING_POSTCARD, is_json};
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, McapResult, WriteOptions, Writer};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Write;

/// The message encoding of channels with postcard payloads; MCAP's own registry has JSON.
const POSTCARD: &str = "x-v2x-postcard";
/// The key of a channel's metadata under which its Zenoh encoding stands.
pub(super) const ZENOH_ENCODING: &str = "zenoh_encoding";
/// The Zenoh encoding of what is neither JSON nor said to be postcard: none.
const ENCODING_NONE: &str = "zenoh/bytes";
/// Channels of one file, one of which is for all further keys. MCAP has room for 65,535, and any agent can send under many keys.
const MAX_CHANNELS: usize = 4096;
/// Longest key with a channel of its own.
const MAX_KEY_BYTES: usize = 512;
/// The topic of that channel: no key of ours.
const UNSORTED: &str = "v2x-unsorted";
/// Bytes of a chunk, beyond which the next one begins.
const CHUNK_BYTES: u64 = 1 << 20;

/// Writes an MCAP file.
pub(super) struct McapWriter<W: Write> {
    writer: Writer<NoSeek<W>>,
    /// By key and encoding: the channel, and the number of its next message.
    channels: BTreeMap<(String, &'static str), (u16, u32)>,
    /// Messages without a channel of their own.
    unsorted: u64,
}

/// What kind of messages a channel has.
struct ChannelKind<'a> {
    topic: &'a str,
    /// One of three, as hubs see it: whoever sends can call it anything.
    encoding: &'static str,
    schema: Schema<'a>,
}

/// A schema: its name, its language, and its text.
struct Schema<'a>(&'a str, &'a str, &'a str);

impl<W: Write> McapWriter<W> {
    pub(super) fn new(
        out: W,
        facts: &BTreeMap<String, String>,
        attachments: &BTreeMap<String, Vec<u8>>,
    ) -> McapResult<Self> {
        let options = WriteOptions::new()
            .compression(None)
            .chunk_size(Some(CHUNK_BYTES))
            // A chunk is written whole: a recorder that is killed leaves no half one with a wrong length.
            .disable_seeking(true)
            .library(concat!("v2x ", env!("CARGO_PKG_VERSION")));
        let writer = options.create(NoSeek::new(out))?;
        let mut writer = Self { writer, channels: BTreeMap::new(), unsorted: 0 };
        writer.write_facts("v2x", facts.clone())?;
        for (name, data) in attachments {
            writer.writer.attach(&Attachment {
                log_time: 0,
                create_time: 0,
                name: name.clone(),
                media_type: media_type(name).to_owned(),
                data: Cow::Borrowed(data),
            })?;
        }
        Ok(writer)
    }

    /// Writes metadata of this name.
    pub(super) fn write_facts(&mut self, name: &str, facts: BTreeMap<String, String>) -> McapResult<()> {
        self.writer.write_metadata(&Metadata { name: name.to_owned(), metadata: facts })
    }

    /// Appends a sample.
    pub(super) fn write(&mut self, entry: &Entry) -> McapResult<()> {
        let is_json = is_json(&entry.encoding, &entry.payload);
        let encoding = match entry.encoding.as_str() {
            _ if is_json => ENCODING_JSON,
            ENCODING_POSTCARD => ENCODING_POSTCARD,
            _ => ENCODING_NONE,
        };
        let schema = schema_of(Topic::of(&entry.key), is_json);
        let kind = ChannelKind { topic: &entry.key, encoding, schema };
        if self.has_room(&kind) {
            return self.append(&kind, entry.received_at, &entry.payload);
        }
        self.unsorted += 1;
        let kind = ChannelKind { topic: UNSORTED, encoding: ENCODING_NONE, schema: schema_of(None, false) };
        self.append(&kind, entry.received_at, &entry.payload)
    }

    /// Appends a message of Foxglove's schema `SceneUpdate`, where there is room for its topic.
    pub(super) fn write_scene(&mut self, topic: &str, at: Timestamp, json: &[u8]) -> McapResult<()> {
        let schema = Schema(SCENE_SCHEMA_NAME, "jsonschema", SCENE_SCHEMA);
        let kind = ChannelKind { topic, encoding: ENCODING_JSON, schema };
        if self.has_room(&kind) { self.append(&kind, at, json) } else { Ok(()) }
    }

    /// Messages without a channel of their own.
    pub(super) const fn unsorted(&self) -> u64 {
        self.unsorted
    }

    /// Whether a message has a channel of its own, or can have one.
    fn has_room(&self, kind: &ChannelKind<'_>) -> bool {
        kind.topic.len() <= MAX_KEY_BYTES
            && (self.channels.len() < MAX_CHANNELS - 1
                || self.channels.contains_key(&(kind.topic.to_owned(), kind.encoding)))
    }

    fn append(&mut self, kind: &ChannelKind<'_>, at: Timestamp, payload: &[u8]) -> McapResult<()> {
        let (channel_id, sequence) = self.channel(kind)?;
        let nanos = u64::try_from(at.as_nanos()).unwrap_or(0);
        let header = MessageHeader { channel_id, sequence, log_time: nanos, publish_time: nanos };
        self.writer.write_to_known_channel(&header, payload)
    }

    /// The channel, and the number of its next message.
    fn channel(&mut self, kind: &ChannelKind<'_>) -> McapResult<(u16, u32)> {
        let ChannelKind { topic, encoding, schema: Schema(name, language, text) } = kind;
        let key = ((*topic).to_owned(), *encoding);
        if let Some((channel, next)) = self.channels.get_mut(&key) {
            let sequence = *next;
            *next = next.wrapping_add(1);
            return Ok((*channel, sequence));
        }
        let schema = self.writer.add_schema(name, language, text.as_bytes())?;
        let message_encoding = if *encoding == ENCODING_JSON { "json" } else { POSTCARD };
        let metadata = BTreeMap::from([(ZENOH_ENCODING.to_owned(), (*encoding).to_owned())]);
        let channel = self.writer.add_channel(schema, topic, message_encoding, &metadata)?;
        self.channels.insert(key, (channel, 1));
        Ok((channel, 0))
    }

    /// Ends the chunk: what was written before is readable whatever happens now.
    pub(super) fn flush(&mut self) -> McapResult<()> {
        self.writer.flush()
    }

    /// Writes the index and the end.
    pub(super) fn finish(&mut self) -> McapResult<()> {
        self.writer.finish().map(drop)
    }
}

/// By the end of a file's name.
fn media_type(name: &str) -> &'static str {
    match name.rsplit_once('.') {
        Some((_, "toml")) => "application/toml",
        Some((_, "csv")) => "text/csv",
        Some((_, "xml")) => "application/xml",
        Some((_, "json")) => ENCODING_JSON,
        _ => "application/octet-stream",
    }
}

/// The schema of a topic's payloads: of JSON the shipped one, of postcard only its name.
fn schema_of(topic: Option<Topic>, is_json: bool) -> Schema<'static> {
    let (name, json) = match topic {
        Some(Topic::Detections(_)) => ("v2x.DetectionFrame", schemas::DETECTION_FRAME),
        Some(Topic::Sensor(_)) => ("v2x.SensorDescription", schemas::SENSOR_DESCRIPTION),
        Some(Topic::Fused(_) | Topic::Lagged(_) | Topic::Tile(..)) => {
            ("v2x.FusedFrame", schemas::FUSED_FRAME)
        }
        Some(Topic::Delta(_)) => ("v2x.DeltaFrame", schemas::DELTA_FRAME),
        Some(Topic::Journal(_)) => ("v2x.Journal", ""),
        Some(Topic::Truth(_)) => ("v2x.Truth", r#"{"type":"object"}"#),
        Some(Topic::AgentAlive(_)) | None => ("v2x.Other", r#"{"type":"object"}"#),
    };
    if is_json && !json.is_empty() { Schema(name, "jsonschema", json) } else { Schema(name, "", "") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_without_an_encoding_is_labelled_as_json_and_what_is_none_on_the_same_key_is_not() {
        let mut file = Vec::new();
        let mut writer = McapWriter::new(&mut file, &BTreeMap::new(), &BTreeMap::new()).unwrap();
        let entry = |encoding: &str, payload: &[u8]| Entry {
            received_at: Timestamp::EPOCH,
            key: "v2x/demo/agent/cam/detections".into(),
            encoding: encoding.into(),
            payload: payload.to_vec(),
        };
        for (encoding, payload) in [
            ("zenoh/bytes", &b"{}"[..]),
            ("zenoh/bytes", &[1, 2]),
            ("text/json", b"{}"),
            ("zenoh/string", b"{"),
        ] {
            writer.write(&entry(encoding, payload)).unwrap();
        }
        writer.finish().unwrap();
        drop(writer);
        let messages = mcap::MessageStream::new(&file).unwrap().map(Result::unwrap);
        let labels: Vec<_> = messages.map(|one| one.channel.message_encoding.clone()).collect();
        assert_eq!(labels, ["json", POSTCARD, "json", "json"]);
    }

    #[test]
    fn a_flood_of_encodings_and_keys_ends_no_recording_and_hides_no_key_that_was_there_before() {
        let mut file = Vec::new();
        let mut writer = McapWriter::new(&mut file, &BTreeMap::new(), &BTreeMap::new()).unwrap();
        let mut write = |key: String, encoding: String, payload: &[u8]| {
            let entry = Entry { received_at: Timestamp::EPOCH, key, encoding, payload: payload.to_vec() };
            writer.write(&entry).unwrap();
            (writer.channels.len(), writer.unsorted)
        };
        let key = || "v2x/demo/agent/cam/detections".to_owned();
        for k in 0..70_000 {
            assert!(write(key(), format!("text/x;{k}"), &[7]).0 == 1);
        }
        assert_eq!(write(key(), "text/x".to_owned(), b"{}"), (2, 0));
        assert_eq!(write(key(), ENCODING_POSTCARD.to_owned(), b"{}"), (3, 0));
        assert_eq!(write("v2x/".repeat(200), String::new(), b"{}"), (4, 1), "a key that is too long");
        for k in 0..70_000 {
            assert!(write(format!("v2x/demo/agent/cam/{k}"), String::new(), &[7]).0 <= MAX_CHANNELS);
        }
        let (channels, unsorted) = write(key(), String::new(), &[7]);
        assert_eq!(channels, MAX_CHANNELS - 1);
        assert!(unsorted > 60_000 && write(key(), String::new(), &[7]).1 == unsorted);
        writer.finish().unwrap();
        drop(writer);
        let messages = mcap::MessageStream::new(&file).unwrap().map(Result::unwrap);
        let of_cam = messages.filter(|one| one.channel.topic == key()).count();
        assert_eq!(of_cam, 70_004);
    }
}
