//! What of an agent's errors can be seen, and what is taken out of its frames.

use super::report::Observable;

/// An error is seen where its standard deviation is below this share of the declared one, and stays seen up to the
/// second.
const SEEN: [f64; 2] = [0.5, 0.6];
/// It is taken out from so many standard deviations of the estimate on, and until it is below the second.
const SIGNIFICANT: [f64; 2] = [3.0, 2.0];
/// And from this share of the declared standard deviation on, and until it is below the second: less is not worth it.
const WORTHWHILE: [f64; 2] = [0.1, 0.05];
/// Position and clock with a higher correlation are one error seen, not two, unless both are surer than the second.
const CONFOUNDED: [f64; 2] = [0.9, 0.3];
/// An estimate exceeds what was declared where it does so by this many of its standard deviations.
const EXCEEDING: f64 = 2.0;

/// What is believed of one agent's errors, in units of what it declares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Belief {
    pub(super) mean: [f64; 4],
    pub(super) covariance: [[f64; 4]; 4],
}

/// What follows from it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Decision {
    pub(super) observable: Observable,
    pub(super) confounded: bool,
    pub(super) exceeds_declared: bool,
    is_taken_out: Observable,
}

/// An error or the length of two, with the standard deviation of the estimate.
#[derive(Clone, Copy)]
struct Component {
    length: f64,
    sigma: f64,
}

impl Component {
    fn is_seen(self, was: bool) -> bool {
        self.sigma < SEEN[usize::from(was)]
    }

    fn is_significant(self, was: bool) -> bool {
        let (of_sigma, of_declared) = (SIGNIFICANT[usize::from(was)], WORTHWHILE[usize::from(was)]);
        self.length > of_sigma * self.sigma && self.length > of_declared
    }

    fn exceeds(self) -> bool {
        self.length - EXCEEDING * self.sigma > 1.0
    }

    /// By what the error is multiplied so that no more than what was declared is taken out.
    fn share(self) -> f64 {
        if self.length > 1.0 { 1.0 / self.length } else { 1.0 }
    }
}

impl Belief {
    /// Position, yaw and clock. Of the position the direction counts in which least is known.
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
    /// The next one, and what is to be taken out, in units of what is declared; nothing where it is not `allowed`.
    pub(super) fn next(&self, belief: &Belief, allowed: bool) -> (Self, [f64; 4]) {
        let [position, yaw, clock] = belief.components();
        let [ceiling, sure] = CONFOUNDED;
        let confounded =
            belief.clock_in_position() > ceiling * ceiling && position.sigma.max(clock.sigma) > sure;
        let was = self.observable;
        let observable = Observable {
            position: position.is_seen(was.position) && !confounded,
            yaw: yaw.is_seen(was.yaw),
            clock: clock.is_seen(was.clock) && !confounded,
        };
        let was = self.is_taken_out;
        let is_taken_out = Observable {
            position: allowed && observable.position && position.is_significant(was.position),
            yaw: allowed && observable.yaw && yaw.is_significant(was.yaw),
            clock: allowed && observable.clock && clock.is_significant(was.clock),
        };
        let share = |taken: bool, of: Component| if taken { of.share() } else { 0.0 };
        let shares = [share(is_taken_out.position, position), share(is_taken_out.yaw, yaw)];
        let [x, y, turn, ahead] = belief.mean;
        let clock_share = share(is_taken_out.clock, clock);
        let taken = [shares[0] * x, shares[0] * y, shares[1] * turn, clock_share * ahead];
        let exceeds_declared = [position, yaw, clock].into_iter().any(Component::exceeds);
        (Self { observable, confounded, exceeds_declared, is_taken_out }, taken)
    }
}

#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    vec![
        ("registration.seen", format!("{SEEN:?}")),
        ("registration.significant", format!("{SIGNIFICANT:?}, worthwhile {WORTHWHILE:?}")),
        ("registration.confounded", format!("{CONFOUNDED:?}")),
        ("registration.exceeding", EXCEEDING.to_string()),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn belief(mean: [f64; 4], sigma: f64) -> Belief {
        let mut covariance = [[0.0; 4]; 4];
        (0..4).for_each(|k| covariance[k][k] = sigma * sigma);
        Belief { mean, covariance }
    }

    #[test]
    fn what_is_seen_and_significant_is_taken_out_and_what_is_not_stays() {
        let begin = Decision::default();
        assert_eq!(begin.next(&belief([0.3, 0.0, 0.5, 0.2], 0.12), true).1, [0.0, 0.0, 0.5, 0.0]);
        assert_eq!(begin.next(&belief([0.3, 0.0, 0.5, 0.2], 0.12), false).1, [0.0; 4]);
        assert_eq!(begin.next(&belief([3.0, 0.0, 3.0, 3.0], 0.55), true).1, [0.0; 4]);
    }

    #[test]
    fn a_correction_does_not_flicker_about_its_threshold() {
        let (on, _) = Decision::default().next(&belief([0.0, 0.0, 0.31, 0.0], 0.1), true);
        assert_eq!(on.next(&belief([0.0, 0.0, 0.25, 0.0], 0.1), true).1[2], 0.25);
        assert_eq!(Decision::default().next(&belief([0.0, 0.0, 0.25, 0.0], 0.1), true).1[2], 0.0);
        assert_eq!(on.next(&belief([0.0, 0.0, 0.19, 0.0], 0.1), true).1[2], 0.0);
    }

    proptest! {
        #[test]
        fn never_more_than_declared_is_taken_out(
            mean in prop::array::uniform4(-20.0..20.0f64), sigma in 0.001..1.0f64
        ) {
            let (decision, taken) = Decision::default().next(&belief(mean, sigma), true);
            let (_, again) = decision.next(&belief(mean, sigma), true);
            for taken in [taken, again] {
                let [x, y, yaw, clock] = taken;
                prop_assert!(libm::sqrt(x * x + y * y).max(yaw.abs()).max(clock.abs()) <= 1.0 + 1e-12);
            }
        }
    }
}
