//! What the hubs say of themselves, asked about once a second beside everything else.

use std::time::Duration;
use tokio::sync::mpsc::{Receiver, channel};
use tokio::task::JoinHandle;
use v2x_common::id::{HubId, NetworkId};
use v2x_fusion_hub::hub::HubStatus;
use v2x_lab::loopback::consumer::Consumer;
use v2x_lab::loopback::hub_status;

/// Time from an answer to the next question.
const PAUSE: Duration = Duration::from_secs(1);

/// The questions and their answers. Dropping it ends the questions.
pub(super) struct Statuses {
    answers: Receiver<Vec<HubStatus>>,
    questions: JoinHandle<()>,
}

impl Statuses {
    /// Begins to ask.
    pub(super) fn ask(consumer: &Consumer, network: NetworkId, hub: Option<HubId>) -> Self {
        let (sender, answers) = channel(1);
        let session = consumer.session().clone();
        let questions = tokio::spawn(async move {
            loop {
                match hub_status::query_of(&session, network, hub).await {
                    Ok(statuses) => {
                        if sender.send(statuses).await.is_err() {
                            return;
                        }
                    }
                    // The table says itself when a hub is silent.
                    Err(error) => tracing::debug!(%error, "no status"),
                }
                tokio::time::sleep(PAUSE).await;
            }
        });
        Self { answers, questions }
    }

    /// The next answer. Cancel-safe.
    pub(super) async fn next(&mut self) -> Vec<HubStatus> {
        match self.answers.recv().await {
            Some(statuses) => statuses,
            // The questions have ended, which they do only with this value or by a panic.
            None => std::future::pending().await,
        }
    }

    /// An answer that has come, if there is one.
    pub(super) fn try_next(&mut self) -> Option<Vec<HubStatus>> {
        self.answers.try_recv().ok()
    }
}

impl Drop for Statuses {
    fn drop(&mut self) {
        self.questions.abort();
    }
}
