//! Steps SUMO in real time, and publishes where everything is.

use super::SumoArgs;
use super::client::Client;
use super::error::SumoError;
use super::message::Variable;
use super::objects::Objects;
use super::program::Program;
use super::record::Table;
use crate::sumo_home;
use anyhow::{Context, anyhow, ensure};
use serde_json::json;
use tokio_util::sync::CancellationToken;
use v2x_agent::trajectories::{LiveObject, WorldStep};
use v2x_common::clock;
use v2x_common::keys::Keys;
use v2x_common::net::{events, session};
use v2x_common::time::{Span, Timestamp};
use zenoh::pubsub::Publisher;

/// Steps come earlier than their time by this and a step, so that agents know the places on both sides of a capture. Nothing
/// that agents do is fed back, so that SUMO can be ahead.
const AHEAD: Span = Span::from_millis(500);
/// Time between two warnings that SUMO is too slow.
const WARN_EVERY: Span = Span::from_millis(10_000);
/// So long SUMO may be empty before the world begins, s.
const EMPTY_S: f64 = 3600.0;

/// Runs SUMO until shutdown.
pub(crate) async fn run(args: &SumoArgs, shutdown: &CancellationToken) -> anyhow::Result<()> {
    ensure!(args.begin.is_none_or(|begin| (0.0..=1e6).contains(&begin)), "--begin is no time in s, 0 to 1e6");
    let started = tokio::select! {
        started = start(args) => started?,
        () = shutdown.cancelled() => return Ok(()),
    };
    let (program, sumo) = started;
    let config = session::client_config(&args.session_options())?;
    let Some(session) = session::open_patiently(config, None, shutdown).await? else { return Ok(()) };
    let publisher = session
        .declare_publisher(Keys::new(args.network).world())
        .encoding(zenoh::bytes::Encoding::APPLICATION_JSON)
        .await
        .map_err(|error| anyhow!("declaring the world: {error}"))?;
    let table = args.record.as_deref().map(Table::create).transpose()?;
    let mut world = World { sumo, objects: Objects::default(), publisher, table, steps: 0, late_steps: 0 };
    let served = world.serve(args.events, shutdown).await;
    let World { sumo, objects, publisher, steps, late_steps, .. } = world;
    match served {
        Ok(()) => {}
        Err(Stop::Sumo(error)) => return Err(why(error, program).await),
        Err(Stop::Other(error)) => return Err(error),
    }
    sumo.close().await;
    if let Some(program) = program {
        program.end().await?;
    }
    tracing::info!(steps, late_steps, objects = objects.count(), "SUMO ends");
    if args.events {
        events::emit(
            "stopped",
            &json!({ "steps": steps, "late_steps": late_steps, "objects": objects.count() }),
        );
    }
    drop(publisher);
    session::close(session).await
}

/// Starts SUMO, or connects to one, and goes to the first time.
async fn start(args: &SumoArgs) -> anyhow::Result<(Option<Program>, Client)> {
    let (program, mut sumo, (protocol, name)) = match (&args.traci, &args.config) {
        (Some(address), _) => {
            let (sumo, version) = Client::connect(address, None).await?;
            (None, sumo, version)
        }
        (None, config) => {
            let config = config.as_deref().context("no SUMO configuration")?;
            let (program, sumo, version) = Program::start(config).await?;
            (Some(program), sumo, version)
        }
    };
    tracing::info!(protocol, "{name}");
    match sumo.go_to(args.begin.unwrap_or(f64::NEG_INFINITY)).await {
        Ok(()) => Ok((program, sumo)),
        Err(error) => Err(why(error, program).await),
    }
}

/// The cause of an error: where SUMO is ours and has ended, its own words.
async fn why(error: SumoError, program: Option<Program>) -> anyhow::Error {
    match program {
        Some(program) => program.why(error).await.into(),
        None => error.into(),
    }
}

/// Why serving stopped.
enum Stop {
    Sumo(SumoError),
    Other(anyhow::Error),
}

impl From<SumoError> for Stop {
    fn from(error: SumoError) -> Self {
        Self::Sumo(error)
    }
}

impl From<anyhow::Error> for Stop {
    fn from(error: anyhow::Error) -> Self {
        Self::Other(error)
    }
}

struct World<'a> {
    sumo: Client,
    objects: Objects,
    publisher: Publisher<'a>,
    table: Option<Table>,
    steps: u64,
    /// Published after their own time.
    late_steps: u64,
}

