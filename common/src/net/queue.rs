//! A bounded queue between a Zenoh callback and a task: when full, the oldest item is dropped and counted.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use tokio::sync::Notify;

/// Drops the oldest item when full: an old sensor frame is worth less than a new one.
#[derive(Debug)]
pub struct DropOldestQueue<T> {
    state: Mutex<State<T>>,
    arrived: Notify,
    capacity: usize,
}

#[derive(Debug)]
struct State<T> {
    items: VecDeque<T>,
    received: u64,
    dropped: u64,
}

/// What has come into a queue, and where it is: `received` is what was taken out and the sum of the others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct QueueCounts {
    /// Items that were put.
    pub received: u64,
    /// Items that wait.
    pub waiting: u64,
    /// Items that were dropped, the queue being full.
    pub dropped: u64,
}

impl<T> DropOldestQueue<T> {
    /// Holds at most `capacity` items.
    pub fn new(capacity: usize) -> Self {
        // Not allocated for its capacity: memory use would grow for minutes while the buffer is first filled.
        let state = State { items: VecDeque::new(), received: 0, dropped: 0 };
        Self { state: Mutex::new(state), arrived: Notify::new(), capacity: capacity.max(1) }
    }

    fn lock(&self) -> MutexGuard<'_, State<T>> {
        // The state is consistent between any two statements: a poisoned lock is safe to use.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts an item at the end, from any thread, without waiting.
    pub fn push(&self, item: T) {
        // Dropped here, when the queue is free again.
        let _dropped = self.push_displacing(item);
    }

    /// The same; the oldest item, where it is dropped for this one.
    pub fn push_displacing(&self, item: T) -> Option<T> {
        let mut state = self.lock();
        state.received += 1;
        let displaced = if state.items.len() >= self.capacity { state.items.pop_front() } else { None };
        state.dropped += u64::from(displaced.is_some());
        state.items.push_back(item);
        drop(state);
        self.arrived.notify_one();
        displaced
    }

    /// The first item, if there is one.
    pub fn try_pop(&self) -> Option<T> {
        self.lock().items.pop_front()
    }

    /// The first item, waiting for one. Cancelling does not lose an item.
    pub async fn pop(&self) -> T {
        loop {
            if let Some(item) = self.try_pop() {
                return item;
            }
            self.arrived.notified().await;
        }
    }

    /// Waits until there is an item, without removing it. For one reader.
    pub async fn wait(&self) {
        while self.lock().items.is_empty() {
            self.arrived.notified().await;
        }
    }

    /// Whether nothing waits.
    pub fn is_empty(&self) -> bool {
        self.lock().items.is_empty()
    }

    /// What has come, at one moment.
    pub fn counts(&self) -> QueueCounts {
        let state = self.lock();
        QueueCounts { received: state.received, waiting: state.items.len() as u64, dropped: state.dropped }
    }

    /// Number of dropped items.
    pub fn dropped(&self) -> u64 {
        self.lock().dropped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_queue_drops_the_oldest_item_and_counts_it() {
        let queue = DropOldestQueue::new(2);
        for item in 0..5 {
            queue.push(item);
        }
        assert_eq!((queue.try_pop(), queue.try_pop(), queue.try_pop()), (Some(3), Some(4), None));
        assert_eq!(queue.dropped(), 3);
        queue.push(5);
        assert_eq!(queue.counts(), QueueCounts { received: 6, waiting: 1, dropped: 3 });
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_push_wakes_a_waiting_reader() {
        let queue = std::sync::Arc::new(DropOldestQueue::new(2));
        let reader = tokio::spawn({
            let queue = queue.clone();
            async move { queue.pop().await }
        });
        queue.push(7);
        assert_eq!(reader.await.unwrap(), 7);
    }
}
