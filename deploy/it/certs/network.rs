//! A hub with certificates for a test, and clients of it within the test.

use crate::support::{self, Ending, TIMEOUT, V2x};
use anyhow::{Context, anyhow, ensure};
use std::path::{Path, PathBuf};
use tokio_util::sync::CancellationToken;
use v2x_common::fused::FusedFrame;
use v2x_common::id::NetworkId;
use v2x_common::keys::Keys;
use v2x_common::net::session::{self, SessionOptions};
use v2x_common::wire;
use v2x_fusion_hub::hub::{AgentStatus, HubStatus};
use zenoh::Session;
use zenoh::handlers::FifoChannelHandler;
use zenoh::pubsub::Subscriber;
use zenoh::sample::Sample;

/// The folder of a test with the authority `certs`, and a hub that runs.
pub(super) struct Secured {
    pub(super) folder: PathBuf,
    pub(super) endpoint: String,
    pub(super) hub: V2x,
}

/// The keys of the network of all these tests; each has a hub of its own.
pub(super) fn keys() -> Keys {
    Keys::new(NetworkId::new("demo").expect("a name"))
}

/// Runs `v2x certs`, which is to succeed.
pub(super) async fn certs(folder: &Path, args: &[&str]) -> anyhow::Result<Ending> {
    let ending = support::run(folder, &[&["certs"], args].concat()).await?;
    ensure!(ending.code == Some(0), "{args:?}: {ending:?}");
    Ok(ending)
}

/// The configuration file of somebody, in the authority `certs`.
pub(super) fn config_of(who: &str) -> String {
    format!("certs/{who}/zenoh.json5")
}

/// Starts a hub on a free port, by this protocol; returns it with its endpoint.
pub(super) async fn hub(folder: &Path, protocol: &str, args: &[&str]) -> anyhow::Result<(V2x, String)> {
    let listen = format!("{protocol}/127.0.0.1:0");
    let mut hub = V2x::start(folder, &[&["hub", "--events", "--listen", &listen], args].concat())?;
    let ready: serde_json::Value = serde_json::from_str(&hub.line().await?)?;
    let endpoint = ready["locators"][0].as_str().context("no locator")?.to_owned();
    Ok((hub, endpoint))
}

impl Secured {
    /// With the agent ego, which may publish the truth, the viewer screen, and these others (`agent`, NAME).
    pub(super) async fn start(test: &str, others: &[[&str; 2]]) -> anyhow::Result<Self> {
        let folder = support::folder(test)?;
        certs(&folder, &["init"]).await?;
        certs(&folder, &["agent", "ego", "--truth"]).await?;
        certs(&folder, &["viewer", "screen"]).await?;
        for other in others {
            certs(&folder, other).await?;
        }
        let (hub, endpoint) = hub(&folder, "tls", &["--zenoh-config", &config_of("hub/hub")]).await?;
        Ok(Self { folder, endpoint, hub })
    }

    /// Starts an agent of the scenario crossing with the certificate of the same name.
    pub(super) fn agent(&self, id: &str) -> anyhow::Result<V2x> {
        self.agent_at(&self.endpoint, id)
    }

    /// The same, connected to another hub.
    pub(super) fn agent_at(&self, endpoint: &str, id: &str) -> anyhow::Result<V2x> {
        let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/crossing.toml");
        let scenario = scenario.to_str().context("a path in UTF-8")?;
        let config = config_of(&format!("agent/{id}"));
        let args =
            ["agent", "--scenario", scenario, "--id", id, "--connect", endpoint, "--zenoh-config", &config];
        V2x::start(&self.folder, &args)
    }

    /// A session within the test, with the certificate of somebody.
    pub(super) async fn session(&self, who: &str) -> anyhow::Result<Session> {
        self.session_at(&self.endpoint, who).await
    }

