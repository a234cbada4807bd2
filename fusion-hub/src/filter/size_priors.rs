//! Size priors of classes, learnt from the tracks.
//!
//! Empirical Bayes in two levels (deploy/docs/methods.md): ln s of an object is normal about its class's mean
//! with a known spread, the class's mean normal about a typical one. Every track adds a pseudo-observation:
//! its own evidence, without the prior under which it was interpreted.

use super::size_evidence::{LogNormal, SizeEvidence, SizeReading};
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;
use v2x_common::class::Class;

/// Relative spread of class means about [`Class::typical_size`]: round numbers, good to a quarter.
const TYPICAL_SPREAD: f64 = 0.25;

/// Prior about the typical size under which one object's reports give the pseudo-observation: wide
/// enough to add no information, narrow enough that a single report has a mean.
const READING_SPREAD: f64 = 0.5;

/// Share of objects that are unlike their class (a van, or a lorry that a detector classifies as a car), and by how
/// much more these differ: round numbers.
const UNUSUAL: f64 = 0.02;
const WIDER: f64 = 3.0;
/// Odds below this are neglected.
const NEGLIGIBLE: f64 = 0.03;

/// How sizes of one class differ: standard deviations of ln width and ln depth, and their correlation.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Spread {
    tau: [f64; 2],
    rho: f64,
}

impl Spread {
    const fn new(tau_width: f64, tau_depth: f64, rho: f64) -> Self {
        Self { tau: [tau_width, tau_depth], rho }
    }

    /// deploy/docs/methods.md; classes that are not in its table use those of a similar class.
    const fn of(class: Class) -> Self {
        match class {
            Class::Car | Class::PoliceCar => Self::new(0.08, 0.08, 0.5),
            Class::Truck | Class::Ambulance => Self::new(0.15, 0.25, 0.8),
            Class::RigidBus | Class::BendyBus => Self::new(0.08, 0.2, 0.3),
            Class::Trailer => Self::new(0.15, 0.3, 0.5),
            Class::Barrier => Self::new(0.12, 0.2, 0.0),
            Class::TrafficCone => Self::new(0.2, 0.2, 0.8),
            Class::Motorcycle => Self::new(0.2, 0.2, 0.6),
            Class::Bicycle => Self::new(0.2, 0.12, 0.5),
            Class::ConstructionVehicle => Self::new(0.2, 0.3, 0.4),
            Class::Unknown | Class::Debris | Class::PushablePullable | Class::BicycleRack | Class::Animal => {
                Self::new(0.8, 0.8, 0.5)
            }
            _ => Self::new(0.15, 0.22, 0.5),
        }
    }
}

/// Information about one dimension's class mean, in whole parts of 2⁻²⁴: sums of integers are the same in any
/// order of tracks, and what was added can be subtracted exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
struct Information {
    /// Σ weight.
    weight: i64,
    /// Σ weight · (ln s − typical).
    sum: i64,
}

const PARTS: f64 = (1 << 24) as f64;
/// The information of some thousand well measured cars.
const MAX_KEPT_PARTS: i64 = 150_000 << 24;
/// Most that one track adds: sums over all tracks of a hub stay far inside of 64 bits.
const MOST_PARTS: f64 = 1e12;

impl Information {
    fn new(weight: f64, sum: f64) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "clamped before the cast")]
        let parts = |value: f64| (value * PARTS).clamp(-MOST_PARTS, MOST_PARTS) as i64;
        Self { weight: parts(weight), sum: parts(sum) }
    }

    fn add(&mut self, other: Self) {
        self.weight = self.weight.saturating_add(other.weight);
        self.sum = self.sum.saturating_add(other.sum);
    }
}

/// The sizes of all classes, as a set of tracks gives them.
///
/// Tracks can be added in any order; a copy with the deleted tracks can be kept and added to.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SizePriors {
    classes: [[Information; 2]; Class::ALL.len()],
    /// Whether classes give no information.
    is_flat: bool,
}

/// What one track has added to the priors of its class, and how its evidence was read for it.
#[derive(Clone, Copy, Debug)]
pub struct Contribution {
    class: Class,
    of_dimension: [Information; 2],
    evidence: [SizeEvidence; 2],
    readings: [SizeReading; 2],
}

impl Contribution {
    fn of(class: Class, evidence: &[SizeEvidence; 2]) -> Self {
        let readings = [SizeReading::of(&evidence[0]), SizeReading::of(&evidence[1])];
        Self { class, of_dimension: added(class, &readings), evidence: *evidence, readings }
    }
}

