//! What the engine refuses, drops and learns of one agent.

use super::super::finding::{Code, Finding};
use super::super::window::Counts;
use super::one::{MIN_VALUES, One};

/// Refusals of a reason that are told: so many, and such a share of the frames.
const MIN_REFUSED: u64 = 3;
const REFUSED_SHARE: f64 = 0.02;
/// Refusals that are told as two processes of one name.
const TOLD_ELSEWHERE: [&str; 2] = ["duplicate", "held_off"];
/// Factors on stated standard deviations that are told.
const FACTOR: (f64, f64) = (0.5, 2.0);
/// The same of normalised innovations squared for each degree of freedom, where nothing is learnt.
const NIS: (f64, f64) = (0.25, 4.0);
/// Innovations that say anything.
const MIN_INNOVATIONS: u64 = 100;

pub(super) fn findings(one: &One<'_>) -> Vec<Finding> {
    let mut findings = refused(one);
    findings.extend(dropped(one));
    findings.extend(unknown_classes(one));
    findings.extend(description(one));
    findings.extend(stated_errors(one));
    findings
}

#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
fn refused(one: &One<'_>) -> Vec<Finding> {
    let survey = one.survey;
    let refused: u64 = survey.refused.values().map(|(count, _)| count).sum();
    // What is refused before it is decoded is no observation.
    let heard = survey.arrivals.frames;
    let frames = heard.max(refused);
    let is_told = |reason: &str, count: u64| {
        count >= MIN_REFUSED
            && count as f64 >= REFUSED_SHARE * frames as f64
            && !TOLD_ELSEWHERE.contains(&reason)
    };
    let told = survey.refused.iter().filter(|(reason, (count, _))| is_told(reason, *count));
    told.map(|(reason, (count, last))| {
        let code = match *reason {
            "wrong_time_unit" => Code::TimeUnit,
            "queue_full" => Code::Overload,
            _ => Code::FramesRefused,
        };
        let says = match code {
            Code::Overload => format!(
                "{count} of its frames were dropped for lack of time ({reason}): they wait longer than the hub takes, and {heard} \
                 were read"
            ),
            _ => format!("{count} of {frames} frames are refused ({reason}); the newest: {last}"),
        };
        one.fault(code, says, remedy(reason))
    })
    .collect()
}

/// What to do about frames that are refused.
fn remedy(reason: &str) -> &'static str {
    match reason {
        "wrong_time_unit" => {
            "`captured_at` is Unix time: whole microseconds in JSON (Python: `time.time_ns() // 1000`), nanoseconds in the \
             compact format"
        }
        "too_late" => {
            "Its clock is behind, or its link is slower than `max_latency_ms` of the hub: set the clock, or raise that"
        }
        "too_early" => "Its clock is ahead: set it (chrony, PTP)",
        "map_frame_mismatch" => "Send positions in the hub's map frame, with its name or with none",
        "agent_mismatch" => "The name in the payload and in the key must be the same; JSON may leave it out",
        "not_listened_to" => "`only_agents` of the hub's configuration leaves it out",
        "no_sensor_pose" => {
            "Send `sensor_pose` with each frame, or set the hub's `frame` for this agent to `map` or `sensor`"
        }
        "queue_full" if cfg!(debug_assertions) => {
            "This hub was built without optimisation, which costs some 20 times the time: build it with `--release`"
        }
        "queue_full" => {
            "Fewer agents, lower rates, fewer detections in each frame, or a faster machine for the hub"
        }
        "overloaded" | "too_many_frames" | "too_many_detections" | "too_large" => {
            "It sends more than its share: fewer frames, or fewer detections in each"
        }
        _ => {
            "The format is in `common/schemas/detection-frame.schema.json`; is the encoding of the sample `application/json`?"
        }
    }
}

