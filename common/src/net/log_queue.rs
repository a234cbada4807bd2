//! A thread that writes what is logged: whoever reads logs slowly, or no more, stops nobody who logs. A terminal that is held by Ctrl-S, a pager,
//! and a supervisor that stands still read nothing, and a pipe is full after 64 KiB.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

/// Messages that wait; what is logged while there are so many is left out, and counted.
const WAITING: usize = 1024;

/// What waits to be written.
pub(super) struct LogQueue(Arc<Shared>);

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    /// Something was put, or was written.
    changed: Condvar,
}

#[derive(Default)]
struct State {
    messages: VecDeque<Vec<u8>>,
    is_writing: bool,
    left_out: u64,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        // The state is consistent between any two statements: a poisoned lock is safe to use.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Until the process ends.
    fn write_all(&self, mut out: impl Write) {
        loop {
            let waits = |state: &mut State| state.messages.is_empty();
            let mut state =
                self.changed.wait_while(self.lock(), waits).unwrap_or_else(PoisonError::into_inner);
            let message = state.messages.pop_front().unwrap_or_default();
            state.is_writing = true;
            drop(state);
            // A closed standard error is no fault of whoever logs.
            let _ = out.write_all(&message);
            let left_out = {
                let mut state = self.lock();
                state.is_writing = false;
                std::mem::take(&mut state.left_out)
            };
            self.changed.notify_all();
            if left_out > 0 {
                tracing::warn!(
                    messages = left_out,
                    "nobody has read the log in time: messages were left out"
                );
            }
        }
    }
}

impl LogQueue {
    /// Writes to this from now on.
    pub(super) fn begin(out: impl Write + Send + 'static) -> io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let of_thread = shared.clone();
        thread::Builder::new().name("log".to_owned()).spawn(move || of_thread.write_all(out))?;
        Ok(Self(shared))
    }

    /// Puts a message, which is left out where too many wait.
    pub(super) fn put(&self, message: &[u8]) {
        let mut state = self.0.lock();
        if state.messages.len() < WAITING {
            state.messages.push_back(message.to_vec());
        } else {
            state.left_out += 1;
        }
        drop(state);
        self.0.changed.notify_all();
    }

    /// Waits until all is written, for no longer than this.
    pub(super) fn flush(&self, within: Duration) {
        let waits = |state: &mut State| state.is_writing || !state.messages.is_empty();
        drop(self.0.changed.wait_timeout_while(self.0.lock(), within, waits));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

    /// A reader that takes each message only when it is asked to.
    struct Slow(SyncSender<Vec<u8>>);

    impl Write for Slow {
        fn write(&mut self, message: &[u8]) -> io::Result<usize> {
            self.0.send(message.to_vec()).map_err(|_| io::ErrorKind::BrokenPipe)?;
            Ok(message.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn slow() -> (LogQueue, Receiver<Vec<u8>>) {
        let (out, read) = sync_channel(0);
        (LogQueue::begin(Slow(out)).unwrap(), read)
    }

    #[test]
    fn a_flood_of_messages_that_nobody_reads_stops_nobody_who_logs_and_is_bounded() {
        let (queue, read) = slow();
        for number in 0..3 * WAITING {
            queue.put(number.to_string().as_bytes());
        }
        queue.flush(Duration::from_millis(1));
        let mut seen = Vec::new();
        while seen.len() < WAITING {
            seen.push(read.recv().unwrap());
        }
        assert_eq!(seen[..2], [b"0".to_vec(), b"1".to_vec()], "in their order, the first ones");
        // One was perhaps on its way to the reader while the others waited.
        let state = queue.0.lock();
        assert!(state.messages.len() <= 1, "{}", state.messages.len());
    }

    #[test]
    fn a_fault_of_the_reader_of_logs_ends_neither_those_who_log_nor_a_flush() {
        let (queue, read) = slow();
        drop(read);
        queue.put(b"message");
        queue.flush(Duration::from_secs(60));
        assert!(queue.0.lock().messages.is_empty());
    }
}
