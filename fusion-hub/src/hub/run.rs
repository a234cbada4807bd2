//! The hub's loop: samples in, fused frames out.

use super::access::Access;
use super::control_counts::ControlCounts;
use super::control_queue::Control;
use super::core::{Core, Handled};
use super::error::HubError;
use super::exposure;
use super::health::{Health, Seen};
use super::intake::Received;
use super::journal::Journal;
use super::monitor::Monitor;
use super::network::{Declared, Network};
use super::on_demand::OnDemand;
use super::partial_lists::PartialLists;
use super::processor_time::ProcessorTime;
use super::recorder::{Recorder, RecordingStatus};
use super::roster::Roster;
use super::settings::HubSettings;
use super::standby::Standby;
use super::status::HubStatus;
use super::system_clock::SystemClock;
use super::timing::Timing;
use super::token_changes::TokensRead;
use super::turns::{Turn, Turns};
use crate::engine::{Engine, EngineConfig, PublishMode, Schedule};
use crate::standby::lineage_at;
use std::path::PathBuf;
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::clock;
use v2x_common::id::{HubId, NetworkId};
use v2x_common::keys::Keys;
use v2x_common::net::session::{self, SessionOptions};
use v2x_common::net::zenoh_refusals::zenoh_refusals;
use v2x_common::recording::{RecordingFile, RecordingOptions};
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::ENCODING_POSTCARD;
use v2x_common::wire::journal::Call;
use zenoh::{Config, Session};

mod beginning;
mod following;
mod liveliness;
mod own_status;

/// How often the statistics of the agents are checked: each time one pair of agents is compared, of up to twenty in ten seconds.
const CHECK_INTERVAL: Duration = Duration::from_millis(500);
/// A hub whose loop takes no step for so long did not run: it takes two a second by itself.
const HELD_UP: Span = Span::from_millis(2_000);
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
    /// The recording that it writes itself, if any: file and options.
    pub record: Option<(PathBuf, RecordingOptions)>,
    /// Where it shows itself twice a second, if anywhere.
    pub monitor: Option<Monitor>,
    /// How often this process has begun again because Zenoh's code was broken.
    pub began_again: u32,
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
    serve_by(setup, shutdown, engine, on_ready, clock::step).await
}

/// The same with another way to read how far the system's clock is ahead.
pub(super) async fn serve_by(
    setup: HubSetup,
    shutdown: CancellationToken,
    engine: impl FnOnce(EngineConfig) -> Engine,
    on_ready: impl FnOnce(HubId, &[String]),
    read_clock: fn() -> Span,
) -> Result<HubStatus, HubError> {
    let access = Access::new(&setup.session).map_err(|error| HubError::Configuration(error.into()))?;
    let config = access.in_force().clone();
    // Made first: without it nothing is to begin.
    let recording = beginning::recording(setup.record.clone(), &setup.settings)?;
    if let Some(warning) = exposure::warning(&config) {
        tracing::warn!("{warning}");
    }
    let mut session = match beginning::join(setup.network, &setup.settings, config).await {
        Ok(session) => session,
        Err(error) => {
            recording.into_iter().for_each(RecordingFile::discard);
            return Err(error);
        }
    };
    let mut hub = Hub::declare((setup, access), engine, &session, recording).await?;
    hub.system_clock = SystemClock::new(read_clock);
    tracing::info!(hub = %hub.settings.engine.hub, network = %hub.network_id, locators = ?hub.locators, "hub is ready");
    hub.show(true);
    on_ready(hub.settings.engine.hub, &hub.locators);
    while let Some(config) = hub.serve(&shutdown).await? {
        let Some(joined) = hub.rejoin(session, config, &shutdown).await? else { return Ok(hub.status()) };
        session = joined;
    }
    hub.journal.end().await;
    tracing::info!(hub = %hub.settings.engine.hub, published = hub.frames_published, "hub ends");
    let status = hub.status();
    drop(hub);
    session::close(session).await.map_err(|error| HubError::Close(error.into()))?;
    Ok(status)
}

