//! The processes of a running network.

use serde_json::Value;
use std::collections::BTreeMap;
use std::future::poll_fn;
use std::path::Path;
use std::task::Poll;
use v2x_agent::scenario::Scenario;
use v2x_common::id::AgentId;
use v2x_common::time::Timestamp;
use v2x_fusion_hub::hub::HubStatus;
use v2x_lab::loopback::{AgentOptions, Child, ChildError, HubOptions, Launcher};

/// A hub and the agents of a scenario, each a process.
pub(crate) struct Network {
    pub(crate) hub: Child,
    pub(crate) locator: String,
    pub(crate) agents: Vec<(AgentId, Child)>,
}

/// What a network's processes said at their end.
#[derive(Debug, Default)]
pub(crate) struct LastWords {
    pub(crate) frames_sent: BTreeMap<AgentId, u64>,
    pub(crate) hub: Option<HubStatus>,
    pub(crate) failures: Vec<String>,
}

/// What every agent of a run is given.
pub(crate) struct AgentsOfRun<'a> {
    pub(crate) scenario: &'a Scenario,
    pub(crate) file: &'a Path,
    pub(crate) seed: u64,
    pub(crate) start: Timestamp,
}

impl Network {
    /// Starts the hub.
    pub(crate) async fn start_hub(
        launcher: &Launcher,
        listen: &str,
        config: &Path,
    ) -> Result<Self, ChildError> {
        let options = HubOptions {
            listen: listen.to_owned(),
            config: Some(config.to_owned()),
            ..HubOptions::default()
        };
        let (hub, locator) = launcher.hub(&options).await?;
        Ok(Self { hub, locator, agents: Vec::new() })
    }

    /// Starts every agent of the scenario.
    pub(crate) async fn start_agents(
        &mut self,
        launcher: &Launcher,
        run: &AgentsOfRun<'_>,
    ) -> Result<(), ChildError> {
        let options = AgentOptions {
            scenario: run.file.to_owned(),
            connect: self.locator.clone(),
            seed: run.seed,
            start: run.start,
        };
        for agent in &run.scenario.agents {
            self.agents.push((agent.id(), launcher.agent(&agent.id(), &options).await?));
        }
        Ok(())
    }

    /// Waits until a process ends that should go on; gives its error.
    pub(crate) async fn first_death(&mut self) -> ChildError {
        let children = std::iter::once(&mut self.hub).chain(self.agents.iter_mut().map(|(_, child)| child));
        let mut silences: Vec<_> = children.map(|child| Box::pin(silence(child))).collect();
        let dead = poll_fn(|context| {
            let mut polled = silences.iter_mut().map(|silence| silence.as_mut().poll(context));
            polled.find(Poll::is_ready).unwrap_or(Poll::Pending)
        });
        let dead = dead.await;
        drop(silences);
        dead.ended_before("told to end").await
    }

    /// Ends all agents, so that what they have sent can still be fused.
    pub(crate) async fn end_agents(&mut self, words: &mut LastWords) {
        self.agents.iter_mut().for_each(|(_, child)| child.ask_to_end());
        for (id, child) in std::mem::take(&mut self.agents) {
            if let Some(said) = end(child, words).await
                && let Some(sent) = said["frames_sent"].as_u64()
            {
                words.frames_sent.insert(id, sent);
            }
        }
    }

    /// Ends the hub.
    pub(crate) async fn end_hub(self, words: &mut LastWords) {
        if let Some(mut said) = end(self.hub, words).await {
            match serde_json::from_value::<HubStatus>(said["status"].take()) {
                Ok(status) => {
                    if status.dropped_overload > 0 {
                        words.failures.push(format!(
                            "the hub could not keep up: {} samples were dropped",
                            status.dropped_overload
                        ));
                    }
                    words.hub = Some(status);
                }
                Err(error) => words.failures.push(format!("the hub's last status is unreadable: {error}")),
            }
        }
    }
}

/// Waits until a child says nothing any more.
async fn silence(child: &mut Child) -> &mut Child {
    while child.next_event().await.is_some() {}
    child
}

/// Ends a child and notes it where that did not go well; gives what it said last.
async fn end(child: Child, words: &mut LastWords) -> Option<Value> {
    let name = child.name().to_owned();
    match child.end("stopped").await {
        Ok((status, said)) => {
            if !status.success() {
                words.failures.push(format!("{name} ended with {status}"));
            } else if said.is_none() {
                words.failures.push(format!("{name} ended without a report"));
            }
            said
        }
        Err(error) => {
            words.failures.push(error.to_string());
            None
        }
    }
}

/// Ends the consumer, and notes what it says it dropped.
pub(crate) async fn end_consumer(child: Child, words: &mut LastWords) {
    if let Some(said) = end(child, words).await {
        let dropped = said["dropped"].as_u64().unwrap_or(0);
        if dropped > 0 {
            words.failures.push(format!("the consumer could not keep up: {dropped} samples were dropped"));
        }
    }
}
