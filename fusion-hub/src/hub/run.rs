//! The hub's loop: samples in, fused frames out.

use super::encoding::encode;
use super::error::HubError;
use super::fair_queue::QueueLimits;
use super::intake::Received;
use super::network::{Control, List, Network};
use super::partial_lists::PartialLists;
use super::roster::Roster;
use super::settings::HubSettings;
use super::status::{AgentStatus, HubStatus, RegistrationStatus, memory_bytes};
use super::timing::Timing;
use super::turns::{Turn, Turns};
use crate::engine::{Disposition, Engine, EngineConfig, PublishMode, Refusal, Schedule};
use std::borrow::Cow;
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::clock;
use v2x_common::fused::FusedFrame;
use v2x_common::id::{AgentId, HubId, NetworkId};
use v2x_common::keys::Keys;
use v2x_common::net::session::{self, SessionOptions};
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::ENCODING_JSON;
use zenoh::Session;

/// How often the statistics of the agents are checked.
const CHECK_INTERVAL: Duration = Duration::from_secs(1);
/// A list that is due waits for so long at most for the frames that are there.
const DRAINED_FOR: Span = Span::from_millis(5);

/// What makes a hub.
#[derive(Clone, Debug)]
pub struct HubSetup {
    /// The network to serve.
    pub network: NetworkId,
    /// How it fuses and publishes.
    pub settings: HubSettings,
    /// Where it listens, and what it joins.
    pub session: SessionOptions,
}

/// Runs a hub in this process until shutdown; returns its last status.
///
/// `on_ready` gets its name and the endpoints on which it listens, with the real port where 0 was asked for, as soon as
/// nothing that is sent there is lost.
///
/// # Errors
/// Where the Zenoh configuration cannot be used, or the endpoints are taken.
pub async fn serve(
    setup: HubSetup,
    shutdown: CancellationToken,
    engine: impl FnOnce(EngineConfig) -> Engine,
    on_ready: impl FnOnce(HubId, &[String]),
) -> Result<HubStatus, HubError> {
    let config =
        session::hub_config(&setup.session).map_err(|error| HubError::Configuration(error.into()))?;
    let session = session::open(config).await.map_err(|error| {
        let listen = &setup.session.listen;
        let endpoints = if listen.is_empty() { session::DEFAULT_ENDPOINT.into() } else { listen.join(", ") };
        HubError::Listen { endpoints, cause: error.into() }
    })?;
    let locators = session::locators(&session).await;
    let mut hub = Hub::declare(setup, engine, &session, locators).await?;
    tracing::info!(hub = %hub.settings.engine.hub, network = %hub.network_id, locators = ?hub.locators, "hub is ready");
    on_ready(hub.settings.engine.hub, &hub.locators);
    hub.serve(&shutdown).await;
    tracing::info!(hub = %hub.settings.engine.hub, published = hub.frames_published, "hub ends");
    let status = hub.status();
    drop(hub);
    session::close(session).await.map_err(|error| HubError::Close(error.into()))?;
    Ok(status)
}

struct Hub {
    network_id: NetworkId,
    settings: HubSettings,
    engine: Engine,
    schedule: Schedule,
    /// Of the second list.
    lagged_schedule: Option<Schedule>,
    timing: Timing,
    roster: Roster,
    turns: Turns,
    network: Network,
    locators: Vec<String>,
    started_at: Timestamp,
    objects: usize,
    frames_published: u64,
    publish_errors: u64,
    objects_withheld: u64,
    partial_lists: PartialLists,
    buffer: Vec<u8>,
}

impl Hub {
    async fn declare(
        HubSetup { network: network_id, mut settings, .. }: HubSetup,
        engine: impl FnOnce(EngineConfig) -> Engine,
        session: &Session,
        locators: Vec<String>,
    ) -> Result<Self, HubError> {
        let started_at = clock::now();
        settings.engine.lineage = lineage_of(started_at);
        let keys = Keys::new(network_id);
        let hub = settings.engine.hub;
        let network = Network::declare(session, &keys, &hub, settings.lagged_interval.is_some()).await;
        let network = network.map_err(|cause| HubError::Declare { hub, cause })?;
        let partial_lists = PartialLists::new(settings.tiles);
        Ok(Self {
            network_id,
            engine: engine(settings.engine),
            schedule: Schedule::new(settings.publish, started_at),
            lagged_schedule: settings
                .lagged_interval
                .map(|interval| Schedule::new(PublishMode::Fixed { interval }, started_at)),
            settings,
            timing: Timing::new(),
            roster: Roster::default(),
            turns: Turns::default(),
            network,
            locators,
            started_at,
            objects: 0,
            frames_published: 0,
            publish_errors: 0,
            objects_withheld: 0,
            partial_lists,
            buffer: Vec::new(),
        })
    }

