//! A network for a test, and waits for its events.

use anyhow::{Context, anyhow, ensure};
use std::path::{Path, PathBuf};
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::clock;
use v2x_common::fused::{AgentHealth, FusedFrame};
use v2x_common::id::{AgentId, NetworkId};
use v2x_common::keys::Keys;
use v2x_common::net::session::{self, SessionOptions};
use v2x_common::time::Timestamp;
use v2x_common::wire;
use v2x_fusion_hub::hub::{AgentStatus, HubStatus};
use v2x_lab::loopback::consumer::{Consumer, Subscription, Traffic};
use v2x_lab::loopback::{AgentOptions, Child, HubOptions, Launcher, hub_status};
use zenoh::Session;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;

/// Time limit for one event on a busy machine.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// Capacity of the queue of frames.
const CAPACITY: usize = 1 << 14;

/// A large Δmax: a pause of a busy machine of less than 5 s must not fail a test.
const SETTINGS: &str = "[hub]\ndelta_max_ms = 5000\nmap_frame = \"EPSG:32632\"\n";

/// Starts the processes of one network. Their logs stay in the folder of the test.
pub(crate) struct Lab {
    launcher: Launcher,
    folder: PathBuf,
    start: Timestamp,
}

/// A running hub.
pub(crate) struct Hub {
    pub(crate) child: Child,
    pub(crate) locator: String,
}

impl Lab {
    /// A network of this name. The folder has the same name, so each test needs its own name.
    pub(crate) fn new(name: &str) -> anyhow::Result<Self> {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        std::fs::create_dir_all(&folder).with_context(|| format!("making {}", folder.display()))?;
        std::fs::write(folder.join("hub.toml"), SETTINGS).context("writing the hub's settings")?;
        Ok(Self::with_network(folder, NetworkId::new(name)?))
    }

    /// A network whose hub uses this method.
    pub(crate) fn with_method(name: &str, method: &str) -> anyhow::Result<Self> {
        Self::with_settings(name, &format!("method = {method:?}\n"))
    }

    /// A network whose hubs have these further lines in their table of settings.
    pub(crate) fn with_settings(name: &str, lines: &str) -> anyhow::Result<Self> {
        let lab = Self::new(name)?;
        let settings = format!("{SETTINGS}{lines}");
        std::fs::write(lab.folder.join("hub.toml"), settings).context("writing the hub's settings")?;
        Ok(lab)
    }

    /// Another network in the same folder.
    pub(crate) fn sibling(&self, network: &str) -> anyhow::Result<Self> {
        Ok(Self::with_network(self.folder.clone(), NetworkId::new(network)?))
    }

    fn with_network(folder: PathBuf, network: NetworkId) -> Self {
        let launcher = Launcher::new(env!("CARGO_BIN_EXE_lab").into(), network).with_logs(&folder, "info");
        Self { launcher, folder, start: clock::now() }
    }

    pub(crate) fn keys(&self) -> Keys {
        Keys::new(self.launcher.network())
    }

    /// A hub on a free port.
    pub(crate) async fn hub(&self) -> anyhow::Result<Hub> {
        self.hub_at("tcp/127.0.0.1:0").await
    }

    /// A hub on this port.
    pub(crate) async fn hub_at(&self, listen: &str) -> anyhow::Result<Hub> {
        let options = HubOptions {
            listen: listen.to_owned(),
            config: Some(self.folder.join("hub.toml")),
            ..HubOptions::default()
        };
        let (child, locator) = self.launcher.hub(&options).await?;
        Ok(Hub { child, locator })
    }

    /// A hub that is connected to another one. Its log has another name.
    pub(crate) async fn hub_joined_to(&self, other: &Hub) -> anyhow::Result<Child> {
        let args = ["--listen", "tcp/127.0.0.1:0", "--connect", &other.locator].map(str::to_owned);
        Ok(self.launcher.start("joined-hub", "hub", &args).await?.0)
    }

    /// A hub whose Zenoh configuration says whom it joins. Its log has another name, too.
    pub(crate) async fn hub_configured_by(&self, config: &Path) -> anyhow::Result<Child> {
        let args = ["--zenoh-config".to_owned(), config.display().to_string()];
        Ok(self.launcher.start("joined-hub", "hub", &args).await?.0)
    }

