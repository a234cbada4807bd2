//! Metrics of each agent.

use super::out::{Family, Labels, Out, in_unit, label, plain, seconds};
use crate::hub::status::{AgentStatus, RegistrationStatus};
use crate::learning::LearntSensorReport;
use std::fmt;
use v2x_common::time::Timestamp;

/// Writes them.
pub(super) fn encode(out: &mut Out<'_>, agents: &[AgentStatus], now: Timestamp) -> fmt::Result {
    frames(out, agents)?;
    refused(out, agents)?;
    arrivals(out, agents, now)?;
    offsets(out, agents)?;
    learnt(out, agents)
}

fn of(agent: &AgentStatus) -> Labels<'static> {
    label("agent", agent.id.to_string())
}

fn counted(
    out: &mut Out<'_>,
    family: &Family,
    agents: &[AgentStatus],
    count: fn(&AgentStatus) -> u64,
) -> fmt::Result {
    out.counters(family, agents.iter().map(|agent| (of(agent), count(agent))))
}

/// A gauge of each agent that has a value.
fn known(
    out: &mut Out<'_>,
    family: &Family,
    agents: &[AgentStatus],
    value: impl Fn(&AgentStatus) -> Option<f64>,
) -> fmt::Result {
    out.gauges(family, agents.iter().filter_map(|agent| Some((of(agent), value(agent)?))))
}

fn frames(out: &mut Out<'_>, agents: &[AgentStatus]) -> fmt::Result {
    let is_alive = |agent: &AgentStatus| Some(f64::from(u8::from(agent.alive)));
    known(out, &plain("agent_alive", "1 where the agent is alive"), agents, is_alive)?;
    counted(out, &plain("agent_frames_accepted", "Frames accepted"), agents, |agent| agent.accepted)?;
    counted(
        out,
        &plain("agent_frames_out_of_sequence", "Frames accepted that were older than others before"),
        agents,
        |agent| agent.out_of_sequence,
    )?;
    counted(
        out,
        &plain("agent_frames_ahead_of_time", "Frames accepted that lay in the future"),
        agents,
        |agent| agent.ahead_of_time,
    )
}

fn refused(out: &mut Out<'_>, agents: &[AgentStatus]) -> fmt::Result {
    let by = |name: &'static str, map: fn(&AgentStatus) -> &std::collections::BTreeMap<String, u64>| {
        agents.iter().flat_map(move |agent| {
            map(agent).iter().map(move |(key, count)| {
                (vec![("agent", agent.id.to_string().into()), (name, key.into())], *count)
            })
        })
    };
    out.counters(
        &plain("agent_frames_refused", "Frames refused, by reason"),
        by("reason", |agent| &agent.refused),
    )?;
    out.counters(
        &plain("agent_detections_dropped", "Impossible detections of accepted frames, by field and cause"),
        by("cause", |agent| &agent.dropped_detections),
    )?;
    counted(out, &plain("agent_descriptions_refused", "Sensor descriptions refused"), agents, |agent| {
        agent.descriptions_refused
    })?;
    counted(
        out,
        &plain("agent_unmapped_classes", "Detections whose class name was not known"),
        agents,
        |agent| agent.unmapped_classes,
    )
}

fn arrivals(out: &mut Out<'_>, agents: &[AgentStatus], now: Timestamp) -> fmt::Result {
    #[expect(clippy::cast_precision_loss, reason = "an age in µs, far below 2^53")]
    let age = |agent: &AgentStatus| Some((now.as_micros() - agent.newest_captured_at?) as f64 / 1e6);
    known(out, &seconds("agent_age", "Age of the newest accepted frame, by its capture"), agents, age)?;
    known(out, &in_unit("agent_rate", "hertz", "Frames a second"), agents, |agent| {
        Some(agent.transport?.rate_hz)
    })?;
    known(out, &seconds("agent_delay", "Mean time from capture to arrival"), agents, |agent| {
        Some(agent.transport?.delay_ms / 1e3)
    })?;
    known(out, &seconds("agent_jitter", "Its standard deviation"), agents, |agent| {
        Some(agent.transport?.jitter_ms / 1e3)
    })?;
    known(
        out,
        &in_unit("agent_missing", "ratio", "Share of frames missing by their sequence numbers"),
        agents,
        |agent| agent.transport?.missing,
    )?;
    known(
        out,
        &plain(
            "agent_nis_per_dof",
            "Normalised innovation squared for each degree of freedom: 1 is consistent",
        ),
        agents,
        |agent| agent.nis_per_dof,
    )
}

/// Errors of clock and pose: estimated, and as applied in correction.
fn offsets(out: &mut Out<'_>, agents: &[AgentStatus]) -> fmt::Result {
    let estimated = || agents.iter().filter_map(|agent| Some((agent, agent.registration.as_ref()?)));
    let row = |agent: &AgentStatus, kind: &'static str, axis: Option<&'static str>| {
        let mut labels = of(agent);
        labels.extend(axis.map(|axis| ("axis", axis.into())));
        labels.push(("kind", kind.into()));
        labels
    };
    let meters = estimated().flat_map(|(agent, it)| {
        [
            (row(agent, "estimated", Some("east")), it.dx_m),
            (row(agent, "estimated", Some("north")), it.dy_m),
            (row(agent, "applied", Some("east")), it.applied_dx_m),
            (row(agent, "applied", Some("north")), it.applied_dy_m),
        ]
    });
    out.gauges(&in_unit("agent_offset", "meters", "Error of its position, as shared objects show"), meters)?;
    let pair = |values: fn(&RegistrationStatus) -> [f64; 2]| {
        estimated().flat_map(move |(agent, it)| {
            let [estimate, applied] = values(it);
            [(row(agent, "estimated", None), estimate), (row(agent, "applied", None), applied)]
        })
    };
    out.gauges(
        &in_unit("agent_offset_yaw", "radians", "Error of its heading"),
        pair(|it| [it.dyaw_deg.to_radians(), it.applied_dyaw_deg.to_radians()]),
    )?;
    out.gauges(
        &seconds("agent_offset_clock", "Error of its clock"),
        pair(|it| [it.clock_ms / 1e3, it.applied_clock_ms / 1e3]),
    )
}

/// How far an agent is trusted.
fn learnt(out: &mut Out<'_>, agents: &[AgentStatus]) -> fmt::Result {
    let of = |value: fn(&LearntSensorReport) -> Option<f64>| {
        move |agent: &AgentStatus| value(agent.learnt.as_ref()?)
    };
    known(
        out,
        &plain("agent_detection_probability", "Learnt probability that an object in view is detected"),
        agents,
        of(|it| it.detection_probability),
    )?;
    known(
        out,
        &plain("agent_false_detections", "Learnt number of false detections in a frame"),
        agents,
        of(|it| it.false_per_frame),
    )?;
    known(
        out,
        &plain("agent_sigma_factor", "Learnt factor on its declared standard deviations: 1 is right"),
        agents,
        of(|it| Some(it.sigma_factor)),
    )?;
    known(
        out,
        &in_unit("agent_class_right", "ratio", "Learnt probability that its class is right"),
        agents,
        of(|it| Some(it.class_right)),
    )?;
    known(
        out,
        &in_unit("agent_turned_headings", "ratio", "Learnt share of headings turned by half a turn"),
        agents,
        of(|it| Some(it.turned_headings)),
    )
}