    async fn serve(&mut self, shutdown: &CancellationToken) {
        let mut check = tokio::time::interval(CHECK_INTERVAL);
        loop {
            let (frames, control) = (self.network.frames.clone(), self.network.control.clone());
            let lagged_deadline = self.lagged_schedule.as_ref().map(Schedule::next_deadline);
            let deadline = self.schedule.next_deadline();
            let deadline = lagged_deadline.map_or(deadline, |lagged| lagged.min(deadline));
            let until_deadline = (deadline - clock::now()).to_duration();
            tokio::select! {
                biased;
                () = shutdown.cancelled() => return,
                _ = check.tick() => self.check(),
                () = control.wait() => self.handle_next().await,
                () = frames.wait() => self.handle_next().await,
                () = tokio::time::sleep(until_deadline) => {}
            }
            if self.schedule.is_due(clock::now()) {
                self.handle_waiting(shutdown).await;
                self.schedule.take_due(clock::now());
                self.publish().await;
            }
            if self.lagged_schedule.as_mut().is_some_and(|schedule| schedule.take_due(clock::now())) {
                self.publish_lagged().await;
            }
        }
    }

    /// Takes in what waits now, before a list is made that can hold it; for no longer than [`DRAINED_FOR`].
    async fn handle_waiting(&mut self, shutdown: &CancellationToken) {
        let until = clock::now() + DRAINED_FOR;
        for _ in 0..self.network.frames.len() {
            if shutdown.is_cancelled() || clock::now() >= until {
                return;
            }
            self.handle_next().await;
        }
    }

    /// Takes in what waits: a frame or something else, whose turn it is.
    async fn handle_next(&mut self) {
        let begun_at = clock::now();
        let Network { frames, control, .. } = &self.network;
        let Some(turn) = self.turns.next(frames.len() > 0, !control.is_empty()) else { return };
        match turn {
            Turn::Frame => {
                let Some(received) = frames.try_pop(begun_at) else { return };
                self.handle_frame(&received);
                self.network.frames.note_cost(&received.agent, clock::now() - begun_at);
            }
            Turn::Control => {
                let Some(event) = control.try_pop() else { return };
                self.handle_control(event).await;
            }
        }
        self.turns.note(turn, clock::now() - begun_at);
    }

    /// Counts the frames for which there was no time, and warns of agents that are refused.
    fn check(&mut self) {
        for (agent, count) in self.network.frames.take_dropped() {
            let limit = QueueLimits::DEFAULT.frames_of_agent;
            self.engine.note_refusals(agent, Refusal::QueueFull { limit }, count);
        }
        self.roster.warn_of_refused(self.engine.agents());
    }

    fn handle_frame(&mut self, received: &Received) {
        let begun_at = clock::now();
        match received.frame(&self.settings) {
            Ok((frame, unmapped_classes)) => {
                if unmapped_classes.total() > 0 {
                    self.engine.note_unmapped_classes(received.agent, &unmapped_classes);
                }
                match self.engine.handle_frame(&frame, received.received_at) {
                    Disposition::Accepted { out_of_sequence } => {
                        tracing::trace!(agent = %received.agent, sequence = frame.id.sequence, out_of_sequence);
                        self.timing.note_handled(frame.id, clock::now() - begun_at);
                        self.schedule.note_update();
                    }
                    Disposition::Refused(refusal) => {
                        tracing::debug!(agent = %received.agent, reason = refusal.reason(), %refusal, "refused");
                    }
                }
            }
            Err(refusal) => {
                tracing::debug!(agent = %received.agent, reason = refusal.reason(), %refusal, "refused");
                self.engine.note_refusal(received.agent, refusal);
            }
        }
    }

    async fn handle_control(&mut self, event: Control) {
        match event {
            Control::Description(received) if !self.settings.listens_to(&received.agent) => {}
            Control::Description(received) => match received.description() {
                // Decoded, and so valid: it is checked by the same rules.
                Ok(description) => drop(self.engine.handle_description(received.agent, description)),
                Err(error) => {
                    tracing::debug!(agent = %received.agent, %error, "sensor description refused");
                    self.engine.note_refused_description(received.agent, error);
                }
            },
            Control::Alive(agent, is_alive) => self.roster.note(agent, is_alive),
            Control::Query(query) => {
                let answer = serde_json::to_vec(&self.status()).unwrap_or_default();
                let reply = query.reply(query.key_expr().clone(), answer).encoding(ENCODING_JSON).await;
                if let Err(error) = reply {
                    tracing::debug!(%error, "status query not answered");
                }
            }
        }
    }

    async fn publish(&mut self) {
        let is_behind = self.network.frames.len() > 0;
        let begun_at = clock::now();
        self.publish_from(begun_at).await;
        let ended_at = clock::now();
        self.timing.note_cost(begun_at, ended_at);
        self.schedule.note_published(begun_at, ended_at, is_behind);
    }