struct Hub {
    network_id: NetworkId,
    settings: HubSettings,
    access: Access,
    core: Core,
    journal: Journal,
    schedule: Schedule,
    /// Of the second list.
    lagged_schedule: Option<Schedule>,
    timing: Timing,
    roster: Roster,
    health: Health,
    turns: Turns,
    network: Network,
    locators: Vec<String>,
    started_at: Timestamp,
    system_clock: SystemClock,
    /// When its loop took its last step.
    ran_at: Timestamp,
    processor: ProcessorTime,
    objects: usize,
    /// When the newest list was put.
    listed_at: Option<Timestamp>,
    frames_published: u64,
    publish_errors: u64,
    objects_withheld: u64,
    partial_lists: PartialLists,
    control: ControlCounts,
    standby: Option<Standby>,
    /// While all tokens are read again.
    tokens: Option<TokensRead>,
    buffer: Vec<u8>,
    monitor: Option<Monitor>,
}

impl Hub {
    async fn declare(
        (setup, access): (HubSetup, Access),
        engine: impl FnOnce(EngineConfig) -> Engine,
        session: &Session,
        recording: Option<RecordingFile>,
    ) -> Result<Self, HubError> {
        let HubSetup { network: network_id, mut settings, monitor, began_again, .. } = setup;
        let started_at = clock::now();
        settings.engine.lineage = lineage_at(started_at);
        let keys = Keys::new(network_id);
        let hub = settings.engine.hub;
        let standby = Standby::of(&settings, started_at);
        let has_lagged = settings.lagged_interval.is_some();
        let declared = Declared {
            hub,
            has_lagged,
            standby: standby.as_ref().map(|one| (settings.engine.lineage, one.settings())),
        };
        let network = Network::declare(session, &keys, declared).await;
        let network = network.map_err(|cause| HubError::Declare { hub, cause })?;
        let partial_lists = PartialLists::new(settings.tiles);
        let stream = OnDemand::declare_whole(session, keys.journal(&hub), ENCODING_POSTCARD).await;
        let stream = stream.map_err(|cause| HubError::Declare { hub, cause })?;
        let core = Core::new(settings.clone(), engine);
        let journal = Journal::new(stream, recording.map(Recorder::begin), keys, &core);
        Ok(Self {
            network_id,
            access,
            core,
            journal,
            schedule: Schedule::new(settings.publish, started_at),
            lagged_schedule: settings
                .lagged_interval
                .map(|interval| Schedule::new(PublishMode::Fixed { interval }, started_at)),
            settings,
            timing: Timing::new(),
            roster: Roster::default(),
            health: Health::of(began_again),
            turns: Turns::default(),
            network,
            locators: session::locators(session).await,
            started_at,
            system_clock: SystemClock::new(clock::step),
            ran_at: started_at,
            processor: ProcessorTime::begin(),
            objects: 0,
            listed_at: None,
            frames_published: 0,
            publish_errors: 0,
            objects_withheld: 0,
            partial_lists,
            control: ControlCounts::default(),
            standby,
            tokens: None,
            buffer: Vec::new(),
            monitor,
        })
    }

