//! Width or depth from many reports.
//!
//! Of a sensor that declares the law of its size errors they are read by that law: its errors are proportional to the true
//! size. A report is z = f·s with f ~ N(1, σ²), cut off below at `lower` (deploy/docs/methods.md). In s
//! the likelihood of all reports together is exp(−(A/s² − 2B/s)/2)/sⁿ for s ≤ min(z/lower), with
//! A = Σ z²/σ², B = Σ z/σ²: four numbers that add up in any order without loss.
//!
//! By the law reports that differ by less than their σ are rather of a smaller object. Where a share of the size is assumed because
//! nobody states an error, this would make exact reports of a car too small by 4 % (σ = 0.2) or 17 % (0.5). Such reports are averaged:
//! the weight of one does not depend on what it reports, and ln s is normal about the mean's logarithm with the variance 1/Σ 1/σ².
//! Errors that are stated in metres are read by the law, too: weighed by their share, a mean would favour what is reported too large.

use super::Size;
pub use super::log_normal::LogNormal;
use super::size_posterior::Posterior;
use serde::{Deserialize, Serialize};

/// The evidence of all reports of one dimension.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SizeEvidence {
    /// A, m².
    squares: f64,
    /// B, m.
    sum: f64,
    /// n.
    count: f64,
    /// Largest size (m) that could have been reported so small.
    most: f64,
    /// Reports without a law whose σ is a share of the size: Σ 1/σ², and Σ z/σ² in m.
    averaged: (f64, f64),
}

impl SizeEvidence {
    /// The evidence of a first report `z` (m) with relative variance `variance`, cut off below `lower` times the size
    /// (0: not cut off).
    pub fn initial(z: f64, variance: f64, lower: f64) -> Self {
        let mut initial = Self::NONE;
        initial.update(z, variance, lower);
        initial
    }

    /// The evidence of a first report `z` (m) with relative variance `variance` whose law nobody declares.
    pub fn of_average(z: f64, variance: f64) -> Self {
        let mut initial = Self::NONE;
        initial.average(z, variance);
        initial
    }

    const NONE: Self = Self { squares: 0.0, sum: 0.0, count: 0.0, most: f64::INFINITY, averaged: (0.0, 0.0) };

    /// Adds a report.
    pub fn update(&mut self, z: f64, variance: f64, lower: f64) {
        let weight = 1.0 / variance;
        self.squares += z * z * weight;
        self.sum += z * weight;
        self.count += 1.0;
        // A division by 0 gives infinity, as intended.
        self.most = self.most.min(z / lower);
    }

    /// Adds a report whose law nobody declares.
    pub fn average(&mut self, z: f64, variance: f64) {
        let weight = 1.0 / variance;
        self.averaged = (self.averaged.0 + weight, self.averaged.1 + z * weight);
    }

    /// Adds a report of unknown correlation with the others, which is all evidence of its own: of one quantity,
    /// covariance intersection takes the more accurate one.
    pub fn intersect(&mut self, alone: Self) {
        if alone.information() > self.information() {
            *self = alone;
        }
    }

    /// The size that makes the reports likeliest, m.
    pub fn likeliest(&self) -> f64 {
        let Some(mean) = self.mean() else { return self.unbounded().min(self.most) };
        if self.count == 0.0 {
            return libm::exp(mean.mean_ln);
        }
        let posterior = self.by_law().under(Some(&mean));
        1.0 / (posterior.w * posterior.peak().w)
    }

    /// What the reports with a law say.
    fn by_law(&self) -> Posterior {
        Posterior::of([self.squares, self.sum, self.count, self.most])
    }

    /// What the averaged reports say; `None` without any.
    fn mean(&self) -> Option<LogNormal> {
        let (weight, sum) = self.averaged;
        (weight > 0.0).then(|| LogNormal { mean_ln: libm::log(sum / weight), variance_ln: 1.0 / weight })
    }

