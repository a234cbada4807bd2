//! A checked agent.

use v2x_common::geometry::Pose;
use v2x_common::id::AgentId;
use v2x_common::sensor::{Accuracy, FieldOfView, SensorKind};
use v2x_common::time::Span;

use crate::clock::ClockError;
use crate::link::{Delay, LinkConfig};
use crate::noise::NoiseModel;
use crate::pose_error::PoseError;
use crate::random::uniform;
use crate::sending::{SendRule, Transmit};
use rand_chacha::ChaCha8Rng;

/// One agent: its sensor, its errors, its link.
#[derive(Clone, Debug, PartialEq)]
pub struct AgentConfig {
    /// Its name in the network.
    pub id: AgentId,
    /// Vehicle or roadside unit.
    pub kind: SensorKind,
    /// Where it is.
    pub station: Station,
    /// How often it captures.
    pub rate: Rate,
    /// Its first capture after the scenario's start.
    pub phase: Phase,
    /// How its clock errs.
    pub clock: ClockError,
    /// How it errs about its pose in everything that it tells; `None`: a vehicle errs in its report of itself only,
    /// anew in each frame, by the accuracy that it declares.
    pub pose_error: Option<PoseError>,
    /// How its detections err.
    pub noise: NoiseModel,
    /// Where it sees.
    pub field_of_view: FieldOfView,
    /// Probability that an object in the field of view is detected in a frame.
    pub detection_probability: f64,
    /// Mean number of false detections in a frame.
    pub clutter_per_frame: f64,
    /// How well it knows its own pose and time as it declares it (1 σ), rightly or not.
    pub accuracy: Accuracy,
    /// How long its detector takes, from capture to a frame that is ready.
    pub sensing: Delay,
    /// When frames that are ready leave.
    pub transmit: Transmit,
    /// What of its detections it sends.
    pub send: SendRule,
    /// How its frames travel.
    pub link: LinkConfig,
}

/// Where an agent is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Station {
    /// It stands.
    Fixed(Pose),
    /// It drives on a route of the world.
    Driving(Route),
}

/// A closed route for driving agents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Route {
    /// Clockwise around one block of the crossing, through the crossing once in each cycle of the
    /// lights. The number is the arm from which the crossing is entered: 0 east, 1 north, 2 west, 3 south.
    Block(u8),
    /// Along the motorway and back on the service road beside it. 0: east on the southern side; 1: west
    /// on the northern side.
    Service(u8),
}

impl Route {
    const ALL: [(&str, Self); 6] = [
        ("block-ne", Self::Block(0)),
        ("block-nw", Self::Block(1)),
        ("block-sw", Self::Block(2)),
        ("block-se", Self::Block(3)),
        ("service-south", Self::Service(0)),
        ("service-north", Self::Service(1)),
    ];

    /// The route of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(known, _)| *known == name).map(|(_, route)| *route)
    }

    /// How many agents have room on it.
    pub const fn capacity(self) -> usize {
        match self {
            Self::Block(_) => 2,
            Self::Service(_) => 4,
        }
    }
}

/// A place within a period.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// This one.
    Fixed(Span),
    /// Drawn once for each run and agent, evenly over the period.
    Random,
}

impl Phase {
    /// The phase; `rng` is asked only where it is left to chance.
    pub fn within(self, period: Span, rng: &mut ChaCha8Rng) -> Span {
        match self {
            Self::Fixed(phase) => phase,
            Self::Random => Span::from_secs_f64(uniform(rng, 0.0, period.as_secs_f64())),
        }
    }
}

/// Frames per second, as a whole number of millihertz, so that capture times never drift.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rate {
    millihertz: u32,
}

impl Rate {
    const NANOS_PER_KILOSECOND: i128 = 1_000_000_000_000;

    /// Rounded to the nearest millihertz; `None` outside of 0.1 to 1000 Hz.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the range is checked")]
    pub fn from_hz(rate_hz: f64) -> Option<Self> {
        (0.1..=1000.0).contains(&rate_hz).then(|| Self { millihertz: libm::round(rate_hz * 1e3) as u32 })
    }

    /// In Hz.
    pub fn hz(self) -> f64 {
        f64::from(self.millihertz) / 1e3
    }

    /// Frames in a second, rounded up.
    pub const fn frames_in_a_second(self) -> u32 {
        self.millihertz.div_ceil(1000)
    }

    /// From frame 0 to frame `sequence`, rounded down to the nanosecond; saturates after 292 years.
    pub fn elapsed(self, sequence: u64) -> Span {
        let nanos = i128::from(sequence) * Self::NANOS_PER_KILOSECOND / i128::from(self.millihertz);
        Span::from_nanos(i64::try_from(nanos).unwrap_or(i64::MAX))
    }

    /// The first frame whose [`Self::elapsed`] is at least `span`.
    pub fn sequence_at_or_after(self, span: Span) -> u64 {
        let product = i128::from(span.as_nanos().max(0)) * i128::from(self.millihertz);
        let sequence = (product + Self::NANOS_PER_KILOSECOND - 1) / Self::NANOS_PER_KILOSECOND;
        u64::try_from(sequence).expect("2^63 ns at 1000 Hz are below 2^64 frames")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_rate_that_does_not_divide_a_second_does_not_drift() {
        let rate = Rate::from_hz(3.0).unwrap();
        assert_eq!(rate.elapsed(1).as_nanos(), 333_333_333);
        assert_eq!(rate.elapsed(3 * 3600 * 24), Span::from_millis(24 * 3_600_000));
        assert_eq!(Rate::from_hz(0.0), None);
        assert_eq!(Rate::from_hz(f64::NAN), None);
    }

    proptest! {
        #[test]
        fn the_next_frame_is_the_first_that_is_not_earlier(rate_hz in 0.1..1000.0f64, nanos in 0..i64::MAX / 2) {
            let rate = Rate::from_hz(rate_hz).unwrap();
            let sequence = rate.sequence_at_or_after(Span::from_nanos(nanos));
            prop_assert!(rate.elapsed(sequence).as_nanos() >= nanos);
            prop_assert!(sequence == 0 || rate.elapsed(sequence - 1).as_nanos() < nanos);
        }
    }
}
