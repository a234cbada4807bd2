//! An agent in this process: a client of the hub whose link delays its frames.

use crate::loopback::access::Access;
use crate::loopback::connection::Connection;
use crate::loopback::delay_queue;
use crate::loopback::delay_queue::DelayQueue;
use crate::loopback::error::KitError;
use crate::loopback::script::Script;
use crate::loopback::task_group::{TaskToken, WeakTaskToken};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tokio_util::sync::{CancellationToken, DropGuard};
use v2x_agent::link::profiles::{self, ProfileError};
use v2x_agent::link::{Delay, Link, LinkConfig, Parcel, Transit};
use v2x_common::clock;
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::id::{AgentId, FrameId};
use v2x_common::sensor::SensorDescription;
use v2x_common::time::Timestamp;
use v2x_common::wire;

/// The options of an agent before it joins a network. [`NewAgent::join`] reports invalid options.
#[must_use = "it is no agent before it joins"]
pub struct NewAgent {
    name: String,
    link: Result<LinkConfig, ProfileError>,
    seed: u64,
    description: Option<SensorDescription>,
    access: Access,
}

impl NewAgent {
    pub(super) fn new(name: &str, access: Access) -> Self {
        Self { name: name.to_owned(), link: Ok(LinkConfig::default()), seed: 0, description: None, access }
    }

    /// Sets the link of its frames: `lte-uu`, `its-g5:loss=0.1,burst=4`, `custom:delay=80ms,jitter=30ms` and all links
    /// of `v2x links`.
    pub fn over(mut self, link: &str) -> Self {
        self.link = profiles::parse(link, |path| std::fs::read_to_string(path));
        self
    }

    /// Sets a link with a constant delay and no loss.
    pub fn late_by(mut self, delay: Duration) -> Self {
        let delay = Delay::constant(delay.as_secs_f64());
        self.link = Ok(LinkConfig { delay, ..LinkConfig::default() });
        self
    }

    /// Sets the endpoint to connect to instead of the hub, for example a proxy or router between them.
    pub fn through(mut self, endpoint: &str) -> Self {
        self.access.session.connect = vec![endpoint.to_owned()];
        self
    }

    /// Sets the seed of its link and of the noise of its scripts.
    pub const fn seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// Sets the sensor description that it publishes on joining and every second. Without a description, the hub
    /// ignores its missed detections.
    pub const fn described(mut self, description: SensorDescription) -> Self {
        self.description = Some(description);
        self
    }

    /// Connects and waits until the hub has subscribed, so that no early frame is lost.
    pub async fn join(self) -> Result<Agent, KitError> {
        let Self { name, link, seed, description, access } = self;
        let id = AgentId::new(&name).map_err(|source| KitError::Name { name, source })?;
        let link = link.map_err(|source| KitError::Link { agent: id, source })?;
        let connection = Connection::open(&access, id, description).await?;
        let queue = DelayQueue::new(link.reorder);
        let sender = Arc::new(FrameSender {
            id,
            epoch: u64::try_from(clock::now().as_micros()).unwrap_or(0),
            sequence: AtomicU64::new(0),
            link: Link::new(link, seed, id),
            started_at: access.started_at,
            queue,
        });
        let Access { ended, token, .. } = access;
        let tasks = token.downgrade();
        tokio::spawn(deliver(connection, sender.clone(), ended.clone(), token));
        Ok(Agent { sender, seed, tasks, ended: ended.drop_guard() })
    }
}

/// An agent of a network. Dropping it leaves the network; frames in transit are lost.
#[must_use = "it leaves when it is dropped"]
pub struct Agent {
    sender: Arc<FrameSender>,
    seed: u64,
    tasks: WeakTaskToken,
    ended: DropGuard,
}

/// A receipt of a sent frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sent {
    /// Id of the frame. The first fused frame that contains it lists it in `includes`.
    pub frame: FrameId,
    /// Arrival time at the hub; `None` if the link loses the frame.
    pub arrives_at: Option<Timestamp>,
}

impl Agent {
    /// Name of the agent.
    pub fn id(&self) -> AgentId {
        self.sender.id
    }

    /// Sends a frame with these detections, measured now.
    pub fn send(&self, detections: Vec<Detection>) -> Result<Sent, KitError> {
        self.send_frame(&self.frame(clock::now(), detections))
    }

