//! A network for a test, and waiting for what happens in it.

use anyhow::{Context, anyhow};
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
use v2x_lab::loopback::{AgentOptions, Child, HubOptions, Launcher};
use zenoh::Session;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;

/// How long any one event may take on a machine that is busy with other things.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// Frames that wait to be looked at.
const CAPACITY: usize = 1 << 14;

/// A wide Δmax: no test is about what a busy machine holds up by less than 5 s.
const SETTINGS: &str = "[hub]\ndelta_max_ms = 5000\nmap_frame = \"EPSG:32632\"\n";

/// Starts the processes of one network; their logs are left in the test's folder.
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
    /// For a network of this name; the name of its folder too, so one test must use it alone.
    pub(crate) fn new(name: &str) -> anyhow::Result<Self> {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        std::fs::create_dir_all(&folder).with_context(|| format!("making {}", folder.display()))?;
        std::fs::write(folder.join("hub.toml"), SETTINGS).context("writing the hub's settings")?;
        Ok(Self::with_network(folder, NetworkId::new(name)?))
    }

    /// The same with this method in the hub.
    pub(crate) fn with_method(name: &str, method: &str) -> anyhow::Result<Self> {
        let lab = Self::new(name)?;
        let settings = format!("{SETTINGS}method = {method:?}\n");
        std::fs::write(lab.folder.join("hub.toml"), settings).context("writing the hub's settings")?;
        Ok(lab)
    }

    /// Another network, in the same folder.
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

    /// A hub that also is connected to another one, under another name of its log.
    pub(crate) async fn hub_joined_to(&self, other: &Hub) -> anyhow::Result<Child> {
        let args = ["--listen", "tcp/127.0.0.1:0", "--connect", &other.locator].map(str::to_owned);
        Ok(self.launcher.start("joined-hub", "hub", &args).await?.0)
    }

    /// An agent of the default scenario, `ego` or `rsu`.
    pub(crate) async fn agent(&self, id: &str, hub: &Hub) -> anyhow::Result<Child> {
        let options = AgentOptions {
            scenario: Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deploy/scenarios/crossing.toml"),
            connect: hub.locator.clone(),
            seed: 1,
            start: self.start,
        };
        Ok(self.launcher.agent(&AgentId::new(id)?, &options).await?)
    }

    /// What the hub has logged.
    pub(crate) fn hub_log(&self) -> anyhow::Result<String> {
        std::fs::read_to_string(self.folder.join("hub.log")).context("reading the hub's log")
    }

    /// A consumer of this network, at this hub.
    pub(crate) async fn watch(&self, hub: &Hub) -> anyhow::Result<Watch> {
        let options = SessionOptions { connect: vec![hub.locator.clone()], ..Default::default() };
        let network = self.launcher.network();
        let subscription = Subscription { network, traffic: Traffic::Fused, capacity: CAPACITY };
        let shutdown = CancellationToken::new();
        let consumer = Consumer::connect(&options, subscription, PATIENCE, &shutdown).await?;
        Ok(Watch { consumer: consumer.context("nobody asked to shut down")?, keys: self.keys() })
    }
}

/// A consumer through which a test sees what happens.
pub(crate) struct Watch {
    consumer: Consumer,
    keys: Keys,
}

impl Watch {
    /// The next fused frame.
    pub(crate) async fn next(&self) -> anyhow::Result<FusedFrame> {
        let entry = tokio::time::timeout(PATIENCE, self.consumer.next()).await.context("no fused frame")?;
        wire::fused::decode(&entry.payload).context("a fused frame that cannot be read")
    }

    /// The first fused frame from now on of which something is so.
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

    /// The hub's answer to a status query, as it came; `None` where no hub answered.
    pub(crate) async fn status_json(&self) -> anyhow::Result<Option<serde_json::Value>> {
        let session = self.consumer.session();
        let replies = session.get(self.keys.all_status()).await.map_err(|error| anyhow!("{error}"))?;
        let Ok(reply) = replies.recv_async().await else { return Ok(None) };
        let sample = reply.result().map_err(|error| anyhow!("{error}"))?;
        Ok(Some(serde_json::from_slice(&sample.payload().to_bytes())?))
    }

    /// The first status of which something is so; asked for after each fused frame.
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

/// A session of a client that is not ours.
pub(crate) async fn foreign_session(hub: &Hub) -> anyhow::Result<Session> {
    let options = SessionOptions { connect: vec![hub.locator.clone()], ..Default::default() };
    session::open(session::client_config(&options)?).await
}

/// A publisher that a hub has subscribed to: what it puts is not lost.
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

/// Whether an object of the frame rests on measurements of this agent.
pub(crate) fn rests_on(frame: &FusedFrame, agent: &str) -> bool {
    let mut contributors = frame.objects.iter().flat_map(|object| &object.contributors);
    contributors.any(|measurement| measurement.frame.agent.as_str() == agent)
}

/// What the frame says of this agent.
pub(crate) fn health(frame: &FusedFrame, agent: &str) -> Option<AgentHealth> {
    frame.agents.iter().find(|health| health.agent.as_str() == agent).copied()
}

/// What the status says of this agent.
pub(crate) fn standing<'a>(status: &'a HubStatus, agent: &str) -> Option<&'a AgentStatus> {
    status.agents.iter().find(|standing| standing.id.as_str() == agent)
}
