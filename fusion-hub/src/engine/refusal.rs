//! Why a frame is not taken.

use v2x_common::duration::in_words;
use v2x_common::id::{AgentId, MapFrame};
use v2x_common::time::{Span, StampUnit, Timestamp};
use v2x_common::wire::WireError;

/// Why a frame was refused. Nothing is dropped without one, and every one is counted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// The payload is no frame, or holds values that cannot be.
    #[error(transparent)]
    Malformed(#[from] WireError),
    /// The payload names another agent than the key.
    #[error("the payload names agent {payload}, the key names {key}")]
    AgentMismatch {
        /// The agent in the payload.
        payload: AgentId,
        /// The agent in the key.
        key: AgentId,
    },
    /// The positions are in another coordinate frame.
    #[error("map frame {frame} is not this hub's {hub}")]
    MapFrameMismatch {
        /// The frame's.
        frame: MapFrame,
        /// The hub's.
        hub: MapFrame,
    },
    /// Measured longer ago than Δmax by the hub's clock.
    #[error("captured {} before the hub's time: too late", words(*.age))]
    TooLate {
        /// How long ago.
        age: Span,
    },
    /// Measured before something that is in already, where late data is dropped.
    #[error("captured {behind} before the newest frame: out of sequence, and late data is dropped")]
    OutOfSequence {
        /// How long before.
        behind: Span,
    },
    /// From an agent that the settings exclude.
    #[error("this hub listens to others only (hub.only_agents)")]
    NotListenedTo,
    /// Measured further in the future than Δmax by the hub's clock.
    #[error("captured {} ahead of the hub's time: too early; is the agent's clock set?", words(*.ahead))]
    TooEarly {
        /// How far ahead.
        ahead: Span,
    },
    /// Captured far from the hub's time, as by a clock of another unit or epoch.
    #[error("captured {} {} the hub's time: {cause}", words(.off.abs()), if *.off < Span::ZERO { "before" } else { "ahead of" })]
    WrongTimeUnit {
        /// Capture time less the hub's time.
        off: Span,
        /// What the stamp seems to be.
        cause: StampFault,
    },
    /// This agent's frame of this epoch and number was here before.
    #[error("duplicate of frame {sequence} of epoch {epoch}")]
    Duplicate {
        /// The agent's boot epoch.
        epoch: u64,
        /// The frame's number.
        sequence: u64,
    },
    /// Two processes send under one name, and this one came second.
    #[error(
        "another process sends under this name (its boot epoch is {epoch}) and was here first: held off until that one ends"
    )]
    HeldOff {
        /// The boot epoch of the other one.
        epoch: u64,
    },
    /// Younger than Δmax, but history was shortened for lack of room, or there is none even so.
    #[error("captured {age} before the hub's time: overloaded, history is shorter than the maximum latency")]
    Overloaded {
        /// How long ago.
        age: Span,
    },
    /// More agents than the hub's registry holds.
    #[error("more than {limit} agents")]
    TooManyAgents {
        /// How many are allowed.
        limit: usize,
    },
    /// More detections within Δmax than one agent may send.
    #[error("more than {limit} detections of this agent within the maximum latency")]
    TooManyDetections {
        /// How many are allowed.
        limit: usize,
    },
    /// It waited while the hub had no time for it, until newer ones took its place.
    #[error(
        "waited too long: this agent's frames cost more than its share of the hub's time, or are more than {limit}"
    )]
    QueueFull {
        /// How many frames of an agent may wait.
        limit: usize,
    },
    /// A payload that is larger than any frame.
    #[error("{bytes} bytes, at most {limit}")]
    TooLarge {
        /// Its size.
        bytes: usize,
        /// The largest one allowed.
        limit: usize,
    },
    /// More frames within Δmax than one agent may send.
    #[error("more than {limit} frames of this agent within the maximum latency")]
    TooManyFrames {
        /// How many are allowed.
        limit: usize,
    },
}

fn words(span: Span) -> String {
    in_words(span.as_secs_f64())
}