/// The priors for one track: with what it has added itself, where that is known already.
#[derive(Clone, Copy, Debug)]
pub struct TrackSizePriors<'a> {
    all: &'a SizePriors,
    own: Option<&'a Contribution>,
}

impl TrackSizePriors<'_> {
    /// Width and depth of the track, if it is of this class, from its own reports and those of the others.
    pub fn sizes(&self, class: Class, evidence: &[SizeEvidence; 2]) -> [LogNormal; 2] {
        if self.all.is_flat {
            return [evidence[0].estimate(None), evidence[1].estimate(None)];
        }
        let own = self.own.filter(|own| own.class == class);
        match own {
            Some(own) if own.evidence == *evidence => self.all.sizes_of(own),
            Some(own) => {
                // Another version of the track, of which one counts.
                self.all.sizes_of(&Contribution {
                    of_dimension: own.of_dimension,
                    ..Contribution::of(class, evidence)
                })
            }
            None => self.all.sizes_of(&Contribution::of(class, evidence)),
        }
    }
}

/// ln of the typical width and depth of each class, by its byte.
static TYPICAL: LazyLock<[[f64; 2]; Class::ALL.len()]> = LazyLock::new(|| {
    let mut typical = [[0.0; 2]; Class::ALL.len()];
    for class in Class::ALL {
        let (width, depth) = class.typical_size();
        typical[usize::from(class.byte())] = [libm::log(width), libm::log(depth)];
    }
    typical
});

fn typical(class: Class) -> [f64; 2] {
    TYPICAL[usize::from(class.byte())]
}

/// A track's evidence about its class: a pseudo-observation and its weight, by dimension.
fn added(class: Class, readings: &[SizeReading; 2]) -> [Information; 2] {
    let typical = typical(class);
    let spread = Spread::of(class);
    std::array::from_fn(|dimension| {
        let reading = LogNormal { mean_ln: typical[dimension], variance_ln: READING_SPREAD * READING_SPREAD };
        let LogNormal { mean_ln, variance_ln } = readings[dimension].estimate(Some(&reading));
        let gained = reading.variance_ln - variance_ln;
        // Reports that do not reduce the prior's variance add no information.
        if gained <= 0.0 {
            return Information::default();
        }
        let factor = reading.variance_ln / gained;
        let tau = spread.tau[dimension];
        let weight = 1.0 / (tau * tau + variance_ln * factor);
        Information::new(weight, weight * (mean_ln - typical[dimension]) * factor)
    })
}

impl SizePriors {
    /// Priors without information: the logarithm of a size is uniform.
    pub const FLAT: Self =
        Self { classes: [[Information { weight: 0, sum: 0 }; 2]; Class::ALL.len()], is_flat: true };

    /// Adds one track's evidence about its class: what it has added, where anything. `before` is what the track has added to a
    /// list before: where it has not been reported since, that is not computed again.
    pub fn note(
        &mut self,
        class: Class,
        evidence: &[SizeEvidence; 2],
        before: Option<&Contribution>,
    ) -> Option<Contribution> {
        if self.is_flat {
            return None;
        }
        let before = before.filter(|before| before.class == class && before.evidence == *evidence);
        let own = before.copied().unwrap_or_else(|| Contribution::of(class, evidence));
        for (sum, own) in self.classes[usize::from(class.byte())].iter_mut().zip(own.of_dimension) {
            sum.add(own);
        }
        Some(own)
    }

    /// For a track that has added this.
    pub const fn of_track<'a>(&'a self, own: Option<&'a Contribution>) -> TrackSizePriors<'a> {
        TrackSizePriors { all: self, own }
    }

    /// Lets older objects of a class count less once there are many.
    pub fn fade(&mut self, class: Class) {
        for information in &mut self.classes[usize::from(class.byte())] {
            if information.weight > MAX_KEPT_PARTS {
                information.weight /= 2;
                information.sum /= 2;
            }
        }
    }

    /// Width and depth of any object of a class.
    pub fn of(&self, class: Class) -> [LogNormal; 2] {
        self.without(class, &[Information::default(); 2])
    }

    /// Width and depth of a track that has added this, from its own reports and those of the others.
    ///
    /// Each dimension's prior is conditioned on the estimate of the other one.
    fn sizes_of(&self, own: &Contribution) -> [LogNormal; 2] {
        let Contribution { class, of_dimension, readings, .. } = own;
        let priors = self.without(*class, of_dimension);
        let first = [under(&readings[0], &priors[0]), under(&readings[1], &priors[1])];
        let rho = Spread::of(*class).rho;
        if rho == 0.0 {
            return first;
        }
        std::array::from_fn(|dimension| {
            let other = 1 - dimension;
            let prior = given(&priors[dimension], &priors[other], &first[other], rho);
            under(&readings[dimension], &prior)
        })
    }