    /// A hub that stands by, with these further arguments. Its log has this name.
    pub(crate) async fn standby(&self, name: &str, args: &[&str]) -> anyhow::Result<Hub> {
        let settings = self.folder.join("hub.toml").display().to_string();
        let own = ["--standby", "--config", &settings, "--listen", "tcp/127.0.0.1:0"];
        let args: Vec<_> = own.iter().chain(args).map(|arg| (*arg).to_owned()).collect();
        let (child, ready) = self.launcher.start(name, "hub", &args).await?;
        let locator = ready["locators"][0].as_str().context("the hub listens nowhere")?.to_owned();
        Ok(Hub { child, locator })
    }

    /// An agent of the default scenario, `ego` or `rsu`.
    pub(crate) async fn agent(&self, id: &str, hub: &Hub) -> anyhow::Result<Child> {
        self.agent_at(id, &hub.locator).await
    }

    /// The same, connected to an endpoint.
    pub(crate) async fn agent_at(&self, id: &str, endpoint: &str) -> anyhow::Result<Child> {
        let options = AgentOptions {
            scenario: Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deploy/scenarios/crossing.toml"),
            connect: endpoint.to_owned(),
            seed: 1,
            start: self.start,
        };
        Ok(self.launcher.agent(&AgentId::new(id)?, &options).await?)
    }

    /// Where the logs and settings are.
    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// The log of the hub.
    pub(crate) fn hub_log(&self) -> anyhow::Result<String> {
        std::fs::read_to_string(self.folder.join("hub.log")).context("reading the hub's log")
    }

    /// A consumer of this network, connected to this hub.
    pub(crate) async fn watch(&self, hub: &Hub) -> anyhow::Result<Watch> {
        self.watch_lists(hub, Traffic::Fused).await
    }

    /// The same of other lists.
    pub(crate) async fn watch_lists(&self, hub: &Hub, traffic: Traffic) -> anyhow::Result<Watch> {
        let options = SessionOptions { connect: vec![hub.locator.clone()], ..Default::default() };
        let network = self.launcher.network();
        let subscription = Subscription { network, traffic, hub: None, capacity: CAPACITY };
        let shutdown = CancellationToken::new();
        let consumer = Consumer::connect(&options, subscription, PATIENCE, &shutdown).await?;
        Ok(Watch { consumer: consumer.context("no shutdown was requested")?, keys: self.keys(), network })
    }
}

/// A consumer that observes a network for a test.
pub(crate) struct Watch {
    consumer: Consumer,
    keys: Keys,
    network: NetworkId,
}

impl Watch {
    /// The next fused frame.
    pub(crate) async fn next(&self) -> anyhow::Result<FusedFrame> {
        let entry = tokio::time::timeout(PATIENCE, self.consumer.next()).await.context("no fused frame")?;
        wire::fused::decode(&entry.payload).context("a fused frame that cannot be read")
    }

    /// The first fused frame from now on that fulfils a condition.
    pub(crate) async fn until(
        &self,
        what: &str,
        mut is_so: impl FnMut(&FusedFrame) -> bool,
    ) -> anyhow::Result<FusedFrame> {
        let mut last = None;
        let found = async {
            loop {
                let frame = self.next().await?;
                if is_so(&frame) {
                    return Ok(frame);
                }
                last = Some((frame.lineage, frame.sequence, frame.objects.len(), frame.agents));
            }
        };
        match tokio::time::timeout(PATIENCE, found).await {
            Ok(found) => found,
            Err(_) => Err(anyhow!("{what}: not within {PATIENCE:?}; the last fused frame: {last:?}")),
        }
    }

    /// The raw reply of the hub to a status query; `None` without a reply.
    pub(crate) async fn status_json(&self) -> anyhow::Result<Option<serde_json::Value>> {
        let session = self.consumer.session();
        let replies = session.get(self.keys.all_status()).await.map_err(|error| anyhow!("{error}"))?;
        let Ok(reply) = replies.recv_async().await else { return Ok(None) };
        let sample = reply.result().map_err(|error| anyhow!("{error}"))?;
        Ok(Some(serde_json::from_slice(&sample.payload().to_bytes())?))
    }

