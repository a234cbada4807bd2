//! The hub's own recording: a thread of its own writes the file, so that a slow disk stops nothing.

use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;
use v2x_common::clock;
use v2x_common::recording::{Entry, FileError, RecordingFile};

/// Samples that may wait for the disk.
const WAITING: usize = 1 << 14;
/// What waits for no further sample is readable after this.
const FLUSHED_EVERY: Duration = Duration::from_millis(500);

/// Writes samples into a file.
pub(super) struct Recorder {
    queue: SyncSender<Entry>,
    thread: JoinHandle<()>,
    state: Arc<State>,
    /// Samples for which the disk was too slow.
    dropped: u64,
}

/// The status of a hub's own recording.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecordingStatus {
    /// Bytes written.
    pub bytes: u64,
    /// Samples for which the disk was too slow.
    pub dropped: u64,
    /// Why nothing is written any more, where that is so.
    pub error: Option<String>,
}

impl RecordingStatus {
    pub(super) fn of(recorder: &Recorder) -> Self {
        Self { bytes: recorder.bytes(), dropped: recorder.dropped(), error: recorder.error() }
    }
}

#[derive(Debug, Default)]
struct State {
    bytes: AtomicU64,
    /// A further file began, which has no start of the journal yet.
    wants_start: AtomicBool,
    /// Why nothing is written any more.
    error: Mutex<Option<String>>,
}

/// Why nothing is written where the thread ended without a word.
const BROKEN: &str = "the recording's thread broke";

impl State {
    /// Nothing is written any more, for this reason; the first one counts.
    fn end_by(&self, why: &str) {
        let mut error = self.error.lock().unwrap_or_else(PoisonError::into_inner);
        if error.is_none() {
            tracing::error!(error = why, "the recording ends here; the hub goes on");
            *error = Some(why.to_owned());
        }
    }
}

impl Recorder {
    /// Writes into this file from now on.
    pub(super) fn begin(file: RecordingFile) -> Self {
        tracing::info!(file = %file.path().display(), "recording");
        let (queue, samples) = sync_channel(WAITING);
        let state = Arc::new(State::default());
        let shared = state.clone();
        let thread = std::thread::spawn(move || {
            if let Err(error) = write_all(file, &samples, &shared) {
                shared.end_by(&error.to_string());
            }
        });
        Self { queue, thread, state, dropped: 0 }
    }

    /// Records a sample; where the disk is too slow, it is left out and counted.
    pub(super) fn record(&mut self, entry: Entry) {
        match self.queue.try_send(entry) {
            Ok(()) => {}
            Err(TrySendError::Full(_)) => {
                self.dropped += 1;
                if self.dropped.is_power_of_two() {
                    tracing::warn!(dropped = self.dropped, "the disk is too slow for the recording");
                }
            }
            // It says why before it ends, unless it broke.
            Err(TrySendError::Disconnected(_)) => self.state.end_by(BROKEN),
        }
    }

    /// Whether a further file began since this was asked last: it needs a start of the journal.
    pub(super) fn takes_start(&self) -> bool {
        self.state.wants_start.swap(false, Ordering::Relaxed)
    }

    /// Bytes written.
    pub(super) fn bytes(&self) -> u64 {
        self.state.bytes.load(Ordering::Relaxed)
    }

    /// Samples for which the disk was too slow.
    pub(super) const fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Why nothing is written any more, where that is so.
    pub(super) fn error(&self) -> Option<String> {
        self.state.error.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Writes what waits, and ends the file.
    pub(super) fn end(self) {
        drop(self.queue);
        if self.thread.join().is_err() {
            self.state.end_by(BROKEN);
        }
    }
}

fn write_all(mut file: RecordingFile, samples: &Receiver<Entry>, state: &State) -> Result<(), FileError> {
    let mut has_warned = false;
    loop {
        if file.unsorted() > 0 && !std::mem::replace(&mut has_warned, true) {
            tracing::warn!(
                "samples come under too many keys: those of further ones are recorded without them"
            );
        }
        match samples.recv_timeout(FLUSHED_EVERY) {
            Ok(entry) => {
                if file.write(&entry)? {
                    tracing::info!(file = %file.path().display(), "a further file of the recording begins");
                    state.wants_start.store(true, Ordering::Relaxed);
                }
            }
            Err(RecvTimeoutError::Timeout) => file.flush(clock::now())?,
            Err(RecvTimeoutError::Disconnected) => return file.finish(),
        }
        state.bytes.store(file.bytes(), Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::time::Timestamp;

    #[test]
    fn a_fault_that_ends_the_recordings_thread_is_an_error_that_the_status_shows() {
        let (queue, samples) = sync_channel(1);
        // As after a panic: it took its end of the queue along, and said nothing.
        drop(samples);
        let thread = std::thread::spawn(|| {});
        let mut recorder = Recorder { queue, thread, state: Arc::default(), dropped: 0 };
        assert_eq!(recorder.error(), None);
        recorder.record(Entry {
            received_at: Timestamp::EPOCH,
            key: String::new(),
            encoding: String::new(),
            payload: Vec::new(),
        });
        assert_eq!((recorder.error().as_deref(), recorder.dropped()), (Some(BROKEN), 0));
        recorder.state.end_by("later");
        assert_eq!(recorder.error().as_deref(), Some(BROKEN));
    }
}
