//! How an agent's headings differ from the course of what moves.
//!
//! The course is the way between two reports of one agent about one object, about a second apart: it needs no filter, and
//! the agent's own error of position cancels. Where such differences of one object are alike after two seconds, errors of
//! headings last, as those of boxes do that are fitted to the side that is seen: they do not average out over frames.
//!
//! What stands does not turn round: two reports of one agent about it differ by its errors alone. How much they do says nothing of
//! errors that both have.

use crate::values::HeadingLaw;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};
use v2x_common::geometry::angle_difference;
use v2x_common::time::{Span, Timestamp};

/// Two reports are compared after this time, and forgotten after the other.
const APART: Span = Span::from_millis(900);
const FORGOTTEN: Span = Span::from_millis(3000);
/// The object must have moved so far, m: then the way's direction is known better than a heading.
const LEAST_WAY_M: f64 = 4.0;
/// And it must not have turned by more than this, rad.
const MOST_TURN: f64 = 0.2;
/// What is assumed in advance: one heading in fifty is turned round, with the weight of so many.
const PRIOR: f64 = 10.0;
const PRIOR_REVERSED: f64 = 0.02;
/// Probabilities are kept from being certain.
const LIMITS: [f64; 2] = [0.002, 0.98];
/// A constant error counts from so many comparisons on, where it exceeds this, rad, and where headings agree about it: the
/// length of their mean vector.
const LEAST_COMPARISONS: f64 = 50.0;
const LEAST_OFFSET: f64 = 0.15;
const LEAST_AGREEMENT: f64 = 0.9;
/// Correlation of pairs of differences from which on errors last.
const COLOURED: f64 = 0.2;
/// Where an agent describes its errors, they are as described, and white, until so many pairs say otherwise, by so many
/// standard deviations of the correlation of white ones.
const LEAST_PAIRS: f64 = 40.0;
const CHANCE_SIGMAS: f64 = 2.5;
/// Where it does not, [`HeadingLaw::PRESUMED_SHARE`] has the weight of so many pairs: one needs seconds of an object that
/// drives, and errors that last are as harmful before they are found as after.
const PRESUMED_PAIRS: f64 = 10.0;
/// Of what stands: errors are as declared with the weight of so many pairs of reports, and until they are this many times the
/// declared variance.
const STANDING_PRIOR: f64 = 5.0;
const BEYOND_DECLARED: f64 = 4.0;
/// With less agreement of axes between two reports, chance decides about it.
const LEAST_ALIKE: f64 = 0.05;
/// Unit of sums: whole numbers add up to the same in any order.
const UNITS: f64 = 4096.0;
/// The same of squared angles, rad².
const PAIR_UNITS: f64 = 1_048_576.0;

/// A report of one object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Report {
    pub(super) at: Timestamp,
    pub(super) position: [f64; 2],
    pub(super) yaw: f64,
}

/// A heading held against the course.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Difference {
    /// Of the later report's heading, rad.
    pub(super) heading: f64,
    /// Of the axis in the middle of both reports, rad in [-π/2, π/2]: on a bend, the course is its direction there.
    pub(super) axis: f64,
}

/// The difference of a heading from the course between two reports.
pub(super) fn compare(earlier: &Report, later: &Report) -> Option<Difference> {
    let [dx, dy] = [later.position[0] - earlier.position[0], later.position[1] - earlier.position[1]];
    let turn = libm::sin(angle_difference(later.yaw, earlier.yaw));
    let is_straight = turn.abs() <= libm::sin(MOST_TURN);
    let is_far = dx * dx + dy * dy >= LEAST_WAY_M * LEAST_WAY_M;
    (is_straight && is_far).then(|| {
        let heading = angle_difference(later.yaw, libm::atan2(dy, dx));
        // Of small angles; with one of both turned round, the sine has the other sign.
        let half_turn = if libm::cos(later.yaw - earlier.yaw) < 0.0 { -turn } else { turn } / 2.0;
        Difference { heading, axis: axis_of(heading - half_turn) }
    })
}

/// An angle as that of an axis, rad in [-π/2, π/2].
fn axis_of(angle: f64) -> f64 {
    angle - PI * libm::round(angle / PI)
}

/// Whether a report is to be compared with an earlier one, or to take its place.
pub(super) fn is_due(earlier: &Report, at: Timestamp) -> Option<bool> {
    let apart = at - earlier.at;
    (apart >= APART).then_some(apart <= FORGOTTEN)
}

