//! Knowing when the last task of an agent has ended.

use std::convert::Infallible;
use tokio::sync::mpsc;

/// All tasks that hold a [`Member`].
pub(super) struct Crew {
    // Nothing is ever sent: that the channel closes is the message.
    member: Member,
    gone: mpsc::Receiver<Infallible>,
}

/// Held by a task for as long as it runs.
pub(super) type Member = mpsc::Sender<Infallible>;

/// Held by what starts such tasks, and is not waited for itself.
pub(super) type Recruiter = mpsc::WeakSender<Infallible>;

impl Crew {
    pub(super) fn new() -> Self {
        let (member, gone) = mpsc::channel(1);
        Self { member, gone }
    }

    pub(super) fn member(&self) -> Member {
        self.member.clone()
    }

    /// Waits until no task is left.
    pub(super) async fn gone(self) {
        let Self { member, mut gone } = self;
        drop(member);
        // Closed, as nothing is ever sent.
        let _ = gone.recv().await;
    }
}
