//! Starting hubs and agents as children of this process.

use crate::loopback::{Child, ChildError};
use std::path::{Path, PathBuf};
use std::time::Duration;
use v2x_common::id::{AgentId, NetworkId};
use v2x_common::time::Timestamp;

/// How long a child may take to be ready.
const READY_PATIENCE: Duration = Duration::from_secs(20);

/// Starts children of one network: this program itself, or another one with the subcommands `hub` and
/// `agent`.
#[derive(Clone, Debug)]
pub struct Launcher {
    program: PathBuf,
    network: NetworkId,
    logs: Option<PathBuf>,
    log_filter: String,
}

/// How a hub is started.
#[derive(Clone, Debug)]
pub struct HubOptions {
    /// Where to listen; port 0 is a free port.
    pub listen: String,
    /// A file whose `[hub]` table holds the settings.
    pub config: Option<PathBuf>,
    /// Endpoints of other hubs or routers to join.
    pub connect: Vec<String>,
}

impl Default for HubOptions {
    fn default() -> Self {
        Self { listen: "tcp/127.0.0.1:0".to_owned(), config: None, connect: Vec::new() }
    }
}

/// How the agents of a run are started.
#[derive(Clone, Debug)]
pub struct AgentOptions {
    /// The scenario file.
    pub scenario: PathBuf,
    /// The hub's endpoint.
    pub connect: String,
    /// Seed of the run.
    pub seed: u64,
    /// When scenario time is 0.
    pub start: Timestamp,
}

impl Launcher {
    /// Children of this network, run by `program`.
    pub fn new(program: PathBuf, network: NetworkId) -> Self {
        let log_filter = v2x_common::net::logging::DEFAULT_FILTER.to_owned();
        Self { program, network, logs: None, log_filter }
    }

    /// Logs of children go to this folder, one file each.
    #[must_use]
    pub fn with_logs(mut self, folder: &Path, filter: &str) -> Self {
        self.logs = Some(folder.to_owned());
        filter.clone_into(&mut self.log_filter);
        self
    }

    /// The network of its children.
    pub const fn network(&self) -> NetworkId {
        self.network
    }

    /// Starts a child with this subcommand, and waits until it says that it is ready; returns what it said.
    pub async fn start(
        &self,
        name: &str,
        subcommand: &str,
        args: &[String],
    ) -> Result<(Child, serde_json::Value), ChildError> {
        let log = self.logs.as_ref().map(|folder| folder.join(format!("{name}.log")));
        let mut all = vec![subcommand.to_owned(), "--events".to_owned(), "--exit-with-stdin".to_owned()];
        all.extend([
            "--network".to_owned(),
            self.network.to_string(),
            "--log".to_owned(),
            self.log_filter.clone(),
        ]);
        all.extend_from_slice(args);
        let mut child = Child::start(name, &self.program, &all, log)?;
        let ready = child.expect_event("ready", READY_PATIENCE).await?;
        Ok((child, ready))
    }

    /// Starts a hub; returns it with the endpoint at which it really listens.
    pub async fn hub(&self, options: &HubOptions) -> Result<(Child, String), ChildError> {
        self.hub_named("hub", options).await
    }

    /// The same where there are several: the name is the process's, for its log and in messages.
    pub async fn hub_named(&self, name: &str, options: &HubOptions) -> Result<(Child, String), ChildError> {
        let mut args = vec!["--listen".to_owned(), options.listen.clone()];
        if let Some(config) = &options.config {
            args.extend(["--config".to_owned(), config.display().to_string()]);
        }
        args.extend(options.connect.iter().flat_map(|endpoint| ["--connect".to_owned(), endpoint.clone()]));
        let (child, ready) = self.start(name, "hub", &args).await?;
        let locator = ready["locators"][0].as_str().unwrap_or(&options.listen).to_owned();
        Ok((child, locator))
    }

    /// Starts one agent of a scenario.
    pub async fn agent(&self, id: &AgentId, options: &AgentOptions) -> Result<Child, ChildError> {
        let args = [
            ("--scenario", options.scenario.display().to_string()),
            ("--id", id.to_string()),
            ("--connect", options.connect.clone()),
            ("--seed", options.seed.to_string()),
            ("--start", options.start.as_micros().to_string()),
        ];
        let args: Vec<_> = args.into_iter().flat_map(|(flag, value)| [flag.to_owned(), value]).collect();
        Ok(self.start(id.as_str(), "agent", &args).await?.0)
    }
}
