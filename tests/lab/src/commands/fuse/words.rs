//! What looks wrong with a log, in words.

use crate::data::detection_log::{DetectionLog, SensorSurvey, Survey, TimeUnits};
use std::collections::BTreeSet;
use std::io::Read;
use v2x_common::id::AgentId;
use v2x_common::time::Span;
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

/// What is found of the log that was read, and of its sensors.
pub(super) fn warnings<R: Read>(
    log: &DetectionLog<R>,
    survey: &Survey,
    (findings, has_memory): (&[Finding], bool),
) -> Vec<String> {
    let settings = log.settings();
    let sensors: Vec<_> = survey.sensors().iter().filter(|(sensor, _)| settings.listens_to(sensor)).collect();
    let times: Vec<_> =
        sensors.iter().filter_map(|(sensor, of)| Some((**sensor, times(sensor, of)?))).collect();
    let in_other_units = times.iter().map(|(sensor, _)| *sensor).collect();
    let mut warnings = without_effect(log);
    warnings.extend(times.into_iter().map(|(_, words)| words));
    if has_memory {
        let words = |(sensor, of): &(&AgentId, &SensorSurvey)| no_misses(sensor, of, log.has_poses());
        warnings.extend(sensors.iter().filter_map(words));
    }
    warnings.extend(unknown_classes(log));
    warnings.extend(found(findings, &in_other_units));
    warnings
}

/// Times that are not seconds, or of two epochs.
fn times(sensor: &AgentId, survey: &SensorSurvey) -> Option<String> {
    if let Some(TimeUnits { captured, received }) = survey.time_units() {
        let [captures, arrivals] = survey.spans().map(Span::as_secs_f64);
        let units = match (captured.name(), received.name()) {
            (captured, received) if captured == received => format!("{captured} (`t` and `t_arr`)"),
            (captured, received) => format!("{captured} (`t`) and in {received} (`t_arr`)"),
        };
        return Some(format!(
            "{sensor}: its times seem to be in {units}: over {} frames `t` goes on by {captures} and `t_arr` by {arrivals}. Write \
             both in seconds",
            survey.frames
        ));
    }
    let (shortest, longest) = survey.delay;
    let is_other = shortest > OTHER_EPOCH || longest < Span::ZERO - OTHER_EPOCH;
    is_other.then(|| {
        format!(
            "{sensor}: `t` and `t_arr` seem to count from different times: `t_arr` less `t` is {:.0} s. Write \
             both from the same time on",
            shortest.as_secs_f64()
        )
    })
}

/// Frames without a detection are evidence only where it is known what the sensor could see.
fn no_misses(sensor: &AgentId, survey: &SensorSurvey, has_columns: bool) -> Option<String> {
    let n = survey.empty_without_place;
    let change = if has_columns { "Fill in" } else { "Add" };
    (n > 0).then(|| {
        format!(
            "{sensor}: {n} of its {} frames have no detection, and none of these counts as a miss, because the sensor's place is \
             not known: objects that are gone stay until they have coasted. {change} the columns sensor_x and sensor_y (m, in the \
             map frame)",
            survey.frames
        )
    })
}

/// Tables of agents that are not in the log: mostly a name that is written differently.
fn without_effect<R: Read>(log: &DetectionLog<R>) -> Vec<String> {
    let sensors: BTreeSet<_> = log.sensors().collect();
    let names: Vec<_> = sensors.iter().map(|sensor| sensor.as_str()).collect();
    let others = log.settings().agents.keys().filter(|agent| !sensors.contains(agent));
    let words = others.map(|agent| {
        format!("[hub.agents.{agent}] has no effect: the sensors of the log are {}", names.join(", "))
    });
    words.collect()
}

/// Which line says what unknown classes are, for each sensor.
fn unknown_classes<R: Read>(log: &DetectionLog<R>) -> Vec<String> {
    let of_sensors = log.remarks().unmapped_of();
    let words = of_sensors.map(|(sensor, names)| {
        let (setting, which) = names.setting();
        format!(
            "{sensor}: {} detections of unknown classes ({}) are fused as `unknown`. Write `{setting}` under \
             `[hub.agents.{sensor}]` in the file of --hub-config, with {which}",
            names.total(),
            names.in_words()
        )
    });
    words.collect()
}

/// What the diagnosis finds, but for what the report lists with numbers of its own.
fn found(findings: &[Finding], in_other_units: &BTreeSet<AgentId>) -> Vec<String> {
    let is_listed = |code: Code| {
        matches!(
            code,
            Code::FramesRefused | Code::TimeUnit | Code::ImpossibleDetections | Code::UnknownClasses
        )
    };
    let follows = |one: &Finding| {
        OF_TIMES.contains(&one.code) && one.agent.is_some_and(|agent| in_other_units.contains(&agent))
    };
    let findings = findings.iter().filter(|one| !is_listed(one.code) && !follows(one));
    findings.map(ToString::to_string).collect()
}
