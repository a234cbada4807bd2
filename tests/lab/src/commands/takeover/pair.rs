//! Two linked hubs of one name as processes, and a consumer of each.

use crate::loopback::consumer::{Consumer, Subscription, Traffic};
use crate::loopback::hub_status;
use crate::loopback::{Child, Launcher};
use anyhow::{Context, ensure};
use std::path::Path;
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::clock;
use v2x_common::fused::FusedFrame;
use v2x_common::id::{AgentId, NetworkId};
use v2x_common::net::session::SessionOptions;
use v2x_common::time::Timestamp;
use v2x_common::wire;

/// Time limit for whatever is to happen on a busy machine.
const PATIENCE: Duration = Duration::from_secs(30);
const CAPACITY: usize = 1 << 14;
/// An object is at its place within this; in the longest silence it drives less.
const AT_ITS_PLACE_M: f64 = 5.0;
/// An own track for every published object, but for those that have just come.
const FOLLOWED_SHARE: f64 = 0.999;

/// A list, and when it came.
#[derive(Clone, Debug)]
pub(super) struct Received {
    pub(super) frame: FusedFrame,
    pub(super) received_at: Timestamp,
}

/// What a takeover was.
pub(super) struct Change {
    /// The last list of the hub that was killed.
    pub(super) last: Received,
    pub(super) killed_at: Timestamp,
    /// The first one of the other hub.
    pub(super) next: Received,
}

struct Hub {
    child: Option<Child>,
    endpoint: String,
    consumer: Consumer,
    /// The newest stamp at its consumer.
    newest: Option<Timestamp>,
}

/// Two hubs, of which one publishes.
pub(super) struct Pair {
    network: NetworkId,
    hubs: [Hub; 2],
    publishing: usize,
    stamps_back: u32,
}

impl Pair {
    pub(super) async fn start(launcher: &Launcher) -> anyhow::Result<Self> {
        let (first, one) = start(launcher, 0, "tcp/127.0.0.1:0", None).await?;
        let (second, other) = start(launcher, 1, "tcp/127.0.0.1:0", Some(&one)).await?;
        let network = launcher.network();
        let consumers = [consumer(network, &one).await?, consumer(network, &other).await?];
        let [first_consumer, second_consumer] = consumers;
        let hubs = [
            Hub { child: Some(first), endpoint: one, consumer: first_consumer, newest: None },
            Hub { child: Some(second), endpoint: other, consumer: second_consumer, newest: None },
        ];
        Ok(Self { network, hubs, publishing: 0, stamps_back: 0 })
    }

    /// Agents that know both hubs, in turn the one or the other first.
    pub(super) async fn agents(
        &self,
        launcher: &Launcher,
        scenario: &Path,
        ids: impl Iterator<Item = AgentId>,
    ) -> anyhow::Result<Vec<Child>> {
        let start = clock::now().as_micros().to_string();
        let mut agents = Vec::new();
        for (i, id) in ids.enumerate() {
            let [first, second] = [i % 2, 1 - i % 2].map(|hub| self.hubs[hub].endpoint.clone());
            let id = id.to_string();
            let args = [
                ["--scenario", &scenario.display().to_string()],
                ["--id", &id],
                ["--seed", "1"],
                ["--start", &start],
                ["--connect", &first],
                ["--connect", &second],
            ];
            let args: Vec<_> = args.concat().into_iter().map(str::to_owned).collect();
            agents.push(launcher.start(&id, "agent", &args).await?.0);
        }
        Ok(agents)
    }

    /// The next list at the hub that stands by, or that has just taken over.
    async fn next(&mut self, hub: usize) -> anyhow::Result<Received> {
        let hub = &mut self.hubs[hub];
        let entry = tokio::time::timeout(PATIENCE, hub.consumer.next()).await.context("no list")?;
        let frame = wire::fused::decode(&entry.payload).context("a list that cannot be read")?;
        if hub.newest.is_some_and(|newest| frame.fused_at <= newest) {
            self.stamps_back += 1;
        }
        hub.newest = Some(frame.fused_at);
        Ok(Received { frame, received_at: entry.received_at })
    }

