//! Warnings in words: what is probably wrong with an input, as its numbers show it.

use crate::diagnose::offset::Offset;
use crate::diagnose::survey::SensorSurvey;
use std::collections::BTreeMap;
use std::fmt;
use v2x_common::id::AgentId;
use v2x_common::reported::RawHeadings;
use v2x_common::time::Span;

/// Fewest values that show anything.
const MIN_VALUES: u64 = 10;
/// Share of headings beyond a whole turn from which they are no radians: radians that are not wrapped exceed a turn rarely,
/// and by little.
const DEGREES_SHARE: f64 = 0.3;
/// The largest heading of radians that are not wrapped, rad; and of degrees, with a margin for rounding.
const MOST_RADIANS: f64 = 15.0;
const MOST_DEGREES: f64 = 360.5;
/// Share of vehicles that are wider than long from which width and depth are swapped.
const SWAPPED_SHARE: f64 = 0.8;
/// Frames that arrive later than this after their capture, and this much later than another sensor's.
const LONG_DELAY: Span = Span::from_millis(250);
const MORE_DELAY: Span = Span::from_millis(200);
/// Normalised innovations squared per degree of freedom beyond which stated errors are false by a factor of two.
const HIGH_NIS: f64 = 4.0;
const LOW_NIS: f64 = 0.25;
const MIN_INNOVATIONS: u64 = 100;

/// What is probably wrong.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Warning {
    /// Headings in degrees.
    Degrees {
        /// Which sensor's.
        sensor: AgentId,
        /// The largest one.
        largest: f64,
    },
    /// Width and depth in the wrong order.
    SwappedSizes {
        /// Which sensor's.
        sensor: AgentId,
        /// Vehicles that are wider than long.
        wide: u64,
        /// All vehicles.
        vehicles: u64,
    },
    /// Map frames that differ.
    Offset(Offset),
    /// Frames that arrive before they are captured.
    ClockAhead {
        /// Which sensor's.
        sensor: AgentId,
        /// By how much at least.
        by: Span,
    },
    /// Frames that all arrive late.
    ClockBehind {
        /// Which sensor's.
        sensor: AgentId,
        /// The shortest delay.
        delay: Span,
    },
    /// Stated errors that are false.
    StatedErrors {
        /// Which sensor's.
        sensor: AgentId,
        /// Normalised innovation squared per degree of freedom.
        nis_per_dof: f64,
    },
}

/// What the rows of a log show.
pub(crate) fn of_log(
    sensors: &BTreeMap<AgentId, SensorSurvey>,
    headings: &BTreeMap<AgentId, RawHeadings>,
    offsets: Vec<Offset>,
) -> Vec<Warning> {
    let mut warnings: Vec<_> = headings.iter().filter_map(|(sensor, of)| degrees(*sensor, of)).collect();
    warnings.extend(sensors.iter().filter_map(|(sensor, of)| swapped_sizes(*sensor, of)));
    warnings.extend(offsets.into_iter().map(Warning::Offset));
    let fastest = sensors.values().map(|of| of.delay.0).min().unwrap_or(Span::ZERO);
    warnings.extend(sensors.iter().filter_map(|(sensor, of)| clock(*sensor, of, fastest)));
    warnings
}

/// Headings in degrees.
#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
fn degrees(sensor: AgentId, headings: &RawHeadings) -> Option<Warning> {
    let RawHeadings { n, beyond_a_turn, largest } = *headings;
    let is_degrees = n >= MIN_VALUES
        && beyond_a_turn as f64 >= DEGREES_SHARE * n as f64
        && (MOST_RADIANS..=MOST_DEGREES).contains(&largest);
    is_degrees.then_some(Warning::Degrees { sensor, largest })
}

#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
fn swapped_sizes(sensor: AgentId, survey: &SensorSurvey) -> Option<Warning> {
    let (vehicles, wide) = (survey.vehicles, survey.wide_vehicles);
    let is_swapped = vehicles >= MIN_VALUES && wide as f64 >= SWAPPED_SHARE * vehicles as f64;
    is_swapped.then_some(Warning::SwappedSizes { sensor, wide, vehicles })
}

fn clock(sensor: AgentId, survey: &SensorSurvey, fastest: Span) -> Option<Warning> {
    let delay = survey.delay.0;
    if delay < Span::ZERO {
        return Some(Warning::ClockAhead { sensor, by: -delay });
    }
    let is_late = delay > LONG_DELAY && delay - fastest > MORE_DELAY;
    is_late.then_some(Warning::ClockBehind { sensor, delay })
}