    async fn publish_from(&mut self, begun_at: Timestamp) {
        let frame = self.engine.fused(begun_at);
        self.objects = frame.objects.len();
        let encoded = match put(&self.network.fused, frame, &mut self.buffer).await {
            Ok(encoded) => encoded,
            Err(error) => {
                self.publish_errors += 1;
                self.timing.forget_handled();
                tracing::warn!(%error, "fused frame not published");
                return;
            }
        };
        self.objects_withheld += (frame.objects.len() - encoded.objects.len()) as u64;
        self.frames_published += 1;
        let put_at = clock::now();
        self.timing.note_published(&frame.includes, put_at, put_at - begun_at);
        if let Err(error) = self.network.fused.put_json(frame).await {
            self.publish_errors += 1;
            tracing::warn!(%error, "fused frame not published as JSON");
        }
        if let Err(error) = self.partial_lists.publish(&encoded, &self.network.parts).await {
            self.publish_errors += 1;
            tracing::warn!(%error, "list by what changes or by tile not published");
        }
    }

    /// Publishes the second list.
    async fn publish_lagged(&mut self) {
        let Some(list) = &self.network.lagged else { return };
        let Some(frame) = self.engine.lagged(clock::now()) else { return };
        let put = async {
            put(list, frame, &mut self.buffer).await?;
            list.put_json(frame).await
        };
        if let Err(error) = put.await {
            self.publish_errors += 1;
            tracing::warn!(%error, "fused frame of the second list not published");
        }
    }

    fn status(&self) -> HubStatus {
        HubStatus {
            hub: self.settings.engine.hub,
            network: self.network_id,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            lineage: self.settings.engine.lineage,
            started_at: self.started_at.as_micros(),
            now: clock::now().as_micros(),
            locators: self.locators.clone(),
            tracks: self.engine.counts().tracks,
            objects: self.objects,
            frames_published: self.frames_published,
            publish_errors: self.publish_errors,
            dropped_overload: self.network.frames.dropped() + self.network.control.dropped(),
            refused_beyond_limit: self.engine.agents().refused_beyond_limit(),
            refused_unnamed: self.network.unnamed.samples(),
            invalid_names: self.network.unnamed.names(),
            alive_beyond_limit: self.roster.beyond_limit(),
            births_refused: self.engine.counts().births_refused,
            merges: self.engine.counts().merges,
            objects_withheld: self.objects_withheld,
            delta_frames_published: self.partial_lists.delta_frames(),
            tile_frames_published: self.partial_lists.tile_frames(),
            latency_ms: self.timing.latency_ms(),
            compute_ms: self.timing.compute_ms(),
            publish_ms: self.timing.publish_ms(),
            memory_bytes: memory_bytes(),
            agents: self.agent_statuses(),
        }
    }

    fn agent_statuses(&self) -> Vec<AgentStatus> {
        let agents = self.engine.agents();
        let silent = self.roster.alive().filter(|agent| agents.record(agent).is_none());
        let mut statuses: Vec<_> = silent.map(|agent| AgentStatus::silent(*agent)).collect();
        statuses.extend(agents.iter().map(|(agent, record)| {
            AgentStatus {
                id: *agent,
                alive: self.roster.is_alive(agent),
                accepted: record.statistics.accepted,
                synchronous: record.statistics.synchronous,
                out_of_sequence: record.statistics.out_of_sequence,
                ahead_of_time: record.statistics.ahead_of_time,
                clock_set_back: record.statistics.clock_set_back,
                refused: record
                    .statistics
                    .refused
                    .iter()
                    .map(|(reason, count)| (reason.clone().into_owned(), *count))
                    .collect(),
                last_refusal: record.statistics.last_refusal.as_ref().map(ToString::to_string),
                dropped_detections: record
                    .statistics
                    .dropped
                    .by_cause
                    .iter()
                    .map(|((field, cause), count)| (format!("{field} {cause}"), *count))
                    .collect(),
                last_dropped: record.statistics.dropped.last.as_ref().map(ToString::to_string),
                unmapped_classes: record.statistics.unmapped_classes.total(),
                unmapped_names: record
                    .statistics
                    .unmapped_classes
                    .names()
                    .map(|(name, count)| (name.to_owned(), count))
                    .collect(),
                descriptions_refused: record.statistics.descriptions_refused,
                nis_per_dof: record.statistics.recent_nis_per_dof(self.engine.now()),
                registration: self.registration_of(agent),
                learnt: self.engine.learnt(agent),
                newest_captured_at: record.newest_captured_at.map(Timestamp::as_micros),
                sensor: record.description,
            }
        }));
        statuses.sort_by_key(|status| status.id);
        statuses
    }

    fn registration_of(&self, agent: &AgentId) -> Option<RegistrationStatus> {
        self.engine.registration().find(|one| one.agent == *agent).map(|one| RegistrationStatus::of(&one))
    }
}

/// Puts a frame of a list; what was put of it.
async fn put<'a>(
    list: &List,
    frame: &'a FusedFrame,
    buffer: &mut Vec<u8>,
) -> anyhow::Result<Cow<'a, FusedFrame>> {
    let encoded = encode(frame, buffer)?;
    list.put(buffer).await?;
    Ok(encoded)
}

/// Tenths of a second since the epoch, cut to 32 bits: new at every start, for 13 years.
fn lineage_of(started_at: Timestamp) -> u32 {
    let tenths = started_at.as_nanos() / 100_000_000;
    u32::try_from(tenths & 0xffff_ffff).expect("cut to 32 bits")
}
