//! Frames in transit over a simulated link, in real time.

use std::sync::{Mutex, MutexGuard, PoisonError};
use tokio::sync::Notify;
use v2x_agent::link::Outbox;
use v2x_common::clock;
use v2x_common::time::Timestamp;

/// Capacity in frames: seconds of delay at a usual rate.
pub(super) const CAPACITY: usize = 4096;

/// Queue of frames that are released when they are due.
pub(super) struct DelayQueue {
    outbox: Mutex<Outbox<Vec<u8>>>,
    changed: Notify,
}

impl DelayQueue {
    pub(super) fn new(reorder: bool) -> Self {
        Self { outbox: Mutex::new(Outbox::new(CAPACITY, reorder)), changed: Notify::new() }
    }

    fn lock(&self) -> MutexGuard<'_, Outbox<Vec<u8>>> {
        // The outbox is consistent after each of its calls, so a panic elsewhere leaves it valid.
        self.outbox.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a frame; `false` if the queue is full.
    pub(super) fn push(&self, due: Timestamp, payload: Vec<u8>) -> bool {
        let mut outbox = self.lock();
        if outbox.len() >= CAPACITY {
            return false;
        }
        outbox.push(due, payload);
        drop(outbox);
        self.changed.notify_one();
        true
    }

    /// The next frame, when it is due. For one reader. Cancel-safe.
    pub(super) async fn next(&self) -> Vec<u8> {
        loop {
            let now = clock::now();
            let (popped, next_due) = {
                let mut outbox = self.lock();
                (outbox.pop_due(now), outbox.next_due())
            };
            if let Some((_, payload)) = popped {
                return payload;
            }
            let due = async {
                match next_due {
                    Some(due) => tokio::time::sleep((due - now).to_duration()).await,
                    None => std::future::pending().await,
                }
            };
            tokio::select! {
                () = due => {}
                () = self.changed.notified() => {}
            }
        }
    }
}
