//! The metrics of a hub; `deploy/docs/metrics.md` lists them.

use super::of_agents;
use super::out::{Labels, Out, in_unit, label, plain, seconds};
use crate::hub::health::Verdict;
use crate::hub::monitor::{Monitor, Snapshot};
use crate::hub::processor_time;
use crate::hub::status::HubStatus;
use prometheus_client::collector::Collector;
use prometheus_client::encoding::{DescriptorEncoder, text};
use prometheus_client::registry::Registry;
use std::borrow::Cow;
use std::fmt;
use v2x_common::time::Timestamp;
use v2x_common::{clock, version};

/// Of every name.
const PREFIX: &str = "v2x_hub";

/// Everything as OpenMetrics; `None` before the hub is ready.
pub(in crate::hub) fn exposition(monitor: &Monitor) -> Result<Option<String>, fmt::Error> {
    let Some(snapshot) = monitor.newest() else { return Ok(None) };
    let mut registry = Registry::with_prefix(PREFIX);
    registry.register_collector(Box::new(Exported { snapshot, now: clock::now() }));
    let mut written = String::new();
    text::encode(&mut written, &registry)?;
    Ok(Some(written))
}

#[derive(Debug)]
struct Exported {
    snapshot: std::sync::Arc<Snapshot>,
    now: Timestamp,
}

impl Collector for Exported {
    fn encode(&self, encoder: DescriptorEncoder) -> fmt::Result {
        let mut out = Out(encoder);
        let status = &self.snapshot.status;
        process(&mut out, status)?;
        state(&mut out, status)?;
        lists(&mut out, status)?;
        refused(&mut out, status)?;
        sessions(&mut out, status)?;
        out.counter(
            &plain("candidates", "Pairs of a detection and a track that were near enough to be weighed"),
            self.snapshot.candidates,
        )?;
        spans(&mut out, &self.snapshot)?;
        recording(&mut out, status)?;
        of_agents::encode(&mut out, &status.agents, self.now)
    }
}

fn flag(is_so: bool) -> f64 {
    f64::from(u8::from(is_so))
}

#[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
fn process(out: &mut Out<'_>, status: &HubStatus) -> fmt::Result {
    let names = [
        ("version", Cow::from(version::VERSION)),
        ("commit", version::COMMIT.into()),
        ("network", status.network.to_string().into()),
        ("hub", status.hub.to_string().into()),
    ];
    out.info(&plain("build", "Which program, network and hub"), &names.into())?;
    out.gauge(
        &seconds("start_time", "When the hub started, since the Unix epoch"),
        status.started_at as f64 / 1e6,
    )?;
    out.seconds_total(
        &seconds("cpu", "Time that the whole process has had of all processors"),
        processor_time::used().as_secs_f64(),
    )?;
    let memory = status.memory_bytes.map(|bytes| (Labels::new(), bytes as f64));
    out.gauges(&in_unit("resident_memory", "bytes", "Resident memory of the process"), memory)?;
    out.gauge(
        &seconds("clock_step", "How far the system's clock is ahead of the hub's, since somebody set it"),
        status.clock_step_ms / 1e3,
    )
}

