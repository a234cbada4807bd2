//! The mixture of what several models hold of an object, about to become one model's.

use super::gaussian::{Full, Gaussian, YAW, apart, at, wrapped};
use crate::values::Real;

/// Mean and covariance of a mixture's leading components; `otherwise` where the weights are all 0: a model of weight 0 keeps its
/// state.
///
/// Deviations are taken from component `own`, the heading's the shorter way around, and the covariance
/// about the mean found, so that nothing cancels.
#[inline(always)]
pub(super) fn mixed<const N: usize, const T: usize, R: Real>(
    sources: &[Full<R>; 4],
    own: usize,
    weights: &[R; 4],
    otherwise: &Gaussian<N, T, R>,
) -> Gaussian<N, T, R> {
    let zero = weights[0].same(0.0);
    let mut sum = zero;
    for weight in weights {
        sum += *weight;
    }
    let has_none = sum.is_below(zero.same(f64::MIN_POSITIVE));
    if R::all(has_none) {
        return *otherwise;
    }
    let mut shares = *weights;
    let mut mean = [zero; N];
    let mut deviations = [[zero; N]; 4];
    for (from, deviation) in deviations.iter_mut().enumerate() {
        shares[from] = weights[from] / sum;
        for (i, deviation) in deviation.iter_mut().enumerate() {
            *deviation = sources[from].mean[i] - sources[own].mean[i];
        }
        deviation[YAW] = wrapped(deviation[YAW]);
        deviation[0] = apart(deviation[0]);
        deviation[1] = apart(deviation[1]);
        for (mean, deviation) in mean.iter_mut().zip(deviation) {
            *mean += shares[from] * *deviation;
        }
    }
    let mut covariance = [zero; T];
    for (from, deviation) in deviations.iter().enumerate() {
        if R::all(shares[from].abs().is_at_most(zero)) {
            continue;
        }
        let mut centred = *deviation;
        for (centred, mean) in centred.iter_mut().zip(&mean) {
            *centred -= *mean;
        }
        for row in 0..N {
            for column in 0..=row {
                covariance[at(row, column)] += shares[from]
                    * (sources[from].covariance[at(row, column)] + centred[row] * centred[column]);
            }
        }
    }
    for (mean, reference) in mean.iter_mut().zip(sources[own].mean) {
        *mean += reference;
    }
    let mut result = Gaussian { mean, covariance };
    result.wrap();
    result.unless(has_none, otherwise)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::imm::gaussian::Still;
    use crate::filter::imm::gaussian::tests::{Dense, any_state, dense};
    use nalgebra::SVector;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    proptest! {
        #[test]
        fn a_mixture_has_the_moments_of_its_parts(
            sources in [any_state(), any_state(), any_state(), any_state()],
            weights in [0.01..1.0f64, 0.01..1.0, 0.01..1.0, 0.01..1.0],
        ) {
            let mut sources = sources;
            for source in &mut sources {
                source.mean[YAW] /= 2.0;
            }
            let mixture: Full = mixed(&sources, 2, &weights, &sources[0]);
            let sum: f64 = weights.iter().sum();
            let parts = || sources.iter().zip(weights.map(|weight| weight / sum));
            let mean: SVector<f64, 5> = parts().map(|(s, w)| SVector::from(s.mean) * w).sum();
            let second: Dense = parts()
                .map(|(s, w)| (dense(s) + SVector::from(s.mean) * SVector::from(s.mean).transpose()) * w)
                .sum();
            prop_assert!((mean - SVector::from(mixture.mean)).abs().max() < 1e-12);
            prop_assert!((second - mean * mean.transpose() - dense(&mixture)).abs().max() < 1e-12);
        }
    }

    #[test]
    fn headings_on_both_sides_of_pi_have_their_mean_at_pi() {
        let east = Full { mean: [0.0; 5], covariance: std::array::from_fn(|i| f64::from(u8::from(i == 5))) };
        let mut sources = [east; 4];
        sources[0].mean[YAW] = PI - 0.1;
        sources[1].mean[YAW] = -PI + 0.1;
        let mixture: Full = mixed(&sources, 0, &[0.5, 0.5, 0.0, 0.0], &sources[2]);
        assert!((mixture.mean[YAW].abs() - PI).abs() < 1e-12, "{mixture:?}");
        assert!((mixture.covariance[at(YAW, YAW)] - 1.01).abs() < 1e-12);
    }

    #[test]
    fn a_model_without_weight_keeps_its_state() {
        let (source, kept) =
            (Full { mean: [1.0; 5], covariance: [1.0; 15] }, Still { mean: [2.0; 3], covariance: [3.0; 6] });
        assert_eq!(mixed(&[source; 4], 0, &[0.0; 4], &kept), kept);
    }
}
