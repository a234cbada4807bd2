//! The loop of the replay.

use super::args::ReplayArgs;
use super::shift::{NotShifted, Shift};
use anyhow::{Context, anyhow, bail};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::clock;
use v2x_common::id::{AgentId, NetworkId};
use v2x_common::keys::{Keys, Topic};
use v2x_common::net::session;
use v2x_common::recording::{Entry, Recording, RecordingError};
use v2x_common::time::{Span, Timestamp};
use zenoh::Session;
use zenoh::liveliness::LivelinessToken;
use zenoh::qos::{CongestionControl, Priority};

/// Replays until the end, or until shutdown.
pub(crate) async fn run(args: &ReplayArgs, shutdown: &CancellationToken) -> anyhow::Result<()> {
    // Read before anything is connected: a file that is no recording is the first thing to say.
    open(args)?.next().context("the recording is empty")??;
    let timeout = Duration::try_from_secs_f64(args.wait).context("--wait is no number of seconds")?;
    let config = session::client_config(&args.session_options())?;
    let opened = session::open_patiently(config, Some(timeout), shutdown).await;
    let Some(session) = opened.context("start a hub with `v2x hub`, or give --connect")? else {
        return Ok(());
    };
    let mut replay = Replay { args, session: &session, alive: BTreeMap::new(), sent: Sent::default() };
    let replayed = replay.run(shutdown).await;
    let Replay { alive, sent, .. } = replay;
    drop(alive);
    session::close(session).await?;
    replayed?;
    let kept = sent.keeping_stamps;
    if kept > 0 {
        tracing::warn!("{kept} of {} frames kept their old stamps", sent.frames);
    }
    tracing::info!(
        frames = sent.frames,
        agents = sent.agents.len(),
        begun_again = sent.rounds,
        late_ms = sent.latest.as_millis_f64(),
        "replayed"
    );
    Ok(())
}

fn open(args: &ReplayArgs) -> anyhow::Result<impl Iterator<Item = Result<Entry, RecordingError>> + use<>> {
    Recording::open(&args.file).with_context(|| format!("opening {}", args.file.display()))
}

struct Replay<'a> {
    args: &'a ReplayArgs,
    session: &'a Session,
    alive: BTreeMap<AgentId, LivelinessToken>,
    sent: Sent,
}

/// What was sent.
#[derive(Debug, Default)]
struct Sent {
    frames: u64,
    /// How often the recording has begun again.
    rounds: u64,
    agents: BTreeSet<AgentId>,
    /// By how much a message was sent later than it should have been, at most.
    latest: Span,
    /// Frames that could not be shifted.
    keeping_stamps: u64,
    /// Whose frames they are: said once of each.
    refused_agents: BTreeSet<AgentId>,
}

impl Replay<'_> {
    async fn run(&mut self, shutdown: &CancellationToken) -> anyhow::Result<()> {
        loop {
            let sent_before = self.sent.frames;
            let is_ended = self.once(shutdown).await?;
            if self.sent.frames == sent_before {
                bail!("there are no frames of agents after --from {} s", self.args.from);
            }
            if self.sent.keeping_stamps >= self.sent.frames && !self.args.keep_stamps {
                bail!(
                    "no frame of the recording could be shifted to today, so that a hub refuses all of them"
                );
            }
            if !is_ended || !self.args.is_loop {
                return Ok(());
            }
            self.sent.rounds += 1;
            if self.sent.rounds == 1 {
                tracing::info!(
                    "the recording begins again: everything jumps back to its first place, and hubs give it new ids; scores over \
                     several rounds count that as id switches"
                );
            }
        }
    }

    /// The recording once; `false` after a shutdown.
    async fn once(&mut self, shutdown: &CancellationToken) -> anyhow::Result<bool> {
        let mut begins_at = None;
        let mut shift = None;
        for entry in open(self.args)? {
            let entry = match entry {
                Err(unfinished @ RecordingError::Unfinished { .. }) => {
                    tracing::warn!("{unfinished}; what it holds was replayed");
                    break;
                }
                entry => entry?,
            };
            let begins_at = *begins_at.get_or_insert(entry.received_at + Span::from_secs_f64(self.args.from));
            let Some(topic) = Topic::of(&entry.key) else { continue };
            let is_of_agent = matches!(topic, Topic::Detections(_) | Topic::Sensor(_) | Topic::Truth(_));
            if !is_of_agent {
                continue;
            }
            // What an agent says of its sensor holds later, too.
            let is_early = entry.received_at < begins_at;
            if is_early && !matches!(topic, Topic::Sensor(_)) {
                continue;
            }
            let speed = self.args.speed;
            let shift =
                *shift.get_or_insert_with(|| Shift { recorded: begins_at, replayed: clock::now(), speed });
            let due = shift.time(entry.received_at.max(begins_at));
            tokio::select! {
                biased;
                () = shutdown.cancelled() => return Ok(false),
                () = tokio::time::sleep((due - clock::now()).to_duration()) => {}
            }
            self.send(topic, &entry, (shift, due)).await?;
        }
        Ok(true)
    }

    async fn send(
        &mut self,
        topic: Topic,
        entry: &Entry,
        (shift, due): (Shift, Timestamp),
    ) -> anyhow::Result<()> {
        let network = self.args.network;
        let key = network.map_or_else(|| entry.key.clone(), |network| in_network(&entry.key, network));
        if let Topic::Detections(agent) | Topic::Sensor(agent) = topic {
            self.join(agent, &key).await?;
        }
        let shifted = if self.args.keep_stamps { Ok(entry.payload.clone()) } else { shift.payload(entry) };
        let payload = shifted.unwrap_or_else(|why| {
            self.note_kept(topic, &why);
            entry.payload.clone()
        });
        self.session
            .put(key, payload)
            .encoding(entry.encoding.as_str())
            .congestion_control(CongestionControl::Drop)
            .priority(Priority::DataHigh)
            .express(true)
            .await
            .map_err(|error| anyhow!("{error}"))?;
        if matches!(topic, Topic::Detections(_)) {
            self.sent.frames += 1;
            self.sent.latest = self.sent.latest.max(clock::now() - due);
        }
        Ok(())
    }

    /// A frame, or its truth, could not be shifted.
    fn note_kept(&mut self, topic: Topic, why: &NotShifted) {
        let Topic::Detections(agent) = topic else { return };
        self.sent.keeping_stamps += 1;
        if self.sent.refused_agents.insert(agent) {
            tracing::warn!(
                "a frame of {agent} is sent with its old stamps, and a hub refuses it: {why}; further ones are counted"
            );
        }
    }

    /// The agent is alive as long as the replay runs.
    async fn join(&mut self, agent: AgentId, key: &str) -> anyhow::Result<()> {
        if self.sent.agents.insert(agent)
            && let Some(network) = key.split('/').nth(1).and_then(|network| NetworkId::new(network).ok())
        {
            let token = self.session.liveliness().declare_token(Keys::new(network).agent_alive(&agent)).await;
            self.alive.insert(agent, token.map_err(|error| anyhow!("{error}"))?);
        }
        Ok(())
    }
}

/// The key in another network.
fn in_network(key: &str, network: NetworkId) -> String {
    match key.splitn(3, '/').nth(2) {
        Some(rest) => format!("v2x/{network}/{rest}"),
        None => key.to_owned(),
    }
}
