//! What looks wrong with a log, in words.

use crate::data::detection_log::{DetectionLog, SensorSurvey, Survey, TimeUnits};
use std::collections::BTreeSet;
use std::io::Read;
use v2x_common::id::AgentId;
use v2x_common::spelling::nearest;
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::diagnosis::{Code, Finding};

/// Times of capture and arrival that are farther apart than this are of different epochs.
const OTHER_EPOCH: Span = Span::from_millis(100 * 86_400_000);
/// What follows from times in a wrong unit.
const OF_TIMES: [Code; 8] = [
    Code::ClockAhead,
    Code::ClockBehind,
    Code::ClockBehindOrLinkSlow,
    Code::LinkSlow,
    Code::Gaps,
    Code::RateLow,
    Code::Jitter,
    Code::Silent,
];

/// What is found of the log that was read, and of its sensors: what concerns single sensors with their names.
pub(super) fn findings<R: Read>(
    log: &DetectionLog<R>,
    survey: &Survey,
    (findings, has_memory): (&[Finding], bool),
) -> Vec<Finding> {
    let settings = log.settings();
    let sensors: Vec<_> = survey.sensors().iter().filter(|(sensor, _)| settings.listens_to(sensor)).collect();
    let times: Vec<_> = sensors.iter().filter_map(|(sensor, of)| times(sensor, of)).collect();
    let in_other_units = times.iter().filter_map(|one| one.agent).collect();
    let mut all = without_effect(log);
    all.extend(times);
    if has_memory {
        let misses = |(sensor, of): &(&AgentId, &SensorSurvey)| no_misses(sensor, of, log.has_poses());
        all.extend(sensors.iter().filter_map(misses));
    }
    // In another unit of time all of them are long.
    let with_seconds = sensors.iter().filter(|(_, of)| of.time_units().is_none());
    all.extend(with_seconds.filter_map(|(sensor, _)| hole(sensor, survey)));
    all.extend(unknown_classes(log));
    all.extend(found(findings, &in_other_units));
    all
}

/// A finding of the log itself.
fn of_log(code: Code, sensor: Option<AgentId>, says: String, change: impl Into<String>) -> Finding {
    Finding { agent: sensor, ..Finding::of_network(code, says, change) }
}

/// Times that are not seconds, or of two epochs.
fn times(sensor: &AgentId, survey: &SensorSurvey) -> Option<Finding> {
    if let Some(TimeUnits { captured, received }) = survey.time_units() {
        let [captures, arrivals] = survey.spans().map(Span::as_secs_f64);
        let units = match (captured.name(), received.name()) {
            (captured, received) if captured == received => format!("{captured} (`t` and `t_arr`)"),
            (captured, received) => format!("{captured} (`t`) and in {received} (`t_arr`)"),
        };
        let says = format!(
            "its times seem to be in {units}: over {} frames `t` goes on by {captures} and `t_arr` by {arrivals}",
            survey.frames
        );
        let per_second = [("t", captured.per_second()), ("t_arr", received.per_second())];
        let divided = per_second.into_iter().filter(|(_, n)| *n > 1);
        let divided: Vec<_> = divided.map(|(column, n)| format!("`{column}` by {n}")).collect();
        let change = format!("Write both in seconds: divide {}", divided.join(" and "));
        return Some(of_log(Code::TimeUnit, Some(*sensor), says, change));
    }
    let (shortest, longest) = survey.delay;
    let is_other = shortest > OTHER_EPOCH || longest < Span::ZERO - OTHER_EPOCH;
    is_other.then(|| {
        let says = format!(
            "`t` and `t_arr` seem to count from different times: `t_arr` less `t` is {:.0} s",
            shortest.as_secs_f64()
        );
        of_log(Code::TimeUnit, Some(*sensor), says, "Write both from the same time on")
    })
}