    /// The class's prior without one track's own contribution: no evidence counts twice.
    fn without(&self, class: Class, own: &[Information; 2]) -> [LogNormal; 2] {
        let typical = typical(class);
        let spread = Spread::of(class);
        let all = &self.classes[usize::from(class.byte())];
        std::array::from_fn(|dimension| {
            let tau = spread.tau[dimension];
            #[expect(clippy::cast_precision_loss, reason = "24 digits after the point are enough")]
            let others =
                |of: fn(&Information) -> i64| (of(&all[dimension]) - of(&own[dimension])) as f64 / PARTS;
            let weight = others(|information| information.weight).max(0.0);
            let precision = 1.0 / (TYPICAL_SPREAD * TYPICAL_SPREAD) + weight;
            LogNormal {
                mean_ln: typical[dimension] + others(|information| information.sum) / precision,
                variance_ln: tau * tau + 1.0 / precision,
            }
        })
    }
}

/// The posterior of a size under a prior that allows for unusual objects: the estimates under the class's spread and
/// under the wider one, weighted by the likelihood of the reports.
fn under(reading: &SizeReading, prior: &LogNormal) -> LogNormal {
    let usual = reading.estimate(Some(prior));
    let (off, variance) = reading.off(prior.mean_ln);
    let expected = prior.variance_ln + variance;
    // Within one standard deviation the object is usual: the wider prior is not evaluated.
    if off * off <= expected {
        return usual;
    }
    let wide = LogNormal { variance_ln: WIDER * WIDER * prior.variance_ln, ..*prior };
    let expected_of_wide = wide.variance_ln + variance;
    // Ratio of the two normal densities.
    let ratio = libm::sqrt(expected / expected_of_wide)
        * libm::exp(off * off / 2.0 * (1.0 / expected - 1.0 / expected_of_wide));
    let odds = UNUSUAL / (1.0 - UNUSUAL) * ratio;
    if odds < NEGLIGIBLE {
        return usual;
    }
    let share = if odds.is_finite() { odds / (1.0 + odds) } else { 1.0 };
    let unusual = reading.estimate(Some(&wide));
    let apart = unusual.mean_ln - usual.mean_ln;
    LogNormal {
        mean_ln: usual.mean_ln + share * apart,
        variance_ln: (1.0 - share) * usual.variance_ln
            + share * unusual.variance_ln
            + share * (1.0 - share) * apart * apart,
    }
}