    async fn session_at(&self, endpoint: &str, who: &str) -> anyhow::Result<Session> {
        let options = SessionOptions {
            config: Some(self.folder.join(config_of(who))),
            connect: vec![endpoint.to_owned()],
            listen: Vec::new(),
        };
        let config = session::client_config(&options)?;
        let opened = session::open_patiently(config, Some(TIMEOUT), &CancellationToken::new()).await?;
        opened.context("no shutdown was requested")
    }

    /// A viewer within the test.
    pub(super) async fn watch(&self) -> anyhow::Result<Watch> {
        self.watch_at(&self.endpoint).await
    }

    /// The same, connected to another hub.
    pub(super) async fn watch_at(&self, endpoint: &str) -> anyhow::Result<Watch> {
        let session = self.session_at(endpoint, "viewer/screen").await?;
        let subscriber =
            session.declare_subscriber(keys().all_fused()).await.map_err(|error| anyhow!("{error}"))?;
        Ok(Watch { session, subscriber })
    }
}

/// A viewer of a network.
pub(super) struct Watch {
    session: Session,
    subscriber: Subscriber<FifoChannelHandler<Sample>>,
}

impl Watch {
    /// The next fused frame.
    pub(super) async fn next(&self) -> anyhow::Result<FusedFrame> {
        let sample =
            tokio::time::timeout(TIMEOUT, self.subscriber.recv_async()).await.context("no fused frame")?;
        let sample = sample.map_err(|error| anyhow!("{error}"))?;
        wire::fused::decode(&sample.payload().to_bytes()).context("a fused frame that cannot be read")
    }

    /// All answers to a query for the status.
    pub(super) async fn statuses(&self) -> anyhow::Result<Vec<serde_json::Value>> {
        let replies = self.session.get(keys().all_status()).await.map_err(|error| anyhow!("{error}"))?;
        let mut statuses = Vec::new();
        while let Ok(reply) = replies.recv_async().await {
            // An error is a query that nobody has answered in time: on a busy machine, the next one is.
            if let Ok(sample) = reply.result() {
                statuses.push(serde_json::from_slice(&sample.payload().to_bytes())?);
            }
        }
        Ok(statuses)
    }

    /// The first status that fulfils a condition. It is queried after each fused frame.
    pub(super) async fn until(
        &self,
        what: &str,
        mut is_so: impl FnMut(&HubStatus) -> bool,
    ) -> anyhow::Result<HubStatus> {
        let mut last = None;
        let found = async {
            loop {
                self.next().await?;
                for status in self.statuses().await? {
                    let status: HubStatus = serde_json::from_value(status)?;
                    if is_so(&status) {
                        return Ok(status);
                    }
                    last = Some((status.agents, status.refused_by_zenoh));
                }
            }
        };
        match tokio::time::timeout(TIMEOUT, found).await {
            Ok(found) => found,
            Err(_) => Err(anyhow!("{what}: not within {TIMEOUT:?}; the last status: {last:#?}")),
        }
    }

    /// Waits until the hub has taken in further frames of an agent and publishes objects with them.
    pub(super) async fn goes_on(&self, agent: &str) -> anyhow::Result<()> {
        let before = self.until("the agent is there", |status| accepted(status, agent) > 0).await?;
        let least = accepted(&before, agent) + 5;
        let after =
            self.until("the agent goes on", |status| accepted(status, agent) >= least && status.objects > 0);
        after.await.map(drop)
    }
}

/// An agent's part of a status.
pub(super) fn agent<'a>(status: &'a HubStatus, id: &str) -> Option<&'a AgentStatus> {
    status.agents.iter().find(|agent| agent.id.as_str() == id)
}

/// Frames of an agent that were accepted.
pub(super) fn accepted(status: &HubStatus, id: &str) -> u64 {
    agent(status, id).map_or(0, |agent| agent.accepted)
}

/// How often somebody was denied an action on a key.
pub(super) fn denied(status: &HubStatus, who: &str, action: &str, key: &str) -> u64 {
    let kinds = status.refused_by_zenoh.denied.iter();
    kinds
        .filter(|kind| kind.who == who && kind.action == action && kind.key == key)
        .map(|kind| kind.count)
        .sum()
}
