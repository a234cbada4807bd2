//! The journal: every call of the core, in order, for those who record it.
//!
//! It is written only while somebody records: a file of the hub's own, or a subscriber that has asked for a start. Its batches
//! leave after each list, so that they cost lists no time.

use super::core::Core;
use super::on_demand::OnDemand;
use super::recorder::Recorder;
use v2x_common::clock;
use v2x_common::id::HubId;
use v2x_common::keys::Keys;
use v2x_common::net::session::MAX_MESSAGE_OF_HUB;
use v2x_common::recording::Entry;
use v2x_common::time::{Span, Timestamp};
use v2x_common::version;
use v2x_common::wire::journal::{self, Body, Call, Item, Start};
use v2x_common::wire::{ENCODING_JSON, ENCODING_POSTCARD, WireError};

/// A batch leaves at the latest when it has this many bytes.
const BATCH_BYTES: usize = 1 << 18;

/// Whoever asks for starts more often gets none.
const STARTED_EVERY: Span = Span::from_millis(500);

/// The journal of one hub.
pub(super) struct Journal {
    stream: OnDemand,
    recorder: Option<Recorder>,
    keys: Keys,
    hub: HubId,
    lineage: u32,
    /// When the newest start was given to subscribers.
    started_at: Timestamp,
    /// Whether the subscribers have a start to go on from.
    is_streamed: bool,
    /// The items that have not left, and their number; the number of the first one.
    batch: Vec<u8>,
    n_batched: u64,
    next: u64,
    /// Whether the hub has warned of a batch that is larger than what other hubs and routers pass on.
    has_warned: bool,
}

impl Journal {
    pub(super) fn new(stream: OnDemand, recorder: Option<Recorder>, keys: Keys, core: &Core) -> Self {
        let engine = &core.settings().engine;
        let mut journal = Self {
            stream,
            recorder,
            keys,
            hub: engine.hub,
            lineage: engine.lineage,
            started_at: Timestamp::MIN,
            is_streamed: false,
            batch: Vec::new(),
            n_batched: 0,
            next: 0,
            has_warned: false,
        };
        if journal.recorder.is_some() {
            journal.write_start(core);
        }
        journal
    }

    /// Goes on with a publisher of another session. Its subscribers ask for a start again.
    pub(super) fn rejoin(&mut self, stream: OnDemand) {
        self.stream = stream;
        self.end_stream();
    }

    /// Nobody follows the stream any more. Calls that nobody records leave a gap in the numbers: whoever comes later, or again, has
    /// to begin with a start.
    fn end_stream(&mut self) {
        if std::mem::take(&mut self.is_streamed) && !self.is_wanted() {
            self.next += 1;
        }
    }

    /// Another hub publishes from now on, and its journal is the one that subscribers get.
    pub(super) async fn withdraw(&mut self) {
        self.flush().await;
        self.end_stream();
    }

    /// Whether anybody records.
    fn is_wanted(&self) -> bool {
        self.is_streamed || self.recorder.is_some()
    }

    /// What becomes of the hub's own recording, for the status.
    pub(super) fn recorder(&self) -> Option<&Recorder> {
        self.recorder.as_ref()
    }

    /// A subscriber has asked for a start: the state of the core, from which its calls lead on. It costs time, so that it is
    /// given no more often than [`STARTED_EVERY`], and only where somebody subscribes.
    pub(super) fn start(&mut self, core: &Core, now: Timestamp) {
        if !self.stream.is_wanted() || now - self.started_at < STARTED_EVERY {
            return;
        }
        self.started_at = now;
        self.is_streamed = true;
        self.write_start(core);
    }

    fn write_start(&mut self, core: &Core) {
        let settings = serde_json::to_string(core.settings()).unwrap_or_default();
        let saved = core.save();
        let why = saved.as_ref().err().map(ToString::to_string);
        self.push(&Item::Start(Start {
            settings: &settings,
            version: version::VERSION,
            commit: version::COMMIT,
            state: saved.as_deref().ok(),
            not_repeatable: why.as_deref(),
        }));
    }