/// A prior, given an estimate of a quantity that is correlated with it.
fn given(prior: &LogNormal, other_prior: &LogNormal, other: &LogNormal, rho: f64) -> LogNormal {
    let ratio = libm::sqrt(prior.variance_ln / other_prior.variance_ln);
    let explained = (1.0 - other.variance_ln / other_prior.variance_ln).max(0.0);
    LogNormal {
        mean_ln: prior.mean_ln + rho * ratio * (other.mean_ln - other_prior.mean_ln),
        variance_ln: prior.variance_ln * (1.0 - rho * rho * explained),
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(in crate::filter) fn listed() -> Vec<(&'static str, String)> {
    let spread = |class: &Class| (class.name(), Spread::of(*class).tau, Spread::of(*class).rho);
    let spreads: Vec<_> = Class::ALL.iter().map(spread).collect();
    vec![
        ("size.spreads", format!("{spreads:?}")),
        ("size.typical_spread", TYPICAL_SPREAD.to_string()),
        ("size.reading_spread", READING_SPREAD.to_string()),
        ("size.unusual", format!("{UNUSUAL} of objects, {WIDER} times the spread")),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `count` equal reports of a width and a depth.
    fn reported(size: [f64; 2], sigma: f64, count: usize) -> [SizeEvidence; 2] {
        size.map(|z| {
            let mut evidence = SizeEvidence::initial(z, sigma * sigma, 0.1);
            (1..count).for_each(|_| evidence.update(z, sigma * sigma, 0.1));
            evidence
        })
    }

    /// Width and depth of a track that was added.
    fn sizes_in(priors: &SizePriors, class: Class, evidence: &[SizeEvidence; 2]) -> [LogNormal; 2] {
        priors.of_track(None).sizes(class, evidence)
    }

    #[test]
    fn what_was_added_before_is_taken_again_only_for_the_same_evidence_and_class() {
        let (early, later) = (reported([1.8, 4.4], 0.2, 3), reported([1.9, 4.7], 0.2, 5));
        let noted = |class, evidence: &_, before: Option<&Contribution>| {
            let mut priors = SizePriors::default();
            let own = priors.note(class, evidence, before);
            let sizes = priors.of_track(own.as_ref()).sizes(class, evidence);
            (format!("{own:?}"), priors, sizes)
        };
        let before = SizePriors::default().note(Class::Car, &early, None);
        for (class, evidence) in [(Class::Car, early), (Class::Car, later), (Class::Truck, early)] {
            assert_eq!(noted(class, &evidence, before.as_ref()), noted(class, &evidence, None), "{class:?}");
        }
    }

    #[test]
    fn without_tracks_a_class_is_typical() {
        let [width, depth] = SizePriors::default().of(Class::Car);
        assert!((width.mean_ln - libm::log(1.8)).abs() < 1e-12);
        assert!((depth.size().mean - 4.5).abs() < 1e-12);
        assert!((depth.variance_ln - (0.08 * 0.08 + 0.25 * 0.25)).abs() < 1e-12);
    }

    #[test]
    fn a_class_prior_uses_only_tracks_of_its_class() {
        let mut priors = SizePriors::default();
        for _ in 0..100 {
            priors.note(Class::Car, &reported([2.1, 5.2], 0.05, 50), None);
        }
        let [width, depth] = priors.of(Class::Car);
        assert!((width.size().mean - 2.1).abs() < 0.02 && (depth.size().mean - 5.2).abs() < 0.05);
        // The class's mean is known to 0.8 %: what is left is how cars differ.
        assert!(depth.variance_ln < 1.05 * 0.08 * 0.08);
        assert_eq!(priors.of(Class::Truck), SizePriors::default().of(Class::Truck));
        // A single inaccurate report of a car has little weight against a hundred cars.
        let poor = reported([4.0, 2.0], 1.0, 1);
        priors.note(Class::Car, &poor, None);
        let [width, depth] = sizes_in(&priors, Class::Car, &poor);
        assert!((width.size().mean - 2.1).abs() < 0.1 && (depth.size().mean - 5.2).abs() < 0.3);
    }

    #[test]
    fn the_prior_of_a_track_excludes_its_own_evidence() {
        let alone = reported([2.4, 0.7], 0.2, 3);
        let mut priors = SizePriors::default();
        priors.note(Class::Barrier, &alone, None);
        let sizes = sizes_in(&priors, Class::Barrier, &alone);
        for ((size, evidence), typical) in
            sizes.iter().zip(alone).zip(SizePriors::default().of(Class::Barrier))
        {
            let expected = under(&SizeReading::of(&evidence), &typical);
            assert!((size.mean_ln - expected.mean_ln).abs() < 1e-12);
            assert!((size.variance_ln - expected.variance_ln).abs() < 1e-12);
        }
    }

    #[test]
    fn a_longer_truck_has_a_wider_width_prior() {
        let long = [SizeEvidence::initial(2.5, 1.0, 0.1), reported([0.0, 12.0], 0.05, 50)[1]];
        let short = [SizeEvidence::initial(2.5, 1.0, 0.1), reported([0.0, 5.0], 0.05, 50)[1]];
        let mut priors = SizePriors::default();
        priors.note(Class::Truck, &long, None);
        priors.note(Class::Truck, &short, None);
        let width = |evidence| sizes_in(&priors, Class::Truck, evidence)[0].size().mean;
        assert!(width(&long) > 1.15 * width(&short), "{} {}", width(&long), width(&short));
    }

    #[test]
    fn many_reports_of_an_unusual_size_override_the_class_prior() {
        let mut priors = SizePriors::default();
        for _ in 0..100 {
            priors.note(Class::Car, &reported([1.8, 4.5], 0.05, 50), None);
        }
        let depth_after = |count| {
            let lorry = reported([2.4, 9.0], 0.2, count);
            let mut priors = priors.clone();
            priors.note(Class::Car, &lorry, None);
            sizes_in(&priors, Class::Car, &lorry)[1].size().mean
        };
        // One report twice as long is more likely a bad one of a car; ten such reports are not of a usual car.
        assert!(depth_after(1) < 6.0 && depth_after(10) > 8.0, "{} {}", depth_after(1), depth_after(10));
    }

    #[test]
    fn usual_sizes_are_estimated_as_without_the_unusual_prior() {
        let mut priors = SizePriors::default();
        for _ in 0..100 {
            priors.note(Class::Car, &reported([1.8, 4.5], 0.05, 50), None);
        }
        let car = reported([1.85, 4.6], 0.2, 5);
        let prior = priors.of(Class::Car)[1];
        let (bare, allowing) = (car[1].estimate(Some(&prior)), under(&SizeReading::of(&car[1]), &prior));
        assert!((bare.mean_ln - allowing.mean_ln).abs() < 1e-3);
        assert!((bare.variance_ln / allowing.variance_ln - 1.0).abs() < 0.15);
    }

    #[test]
    fn an_unusual_size_is_the_mixture_of_both_priors() {
        let prior = LogNormal { mean_ln: libm::log(4.5), variance_ln: 0.01 };
        for (z, count) in [(7.0, 1), (7.5, 2), (6.0, 8), (3.2, 4)] {
            let evidence = reported([z, z], 0.2, count)[0];
            let wide = LogNormal { variance_ln: 9.0 * prior.variance_ln, ..prior };
            let (usual, unusual) = (evidence.estimate(Some(&prior)), evidence.estimate(Some(&wide)));
            // Normal densities of how far the reports are off, without what both have in common.
            let (off, own) = SizeReading::of(&evidence).off(prior.mean_ln);
            let density = |variance: f64| libm::exp(-off * off / (2.0 * variance)) / libm::sqrt(variance);
            let (a, b) = (0.98 * density(prior.variance_ln + own), 0.02 * density(wide.variance_ln + own));
            let share = b / (a + b);
            let mean = (1.0 - share) * usual.mean_ln + share * unusual.mean_ln;
            let second = |part: &LogNormal| part.variance_ln + part.mean_ln * part.mean_ln;
            let variance = (1.0 - share) * second(&usual) + share * second(&unusual) - mean * mean;
            let found = under(&SizeReading::of(&evidence), &prior);
            assert!(share > 0.03, "{z} {count}: {share} would be neglected");
            assert!((found.mean_ln - mean).abs() < 1e-12, "{z} {count} {found:?}");
            assert!((found.variance_ln - variance).abs() < 1e-12, "{z} {count} {found:?}");
        }
    }

    #[test]
    fn a_correlated_estimate_conditions_a_prior() {
        let prior = LogNormal { mean_ln: 0.5, variance_ln: 0.04 };
        let other_prior = LogNormal { mean_ln: 1.5, variance_ln: 0.09 };
        let known = LogNormal { mean_ln: 1.8, variance_ln: 0.0 };
        // A known other dimension: the conditional normal distribution, slope ρ σ/σ'.
        let found = given(&prior, &other_prior, &known, 0.6);
        assert!((found.mean_ln - (0.5 + 0.6 * (0.2 / 0.3) * 0.3)).abs() < 1e-12);
        assert!((found.variance_ln - 0.04 * (1.0 - 0.36)).abs() < 1e-12);
        // Of which a third of the variance is left: two thirds of that reduction.
        let found = given(&prior, &other_prior, &LogNormal { variance_ln: 0.03, ..known }, 0.6);
        assert!((found.variance_ln - 0.04 * (1.0 - 0.36 * 2.0 / 3.0)).abs() < 1e-12);
    }

    #[test]
    fn a_track_adds_what_its_reports_say_without_the_reading_prior() {
        let car = reported([2.0, 5.0], 0.1, 4);
        let mut priors = SizePriors::default();
        priors.note(Class::Car, &car, None);
        let typical = [libm::log(1.8), libm::log(4.5)];
        for ((evidence, typical), class) in car.iter().zip(typical).zip(priors.of(Class::Car)) {
            let reading = LogNormal { mean_ln: typical, variance_ln: 0.25 };
            let read = evidence.estimate(Some(&reading));
            // In the information form: the posterior's less the prior's.
            let own = 1.0 / (1.0 / read.variance_ln - 1.0 / 0.25);
            let pseudo = own * (read.mean_ln / read.variance_ln - typical / 0.25);
            let weight = 1.0 / (0.08 * 0.08 + own);
            let precision = 16.0 + weight;
            let mean = typical + weight * (pseudo - typical) / precision;
            // What is added is rounded to 2⁻²⁴.
            assert!((class.mean_ln - mean).abs() < 1e-7, "{class:?}");
            assert!((class.variance_ln - (0.08 * 0.08 + 1.0 / precision)).abs() < 1e-7, "{class:?}");
        }
    }

    #[test]
    fn older_objects_count_half_once_there_are_many() {
        let mut priors = SizePriors::default();
        let car = usize::from(Class::Car.byte());
        let at_limit = Information { weight: MAX_KEPT_PARTS, sum: 700 };
        let beyond = Information { weight: 2 * MAX_KEPT_PARTS, sum: -900 };
        priors.classes[car] = [at_limit, beyond];
        priors.fade(Class::Car);
        assert_eq!(priors.classes[car], [at_limit, Information { weight: MAX_KEPT_PARTS, sum: -450 }]);
    }
}