impl World<'_> {
    /// Publishes step after step until shutdown.
    async fn serve(&mut self, is_child: bool, shutdown: &CancellationToken) -> Result<(), Stop> {
        let step_s = tokio::select! {
            step_s = self.sumo.number(Variable::Step) => step_s?,
            () = shutdown.cancelled() => return Ok(()),
        };
        if !(1e-3..=10.0).contains(&step_s) {
            return Err(anyhow!("SUMO's step is {step_s} s, expected 0.001 to 10 s").into());
        }
        // The launcher of a child says so itself, where people see it.
        if let Some(words) = sumo_home::long_step(step_s).filter(|_| !is_child) {
            tracing::warn!("{words}");
        }
        let (first_s, objects) = tokio::select! {
            first = self.first_objects() => first?,
            () = shutdown.cancelled() => return Ok(()),
        };
        let ahead = AHEAD + Span::from_secs_f64(step_s);
        let start = clock::now() + ahead;
        if is_child {
            events::emit("ready", &json!({ "start_us": start.as_micros(), "step_s": step_s }));
        }
        let mut warned_at = start - WARN_EVERY;
        let mut t = Span::ZERO;
        self.publish(start, t, objects).await?;
        loop {
            let due = start + t + Span::from_secs_f64(step_s) - ahead;
            tokio::select! {
                () = shutdown.cancelled() => return Ok(()),
                () = tokio::time::sleep((due - clock::now()).to_duration()) => {}
            }
            let (time_s, objects) = tokio::select! {
                biased;
                next = self.next_objects() => next?,
                () = shutdown.cancelled() => return Ok(()),
            };
            t = Span::from_secs_f64(time_s - first_s);
            self.publish(start, t, objects).await?;
            self.note_lateness(start + t, &mut warned_at);
        }
    }

    /// Goes to the first time with an object, and returns it: the world begins there.
    async fn first_objects(&mut self) -> Result<(f64, Vec<LiveObject>), Stop> {
        let begin_s = self.sumo.number(Variable::Time).await?;
        loop {
            let time_s = self.sumo.number(Variable::Time).await?;
            let objects = self.objects.observe(&mut self.sumo).await?;
            if !objects.is_empty() {
                tracing::info!(time_s, "the world begins");
                return Ok((time_s, objects));
            }
            if time_s - begin_s > EMPTY_S {
                let what = "no vehicle and no person came into SUMO within an hour of its time";
                return Err(anyhow!("{what}; check its routes, or begin later by begin_s").into());
            }
            self.sumo.step(0.0).await?;
        }
    }

    /// One step: SUMO's time, s, and what is there.
    async fn next_objects(&mut self) -> Result<(f64, Vec<LiveObject>), SumoError> {
        self.sumo.step(0.0).await?;
        Ok((self.sumo.number(Variable::Time).await?, self.objects.observe(&mut self.sumo).await?))
    }

    async fn publish(&mut self, start: Timestamp, t: Span, objects: Vec<LiveObject>) -> Result<(), Stop> {
        let step = WorldStep { start_us: start.as_micros(), t_us: t.as_nanos() / 1000, objects };
        self.record(&step);
        let payload = serde_json::to_vec(&step).context("writing a step")?;
        let put = self.publisher.put(payload).await;
        put.map_err(|error| anyhow!("publishing the world: {error}"))?;
        self.steps += 1;
        Ok(())
    }

    /// Writes a step into the table, if there still is one; the network goes on without it.
    fn record(&mut self, step: &WorldStep) {
        let Some(table) = &mut self.table else { return };
        let written = if self.objects.are_countable() {
            table.write(step)
        } else {
            Err(anyhow!("a recorded world has fewer objects than there are"))
        };
        if let Err(error) = written {
            let t_s = Span::from_micros(step.t_us).as_secs_f64();
            tracing::warn!("the recording of the world ends at {t_s:.1} s: {error:#}; the network goes on");
            self.table = None;
        }
    }

    fn note_lateness(&mut self, due: Timestamp, warned_at: &mut Timestamp) {
        let now = clock::now();
        if now <= due {
            return;
        }
        self.late_steps += 1;
        if now - *warned_at >= WARN_EVERY {
            *warned_at = now;
            let behind_s = (now - due).as_secs_f64();
            tracing::warn!(
                "SUMO is slower than real time, {behind_s:.1} s behind, and agents miss frames: take longer steps or less \
                 traffic"
            );
        }
    }
}
