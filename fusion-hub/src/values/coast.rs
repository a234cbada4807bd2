//! How long an object is published without being detected.

use serde::{Deserialize, Serialize};
use v2x_common::time::Span;

/// Detections that the agent that detected an object last is expected to have made meanwhile, until it is not published any
/// more.
const FRAMES: f64 = 5.0;
/// At least and at most.
const SHORTEST: Span = Span::from_millis(700);
const LONGEST: Span = Span::from_millis(5000);

/// Where no rate is known.
const WITHOUT_RATE: Span = Span::from_millis(1500);

/// How long an object is published without being detected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Coast {
    /// As long as the agent that detected it last needs for five detections of it, but 0.7 to 5 s: a parked car does not vanish between
    /// two frames of a slow sensor.
    #[default]
    ByRate,
    /// The same for all.
    Fixed(Span),
}

impl Coast {
    /// For an object that the agent of its last detection detects at this interval, s.
    pub fn of(self, interval_s: f64) -> Span {
        match self {
            Self::ByRate => Span::from_secs_f64(FRAMES * interval_s).clamp(SHORTEST, LONGEST),
            Self::Fixed(coast) => coast,
        }
    }

    /// For how long its track can take detections: at least as long as where no rate is known, so that the order in which
    /// frames arrive matters as little as it can.
    pub fn remembered(self, interval_s: f64) -> Span {
        self.of(interval_s).max(self.without_rate())
    }

    /// For a list of objects that no rates are known of.
    pub const fn without_rate(self) -> Span {
        match self {
            Self::ByRate => WITHOUT_RATE,
            Self::Fixed(coast) => coast,
        }
    }

    /// For any object at most.
    pub const fn longest(self) -> Span {
        match self {
            Self::ByRate => LONGEST,
            Self::Fixed(coast) => coast,
        }
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    vec![("coast.by_rate", format!("{FRAMES} detections, {SHORTEST} to {LONGEST}"))]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_sensors_let_objects_coast_longer_and_a_fixed_time_holds_for_all() {
        let ms = |interval_s| Coast::ByRate.of(interval_s).as_millis_f64();
        assert_eq!((ms(0.05), ms(0.5), ms(2.0)), (700.0, 2500.0, 5000.0));
        assert_eq!(Coast::Fixed(Span::from_millis(700)).of(2.0), Span::from_millis(700));
    }
}