    /// Waits until the hub that stands by knows the ids of everything that is published, in ten lists.
    pub(super) async fn until_followed(&mut self) -> anyhow::Result<()> {
        let standby = 1 - self.publishing;
        let begun_at = clock::now();
        let mut followed = 0;
        while followed < 10 {
            let list = self.next(standby).await?;
            let session = self.hubs[standby].consumer.session();
            let statuses = hub_status::query_all(session, self.network, None).await?;
            let follower =
                statuses.iter().filter_map(|status| status.standby.as_ref()).find(|one| !one.publishes);
            let objects = list.frame.objects.len();
            let is_followed = follower.is_some_and(|one| {
                one.follows == Some(list.frame.lineage)
                    && one.named_by_another as f64 >= FOLLOWED_SHARE * objects as f64
            });
            followed = if is_followed && objects > 0 { followed + 1 } else { 0 };
            let waited = (clock::now() - begun_at).to_duration();
            ensure!(waited < PATIENCE, "no hub stands by for it after {waited:?}: {statuses:#?}");
        }
        Ok(())
    }

    /// Kills the hub that publishes; the first list of the other one.
    pub(super) async fn kill_publishing(&mut self) -> anyhow::Result<Change> {
        let other = 1 - self.publishing;
        let mut last = self.next(other).await?;
        let child = self.hubs[self.publishing].child.take().context("no hub publishes")?;
        let killed_at = clock::now();
        child.kill().await?;
        let next = loop {
            let list = self.next(other).await?;
            let waited = (clock::now() - killed_at).to_duration();
            ensure!(waited < PATIENCE, "the hub that was killed did not publish: the two had changed roles");
            if list.frame.lineage != last.frame.lineage {
                break list;
            }
            last = list;
        };
        self.publishing = other;
        Ok(Change { last, killed_at, next })
    }

    /// The first list for this time or a later one.
    pub(super) async fn list_after(&mut self, at: Timestamp) -> anyhow::Result<Received> {
        loop {
            let list = self.next(self.publishing).await?;
            if list.frame.fused_at >= at {
                return Ok(list);
            }
        }
    }

    /// Starts the hub that was killed again.
    pub(super) async fn restart(&mut self, launcher: &Launcher) -> anyhow::Result<()> {
        let killed = 1 - self.publishing;
        let other = self.hubs[self.publishing].endpoint.clone();
        let (child, _) = start(launcher, killed, &self.hubs[killed].endpoint, Some(&other)).await?;
        self.hubs[killed].child = Some(child);
        Ok(())
    }

    /// Ends the hubs; how many stamps were not after the one before.
    pub(super) async fn end(self) -> anyhow::Result<u32> {
        for hub in self.hubs {
            hub.consumer.close().await?;
            if let Some(child) = hub.child {
                child.end("stopped").await?;
            }
        }
        Ok(self.stamps_back)
    }
}

async fn start(
    launcher: &Launcher,
    number: usize,
    listen: &str,
    connect: Option<&str>,
) -> anyhow::Result<(Child, String)> {
    let mut args = vec!["--standby", "--listen", listen];
    args.extend(connect.into_iter().flat_map(|endpoint| ["--connect", endpoint]));
    let args: Vec<_> = args.into_iter().map(str::to_owned).collect();
    let (child, ready) = launcher.start(&format!("hub-{number}"), "hub", &args).await?;
    let endpoint = ready["locators"][0].as_str().context("the hub listens nowhere")?;
    Ok((child, endpoint.to_owned()))
}

async fn consumer(network: NetworkId, endpoint: &str) -> anyhow::Result<Consumer> {
    let options = SessionOptions { connect: vec![endpoint.to_owned()], ..SessionOptions::default() };
    let subscription = Subscription { network, traffic: Traffic::Fused, hub: None, capacity: CAPACITY };
    let consumer = Consumer::connect(&options, subscription, PATIENCE, &CancellationToken::new()).await?;
    consumer.context("no shutdown was requested")
}

/// How many objects of a list are in the next one, under their id and at their place.
pub(super) fn kept_ids(last: &FusedFrame, next: &FusedFrame) -> usize {
    let is_kept = |object: &&v2x_common::fused::FusedObject| {
        let here = object.bev.pose();
        next.objects.iter().any(|other| {
            other.track == object.track && here.distance_to(other.bev.x, other.bev.y) < AT_ITS_PLACE_M
        })
    };
    for object in last.objects.iter().filter(|object| !is_kept(object)) {
        tracing::info!(track = %object.track, at = ?object.bev, age = %object.age, existence = object.existence, "lost");
    }
    last.objects.iter().filter(is_kept).count()
}
