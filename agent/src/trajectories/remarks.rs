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
/// Objects that go away and come back as often are two.
const MIN_RETURNS: u32 = 3;
/// Two objects are further apart than positions scatter, m.
const APART_M: f64 = 5.0;
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

/// Where an object is by one row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place<'a> {
    pub(super) t: Span,
    pub(super) pose: &'a Pose,
    pub(super) line: u64,
}

/// The first of something, with its object and its lines.
#[derive(Clone, Debug)]
struct First {
    id: String,
    lines: [u64; 2],
    way_m: f64,
    step_s: f64,
}

/// Sums over a recording.
#[derive(Clone, Debug, Default)]
pub(super) struct Survey {
    n_moving: u32,
    /// Sums of the cosine between motion and heading by each reading.
    agreement: [f64; READINGS.len()],
    n_jumps: u32,
    first_jump: Option<First>,
    /// Jumps away from the way and back to it.
    n_returns: u32,
    first_return: Option<First>,
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
        (class, id): (Class, &str),
        places: impl Iterator<Item = Place<'a>>,
        max_gap: Span,
    ) {
        self.n_objects += 1;
        let (mut before, mut n): ([Option<Place<'a>>; 2], u32) = ([None; 2], 0);
        for place in places {
            n = n.saturating_add(1);
            if let Some(last) = before[1] {
                let is_jump = self.add_step((class, id), (&last, &place), max_gap);
                if let Some(first) =
                    before[0].filter(|first| is_jump && returns([first, &last, &place], max_gap))
                {
                    self.n_returns = self.n_returns.saturating_add(1);
                    self.first_return.get_or_insert_with(|| First::of(id, &first, &last));
                }
            }
            before = [before[1], Some(place)];
        }
        self.n_single += u32::from(n == 1);
    }

    /// Whether it is a jump.
    fn add_step(
        &mut self,
        (class, id): (Class, &str),
        (from, to): (&Place<'_>, &Place<'_>),
        max_gap: Span,
    ) -> bool {
        let step = to.t - from.t;
        if step > max_gap {
            self.n_gaps += 1;
            return false;
        }
        let (at, from_at) = (to.pose, from.pose);
        let (dx, dy) = (at.x - from_at.x, at.y - from_at.y);
        let speed_mps = libm::hypot(dx, dy) / step.as_secs_f64();
        self.fastest_mps = self.fastest_mps.max(speed_mps);
        if speed_mps > FASTEST_MPS {
            self.n_jumps += 1;
            self.first_jump.get_or_insert_with(|| First::of(id, from, to));
            return true;
        }
        if speed_mps > MOVING_MPS && class.has_front() && !from_at.yaw.is_nan() {
            self.n_moving = self.n_moving.saturating_add(1);
            let motion = libm::atan2(dy, dx);
            for (sum, (reading, _)) in self.agreement.iter_mut().zip(READINGS) {
                *sum += libm::cos(reading(from_at.yaw) - motion);
            }
        }
        false
    }
}

/// Whether the third place is where the first one leads to, and the second one is far from both.
fn returns([first, second, third]: [&Place<'_>; 3], max_gap: Span) -> bool {
    let passed = third.t - first.t;
    let way_m = |from: &Place<'_>, to: &Place<'_>| from.pose.distance_to(to.pose.x, to.pose.y);
    passed <= max_gap
        && way_m(first, third) <= FASTEST_MPS * passed.as_secs_f64()
        && way_m(first, second) > (FASTEST_MPS * (second.t - first.t).as_secs_f64()).max(APART_M)
}

impl First {
    fn of(id: &str, from: &Place<'_>, to: &Place<'_>) -> Self {
        Self {
            id: id.to_owned(),
            lines: [from.line, to.line],
            way_m: from.pose.distance_to(to.pose.x, to.pose.y),
            step_s: (to.t - from.t).as_secs_f64(),
        }
    }

    fn words(&self) -> String {
        let Self { id, lines: [from, to], way_m, step_s } = self;
        format!("{id:?} goes {way_m:.1} m in {step_s:.3} s between lines {from} and {to}")
    }
}

/// The warnings of a recording.
pub(super) fn warnings(survey: &Survey, format: Format) -> Vec<String> {
    let mut warnings = Vec::new();
    let Survey { n_jumps, fastest_mps, n_returns, n_single, n_gaps, n_objects, .. } = survey;
    warnings.extend(heading(survey));
    if *n_jumps > 0 {
        let cause =
            if format == Format::SumoFcd { "" } else { " (is t in seconds, and are x and y in metres?)" };
        warnings.push(format!(
            "{n_jumps} jumps: up to {fastest_mps:.0} m/s between two rows of an object{}{cause}",
            survey.first_jump.as_ref().map(|first| format!("; {}", first.words())).unwrap_or_default()
        ));
    }
    if let Some(first) = survey.first_return.as_ref().filter(|_| *n_returns >= MIN_RETURNS) {
        warnings.push(format!(
            "one id seems to be of two objects at once: {}, and is back in the next row ({n_returns} times); each object has an id of \
             its own",
            first.words()
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
