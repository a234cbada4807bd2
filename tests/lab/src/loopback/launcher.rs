//! Starts hubs and agents as child processes.

use crate::loopback::{Child, ChildError};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::time::Duration;
use v2x_common::id::{AgentId, NetworkId};
use v2x_common::net::logging;
use v2x_common::time::Timestamp;

/// Time limit for a child to be ready.
const READY_PATIENCE: Duration = Duration::from_secs(20);

/// Starts the children of one network. The program is this one or another one with the subcommands `hub` and
/// `agent`.
#[derive(Clone, Debug)]
pub struct Launcher {
    program: PathBuf,
    network: NetworkId,
    logs: Option<PathBuf>,
    log_filter: String,
}

/// The options of a hub.
#[derive(Clone, Debug)]
pub struct HubOptions {
    /// Endpoint to listen on; port 0 selects a free port.
    pub listen: String,
    /// A TOML file with the settings in its `[hub]` table.
    pub config: Option<PathBuf>,
    /// Endpoints of other hubs or routers to connect to.
    pub connect: Vec<String>,
    /// Zenoh's own configuration, such as one with certificates.
    pub zenoh_config: Option<PathBuf>,
    /// Where it serves metrics and health; port 0 selects a free port.
    pub metrics: Option<SocketAddr>,
    /// The file into which it records; must not be there yet.
    pub record: Option<PathBuf>,
}

impl Default for HubOptions {
    fn default() -> Self {
        Self {
            listen: "tcp/127.0.0.1:0".to_owned(),
            config: None,
            connect: Vec::new(),
            zenoh_config: None,
            metrics: None,
            record: None,
        }
    }
}

/// The options of the agents of a run.
#[derive(Clone, Debug)]
pub struct AgentOptions {
    /// The scenario file.
    pub scenario: PathBuf,
    /// Endpoint of the hub.
    pub connect: String,
    /// Seed of the run.
    pub seed: u64,
    /// Time at which scenario time is 0.
    pub start: Timestamp,
}

impl Launcher {
    /// A launcher for children of this network, run by `program`.
    pub fn new(program: PathBuf, network: NetworkId) -> Self {
        let log_filter = logging::DEFAULT_FILTER.to_owned();
        Self { program, network, logs: None, log_filter }
    }

    /// Sets the folder of logs, one file for each child.
    #[must_use]
    pub fn with_logs(mut self, folder: &Path, filter: &str) -> Self {
        self.logs = Some(folder.to_owned());
        filter.clone_into(&mut self.log_filter);
        self
    }

    /// Name of the network.
    pub const fn network(&self) -> NetworkId {
        self.network
    }

    /// Starts a child with this subcommand and waits until it is ready. Returns the event of readiness.
    pub async fn start(
        &self,
        name: &str,
        subcommand: &str,
        args: &[String],
    ) -> Result<(Child, serde_json::Value), ChildError> {
        let mut child = self.spawn(name, subcommand, args)?;
        let ready = child.expect_event("ready", READY_PATIENCE).await?;
        Ok((child, ready))
    }

    /// Starts a child without waiting.
    pub fn spawn(&self, name: &str, subcommand: &str, args: &[String]) -> Result<Child, ChildError> {
        let log = self.logs.as_ref().map(|folder| folder.join(format!("{name}.log")));
        let mut all = vec![subcommand.to_owned(), "--events".to_owned(), "--exit-with-stdin".to_owned()];
        all.extend([
            "--network".to_owned(),
            self.network.to_string(),
            "--log".to_owned(),
            self.log_filter.clone(),
        ]);
        // A program of somebody else's may not know it.
        if logging::format() != logging::Format::default() {
            all.extend(["--log-format".to_owned(), logging::format().to_string()]);
        }
        all.extend_from_slice(args);
        Child::start(name, &self.program, &all, log)
    }

    /// Starts a hub and returns it with the endpoint on which it listens.
    pub async fn hub(&self, options: &HubOptions) -> Result<(Child, String), ChildError> {
        self.hub_named("hub", options).await
    }

    /// Starts one of several hubs. The name of the process is used for its log and in messages.
    pub async fn hub_named(&self, name: &str, options: &HubOptions) -> Result<(Child, String), ChildError> {
        let mut args = vec!["--listen".to_owned(), options.listen.clone()];
        if let Some(config) = &options.config {
            args.extend(["--config".to_owned(), config.display().to_string()]);
        }
        if let Some(config) = &options.zenoh_config {
            args.extend(["--zenoh-config".to_owned(), config.display().to_string()]);
        }
        args.extend(options.metrics.iter().flat_map(|address| ["--metrics".to_owned(), address.to_string()]));
        args.extend(
            options.record.iter().flat_map(|file| ["--record".to_owned(), file.display().to_string()]),
        );
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