#[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
fn state(out: &mut Out<'_>, status: &HubStatus) -> fmt::Result {
    let alive = status.agents.iter().filter(|agent| agent.alive).count();
    out.gauge(&plain("tracks", "Tracks, published or not"), status.tracks as f64)?;
    out.gauge(&plain("objects", "Objects in the newest list"), status.objects as f64)?;
    out.gauge(
        &plain("agents", "Agents that are alive, or of which anything was received"),
        status.agents.len() as f64,
    )?;
    out.gauge(&plain("agents_alive", "Agents that are alive"), alive as f64)?;
    out.gauge(
        &plain("degraded", "1 where a fault was found at the last check"),
        flag(status.verdict == Verdict::Degraded),
    )?;
    let standby = status.standby.as_ref();
    let stands_by = standby.is_some_and(|standby| !standby.publishes);
    out.gauge(
        &plain("stands_by", "1 where another hub of its name publishes, and this one does not"),
        flag(stands_by),
    )?;
    out.counter(
        &plain("takeovers", "How often it began to publish for want of another hub"),
        standby.map_or(0, |standby| standby.takeovers),
    )?;
    let findings = status.findings.iter().map(|finding| {
        let agent = finding.agent.map(|agent| agent.to_string()).unwrap_or_default();
        let level = if finding.is_fault() { "fault" } else { "note" };
        (vec![("code", finding.code.name().into()), ("agent", agent.into()), ("level", level.into())], 1.0)
    });
    // Of two of one kind and agent, one: a series must be there once.
    let mut distinct: Vec<(Labels<'_>, f64)> = Vec::new();
    for row in findings {
        if !distinct.iter().any(|known| known.0 == row.0) {
            distinct.push(row);
        }
    }
    out.gauges(&plain("finding", "1 for each thing that looks wrong; v2x status says it in words"), distinct)
}

fn lists(out: &mut Out<'_>, status: &HubStatus) -> fmt::Result {
    let published = [
        (label("list", "whole"), status.frames_published),
        (label("list", "delta"), status.delta_frames_published),
        (label("list", "tile"), status.tile_frames_published),
    ];
    out.counters(&plain("lists_published", "Lists put on the network, by kind"), published)?;
    out.counter(&plain("publish_errors", "Lists that could not be encoded or put"), status.publish_errors)?;
    out.counter(
        &plain("objects_withheld", "Objects left out of a list: no room on the wire for their values"),
        status.objects_withheld,
    )?;
    out.counter(&plain("merges", "Tracks merged into an older one of the same object"), status.merges)?;
    out.counter(&plain("births_refused", "Objects not tracked for lack of room"), status.births_refused)
}

fn refused(out: &mut Out<'_>, status: &HubStatus) -> fmt::Result {
    let samples = [
        (label("reason", "unnamed"), status.refused_unnamed),
        (label("reason", "beyond_limit"), status.refused_beyond_limit),
    ];
    out.counter(&plain("samples_dropped", "Samples dropped from full queues"), status.dropped_overload)?;
    let control = &status.control;
    let kinds = [
        (label("kind", "description"), control.descriptions),
        (label("kind", "description_refused"), control.descriptions_refused),
        (label("kind", "description_left_out"), control.descriptions_left_out),
        (label("kind", "liveliness"), control.liveliness),
        (label("kind", "query"), control.queries),
        (label("kind", "query_of_another_hub"), control.queries_of_others),
        (label("kind", "query_refused"), control.queries_refused),
        (label("kind", "dropped"), control.dropped),
    ];
    out.counters(
        &plain("control_messages", "Messages beside detection frames, by what became of them"),
        kinds,
    )?;
    out.counters(&plain("samples_refused", "Samples of no agent that the hub can have"), samples)?;
    let zenoh = &status.refused_by_zenoh;
    let handshakes = zenoh.handshakes.iter().map(|(cause, count)| (label("cause", cause), *count));
    out.counters(&plain("zenoh_handshakes_refused", "TLS handshakes refused, by cause"), handshakes)?;
    out.counter(&plain("zenoh_messages_denied", "Messages that the access control denied"), zenoh.messages)
}

#[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
fn sessions(out: &mut Out<'_>, status: &HubStatus) -> fmt::Result {
    let sessions = &status.sessions;
    let of_one = sessions.most.first().map_or(0, |one| one.sessions);
    out.gauge(&plain("sessions", "Sessions of agents, consumers and routers"), sessions.total as f64)?;
    out.gauge(&plain("sessions_limit", "How many sessions there can be"), sessions.limit as f64)?;
    out.gauge(
        &plain(
            "sessions_of_one",
            "Sessions of the certificate, or of the address without one, that has most",
        ),
        of_one as f64,
    )?;
    out.counter(
        &plain("sessions_refused", "Sessions that were not let in because all places were taken"),
        sessions.refused,
    )
}

fn spans(out: &mut Out<'_>, snapshot: &Snapshot) -> fmt::Result {
    out.histogram(
        &seconds("latency", "From a frame's arrival to the first list put that contains it"),
        &snapshot.latency,
    )?;
    out.histogram(&seconds("compute", "The part of latency in which the hub worked"), &snapshot.compute)?;
    out.histogram(&seconds("publish", "What a list takes to be made and put"), &snapshot.publish)
}

fn recording(out: &mut Out<'_>, status: &HubStatus) -> fmt::Result {
    let of = |value: fn(&crate::hub::RecordingStatus) -> u64| {
        status.recording.iter().map(move |recording| (Labels::new(), value(recording)))
    };
    out.counters(&in_unit("recording", "bytes", "Bytes of the hub's own recording"), of(|it| it.bytes))?;
    out.counters(
        &plain("recording_samples_dropped", "Samples for which the disk was too slow"),
        of(|it| it.dropped),
    )?;
    let failed = status.recording.iter().map(|it| (Labels::new(), flag(it.error.is_some())));
    out.gauges(&plain("recording_failed", "1 where nothing is recorded any more"), failed)
}
