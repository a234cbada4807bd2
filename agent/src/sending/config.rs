//! How an agent sends: when, what, and over which link.

use v2x_common::time::Span;

use crate::link::{Delay, LinkConfig};
use crate::timing::{Phase, Rate};

/// How an agent sends its frames.
#[derive(Clone, Debug, PartialEq)]
pub struct SendingConfig {
    /// Processing time of the detector, from capture until the frame is ready.
    pub sensing: Delay,
    /// When ready frames are sent.
    pub transmit: Transmit,
    /// Which detections are sent.
    pub rule: SendRule,
    /// What the network does to the frames.
    pub link: LinkConfig,
}

/// When ready frames are sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Transmit {
    /// As soon as they are ready.
    #[default]
    Immediately,
    /// At the next opportunity.
    Slotted {
        /// Time between two opportunities.
        period: Span,
        /// Time of one opportunity, since the scenario's start.
        phase: Phase,
    },
}

/// Which of its detections an agent sends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SendRule {
    /// All of them, in each frame.
    #[default]
    Periodic,
    /// Those that the inclusion rules of ETSI TS 103 324 select.
    Etsi,
}

impl SendRule {
    /// Probability that an object in the field of view is reported in a frame, where it is detected with the
    /// probability `detected`.
    ///
    /// By ETSI's rules an object can be left out for as long as [`LONGEST_SILENCE`](super::LONGEST_SILENCE), and a hub must not count that as
    /// missed detections: the declared probability is the least share of frames that the rules guarantee. The
    /// declared rate of clutter is the sensor's: frames with a false detection are always sent, so that the frames
    /// that are sent contain slightly more of it where many frames are withheld.
    pub fn report_probability(self, detected: f64, rate: Rate) -> f64 {
        match self {
            Self::Periodic => detected,
            Self::Etsi => detected / f64::from(rate.frames_in_a_second()),
        }
    }
}
