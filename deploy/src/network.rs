//! The processes of a running network.

use crate::sumo_home;
use anyhow::Context;
use serde_json::Value;
use std::collections::BTreeMap;
use std::future::poll_fn;
use std::path::{Path, PathBuf};
use std::task::Poll;
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_agent::scenario::{Scenario, Sumo, WorldSource};
use v2x_common::id::AgentId;
use v2x_common::time::Timestamp;
use v2x_fusion_hub::hub::HubStatus;
use v2x_lab::loopback::{AgentOptions, Child, ChildError, HubOptions, Launcher};

/// What is said while a world begins that SUMO drives.
pub(crate) const STARTING_SUMO: &str = "starting SUMO; the world begins with its first vehicle";
/// Until the world begins: SUMO reads its network, and goes to the first time.
const WORLD_PATIENCE: Duration = Duration::from_secs(3600);

/// A hub and the agents of a scenario, each a process.
pub(crate) struct Network {
    pub(crate) hub: Child,
    pub(crate) locator: String,
    pub(crate) agents: Vec<(AgentId, Child)>,
    /// Who drives the world, where that is not each agent.
    pub(crate) world: Option<Child>,
}

/// What a network's processes reported at their end.
#[derive(Debug, Default)]
pub(crate) struct FinalReports {
    pub(crate) frames_sent: BTreeMap<AgentId, u64>,
    pub(crate) hub: Option<HubStatus>,
    pub(crate) failures: Vec<String>,
}

/// What all agents of a run share.
pub(crate) struct AgentsOfRun<'a> {
    pub(crate) scenario: &'a Scenario,
    pub(crate) file: &'a Path,
    pub(crate) seed: u64,
    pub(crate) start: Timestamp,
}

impl Network {
    /// Starts the hub.
    pub(crate) async fn start_hub(launcher: &Launcher, options: &HubOptions) -> Result<Self, ChildError> {
        let (hub, locator) = launcher.hub(options).await?;
        Ok(Self { hub, locator, agents: Vec::new(), world: None })
    }

    /// Starts SUMO where it drives the world of the scenario, and waits for the world to begin: returns when that is.
    /// `None` where shutdown comes first; then it has ended.
    async fn start_world(
        &mut self,
        launcher: &Launcher,
        (sumo, record): (&Sumo, &Path),
        shutdown: &CancellationToken,
    ) -> anyhow::Result<Option<Timestamp>> {
        let mut args = match &sumo.source {
            WorldSource::Sumo(config) => vec![config.display().to_string()],
            WorldSource::Traci(address) => vec!["--traci".to_owned(), address.clone()],
        };
        args.extend(sumo.begin_s.into_iter().flat_map(|begin_s| ["--begin".to_owned(), begin_s.to_string()]));
        args.extend(["--record".to_owned(), record.display().to_string()]);
        args.extend(["--connect".to_owned(), self.locator.clone()]);
        let mut child = launcher.spawn("sumo", "sumo", &args)?;
        // It is asked to end even now, and not killed: it has a child of its own.
        let ready = tokio::select! {
            ready = child.expect_event("ready", WORLD_PATIENCE) => ready?,
            () = shutdown.cancelled() => {
                child.end("stopped").await?;
                return Ok(None);
            }
        };
        self.world = Some(child);
        if let Some(words) = ready["step_s"].as_f64().and_then(sumo_home::long_step) {
            tracing::warn!("{words}");
        }
        let start = ready["start_us"].as_i64().and_then(Timestamp::from_micros);
        start.map(Some).context("SUMO's process does not say when the world begins")
    }