    /// Until shutdown (`None`), or until it is to open its session anew with another configuration.
    async fn serve(&mut self, shutdown: &CancellationToken) -> Result<Option<Config>, HubError> {
        // Until now it was being made.
        self.ran_at = clock::now();
        self.begin_to_listen().await?;
        let mut check = tokio::time::interval(CHECK_INTERVAL);
        loop {
            let (frames, control) = (self.network.frames.clone(), self.network.control.clone());
            let lagged_deadline = self.lagged_schedule.as_ref().map(Schedule::next_deadline);
            let deadline = self.standby_deadline().min(self.schedule.next_deadline());
            let deadline = lagged_deadline.map_or(deadline, |lagged| lagged.min(deadline));
            let until_deadline = (deadline - clock::now()).to_duration();
            tokio::select! {
                biased;
                () = shutdown.cancelled() => return Ok(None),
                _ = check.tick() => {
                    self.check().await;
                    if let Some(config) = self.access.changed(clock::now()) {
                        return Ok(Some(config));
                    }
                }
                () = control.wait() => self.handle_next().await,
                () = frames.wait() => self.handle_next().await,
                () = tokio::time::sleep(until_deadline) => {}
            }
            self.follow().await?;
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

    /// Leaves the network and joins it again with another configuration. Its objects and counts stay.
    async fn rejoin(
        &mut self,
        session: Session,
        config: Config,
        shutdown: &CancellationToken,
    ) -> Result<Option<Session>, HubError> {
        tracing::info!("the Zenoh configuration was written anew: the session is opened anew, objects stay");
        self.show(false);
        self.journal.flush().await;
        // A client that reads nothing more can hold the old one: that ends no hub.
        if let Err(error) = session::close(session).await {
            tracing::warn!("{error:#}; going on");
        }
        let Some(session) = self.access.reopen(config, &self.locators, shutdown).await else {
            return Ok(None);
        };
        let (keys, hub) = (Keys::new(self.network_id), self.settings.engine.hub);
        self.roster.begin_anew();
        self.tokens = None;
        let joined = async {
            self.network.rejoin(&session, &keys).await?;
            self.journal
                .rejoin(OnDemand::declare_whole(&session, keys.journal(&hub), ENCODING_POSTCARD).await?);
            zenoh::Result::Ok(())
        };
        joined.await.map_err(|cause| HubError::Declare { hub, cause })?;
        self.locators = session::locators(&session).await;
        tracing::info!(locators = ?self.locators, "hub is ready again");
        Ok(Some(session))
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
        self.check_held_up();
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
        if self.journal.is_full() {
            self.journal.flush().await;
        }
    }

    /// Whether the hub did not run for a while, stopped by a signal or by a system that has no time for it.
    fn check_held_up(&mut self) {
        let now = clock::now();
        let (lasted, busy) = (now - self.ran_at, self.processor.take());
        self.ran_at = now;
        // What it has computed for is no pause.
        if lasted - busy < HELD_UP {
            return;
        }
        tracing::warn!("this hub did not run for {:.1} s; it goes on with its objects", lasted.as_secs_f64());
        self.journal.note(&Call::HeldUp { now, lasted });
        self.core.note_held_up(now, lasted);
    }

    /// Notes that somebody has set the system's clock. The hub's own timeline goes on.
    fn check_clock(&mut self) {
        let Some((step, words)) = self.system_clock.was_set() else { return };
        tracing::warn!("{words}");
        self.journal.note(&Call::ClockStep { step });
        self.core.note_clock_step(step);
    }

    /// Counts the frames for which there was no time, and judges what is wrong.
    async fn check(&mut self) {
        self.check_held_up();
        for (agent, count) in self.network.frames.take_dropped() {
            self.journal.note(&Call::QueueFull { agent, count });
            self.core.note_queue_full(agent, count);
        }
        let seen = Seen {
            roster: &self.roster,
            started_at: self.started_at,
            dropped: self.dropped(),
            invalid_names: self.network.unnamed.names(),
            strays: self.network.strays.findings(self.network_id, clock::now()),
            twin: self.network.twin.lineage(clock::now()).filter(|_| self.has_rival()),
            standby_differs: self.standby.as_ref().and_then(|standby| standby.differs(clock::now())),
            is_access_behind: self.access.is_behind(),
            refused_by_zenoh: zenoh_refusals(),
            sessions: self.access.sessions(),
            recording: self.journal.recorder().map(RecordingStatus::of),
        };
        self.health.check(&mut self.core, &seen, clock::now());
        self.heal_roster(clock::now()).await;
        self.access.log_refusals(clock::now());
        self.journal.flush().await;
        self.show(true);
    }

    fn handle_frame(&mut self, received: &Received) {
        let begun_at = clock::now();
        let Received { agent, received_at, .. } = *received;
        let body = received.body();
        self.journal.note(&Call::Frame { agent, received_at, body });
        match self.core.handle_frame(agent, received_at, &body) {
            Handled::Accepted { frame, out_of_sequence } => {
                tracing::trace!(%agent, sequence = frame.sequence, out_of_sequence);
                self.timing.note_handled(frame, clock::now() - begun_at);
                // One that stands by needs no list of every update.
                if self.publishes() {
                    self.schedule.note_update();
                }
            }
            Handled::Refused(refusal) => {
                tracing::debug!(%agent, reason = refusal.reason(), %refusal, "refused");
            }
        }
    }

    async fn handle_control(&mut self, event: Control) {
        match event {
            Control::Description(received) => {
                let agent = received.agent;
                let body = received.body();
                self.journal.note(&Call::Description { agent, body });
                let is_heard = self.settings.listens_to(&agent);
                // A refused one is counted by its agent and logged, too.
                let count = match self.core.handle_description(agent, &body) {
                    Ok(()) if is_heard => &mut self.control.descriptions,
                    Ok(()) => &mut self.control.descriptions_left_out,
                    Err(_) => &mut self.control.descriptions_refused,
                };
                *count += 1;
            }
            Control::Token(change) => self.note_token(&change),
            Control::StatusQuery(query, asked) => {
                let said = self.status_answer(asked);
                self.network.control.answer(query, said);
            }
            // The journal is that of the hub that publishes.
            Control::JournalQuery(query) if !self.publishes() => {
                self.control.queries_of_others += 1;
                self.network.control.answer(query, None);
            }
            Control::JournalQuery(query) => {
                self.control.queries += 1;
                self.journal.start(&self.core, clock::now());
                self.journal.flush().await;
                let lineage = self.settings.engine.lineage;
                let key = Keys::new(self.network_id).journal(&self.settings.engine.hub);
                let json = serde_json::json!({ "lineage": lineage }).to_string().into_bytes();
                self.network.control.answer(query, Some((key, json)));
            }
        }
    }

    async fn publish(&mut self) {
        self.check_held_up();
        self.check_clock();
        let is_behind = self.network.frames.len() > 0;
        let begun_at = clock::now();
        self.publish_from(begun_at).await;
        let ended_at = clock::now();
        self.timing.note_cost(begun_at, ended_at);
        self.schedule.note_published(begun_at, ended_at, is_behind);
        self.journal.renew(&self.core);
        self.journal.flush().await;
    }

    async fn publish_from(&mut self, begun_at: Timestamp) {
        if !self.publishes() {
            return self.make_unpublished(begun_at);
        }
        let now = self.after_heard(begun_at);
        self.journal.note(&Call::Fused { now });
        let frame = self.core.fused(now);
        self.objects = frame.objects.len();
        let encoded = match self.network.fused.put_frame(frame, &mut self.buffer).await {
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
        self.standby.iter_mut().for_each(|standby| standby.note_published(frame));
        let put_at = clock::now();
        self.listed_at = Some(put_at);
        self.timing.note_published(&frame.includes, put_at, put_at - begun_at);
        self.journal.note_list(Keys::fused, &self.buffer);
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
        let Some(list) = self.network.lagged.as_ref().filter(|_| self.publishes()) else { return };
        let now = self.after_heard(clock::now());
        self.journal.note(&Call::Lagged { now });
        let Some(frame) = self.core.lagged(now) else { return };
        let put = async {
            list.put_frame(frame, &mut self.buffer).await?;
            self.journal.note_list(Keys::lagged, &self.buffer);
            list.put_json(frame).await
        };
        if let Err(error) = put.await {
            self.publish_errors += 1;
            tracing::warn!(%error, "fused frame of the second list not published");
        }
        self.journal.flush().await;
    }

    /// Samples dropped from full queues.
    fn dropped(&self) -> u64 {
        self.network.frames.dropped() + self.network.control.dropped()
    }
}