/// Times without a frame.
fn hole(sensor: &AgentId, survey: &Survey) -> Option<Finding> {
    let (holes, usual_s) = survey.holes(sensor);
    let (from, to) = *holes.first()?;
    let since_epoch_s = |at: Timestamp| (at - Timestamp::EPOCH).as_secs_f64();
    let more = match holes.len() {
        1 => String::new(),
        n => format!(", the longest of {n} such times"),
    };
    let says = format!(
        "it has no frame for {:.1} s, from t = {:.1} to {:.1} s{more}: usually one comes each {:.2} s",
        (to - from).as_secs_f64(),
        since_epoch_s(from),
        since_epoch_s(to),
        usual_s
    );
    let change = "If rows were lost there, what it saw is not fused. If it saw nothing, write a row for each frame all the same, with t_arr, t and \
                  sensor_id and nothing else: only so it counts as seen to be empty";
    Some(of_log(Code::Gaps, Some(*sensor), says, change).as_note())
}

/// Frames without a detection are evidence only where it is known what the sensor could see.
fn no_misses(sensor: &AgentId, survey: &SensorSurvey, has_columns: bool) -> Option<Finding> {
    let n = survey.empty_without_place;
    (n > 0).then(|| {
        let says = format!(
            "{n} of its {} frames have no detection, and none of these counts as a miss, because the sensor's place is not known: \
             objects that are gone stay until they have coasted",
            survey.frames
        );
        let change = if has_columns { "Fill in" } else { "Add" };
        let change = format!("{change} the columns sensor_x and sensor_y (m, in the map frame)");
        of_log(Code::Silent, Some(*sensor), says, change).as_note()
    })
}

/// Settings of agents that are not in the log: mostly a name that is written differently.
fn without_effect<R: Read>(log: &DetectionLog<R>) -> Vec<Finding> {
    let sensors: BTreeSet<_> = log.sensors().collect();
    let names: Vec<_> = sensors.iter().map(|sensor| sensor.as_str()).collect();
    let settings = log.settings();
    let tables = settings.agents.keys().map(|agent| (agent, format!("[hub.agents.{agent}]")));
    let listed = settings.only_agents.iter().map(|agent| (agent, format!("{agent} in `only_agents`")));
    let others = tables.chain(listed).filter(|(agent, _)| !sensors.contains(agent));
    let finding = |(agent, what): (&AgentId, String)| {
        let change = match nearest(agent.as_str(), names.iter().copied()) {
            Some(name) => format!("Did you mean {name}?"),
            None => "Write the name of a sensor, or remove it".to_owned(),
        };
        let says = format!("{what} has no effect: the sensors of the log are {}", names.join(", "));
        of_log(Code::Missing, None, says, change).as_note()
    };
    others.map(finding).collect()
}

/// Which line says what unknown classes are, for each sensor.
fn unknown_classes<R: Read>(log: &DetectionLog<R>) -> Vec<Finding> {
    let of_sensors = log.remarks().unmapped_of();
    let findings = of_sensors.map(|(sensor, names)| {
        let (setting, which) = names.setting();
        let says = format!(
            "{} detections of unknown classes ({}) are fused as `unknown`",
            names.total(),
            names.in_words()
        );
        let change = if names.have_scores() {
            "Write in the column class the class alone, such as car, and the number beside it in the column score, from 0 to 1".to_owned()
        } else {
            format!("Write `{setting}` under `[hub.agents.{sensor}]` in the file of --hub-config, with {which}")
        };
        of_log(Code::UnknownClasses, Some(*sensor), says, change).as_note()
    });
    findings.collect()
}

/// What the diagnosis finds, but for what the report lists with numbers of its own, and for what follows from times in a wrong unit.
fn found(findings: &[Finding], in_other_units: &BTreeSet<AgentId>) -> Vec<Finding> {
    let is_listed = |code: Code| {
        matches!(
            code,
            Code::FramesRefused | Code::TimeUnit | Code::ImpossibleDetections | Code::UnknownClasses
        )
    };
    let follows = |one: &Finding| {
        OF_TIMES.contains(&one.code) && one.agent.is_some_and(|agent| in_other_units.contains(&agent))
    };
    findings.iter().filter(|one| !is_listed(one.code) && !follows(one)).cloned().collect()
}
