//! What looks wrong in a recording.

use std::f64::consts::{FRAC_PI_2, PI};

use v2x_common::class::Class;
use v2x_common::geometry::Pose;
use v2x_common::time::Span;

use super::traffic::Format;

/// Slower motion says nothing about a heading, m/s.
const MOVING_MPS: f64 = 1.0;
/// Nothing on a road is faster, m/s.
const FASTEST_MPS: f64 = 85.0;
/// Fewer moving steps decide nothing.
const ENOUGH: u32 = 20;
/// Mean cosine between heading and motion from which they agree.
const AGREES: f64 = 0.8;

/// By so much more another reading agrees, if it is meant.
const CLEARLY: f64 = 0.1;

/// From a heading as it is written to radians counter-clockwise from east.
type Reading = fn(f64) -> f64;

/// What a heading could mean, and the words for it.
const READINGS: [(Reading, &str); 6] = [
    (|yaw| yaw, ""),
    (|yaw| yaw.to_radians(), "degrees: name the column yaw_deg"),
    (
        |yaw| FRAC_PI_2 - yaw.to_radians(),
        "degrees clockwise from north, as of a compass: name the column heading_deg",
    ),
    (|yaw| FRAC_PI_2 - yaw, "radians clockwise from north: write pi/2 - yaw"),
    (|yaw| -yaw, "clockwise from east (or y points south): write -yaw, or turn y round"),
    (|yaw| yaw + PI, "that of the back: write yaw + pi"),
];

/// Sums over a recording.
#[derive(Clone, Debug, Default)]
pub(super) struct Survey {
    n_moving: u32,
    /// Sums of the cosine between motion and heading by each reading.
    agreement: [f64; READINGS.len()],
    n_jumps: u32,
    /// The largest speed between two rows, m/s.
    fastest_mps: f64,
    n_single: u32,
    n_gaps: u32,
    n_objects: u32,
}

impl Survey {
    /// Adds an object by its places in order of time.
    pub(super) fn add<'a>(
        &mut self,
        class: Class,
        places: impl Iterator<Item = (Span, &'a Pose)>,
        max_gap: Span,
    ) {
        self.n_objects += 1;
        let (mut before, mut n): (Option<(Span, &Pose)>, u32) = (None, 0);
        for (t, pose) in places {
            n = n.saturating_add(1);
            if let Some((since, from)) = before {
                self.add_step(class, (t - since, max_gap), (from, pose));
            }
            before = Some((t, pose));
        }
        self.n_single += u32::from(n == 1);
    }

    fn add_step(&mut self, class: Class, (step, max_gap): (Span, Span), (from, to): (&Pose, &Pose)) {
        if step > max_gap {
            self.n_gaps += 1;
            return;
        }
        let (dx, dy) = (to.x - from.x, to.y - from.y);
        let speed_mps = libm::hypot(dx, dy) / step.as_secs_f64();
        self.fastest_mps = self.fastest_mps.max(speed_mps);
        if speed_mps > FASTEST_MPS {
            self.n_jumps += 1;
        } else if speed_mps > MOVING_MPS && class.has_front() && !from.yaw.is_nan() {
            self.n_moving = self.n_moving.saturating_add(1);
            let motion = libm::atan2(dy, dx);
            for (sum, (reading, _)) in self.agreement.iter_mut().zip(READINGS) {
                *sum += libm::cos(reading(from.yaw) - motion);
            }
        }
    }
}

/// The warnings of a recording.
pub(super) fn warnings(survey: &Survey, format: Format) -> Vec<String> {
    let mut warnings = Vec::new();
    let Survey { n_jumps, fastest_mps, n_single, n_gaps, n_objects, .. } = survey;
    warnings.extend(heading(survey));
    if *n_jumps > 0 {
        let cause =
            if format == Format::SumoFcd { "" } else { " (is t in seconds, and are x and y in metres?)" };
        warnings.push(format!(
            "{n_jumps} jumps: up to {fastest_mps:.0} m/s between two rows of an object{cause}"
        ));
    }
    if *n_single > 0 {
        warnings.push(format!("{n_single} of {n_objects} objects have one row only, and are never seen"));
    }
    if *n_gaps > 0 {
        warnings.push(format!(
            "{n_gaps} gaps in which an object is absent: max_gap_s decides how long a gap may be"
        ));
    }
    warnings
}

/// A heading that disagrees with the motion, and what it would agree with.
fn heading(survey: &Survey) -> Option<String> {
    if survey.n_moving < ENOUGH {
        return None;
    }
    let mean = survey.agreement.map(|sum| sum / f64::from(survey.n_moving));
    let best = (1..mean.len()).max_by(|a, b| mean[*a].total_cmp(&mean[*b]));
    let best = best.filter(|best| mean[*best] >= AGREES && mean[*best] > mean[0] + CLEARLY);
    // Where most objects go east, zero is right in every unit.
    if mean[0] >= AGREES && best.is_none() {
        return None;
    }
    let off_deg = libm::acos(mean[0].clamp(-1.0, 1.0)).to_degrees();
    let what = "the headings disagree with the motion";
    Some(match best {
        Some(best) => format!("{what}; they look like {}", READINGS[best].1),
        None => format!(
            "{what} by {off_deg:.0}° on average; without a column of headings they are those of the motion"
        ),
    })
}