    /// Without the bound: 1/w for the positive root of A w² − B w − n.
    fn unbounded(&self) -> f64 {
        let Self { squares, sum, count, .. } = *self;
        2.0 * squares / (sum + libm::sqrt(sum * sum + 4.0 * squares * count))
    }

    /// About ln s, at the likeliest size.
    fn information(&self) -> f64 {
        self.information_at(self.likeliest())
    }

    fn information_at(&self, size: f64) -> f64 {
        let w = 1.0 / size;
        // Where nothing bounds the size this is A w² + n.
        (2.0 * self.squares * w * w - self.sum * w).max(self.count) + self.averaged.0
    }

    /// The likeliest size (m) and its variance (m²): what gates need, without a prior.
    pub fn roughly(&self) -> Size {
        let mean = self.likeliest();
        Size { mean, variance: mean * mean / self.information_at(mean) }
    }

    /// The posterior of the size; without a prior the logarithm's is uniform.
    ///
    /// Mean and variance of ln s.
    pub fn estimate(&self, prior: Option<&LogNormal>) -> LogNormal {
        SizeReading::of(self).estimate(prior)
    }
}

/// Evidence that is read under several priors: what they have in common.
#[derive(Clone, Copy, Debug)]
pub(super) struct SizeReading {
    /// Whether no report has a law.
    is_averaged: bool,
    mean: Option<LogNormal>,
    /// By the reports with a law alone, where there are any.
    by_law: Posterior,
    /// The likeliest size by all reports, without a prior, and about how certain that is.
    alone: LogNormal,
}

impl SizeReading {
    pub(super) fn of(evidence: &SizeEvidence) -> Self {
        let mean = evidence.mean();
        if evidence.count == 0.0
            && let Some(mean) = mean
        {
            return Self { is_averaged: true, by_law: Posterior::NONE, mean: Some(mean), alone: mean };
        }
        let by_law = evidence.by_law();
        let own = by_law.under(mean.as_ref()).peak();
        let variance_ln = 1.0 / evidence.information_at(1.0 / (by_law.w * own.w));
        let alone = LogNormal { mean_ln: by_law.origin + own.u, variance_ln };
        Self { is_averaged: false, by_law, mean, alone }
    }

    /// How far the likeliest size is from another, in ln s, and the variance of it by the reports alone.
    pub(super) fn off(&self, mean_ln: f64) -> (f64, f64) {
        (self.alone.mean_ln - mean_ln, self.alone.variance_ln)
    }