impl Refusal {
    /// A short name for counting, one per cause.
    pub fn reason(&self) -> &'static str {
        match self {
            Self::Malformed(error) => error.reason(),
            Self::AgentMismatch { .. } => "agent_mismatch",
            Self::MapFrameMismatch { .. } => "map_frame_mismatch",
            Self::TooLate { .. } => "too_late",
            Self::OutOfSequence { .. } => "out_of_sequence",
            Self::NotListenedTo => "not_listened_to",
            Self::TooEarly { .. } => "too_early",
            Self::WrongTimeUnit { .. } => "wrong_time_unit",
            Self::Duplicate { .. } => "duplicate",
            Self::HeldOff { .. } => "held_off",
            Self::Overloaded { .. } => "overloaded",
            Self::TooManyAgents { .. } => "too_many_agents",
            Self::TooManyDetections { .. } => "too_many_detections",
            Self::TooManyFrames { .. } => "too_many_frames",
            Self::QueueFull { .. } => "queue_full",
            Self::TooLarge { .. } => "too_large",
        }
    }
}

/// What a capture time seems to be that cannot be a time of the present.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StampFault {
    /// A thousandth of the present.
    #[error(
        "the stamp seems to be in milliseconds (JSON wants microseconds) or in microseconds (the compact format wants nanoseconds)"
    )]
    Thousandth,
    /// A millionth of the present.
    #[error(
        "the stamp seems to be in seconds (JSON wants microseconds) or in milliseconds (the compact format wants nanoseconds)"
    )]
    Millionth,
    /// A billionth of the present.
    #[error("the stamp seems to be in seconds (the compact format wants nanoseconds)")]
    Billionth,
    /// Within a year of 1970.
    #[error("the stamp seems to count from the start of a simulation or of the agent, not from 1970")]
    OtherEpoch,
}

impl StampFault {
    /// The fault of a stamp that was refused at `now` for its age; `None` where it is just late, or the hub itself does not
    /// count from 1970 (a simulation).
    pub(super) fn of(captured_at: Timestamp, now: Timestamp) -> Option<Self> {
        /// The share by which an agent's clock may err beside its unit: some years.
        const TOLERANCE: f64 = 0.05;
        const YEAR_NS: i64 = 365 * 86_400 * 1_000_000_000;
        #[expect(clippy::cast_precision_loss, reason = "compared by some percent")]
        let [stamp, present] = [captured_at, now].map(|at| at.as_nanos() as f64);
        if StampUnit::of(present) != Some(StampUnit::Nanoseconds) {
            return None;
        }
        let is_part = |part: f64| (stamp * part / present - 1.0).abs() < TOLERANCE;
        let parts = [(1e3, Self::Thousandth), (1e6, Self::Millionth), (1e9, Self::Billionth)];
        let part = parts.into_iter().find(|(part, _)| is_part(*part)).map(|(_, fault)| fault);
        part.or_else(|| (captured_at.as_nanos().saturating_abs() < YEAR_NS).then_some(Self::OtherEpoch))
    }
}

/// What became of a frame.
#[derive(Clone, Debug, PartialEq)]
pub enum Disposition {
    /// It is in.
    Accepted {
        /// Whether it was older than something that was in already.
        out_of_sequence: bool,
    },
    /// It is not.
    Refused(Refusal),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stamp_in_another_unit_or_epoch_is_named_and_a_late_one_is_not() {
        let now = Timestamp::from_nanos(1_795_826_320_182_482_000);
        let fault = |nanos: i64| StampFault::of(Timestamp::from_nanos(nanos), now);
        assert_eq!(fault(1_795_826_320_182_482), Some(StampFault::Thousandth));
        assert_eq!(fault(1_795_826_320_182), Some(StampFault::Millionth));
        assert_eq!(fault(1_795_826_320), Some(StampFault::Billionth));
        assert_eq!(fault(12_500_000_000), Some(StampFault::OtherEpoch));
        assert_eq!(fault(-12_500_000_000), Some(StampFault::OtherEpoch));
        assert_eq!(fault(1_700_000_000_000_000_000), None, "a clock of three years ago");
        let simulated = Timestamp::from_nanos(90_000_000_000);
        assert_eq!(StampFault::of(Timestamp::EPOCH, simulated), None);
    }
}