/// What the innovations of a sensor's detections show of the errors that it states.
pub(crate) fn stated_errors(sensor: AgentId, nis_per_dof: Option<f64>, innovations: u64) -> Option<Warning> {
    let nis_per_dof = nis_per_dof.filter(|nis| !(LOW_NIS..=HIGH_NIS).contains(nis))?;
    (innovations >= MIN_INNOVATIONS).then_some(Warning::StatedErrors { sensor, nis_per_dof })
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Degrees { sensor, largest } => {
                write!(
                    f,
                    "{sensor}: the headings (yaw, up to {largest}) seem to be in degrees, expected radians"
                )
            }
            Self::SwappedSizes { sensor, wide, vehicles } => write!(
                f,
                "{sensor}: {wide} of {vehicles} vehicles are wider than long; are w (across) and d (along the heading) \
                 swapped?"
            ),
            Self::Offset(Offset { sensors: [a, b], by_m: [x, y], share }) => write!(
                f,
                "the objects of {b} lie {x:+.2} m east and {y:+.2} m north of those of {a} ({:.0} % of {a}'s detections \
                 near {b}'s); are both in one map frame?",
                100.0 * share
            ),
            Self::ClockAhead { sensor, by } => {
                write!(f, "{sensor}: frames arrive up to {by} before their capture; its clock is ahead")
            }
            Self::ClockBehind { sensor, delay } => write!(
                f,
                "{sensor}: every frame arrives at least {delay} after its capture; its clock is behind, or its link is slow"
            ),
            Self::StatedErrors { sensor, nis_per_dof } => {
                let (factor, word) = if *nis_per_dof > 1.0 {
                    (libm::sqrt(*nis_per_dof), "small")
                } else {
                    (1.0 / libm::sqrt(*nis_per_dof), "large")
                };
                write!(
                    f,
                    "{sensor}: the stated standard deviations seem too {word} by a factor of {factor:.1} (NIS/dof \
                     {nis_per_dof:.2}, 1 is consistent)"
                )
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::time::Timestamp;

    fn name(name: &str) -> AgentId {
        AgentId::new(name).unwrap()
    }

    const SOUND: SensorSurvey = SensorSurvey {
        frames: 100,
        detections: 100,
        captured: (Timestamp::EPOCH, Timestamp::EPOCH),
        delay: (Span::from_millis(20), Span::from_millis(400)),
        vehicles: 100,
        wide_vehicles: 60,
    };
    const RADIANS: RawHeadings = RawHeadings { n: 100, beyond_a_turn: 20, largest: 14.0 };

    fn of(survey: SensorSurvey, headings: RawHeadings) -> Vec<String> {
        let sensors = BTreeMap::from([(name("a"), SOUND), (name("b"), survey)]);
        let headings = BTreeMap::from([(name("a"), RADIANS), (name("b"), headings)]);
        of_log(&sensors, &headings, Vec::new()).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn a_sound_log_and_single_odd_values_give_no_warning() {
        assert!(of(SOUND, RADIANS).is_empty());
        assert!(of(SOUND, RawHeadings { n: 100, beyond_a_turn: 20, largest: 300.0 }).is_empty(), "a few");
        assert!(of(SOUND, RawHeadings { n: 100, beyond_a_turn: 100, largest: 1e4 }).is_empty(), "no degrees");
        assert!(of(SensorSurvey { vehicles: 5, wide_vehicles: 5, ..SOUND }, RADIANS).is_empty());
        assert!(stated_errors(name("a"), Some(3.9), 1000).is_none());
        assert!(stated_errors(name("a"), Some(30.0), 20).is_none());
        assert!(stated_errors(name("a"), None, 0).is_none());
    }

    #[test]
    fn each_fault_has_its_warning_with_the_sensor_and_the_value() {
        let delayed =
            |low, high| SensorSurvey { delay: (Span::from_millis(low), Span::from_millis(high)), ..SOUND };
        let cases = [
            (
                of(SOUND, RawHeadings { n: 60, beyond_a_turn: 60, largest: 225.0 }),
                "up to 225) seem to be in degrees",
            ),
            (
                of(SensorSurvey { wide_vehicles: 90, ..SOUND }, RADIANS),
                "90 of 100 vehicles are wider than long",
            ),
            (of(delayed(-300, 10), RADIANS), "clock is ahead"),
            (of(delayed(400, 500), RADIANS), "clock is behind, or its link is slow"),
        ];
        for (warnings, expected) in cases {
            assert_eq!(warnings.len(), 1, "{warnings:?}");
            assert!(warnings[0].starts_with("b: ") && warnings[0].contains(expected), "{warnings:?}");
        }
        let small = stated_errors(name("a"), Some(9.0), 1000).unwrap().to_string();
        assert!(small.contains("too small by a factor of 3.0"), "{small}");
        let large = stated_errors(name("a"), Some(0.04), 1000).unwrap().to_string();
        assert!(large.contains("too large by a factor of 5.0"), "{large}");
        let offset = Offset { sensors: [name("a"), name("b")], by_m: [-0.6, 1.5], share: 0.95 };
        let words = Warning::Offset(offset).to_string();
        assert!(words.contains("of b lie -0.60 m east and +1.50 m north of those of a (95 %"), "{words}");
    }
}