    /// Notes a call that is about to be made, or has just been.
    pub(super) fn note(&mut self, call: &Call<'_>) {
        if !self.is_wanted() {
            return;
        }
        if let Some(recorder) = &mut self.recorder {
            let (key, body) = match call {
                Call::Frame { agent, body, .. } => (self.keys.detections(agent), Some(body)),
                Call::Description { agent, body } => (self.keys.sensor(agent), Some(body)),
                _ => (String::new(), None),
            };
            if let Some((encoding, payload)) = body.and_then(sample) {
                let received_at = clock::now();
                recorder.record(Entry { received_at, key, encoding: encoding.to_owned(), payload });
            }
        }
        self.push(&Item::Call(*call));
    }

    /// Notes a list as it was put.
    pub(super) fn note_list(&mut self, key: impl FnOnce(&Keys, &HubId) -> String, bytes: &[u8]) {
        let Some(recorder) = &mut self.recorder else { return };
        recorder.record(Entry {
            received_at: clock::now(),
            key: key(&self.keys, &self.hub),
            encoding: ENCODING_POSTCARD.to_owned(),
            payload: bytes.to_vec(),
        });
    }

    fn push(&mut self, item: &Item<'_>) {
        if let Err(error) = self.try_push(item) {
            // A gap in the numbers shows it to whoever reads the journal.
            tracing::warn!(%error, "a call is missing in the journal");
            self.batch.clear();
            self.next += self.n_batched + 1;
            self.n_batched = 0;
        }
    }

    fn try_push(&mut self, item: &Item<'_>) -> Result<(), WireError> {
        if self.batch.is_empty() {
            journal::begin(self.lineage, self.next, &mut self.batch)?;
        }
        journal::push(item, &mut self.batch)?;
        self.n_batched += 1;
        Ok(())
    }

    /// Whether a batch is to leave before its time.
    pub(super) fn is_full(&self) -> bool {
        self.batch.len() >= BATCH_BYTES
    }

    /// Starts again where a further file of the hub's own recording began.
    pub(super) fn renew(&mut self, core: &Core) {
        if self.recorder.as_ref().is_some_and(Recorder::takes_start) {
            self.write_start(core);
        }
    }

    /// Sends what was noted.
    pub(super) async fn flush(&mut self) {
        if !self.stream.is_wanted() {
            self.end_stream();
        }
        if self.n_batched == 0 {
            return;
        }
        let batch = std::mem::take(&mut self.batch);
        self.next += std::mem::take(&mut self.n_batched);
        if let Some(recorder) = &mut self.recorder {
            recorder.record(Entry {
                received_at: clock::now(),
                key: self.keys.journal(&self.hub),
                encoding: ENCODING_POSTCARD.to_owned(),
                payload: batch.clone(),
            });
        }
        if self.is_streamed && batch.len() as u64 >= MAX_MESSAGE_OF_HUB && !self.has_warned {
            self.has_warned = true;
            tracing::warn!(
                bytes = batch.len(),
                "the start of the journal is too large for other hubs and routers to pass on: record at this hub, by its own \
                 option --record or connected to it"
            );
        }
        if self.is_streamed
            && let Err(error) = self.stream.put(batch).await
        {
            tracing::warn!(%error, "a part of the journal was not published");
        }
    }

    /// Ends the hub's own recording.
    pub(super) async fn end(&mut self) {
        self.flush().await;
        if let Some(recorder) = self.recorder.take() {
            recorder.end();
        }
    }
}

/// The sample of a payload; `None` of one that was not kept.
fn sample(body: &Body<'_>) -> Option<(&'static str, Vec<u8>)> {
    match body {
        Body::Postcard(bytes) => Some((ENCODING_POSTCARD, bytes.to_vec())),
        Body::Json(bytes) => Some((ENCODING_JSON, bytes.to_vec())),
        Body::TooLarge(_) => None,
    }
}
