//! Knowing when the last task of an agent has ended.

use std::convert::Infallible;
use tokio::sync::mpsc;

/// All tasks that hold a [`TaskToken`].
pub(super) struct TaskGroup {
    // Nothing is ever sent: that the channel closes is the message.
    token: TaskToken,
    gone: mpsc::Receiver<Infallible>,
}

/// Held by a task for as long as it runs.
pub(super) type TaskToken = mpsc::Sender<Infallible>;

/// Held by what starts such tasks, and is not waited for itself.
pub(super) type WeakTaskToken = mpsc::WeakSender<Infallible>;

impl TaskGroup {
    pub(super) fn new() -> Self {
        let (token, gone) = mpsc::channel(1);
        Self { token, gone }
    }

    pub(super) fn token(&self) -> TaskToken {
        self.token.clone()
    }

    /// Waits until no task is left.
    pub(super) async fn gone(self) {
        let Self { token, mut gone } = self;
        drop(token);
        // Closed, as nothing is ever sent.
        let _ = gone.recv().await;
    }
}