fn since(one: &One<'_>, count: impl Fn(&Counts) -> u64) -> u64 {
    let record = one.around.engine.agents().record(&one.agent);
    record.map_or(0, |record| count(&Counts::of(record)).saturating_sub(count(&one.survey.before)))
}

fn dropped(one: &One<'_>) -> Option<Finding> {
    let count = since(one, |counts| counts.dropped);
    let record = one.around.engine.agents().record(&one.agent)?;
    let dropped = &record.statistics.dropped;
    (count > 0).then(|| {
        let causes: Vec<_> =
            dropped.by_cause.iter().map(|((field, cause), count)| format!("{field} {cause}: {count}")).collect();
        let last = dropped.last.as_ref().map(|last| format!("; the newest: {last}")).unwrap_or_default();
        let says = format!("{count} detections with impossible values are dropped ({}){last}", causes.join(", "));
        let change = "The rest of their frames is used. Longitudes, pixels or projected coordinates instead of metres in the \
                      map frame give such values";
        one.fault(Code::ImpossibleDetections, says, change)
    })
}

fn unknown_classes(one: &One<'_>) -> Option<Finding> {
    let count = since(one, |counts| counts.unmapped);
    let record = one.around.engine.agents().record(&one.agent)?;
    (count > 0).then(|| {
        let names: Vec<_> = record.statistics.unmapped_classes.names().collect();
        let list: Vec<_> = names.iter().take(8).map(|(name, count)| format!("{name:?} {count}")).collect();
        let says = format!("{count} detections are of classes that are not known ({})", list.join(", "));
        let first = names.first().map_or("name", |(name, _)| name);
        let setting = one.setting(&format!("classes = {{ {first:?} = \"car\" }}"));
        let change = format!("They are fused as `unknown`. Write {setting}, with the class that it is");
        one.fault(Code::UnknownClasses, says, change)
    })
}

fn description(one: &One<'_>) -> Option<Finding> {
    let count = since(one, |counts| counts.descriptions_refused);
    let record = one.around.engine.agents().record(&one.agent)?;
    (count > 0).then(|| {
        let last = record.statistics.last_refused_description.as_ref();
        let last = last.map(ToString::to_string).unwrap_or_default();
        let says = format!("its sensor description is refused ({count} times): {last}");
        let change = "Without it nothing is known of its field of view. The format is in \
                      `common/schemas/sensor-description.schema.json`";
        one.fault(Code::DescriptionRefused, says, change)
    })
}

fn stated_errors(one: &One<'_>) -> Option<Finding> {
    let engine = one.around.engine;
    let record = engine.agents().record(&one.agent)?;
    if record.statistics.innovations.count < MIN_INNOVATIONS || one.survey.arrivals.frames < MIN_VALUES {
        return None;
    }
    let learnt = engine.learnt(&one.agent).map(|learnt| learnt.sigma_factor).filter(|factor| *factor != 1.0);
    let by_nis = || {
        let nis = record.statistics.recent_nis_per_dof(engine.now())?;
        (!(NIS.0..=NIS.1).contains(&nis)).then(|| libm::sqrt(nis))
    };
    let factor = learnt.or_else(by_nis).filter(|factor| !(FACTOR.0..=FACTOR.1).contains(factor))?;
    let is_default = 2 * one.survey.writing.without_sigma > one.survey.writing.detections;
    let whose = if is_default { "assumed" } else { "stated" };
    let (code, word, times) = match factor > 1.0 {
        true => (Code::SigmaTooSmall, "small", factor),
        false => (Code::SigmaTooLarge, "large", 1.0 / factor),
    };
    let says =
        format!("the {whose} standard deviations of its positions are too {word}, by a factor of {times:.1}");
    let change = match is_default {
        true => format!("Write {}, as large as its errors are", one.setting("sigma_position_m = …")),
        false => {
            "Send those that its errors have; the hub corrects them as far as it has learnt them".to_owned()
        }
    };
    Some(one.fault(code, says, change))
}