/// Comparisons of one agent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct HeadingCounts {
    all: f64,
    reversed: f64,
    /// Sums of cosine and sine of twice the difference: of axes.
    axis: [f64; 2],
    /// Pairs of differences two seconds apart: how many, the mean of their squares, and their products.
    pairs: f64,
    pair_squares: f64,
    products: f64,
    /// Of what stands, pairs of reports: how many, how many with fronts at different ends, sum of the cosine of twice the difference,
    /// and of the declared variances, rad².
    standing: f64,
    standing_reversed: f64,
    standing_alike: f64,
    standing_declared: f64,
}

impl HeadingCounts {
    /// Adds a difference, rad.
    pub(super) fn add(&mut self, difference: f64) {
        self.all += 1.0;
        self.reversed += f64::from(u8::from(difference.abs() > FRAC_PI_2));
        self.axis[0] += libm::round(libm::cos(2.0 * difference) * UNITS);
        self.axis[1] += libm::round(libm::sin(2.0 * difference) * UNITS);
    }

    /// Adds a pair of differences of axes of one object, rad, that have no report in common. Quarter turns are no errors that
    /// a variance describes.
    pub(super) fn add_pair(&mut self, [a, b]: [f64; 2]) {
        if a.abs().max(b.abs()) < FRAC_PI_4 {
            self.pairs += 1.0;
            self.pair_squares += libm::round((a * a + b * b) / 2.0 * PAIR_UNITS);
            self.products += libm::round(a * b * PAIR_UNITS);
        }
    }

    /// Adds the difference of two reports' headings of an object that stands, rad, and the declared variance of each, rad².
    pub(super) fn add_standing(&mut self, difference: f64, declared: f64) {
        self.standing += 1.0;
        self.standing_reversed += f64::from(u8::from(libm::cos(difference) < 0.0));
        self.standing_alike += libm::round(libm::cos(2.0 * difference) * UNITS);
        self.standing_declared += libm::round(declared * PAIR_UNITS);
    }

    /// Lets what was counted fade.
    pub(super) fn scale(&mut self, factor: f64) {
        self.all *= factor;
        self.reversed *= factor;
        self.axis = self.axis.map(|sum| sum * factor);
        for sum in [
            &mut self.pairs,
            &mut self.pair_squares,
            &mut self.products,
            &mut self.standing,
            &mut self.standing_reversed,
            &mut self.standing_alike,
            &mut self.standing_declared,
        ] {
            *sum *= factor;
        }
    }

    /// How the headings err, of an agent that describes its errors or not.
    pub(super) fn law(&self, is_described: bool) -> HeadingLaw {
        let [least, most] = LIMITS;
        let reversed = (self.reversed + PRIOR * PRIOR_REVERSED) / (self.all + PRIOR);
        let reversed = reversed.max(self.reversed_at_least()).clamp(least, most);
        let [lasting, lasting_share] =
            if is_described { self.found_to_last() } else { self.presumed_to_last() };
        HeadingLaw::Mixture {
            front_odds_ln: libm::log((1.0 - reversed) / reversed),
            offset: self.offset(),
            lasting,
            lasting_share,
            standing: self.standing_factor(),
        }
    }

    /// The share of headings that are turned by half a turn, by how often two reports of what stands differ by that: 2p(1 - p).
    /// What is always turned does not show.
    fn reversed_at_least(&self) -> f64 {
        let differ = self.standing_reversed / (self.standing + PRIOR);
        (1.0 - libm::sqrt((1.0 - 2.0 * differ).max(0.0))) / 2.0
    }

    /// How many times the declared variance that of the headings of what stands is; at least 1. Of two normal axes with the variance
    /// σ² each, the mean of cos 2(a - b) is exp(-4σ²) (Mardia and Jupp 2000, section 3.5.7).
    fn standing_factor(&self) -> f64 {
        let alike = (self.standing_alike / UNITS + STANDING_PRIOR) / (self.standing + STANDING_PRIOR);
        let found = -libm::log(alike.clamp(LEAST_ALIKE, 1.0)) / 4.0;
        let declared = self.standing_declared / (PAIR_UNITS * self.standing.max(1.0));
        if found > BEYOND_DECLARED * declared && declared > 0.0 { found / declared } else { 1.0 }
    }

    /// What is found to last, against the presumption that nothing does: variance, rad², and none of the declared one.
    fn found_to_last(&self) -> [f64; 2] {
        let by_chance = CHANCE_SIGMAS / libm::sqrt(self.pairs);
        let is_white =
            self.pairs < LEAST_PAIRS || self.products <= (COLOURED + by_chance) * self.pair_squares;
        [if is_white { 0.0 } else { self.variance_that_lasts(self.pairs) }, 0.0]
    }

