//! The hub's own recording: a thread of its own writes the file, so that a slow disk stops nothing.

use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
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

#[derive(Debug, Default)]
struct State {
    bytes: AtomicU64,
    /// A further file began, which has no start of the journal yet.
    wants_start: AtomicBool,
    /// Why nothing is written any more.
    error: Mutex<Option<String>>,
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
                tracing::error!(%error, "the recording ends here; the hub goes on");
                *shared.error.lock().unwrap_or_else(std::sync::PoisonError::into_inner) =
                    Some(error.to_string());
            }
        });
        Self { queue, thread, state, dropped: 0 }
    }

    /// Records a sample; where the disk is too slow, it is left out and counted.
    pub(super) fn record(&mut self, entry: Entry) {
        if let Err(TrySendError::Full(_)) = self.queue.try_send(entry) {
            self.dropped += 1;
            if self.dropped.is_power_of_two() {
                tracing::warn!(dropped = self.dropped, "the disk is too slow for the recording");
            }
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
        self.state.error.lock().unwrap_or_else(std::sync::PoisonError::into_inner).clone()
    }

    /// Writes what waits, and ends the file.
    pub(super) fn end(self) {
        drop(self.queue);
        if self.thread.join().is_err() {
            tracing::error!("the recording's thread broke");
        }
    }
}

fn write_all(mut file: RecordingFile, samples: &Receiver<Entry>, state: &State) -> Result<(), FileError> {
    loop {
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
