//! Samples of the network as messages of the page.

use super::browsers::Browsers;
use super::mailbox::Stream;
use super::message::{Detections, Fused, Message, Sensor};
use super::scene::Scene;
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::FusedFrame;
use v2x_common::id::{AgentId, HubId};
use v2x_common::keys::Topic;
use v2x_common::recording::Entry;
use v2x_common::wire::{self, WireError, Writings};

/// Translates samples; holds nothing but what it compares the next one with.
pub(super) struct Picture<'a> {
    browsers: &'a Browsers,
    scene: Option<&'a Scene>,
    writings: &'a KnownWritings,
    /// Refused frames of all agents, by hub.
    refused: BTreeMap<HubId, u64>,
}

/// How agents write, as the hubs say it; `None` before they were asked for the first time.
pub(super) type KnownWritings = Mutex<Option<Writings>>;

/// What a sample calls for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Next {
    Nothing,
    /// Frames were refused: the status has the reason.
    AskForStatus,
}

impl<'a> Picture<'a> {
    pub(super) fn new(browsers: &'a Browsers, scene: Option<&'a Scene>, writings: &'a KnownWritings) -> Self {
        Self { browsers, scene, writings, refused: BTreeMap::new() }
    }

    /// Sends a sample to the browsers.
    pub(super) fn handle(&mut self, entry: &Entry) -> Result<Next, WireError> {
        match Topic::of(&entry.key) {
            Some(Topic::Sensor(agent)) => {
                let is_json = wire::is_json(&entry.encoding, &entry.payload);
                let decode = if is_json { wire::json::decode_sensor } else { wire::sensor::decode };
                let description = decode(&entry.payload)?;
                let message = Sensor { agent, description: &description };
                send(self.browsers, Stream::Sensor(agent), &Message::Sensor(message));
            }
            // Without a browser frames are not even read.
            _ if self.browsers.is_empty() => {}
            Some(Topic::Detections(agent)) => {
                let Some(frame) = self.detections(agent, entry)? else { return Ok(Next::Nothing) };
                let positions = frame.detections.iter().map(|detection| (detection.bev.x, detection.bev.y));
                let errors = self.scene.and_then(|scene| scene.errors(frame.captured_at, positions));
                let message = Detections::new(&frame, entry.received_at, errors);
                send(self.browsers, Stream::Detections(agent), &Message::Detections(message));
            }
            Some(Topic::Fused(hub)) => {
                let frame = wire::fused::decode(&entry.payload)?;
                // Nobody is shown in the name of another hub.
                if frame.hub == hub {
                    self.send_fused(&frame, entry);
                    return Ok(self.next(hub, &frame));
                }
            }
            _ => {}
        }
        Ok(Next::Nothing)
    }

    /// As the hub reads it, with every detection that was sent: contributors are named by their places in the frame. `None`
    /// before it is known how agents write.
    fn detections(&self, agent: AgentId, entry: &Entry) -> Result<Option<DetectionFrame>, WireError> {
        let writings = self.writings.lock().unwrap_or_else(PoisonError::into_inner);
        let frame = writings.as_ref().map(|known| known.read(agent, &entry.encoding, &entry.payload));
        frame.transpose()
    }

    fn send_fused(&self, frame: &FusedFrame, entry: &Entry) {
        let truth = self.scene.and_then(|scene| scene.truth(frame.fused_at));
        let positions = frame.objects.iter().map(|object| (object.bev.x, object.bev.y));
        let errors = truth.as_deref().map(|truth| super::errors::Errors::of(positions, truth));
        let message = Fused::new(frame, entry.received_at, truth.as_deref(), errors);
        send(self.browsers, Stream::Fused(frame.hub), &Message::Fused(message));
    }

    fn next(&mut self, hub: HubId, frame: &FusedFrame) -> Next {
        let refused = frame.agents.iter().map(|health| health.refused).sum();
        let before = self.refused.insert(hub, refused);
        if before.is_some_and(|before| refused > before) { Next::AskForStatus } else { Next::Nothing }
    }
}

/// Sends a message to every browser.
pub(super) fn send(browsers: &Browsers, stream: Stream, message: &Message<'_>) {
    match serde_json::to_string(message) {
        Ok(json) => browsers.send(stream, &json),
        Err(error) => tracing::warn!(%error, "a message of the view cannot be written"),
    }
}