    /// What lasts where that is presumed until pairs have said otherwise: variance, rad², and share of the declared one.
    fn presumed_to_last(&self) -> [f64; 2] {
        let weight = self.pairs + PRESUMED_PAIRS;
        let share = HeadingLaw::PRESUMED_SHARE * PRESUMED_PAIRS / weight;
        let found = if self.pair_squares > 0.0 { self.products / self.pair_squares } else { 0.0 };
        if share + found * self.pairs / weight <= COLOURED {
            return [0.0, 0.0];
        }
        [self.variance_that_lasts(weight), share]
    }

    /// Mean product of the pairs, with this weight of all that is known, rad². A constant error is corrected and no part of it.
    fn variance_that_lasts(&self, weight: f64) -> f64 {
        let offset = self.offset();
        (self.products / PAIR_UNITS - self.pairs * offset * offset).max(0.0) / weight
    }

    /// The constant error of the axes, rad in [-π/2, π/2]; 0 where it is not significant.
    fn offset(&self) -> f64 {
        let [cos, sin] = self.axis;
        let agreement = libm::hypot(cos, sin) / (UNITS * self.all.max(1.0));
        let offset = libm::atan2(sin, cos) / 2.0;
        let is_significant =
            self.all >= LEAST_COMPARISONS && agreement >= LEAST_AGREEMENT && offset.abs() >= LEAST_OFFSET;
        if is_significant { offset.clamp(-PI / 2.0, PI / 2.0) } else { 0.0 }
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    vec![
        ("learning.heading_prior", format!("{PRIOR_REVERSED} with weight {PRIOR}, within {LIMITS:?}")),
        (
            "learning.heading_offset",
            format!("{LEAST_OFFSET} rad after {LEAST_COMPARISONS}, agreement {LEAST_AGREEMENT}"),
        ),
        (
            "learning.heading_standing",
            format!(
                "as declared with weight {STANDING_PRIOR}, beyond {BEYOND_DECLARED} times that, alike from {LEAST_ALIKE} on"
            ),
        ),
        (
            "learning.heading_lasts",
            format!(
                "correlation {COLOURED}; described: and {CHANCE_SIGMAS} sigma of {LEAST_PAIRS} pairs; else {} presumed \
                 with weight {PRESUMED_PAIRS}",
                HeadingLaw::PRESUMED_SHARE
            ),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(ms: i64, x: f64, yaw: f64) -> Report {
        Report { at: Timestamp::EPOCH + Span::from_millis(ms), position: [x, 0.0], yaw }
    }

    /// The probability of half a turn, and the constant error, rad.
    fn reversed_and_offset(counts: &HeadingCounts) -> (f64, f64) {
        let HeadingLaw::Mixture { front_odds_ln, offset, .. } = counts.law(true) else { panic!("a mixture") };
        (1.0 / (1.0 + libm::exp(front_odds_ln)), offset)
    }

    #[test]
    fn only_what_moved_straight_ahead_is_compared() {
        let compared = compare(&report(0, 0.0, 0.1), &report(1000, 8.0, 0.1)).unwrap();
        assert!(
            (compared.heading - 0.1).abs() < 1e-12 && (compared.axis - 0.1).abs() < 1e-12,
            "{compared:?}"
        );
        assert_eq!(compare(&report(0, 0.0, 0.1), &report(1000, 1.0, 0.1)), None, "too near");
        assert_eq!(compare(&report(0, 0.0, 0.1), &report(1000, 8.0, 0.6)), None, "turned");
        let flipped = compare(&report(0, 0.0, 0.1), &report(1000, 8.0, 0.1 - PI)).unwrap();
        assert!((flipped.heading.abs() - PI + 0.1).abs() < 1e-12, "it is turned round");
        assert!((flipped.axis - 0.1).abs() < 1e-12, "of a turned heading the axis is the same: {flipped:?}");
    }

    #[test]
    fn on_a_bend_the_axis_is_held_against_the_course_in_its_middle() {
        let bend = compare(&report(0, 0.0, -0.09), &report(1000, 8.0, 0.09)).unwrap();
        assert!(bend.axis.abs() < 1e-3 && (bend.heading - 0.09).abs() < 1e-12, "{bend:?}");
    }

    /// After so many pairs: the variance that lasts, rad², and its share of the declared one.
    fn lasting(is_described: bool, pair: fn(i32) -> [f64; 2], n: i32) -> [f64; 2] {
        let mut counts = HeadingCounts::default();
        (0..n).for_each(|k| counts.add_pair(pair(k)));
        let HeadingLaw::Mixture { lasting, lasting_share, .. } = counts.law(is_described) else {
            panic!("a mixture")
        };
        [lasting, lasting_share]
    }

    /// Of objects whose errors are alike after two seconds, and of others.
    fn alike(k: i32) -> [f64; 2] {
        if k % 2 == 0 { [0.1, 0.08] } else { [-0.08, -0.1] }
    }
    fn white(k: i32) -> [f64; 2] {
        [[0.1, 0.1], [0.1, -0.1]][usize::from(k % 2 == 0)]
    }

    #[test]
    fn errors_last_that_are_alike_two_seconds_later_and_no_others() {
        let [found, share] = lasting(true, alike, 100);
        assert!((found - 0.008).abs() < 1e-4 && share == 0.0);
        assert_eq!(lasting(true, alike, 20), [0.0, 0.0], "too few");
        assert_eq!(lasting(true, white, 100), [0.0, 0.0]);
        assert_eq!(lasting(true, |_| [1.5, 1.5], 100), [0.0, 0.0], "a quarter turn is no variance");
    }

    #[test]
    fn where_nothing_is_described_half_is_presumed_to_last_until_pairs_say_otherwise() {
        assert_eq!(lasting(false, alike, 0), [0.0, 0.5]);
        let [found, share] = lasting(false, alike, 10);
        assert!(
            (found - 0.004).abs() < 1e-4 && (share - 0.25).abs() < 1e-12,
            "half of either: {found} {share}"
        );
        let [found, share] = lasting(false, alike, 1000);
        assert!((found - 0.008).abs() < 2e-4 && share < 0.01, "{found} {share}");
        assert_eq!(lasting(false, white, 20), [0.0, 0.0], "white errors are found out soon");
    }

    /// Of what stands, after 200 pairs of reports with a declared σ of 0.05 rad: how many times the variance is, and the share that is
    /// turned.
    fn of_standing(difference: fn(i32) -> f64) -> (f64, f64) {
        let mut counts = HeadingCounts::default();
        (0..200).for_each(|k| counts.add_standing(difference(k), 0.0025));
        let law = counts.law(false);
        (law.standing(), 1.0 / (1.0 + libm::exp(law.front_odds_ln())))
    }

    #[test]
    fn pairs_of_reports_of_what_stands_show_worthless_headings_and_turned_ones() {
        let as_declared = of_standing(|k| if k % 2 == 0 { 0.07 } else { -0.07 });
        assert_eq!(as_declared.0, 1.0);
        let (worthless, _) = of_standing(|k| f64::from(k) * 0.7);
        assert!(worthless * 0.0025 > 0.4, "{worthless}: any axis");
        // Of each report three times the declared σ.
        let (times, turned) = of_standing(|k| if k % 2 == 0 { 0.21 } else { -0.21 });
        assert!((8.0..10.0).contains(&times) && turned < 0.0201, "{times} {turned}");
        // One report in five is turned: one pair in three differs.
        let (times, turned) = of_standing(|k| if k % 25 < 8 { PI } else { 0.0 });
        assert!(times == 1.0 && (0.15..0.22).contains(&turned), "{times} {turned}");
        assert_eq!(HeadingCounts::default().law(false).standing(), 1.0);
    }

    #[test]
    fn the_share_of_turned_headings_is_learnt() {
        let mut counts = HeadingCounts::default();
        let (reversed, offset) = reversed_and_offset(&counts);
        assert!((reversed - 0.02).abs() < 1e-12 && offset == 0.0);
        (0..300).for_each(|k| counts.add(if k % 3 == 0 { PI - 0.02 } else { 0.03 }));
        let (reversed, offset) = reversed_and_offset(&counts);
        assert!((reversed - 0.33).abs() < 0.02 && offset == 0.0, "{reversed} {offset}");
    }

    #[test]
    fn a_constant_error_is_learnt_and_a_small_or_scattered_one_is_not() {
        let offset_of = |differences: fn(i32) -> f64| {
            let mut counts = HeadingCounts::default();
            (0..100).for_each(|k| counts.add(differences(k)));
            reversed_and_offset(&counts).1
        };
        assert!((offset_of(|_| 0.5) - 0.5).abs() < 1e-3);
        assert!((offset_of(|_| 0.5 - PI) - 0.5).abs() < 1e-3, "and turned round");
        assert_eq!(offset_of(|_| 0.1), 0.0);
        assert_eq!(offset_of(|k| f64::from(k % 10) * 0.3), 0.0);
    }
}
