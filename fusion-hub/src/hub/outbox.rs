//! Work that may wait for somebody else, on a thread of its own.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// When so many items or bytes wait, there is no room for more work.
const ITEMS: usize = 64;
const BYTES: usize = 64 << 20;
/// Items that are taken all the same, because they are to be dropped somewhere.
const MOST_ITEMS: usize = 4096;

/// Delivers items, each of which may block the thread for seconds. To put one never waits.
///
/// It is one thread: in Zenoh 1.10 a second one that waits for the same connection goes on waiting when that is closed, and
/// everything else with it.
pub(super) struct Outbox<T> {
    shared: Arc<Shared<T>>,
}

struct Shared<T> {
    waiting: Mutex<Waiting<T>>,
    arrived: Condvar,
}

struct Waiting<T> {
    items: VecDeque<(T, usize)>,
    bytes: usize,
    is_over: bool,
}

impl<T> Shared<T> {
    fn lock(&self) -> MutexGuard<'_, Waiting<T>> {
        // The state is consistent between any two statements: a poisoned lock is safe to use.
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The next item, waiting for one; `None` at the end.
    fn next(&self) -> Option<T> {
        let mut waiting = self.lock();
        loop {
            if waiting.is_over {
                return None;
            }
            if let Some((item, bytes)) = waiting.items.pop_front() {
                waiting.bytes -= bytes;
                return Some(item);
            }
            waiting = self.arrived.wait(waiting).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

impl<T: Send + 'static> Outbox<T> {
    /// Each item is given to `deliver`, in the order in which they were put.
    pub(super) fn new(deliver: impl Fn(T) + Send + 'static) -> Self {
        let waiting = Mutex::new(Waiting { items: VecDeque::new(), bytes: 0, is_over: false });
        let shared = Arc::new(Shared { waiting, arrived: Condvar::new() });
        let queue = shared.clone();
        // It is not waited for at the end: it may still wait for whoever reads nothing.
        std::thread::spawn(move || {
            while let Some(item) = queue.next() {
                deliver(item);
            }
        });
        Self { shared }
    }

    /// Whether there is no room for more work.
    pub(super) fn is_full(&self) -> bool {
        let waiting = self.shared.lock();
        waiting.items.len() >= ITEMS || waiting.bytes >= BYTES
    }

    /// Puts an item of so many bytes, without waiting. Whoever puts it has seen that there is room.
    pub(super) fn push(&self, item: T, bytes: usize) {
        let mut waiting = self.shared.lock();
        waiting.items.push_back((item, bytes));
        waiting.bytes += bytes;
        drop(waiting);
        self.shared.arrived.notify_one();
    }

    /// The same of what is only to be dropped, where there is room or not; gives it back where far too many wait.
    pub(super) fn push_rest(&self, item: T, bytes: usize) -> Result<(), T> {
        let waiting = self.shared.lock();
        if waiting.items.len() >= MOST_ITEMS || waiting.bytes >= BYTES {
            return Err(item);
        }
        drop(waiting);
        self.push(item, bytes);
        Ok(())
    }
}

impl<T> Drop for Outbox<T> {
    fn drop(&mut self) {
        self.shared.lock().is_over = true;
        self.shared.arrived.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;
    use std::time::Duration;

    const PATIENCE: Duration = Duration::from_secs(60);

    #[test]
    fn a_fault_of_one_who_takes_nothing_does_not_stop_whoever_puts_and_others_get_theirs_after_it() {
        let (delivered, arrivals) = channel();
        let (release, blocked) = channel::<()>();
        let outbox = Outbox::new(move |item: usize| {
            if item == 0 {
                let _ = blocked.recv();
            }
            let _ = delivered.send(item);
        });
        (0..=40).for_each(|item| outbox.push(item, 1));
        drop(release);
        let arrived: Vec<_> = (0..=40).map(|_| arrivals.recv_timeout(PATIENCE).unwrap()).collect();
        assert_eq!(arrived, (0..=40).collect::<Vec<_>>());
    }

    #[test]
    fn a_flood_of_items_and_of_bytes_is_bounded() {
        let (release, blocked) = channel::<()>();
        let (begun, begins) = channel();
        let outbox = Outbox::new(move |_: usize| {
            let _ = begun.send(());
            let _ = blocked.recv();
        });
        outbox.push(0, BYTES);
        begins.recv_timeout(PATIENCE).unwrap();
        assert!(!outbox.is_full(), "what is being delivered does not wait");
        (0..ITEMS).for_each(|item| outbox.push(item, 0));
        assert!(outbox.is_full(), "by their number");
        (ITEMS..MOST_ITEMS).for_each(|item| outbox.push_rest(item, 0).unwrap());
        assert_eq!(outbox.push_rest(7, 0), Err(7));
        drop(release);
        (0..MOST_ITEMS).for_each(|_| begins.recv_timeout(PATIENCE).unwrap());
        assert!(!outbox.is_full());
    }
}