    /// Starts who drives the world, if another program does, and every agent of the scenario. Says whether they are up, or
    /// shutdown came first.
    pub(crate) async fn start_world_and_agents(
        &mut self,
        launcher: &Launcher,
        world: Option<(&Sumo, PathBuf)>,
        run: &mut AgentsOfRun<'_>,
        shutdown: &CancellationToken,
    ) -> anyhow::Result<bool> {
        if let Some((sumo, record)) = world {
            match self.start_world(launcher, (sumo, &record), shutdown).await? {
                Some(start) => run.start = start,
                None => return Ok(false),
            }
        }
        tokio::select! {
            started = self.start_agents(launcher, run) => started?,
            () = shutdown.cancelled() => return Ok(false),
        }
        Ok(true)
    }

    /// Starts every agent of the scenario.
    async fn start_agents(&mut self, launcher: &Launcher, run: &AgentsOfRun<'_>) -> Result<(), ChildError> {
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

    /// Waits until a process ends that should still run; returns its error.
    pub(crate) async fn first_exit(&mut self) -> ChildError {
        let children = std::iter::once(&mut self.hub).chain(self.agents.iter_mut().map(|(_, child)| child));
        let children = children.chain(&mut self.world);
        let mut exits: Vec<_> = children.map(|child| Box::pin(last_event(child))).collect();
        let first = poll_fn(|context| {
            let mut polled = exits.iter_mut().map(|exit| exit.as_mut().poll(context));
            polled.find(Poll::is_ready).unwrap_or(Poll::Pending)
        });
        let first = first.await;
        drop(exits);
        first.ended_before("asked to end").await
    }

    /// Ends all agents; the hub still fuses what they have sent.
    pub(crate) async fn end_agents(&mut self, reports: &mut FinalReports) {
        self.agents.iter_mut().for_each(|(_, child)| child.ask_to_end());
        for (id, child) in std::mem::take(&mut self.agents) {
            if let Some(last) = end(child, reports).await
                && let Some(sent) = last["frames_sent"].as_u64()
            {
                reports.frames_sent.insert(id, sent);
            }
        }
    }

    /// Ends who drives the world.
    pub(crate) async fn end_world(&mut self, reports: &mut FinalReports) {
        if let Some(child) = self.world.take()
            && let Some(last) = end(child, reports).await
            && let Some(late) = last["late_steps"].as_u64().filter(|late| *late > 0)
        {
            tracing::warn!("SUMO was slower than real time in {late} steps; agents missed frames then");
        }
    }

    /// Ends the hub.
    pub(crate) async fn end_hub(self, reports: &mut FinalReports) {
        if let Some(mut last) = end(self.hub, reports).await {
            match serde_json::from_value::<HubStatus>(last["status"].take()) {
                Ok(status) => {
                    if status.dropped_overload > 0 {
                        reports.failures.push(format!(
                            "the hub could not keep up: {} samples were dropped",
                            status.dropped_overload
                        ));
                    }
                    reports.hub = Some(status);
                }
                Err(error) => reports.failures.push(format!("the hub's last status is unreadable: {error}")),
            }
        }
    }
}

/// Waits until a child has sent its last event.
async fn last_event(child: &mut Child) -> &mut Child {
    while child.next_event().await.is_some() {}
    child
}

/// Ends a child, adds a failure where it did not end well, and returns its last event.
async fn end(child: Child, reports: &mut FinalReports) -> Option<Value> {
    let name = child.name().to_owned();
    match child.end("stopped").await {
        Ok((status, last)) => {
            if !status.success() {
                reports.failures.push(format!("{name} ended with {status}"));
            } else if last.is_none() {
                reports.failures.push(format!("{name} ended without a report"));
            }
            last
        }
        Err(error) => {
            reports.failures.push(error.to_string());
            None
        }
    }
}

/// Ends the consumer; samples that it dropped are a failure.
pub(crate) async fn end_consumer(child: Child, reports: &mut FinalReports) {
    if let Some(last) = end(child, reports).await {
        let dropped = last["dropped"].as_u64().unwrap_or(0);
        if dropped > 0 {
            reports.failures.push(format!("the consumer could not keep up: {dropped} samples were dropped"));
        }
    }
}