    /// As [`SizeEvidence::estimate`].
    pub(super) fn estimate(&self, prior: Option<&LogNormal>) -> LogNormal {
        let both = match (&self.mean, prior) {
            (None, prior) => prior.copied(),
            (Some(mean), None) => Some(*mean),
            (Some(mean), Some(prior)) => Some(prior.and(mean)),
        };
        match both {
            Some(both) if self.is_averaged => both,
            both => self.by_law.under(both.as_ref()).moments(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    fn uniform(random: &mut ChaCha8Rng) -> f64 {
        (f64::from(random.next_u32()) + 0.5) / 4_294_967_296.0
    }

    /// A factor of the truncated law.
    fn factor(random: &mut ChaCha8Rng, sigma: f64, lower: f64) -> f64 {
        loop {
            let radius = libm::sqrt(-2.0 * libm::log(uniform(random)));
            let f = 1.0 + sigma * radius * libm::cos(std::f64::consts::TAU * uniform(random));
            if f >= lower {
                return f;
            }
        }
    }

    /// The posterior on a dense grid.
    fn on_a_grid(reports: &[(f64, f64, f64)], prior: Option<&LogNormal>) -> LogNormal {
        let (mut zeroth, mut first, mut second) = (0.0, 0.0, 0.0);
        let ln_density = |u: f64| {
            let s = libm::exp(u);
            let mut sum = prior.map_or(0.0, |p| -(u - p.mean_ln) * (u - p.mean_ln) / (2.0 * p.variance_ln));
            for (z, sigma, lower) in reports {
                let off = (z / s - 1.0) / sigma;
                sum += if *z < lower * s { f64::NEG_INFINITY } else { -off * off / 2.0 - u };
            }
            sum
        };
        let grid = || (0..9_000).map(|i| -4.0 + f64::from(i) * 1e-3);
        let most = grid().map(ln_density).fold(f64::NEG_INFINITY, f64::max);
        for u in grid() {
            let density = libm::exp(ln_density(u) - most);
            zeroth += density;
            first += density * u;
            second += density * u * u;
        }
        let mean = first / zeroth;
        LogNormal { mean_ln: mean, variance_ln: second / zeroth - mean * mean }
    }

    #[test]
    fn the_posterior_is_that_of_a_dense_grid() {
        let mut random = ChaCha8Rng::seed_from_u64(9);
        let class = LogNormal { mean_ln: 0.6, variance_ln: 0.04 };
        let vague = LogNormal { mean_ln: 0.2, variance_ln: 2.25 };
        for sigma in [0.05, 0.2, 0.5, 1.0] {
            for count in [1, 2, 5, 20, 100] {
                for (prior, tolerance) in [(Some(&class), 0.01), (Some(&vague), 0.12)] {
                    for _ in 0..3 {
                        let reports: Vec<_> =
                            (0..count).map(|_| (2.0 * factor(&mut random, sigma, 0.1), sigma, 0.1)).collect();
                        let (z, _, lower) = reports[0];
                        let mut evidence = SizeEvidence::initial(z, sigma * sigma, lower);
                        reports[1..]
                            .iter()
                            .for_each(|(z, sigma, lower)| evidence.update(*z, sigma * sigma, *lower));
                        let (estimate, grid) = (evidence.estimate(prior), on_a_grid(&reports, prior));
                        let off = (estimate.mean_ln - grid.mean_ln).abs() / libm::sqrt(grid.variance_ln);
                        let ratio = estimate.variance_ln / grid.variance_ln;
                        assert!(off < tolerance, "{sigma} {count} {prior:?}: {estimate:?} {grid:?}");
                        assert!(
                            (ratio - 1.0).abs() < 3.0 * tolerance,
                            "{sigma} {count} {prior:?}: {estimate:?} {grid:?}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn reports_add_up_in_any_order() {
        let reports = [(2.0, 0.0625, 0.125), (1.5, 0.25, 0.0), (4.0, 0.0625, 0.125)];
        let mut forward = SizeEvidence::initial(reports[0].0, reports[0].1, reports[0].2);
        reports[1..].iter().for_each(|(z, sigma, lower)| forward.update(*z, *sigma, *lower));
        let mut backward = SizeEvidence::initial(reports[2].0, reports[2].1, reports[2].2);
        reports[..2].iter().for_each(|(z, sigma, lower)| backward.update(*z, *sigma, *lower));
        assert_eq!(forward, backward);
    }

    #[test]
    fn an_exact_report_is_the_size_and_absurd_reports_stay_finite() {
        let exact = SizeEvidence::initial(4.5, 1e-8, 0.0).estimate(None).size();
        assert!((exact.mean - 4.5).abs() < 1e-3 && exact.variance < 1e-6);
        let prior = LogNormal { mean_ln: 0.5, variance_ln: 0.01 };
        for (z, sigma, lower) in
            [(1e-3, 0.2, 0.1), (65.0, 0.2, 0.1), (1e-3, 10.0, 0.9), (65.0, 1e-6, 0.0), (1e-3, 1e-6, 0.999)]
        {
            let variance = sigma * sigma;
            let mut evidence = SizeEvidence::initial(z, variance, lower);
            for n in 0..1000 {
                for prior in [None, Some(&prior)] {
                    let estimate = evidence.estimate(prior);
                    assert!(
                        estimate.variance_ln > 0.0 && estimate.variance_ln.is_finite(),
                        "{z} {sigma} {n} {estimate:?}"
                    );
                    assert!(estimate.mean_ln.is_finite());
                }
                evidence.update(z * (1.0 + 0.1 * f64::from(n % 3)), variance, lower);
            }
        }
    }

    #[test]
    fn a_rough_size_is_the_likeliest_with_the_curvature_of_the_likelihood() {
        let reports = [(2.0, 0.3, 0.1), (2.6, 0.2, 0.1), (1.7, 0.25, 0.1)];
        let mut evidence = SizeEvidence::initial(2.0, 0.09, 0.1);
        evidence.update(2.6, 0.04, 0.1);
        evidence.update(1.7, 0.0625, 0.1);
        let ln_likelihood = |u: f64| -> f64 {
            let of = |(z, sigma, _): &(f64, f64, f64)| (z / libm::exp(u) - 1.0) / sigma;
            reports.iter().map(|report| -of(report) * of(report) / 2.0 - u).sum()
        };
        let rough = evidence.roughly();
        let (u, h) = (libm::log(rough.mean), 1e-4);
        let [below, at, above] = [u - h, u, u + h].map(ln_likelihood);
        assert!(((above - below) / (2.0 * h)).abs() < 1e-6, "not at the maximum");
        let information = -(above - 2.0 * at + below) / (h * h);
        assert!((rough.variance * information / (rough.mean * rough.mean) - 1.0).abs() < 1e-4);
        let (off, variance) = SizeReading::of(&evidence).off(0.5);
        assert!((off - (u - 0.5)).abs() < 1e-12 && (variance * information - 1.0).abs() < 1e-4);
    }

    #[test]
    fn of_two_dependent_reports_the_more_accurate_one_holds() {
        let start = SizeEvidence::initial(4.0, 0.04, 0.0);
        let mut evidence = start;
        evidence.intersect(SizeEvidence::initial(5.0, 0.05, 0.0));
        assert_eq!(evidence, start);
        evidence.intersect(SizeEvidence::initial(5.0, 0.03, 0.0));
        assert_eq!(evidence, SizeEvidence::initial(5.0, 0.03, 0.0));
    }

    #[test]
    fn reports_whose_law_nobody_declares_are_averaged_whatever_their_sigma() {
        for (sigma, scatter) in [(0.2, 0.0), (0.5, 0.0), (0.2, 0.1), (0.2, 0.2)] {
            let mut evidence = SizeEvidence::of_average(4.5 * (1.0 + scatter), sigma * sigma);
            for n in 1..40 {
                let factor = 1.0 + if n % 2 == 0 { scatter } else { -scatter };
                evidence.average(4.5 * factor, sigma * sigma);
            }
            let size = evidence.estimate(None).size();
            assert!((size.mean - 4.5).abs() < 1e-9 && (evidence.likeliest() - 4.5).abs() < 1e-9, "{size:?}");
            assert!((size.variance / (4.5 * 4.5 * sigma * sigma / 40.0) - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn reports_with_a_law_and_without_one_add_up() {
        let mut both = SizeEvidence::initial(4.6, 0.04, 0.1);
        both.average(4.4, 0.04);
        let prior = SizeEvidence::of_average(4.4, 0.04).estimate(None);
        assert_eq!(both.estimate(None), SizeEvidence::initial(4.6, 0.04, 0.1).estimate(Some(&prior)));
        let [least, most] = [SizeEvidence::initial(4.6, 0.04, 0.1).likeliest(), 4.4];
        assert!(least.min(most) < both.likeliest() && both.likeliest() < least.max(most));
    }

    #[test]
    fn a_log_normal_size_has_a_variance_relative_to_its_median() {
        let size = LogNormal { mean_ln: libm::log(3.0), variance_ln: 0.02 }.size();
        assert!((size.mean - 3.0).abs() < 1e-12 && (size.variance - 9.0 * 0.02).abs() < 1e-12);
    }
}