    /// The statuses of all hubs, of those that stand by, too.
    pub(crate) async fn statuses(&self) -> anyhow::Result<Vec<HubStatus>> {
        Ok(hub_status::query_all(self.consumer.session(), self.network, None).await?)
    }

    /// The first statuses that fulfil a condition. They are queried after each fused frame.
    pub(crate) async fn statuses_when(
        &self,
        what: &str,
        mut are_so: impl FnMut(&[HubStatus]) -> bool,
    ) -> anyhow::Result<Vec<HubStatus>> {
        let mut last = Vec::new();
        let found = async {
            loop {
                let statuses = self.statuses().await?;
                if are_so(&statuses) {
                    return Ok(statuses);
                }
                last = statuses;
                self.next().await?;
            }
        };
        match tokio::time::timeout(PATIENCE, found).await {
            Ok(found) => found,
            Err(_) => Err(anyhow!("{what}: not within {PATIENCE:?}; the last statuses: {last:#?}")),
        }
    }

    /// The first status that fulfils a condition. It is queried after each fused frame.
    pub(crate) async fn status_when(
        &self,
        what: &str,
        mut is_so: impl FnMut(&HubStatus) -> bool,
    ) -> anyhow::Result<HubStatus> {
        let mut last = None;
        let found = async {
            loop {
                if let Some(json) = self.status_json().await? {
                    let status: HubStatus = serde_json::from_value(json)?;
                    if is_so(&status) {
                        return Ok(status);
                    }
                    last = Some(status);
                }
                self.next().await?;
            }
        };
        match tokio::time::timeout(PATIENCE, found).await {
            Ok(found) => found,
            Err(_) => Err(anyhow!("{what}: not within {PATIENCE:?}; the last status: {last:#?}")),
        }
    }
}

/// The session of a foreign client.
pub(crate) async fn foreign_session(hub: &Hub) -> anyhow::Result<Session> {
    let options = SessionOptions { connect: vec![hub.locator.clone()], ..Default::default() };
    session::open(session::client_config(&options)?).await
}

/// Sends a signal to the process of a hub.
pub(crate) fn signal(hub: &Hub, signal: &str) -> anyhow::Result<()> {
    let id = hub.child.process_id().context("it has ended")?.to_string();
    let sent = std::process::Command::new("kill").args([signal, &id]).status().context("running kill")?;
    ensure!(sent.success(), "kill {signal}: {sent}");
    Ok(())
}

/// A publisher to which a hub has subscribed, so that no message is lost.
pub(crate) async fn matched_publisher(session: &Session, key: String) -> anyhow::Result<Publisher<'static>> {
    let declared = async {
        let publisher = session.declare_publisher(key).congestion_control(CongestionControl::Block).await?;
        let listener = publisher.matching_listener().await?;
        while !publisher.matching_status().await?.matching() {
            listener.recv_async().await?;
        }
        drop(listener);
        Ok::<_, zenoh::Error>(publisher)
    };
    let declared = tokio::time::timeout(PATIENCE, declared).await.context("no hub subscribed")?;
    declared.map_err(|error| anyhow!("{error}"))
}

/// Whether an object of the frame contains measurements of this agent.
pub(crate) fn rests_on(frame: &FusedFrame, agent: &str) -> bool {
    let mut contributors = frame.objects.iter().flat_map(|object| &object.contributors);
    contributors.any(|measurement| measurement.frame.agent.as_str() == agent)
}

/// The state of this agent in the frame.
pub(crate) fn health(frame: &FusedFrame, agent: &str) -> Option<AgentHealth> {
    frame.agents.iter().find(|health| health.agent.as_str() == agent).copied()
}

/// The status of this agent.
pub(crate) fn standing<'a>(status: &'a HubStatus, agent: &str) -> Option<&'a AgentStatus> {
    status.agents.iter().find(|standing| standing.id.as_str() == agent)
}
