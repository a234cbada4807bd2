//! Waiting for the end of all tasks of the agents.

use std::convert::Infallible;
use tokio::sync::mpsc;

/// Waits for all tasks that hold a [`TaskToken`].
pub(super) struct TaskGroup {
    // Nothing is sent on the channel. It closes when the last token is dropped.
    token: TaskToken,
    gone: mpsc::Receiver<Infallible>,
}

/// Held by a task while it runs.
pub(super) type TaskToken = mpsc::Sender<Infallible>;

/// Held by the owner that starts tasks. It is not waited for.
pub(super) type WeakTaskToken = mpsc::WeakSender<Infallible>;

impl TaskGroup {
    pub(super) fn new() -> Self {
        let (token, gone) = mpsc::channel(1);
        Self { token, gone }
    }

    pub(super) fn token(&self) -> TaskToken {
        self.token.clone()
    }

    /// Waits until all tasks have ended.
    pub(super) async fn gone(self) {
        let Self { token, mut gone } = self;
        drop(token);
        // Returns when the channel is closed, since nothing is sent.
        let _ = gone.recv().await;
    }
}