    /// Sends a frame of your own making.
    pub fn send_frame(&self, frame: &DetectionFrame) -> Result<Sent, KitError> {
        if self.ended.token().is_cancelled() { Err(KitError::HubEnded) } else { self.sender.send(frame) }
    }

    /// The next frame of the agent, measured at `measured_at`. Change it as needed and send it with
    /// [`Agent::send_frame`].
    pub fn frame(&self, captured_at: Timestamp, detections: Vec<Detection>) -> DetectionFrame {
        self.sender.frame(captured_at, detections)
    }

    /// Sends the frames of a script from now on until the agent leaves. The first frame is sent immediately; if it
    /// cannot be encoded, this is an error.
    pub fn play(&self, script: Script) -> Result<(), KitError> {
        let token = self.tasks.upgrade().ok_or(KitError::HubEnded)?;
        let begun_at = clock::now();
        self.sender.send_scripted(&script, (self.seed, begun_at), 0)?;
        let (sender, seed, ended) = (self.sender.clone(), self.seed, self.ended.token().clone());
        tokio::spawn(async move {
            // Held until the task ends.
            let _token = token;
            let mut number = 1;
            while sleep_until(script.capture_time(begun_at, number), &ended).await {
                if let Err(error) = sender.send_scripted(&script, (seed, begun_at), number) {
                    tracing::warn!(%error, number, "the script ends");
                    return;
                }
                number += 1;
            }
        });
        Ok(())
    }
}

/// The sending side of an agent: it numbers frames and puts them into the delay queue.
struct FrameSender {
    id: AgentId,
    epoch: u64,
    sequence: AtomicU64,
    link: Link,
    started_at: Timestamp,
    queue: DelayQueue,
}

impl FrameSender {
    fn frame(&self, captured_at: Timestamp, detections: Vec<Detection>) -> DetectionFrame {
        let sequence = self.sequence.fetch_add(1, Ordering::Relaxed);
        let id = FrameId { agent: self.id, epoch: self.epoch, sequence };
        DetectionFrame { detections, ..DetectionFrame::empty(id, captured_at) }
    }

    fn send(&self, frame: &DetectionFrame) -> Result<Sent, KitError> {
        let mut payload = Vec::new();
        let encoded = wire::detections::encode(frame, &mut payload);
        encoded.map_err(|source| KitError::Frame { agent: self.id, source })?;
        let now = clock::now();
        let (sequence, since_start) = (frame.id.sequence, now - self.started_at);
        let parcel = Parcel { sequence, since_start, bytes: payload.len() };
        let Transit::Delivered { delay } = self.link.transit(parcel) else {
            return Ok(Sent { frame: frame.id, arrives_at: None });
        };
        if !self.queue.push(now + delay, payload) {
            return Err(KitError::Backlog { agent: self.id, count: delay_queue::CAPACITY });
        }
        Ok(Sent { frame: frame.id, arrives_at: Some(now + delay) })
    }

    fn send_scripted(
        &self,
        script: &Script,
        (seed, begun_at): (u64, Timestamp),
        number: u64,
    ) -> Result<Sent, KitError> {
        let captured_at = script.capture_time(begun_at, number);
        let detections = script.detections((seed, &self.id), number, captured_at - self.started_at);
        self.send(&self.frame(captured_at, detections))
    }
}

/// Puts frames when they are due, until the agent leaves.
async fn deliver(
    connection: Connection,
    sender: Arc<FrameSender>,
    ended: CancellationToken,
    _token: TaskToken,
) {
    let mut descriptions = tokio::time::interval(Connection::DESCRIPTION_INTERVAL);
    loop {
        let put = tokio::select! {
            biased;
            () = ended.cancelled() => break,
            payload = sender.queue.next() => connection.put(payload).await,
            _ = descriptions.tick() => connection.describe().await,
        };
        if let Err(error) = put {
            tracing::warn!(agent = %sender.id, %error, "not sent");
        }
    }
    connection.close().await;
}

/// Waits until `instant`; `false` if the agent leaves first.
async fn sleep_until(at: Timestamp, ended: &CancellationToken) -> bool {
    tokio::select! {
        biased;
        () = ended.cancelled() => false,
        () = tokio::time::sleep((at - clock::now()).to_duration()) => true,
    }
}
