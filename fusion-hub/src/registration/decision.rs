//! Which of an agent's errors are observable, and which are corrected in its frames.

use super::report::Observable;
use serde::{Deserialize, Serialize};

/// An error becomes observable below the first and stops being observable above the second share of the declared
/// standard deviation.
const OBSERVABLE: [f64; 2] = [0.5, 0.6];
/// It is corrected from the first number of standard deviations of the estimate on, until it is below the second.
const SIGNIFICANT: [f64; 2] = [3.0, 2.0];
/// And from this share of the declared standard deviation on, and until it is below the second: less has no use.
const WORTHWHILE: [f64; 2] = [0.1, 0.05];
/// Position and clock with a higher correlation are confounded, unless both standard deviations are below the second.
const CONFOUNDED: [f64; 2] = [0.9, 0.3];
/// An estimate exceeds what was declared where it does so by this many of its standard deviations.
const EXCEEDING: f64 = 2.0;

/// The estimate of one agent's errors, in units of the declared accuracy.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Belief {
    pub(super) mean: [f64; 4],
    pub(super) covariance: [[f64; 4]; 4],
}

/// What follows from the estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Decision {
    pub(super) observable: Observable,
    pub(super) confounded: bool,
    pub(super) exceeds_declared: bool,
    is_corrected: Observable,
}

/// An error or the length of two, with the standard deviation of the estimate.
#[derive(Clone, Copy)]
struct Component {
    length: f64,
    sigma: f64,
}

impl Component {
    fn is_observable(self, was: bool) -> bool {
        self.sigma < OBSERVABLE[usize::from(was)]
    }

    fn is_significant(self, was: bool) -> bool {
        let (of_sigma, of_declared) = (SIGNIFICANT[usize::from(was)], WORTHWHILE[usize::from(was)]);
        self.length > of_sigma * self.sigma && self.length > of_declared
    }

    fn exceeds(self) -> bool {
        self.length - EXCEEDING * self.sigma > 1.0
    }

    /// Factor on the error, so that the correction is at most the declared accuracy.
    fn share(self) -> f64 {
        if self.length > 1.0 { 1.0 / self.length } else { 1.0 }
    }
}

impl Belief {
    /// Position, yaw and clock. Of the position the direction of largest variance counts.
    fn components(&self) -> [Component; 3] {
        let [x, y, yaw, clock] = self.mean;
        let [xx, xy, yy] = [self.covariance[0][0], self.covariance[0][1], self.covariance[1][1]];
        let half = (xx - yy) / 2.0;
        let widest = (xx + yy) / 2.0 + libm::sqrt(half * half + xy * xy);
        let single = |length: f64, k: usize| Component {
            length: length.abs(),
            sigma: libm::sqrt(self.covariance[k][k]),
        };
        let position = Component { length: libm::sqrt(x * x + y * y), sigma: libm::sqrt(widest) };
        [position, single(yaw, 2), single(clock, 3)]
    }

    /// The greatest correlation of the clock with the position along any direction, squared.
    fn clock_in_position(&self) -> f64 {
        let p = &self.covariance;
        let (a, b) = (p[0][3], p[1][3]);
        let det = p[0][0] * p[1][1] - p[0][1] * p[0][1];
        (p[1][1] * a * a - 2.0 * p[0][1] * a * b + p[0][0] * b * b) / (det * p[3][3])
    }
}

impl Decision {
    /// The next decision, and the correction in units of the declared accuracy; zero where it is not `allowed`.
    pub(super) fn next(&self, estimate: &Belief, allowed: bool) -> (Self, [f64; 4]) {
        let [position, yaw, clock] = estimate.components();
        let [ceiling, sigma] = CONFOUNDED;
        let confounded =
            estimate.clock_in_position() > ceiling * ceiling && position.sigma.max(clock.sigma) > sigma;
        let was = self.observable;
        let observable = Observable {
            position: position.is_observable(was.position) && !confounded,
            yaw: yaw.is_observable(was.yaw),
            clock: clock.is_observable(was.clock) && !confounded,
        };
        let was = self.is_corrected;
        let is_corrected = Observable {
            position: allowed && observable.position && position.is_significant(was.position),
            yaw: allowed && observable.yaw && yaw.is_significant(was.yaw),
            clock: allowed && observable.clock && clock.is_significant(was.clock),
        };
        let share = |corrected: bool, of: Component| if corrected { of.share() } else { 0.0 };
        let shares = [share(is_corrected.position, position), share(is_corrected.yaw, yaw)];
        let [x, y, turn, ahead] = estimate.mean;
        let clock_share = share(is_corrected.clock, clock);
        let corrected = [shares[0] * x, shares[0] * y, shares[1] * turn, clock_share * ahead];
        let exceeds_declared = [position, yaw, clock].into_iter().any(Component::exceeds);
        (Self { observable, confounded, exceeds_declared, is_corrected }, corrected)
    }
}

#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    vec![
        ("registration.seen", format!("{OBSERVABLE:?}")),
        ("registration.significant", format!("{SIGNIFICANT:?}, worthwhile {WORTHWHILE:?}")),
        ("registration.confounded", format!("{CONFOUNDED:?}")),
        ("registration.exceeding", EXCEEDING.to_string()),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn estimate(mean: [f64; 4], sigma: f64) -> Belief {
        let mut covariance = [[0.0; 4]; 4];
        (0..4).for_each(|k| covariance[k][k] = sigma * sigma);
        Belief { mean, covariance }
    }

    #[test]
    fn only_observable_and_significant_errors_are_corrected() {
        let begin = Decision::default();
        assert_eq!(begin.next(&estimate([0.3, 0.0, 0.5, 0.2], 0.12), true).1, [0.0, 0.0, 0.5, 0.0]);
        assert_eq!(begin.next(&estimate([0.3, 0.0, 0.5, 0.2], 0.12), false).1, [0.0; 4]);
        assert_eq!(begin.next(&estimate([3.0, 0.0, 3.0, 3.0], 0.55), true).1, [0.0; 4]);
    }

    #[test]
    fn a_correction_has_hysteresis_about_its_threshold() {
        let (on, _) = Decision::default().next(&estimate([0.0, 0.0, 0.31, 0.0], 0.1), true);
        assert_eq!(on.next(&estimate([0.0, 0.0, 0.25, 0.0], 0.1), true).1[2], 0.25);
        assert_eq!(Decision::default().next(&estimate([0.0, 0.0, 0.25, 0.0], 0.1), true).1[2], 0.0);
        assert_eq!(on.next(&estimate([0.0, 0.0, 0.19, 0.0], 0.1), true).1[2], 0.0);
    }

    proptest! {
        #[test]
        fn corrections_never_exceed_what_was_declared(
            mean in prop::array::uniform4(-20.0..20.0f64), sigma in 0.001..1.0f64
        ) {
            let (decision, corrected) = Decision::default().next(&estimate(mean, sigma), true);
            let (_, again) = decision.next(&estimate(mean, sigma), true);
            for corrected in [corrected, again] {
                let [x, y, yaw, clock] = corrected;
                prop_assert!(libm::sqrt(x * x + y * y).max(yaw.abs()).max(clock.abs()) <= 1.0 + 1e-12);
            }
        }
    }
}
