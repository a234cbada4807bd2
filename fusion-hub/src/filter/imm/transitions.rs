//! Changes of model as a Markov chain in continuous time: P(t) = exp(G t).

use crate::values::{Real, share_lost};

type Matrix<R = f64> = [[R; 4]; 4];

/// Rates (1/s) whose chain, sampled every 0.5 s, has the probabilities of deploy/docs/methods.md.
///
/// Parked to moving .001; stopped to moving .03 and back .008: −2 ln(1 − .038) shared out 30 : 8; smooth to
/// manoeuvre .06 and back .3: −2 ln(1 − .008 − .36), less the rate of stopping, shared out 1 : 5.
const START_PARKED: f64 = 0.002_001_000_7;
const START: f64 = 0.061_169_8;
const STOP: f64 = 0.016_311_9;
const BEGIN_MANOEUVRE: f64 = 0.150_235;
const END_MANOEUVRE: f64 = 0.751_175;

/// An object that starts manoeuvres with probability one half.
const GENERATOR: Matrix = [
    [-START_PARKED, 0.0, START_PARKED / 2.0, START_PARKED / 2.0],
    [0.0, -START, START / 2.0, START / 2.0],
    [0.0, STOP, -STOP - BEGIN_MANOEUVRE, BEGIN_MANOEUVRE],
    [0.0, STOP, END_MANOEUVRE, -STOP - END_MANOEUVRE],
];

/// The generator's eigenvalues, 1/s: rest; leaving the parking space; starting and stopping; changing style.
const EIGENVALUES: [f64; 4] = [0.0, -START_PARKED, -START - STOP, -STOP - BEGIN_MANOEUVRE - END_MANOEUVRE];

/// Sylvester's formula: exp(G t) = Σ exp(λ t) Z, with Z of an eigenvalue λ the product of (G − κ I)/(λ − κ)
/// over the other eigenvalues κ.
const PROJECTORS: [Matrix; 4] = [projector(0), projector(1), projector(2), projector(3)];

const fn projector(of: usize) -> Matrix {
    let mut result = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
    let mut other = 0;
    while other < 4 {
        if other != of {
            result = times_shifted(&result, EIGENVALUES[other], EIGENVALUES[of] - EIGENVALUES[other]);
        }
        other += 1;
    }
    result
}

/// left · (G − shift I) / scale.
const fn times_shifted(left: &Matrix, shift: f64, scale: f64) -> Matrix {
    let mut result = [[0.0; 4]; 4];
    let mut entry = 0;
    while entry < 16 {
        let (row, column) = (entry / 4, entry % 4);
        let mut sum = -shift * left[row][column];
        let mut inner = 0;
        while inner < 4 {
            sum += left[row][inner] * GENERATOR[inner][column];
            inner += 1;
        }
        result[row][column] = sum / scale;
        entry += 1;
    }
    result
}

/// Probabilities of going from one model (row) to another (column) within `duration_s` ≥ 0; rows sum to 1.
#[inline(always)]
pub(super) fn within<R: Real>(duration_s: R) -> Matrix<R> {
    let [_, parked, rest, style] = EIGENVALUES;
    let (zero, one) = (duration_s.same(0.0), duration_s.same(1.0));
    let kept = |rate: f64| one - share_lost(duration_s * -rate);
    let growth = [one, kept(parked), kept(rest), kept(style)];
    let mut result = [[zero; 4]; 4];
    for (row, probabilities) in result.iter_mut().enumerate() {
        let mut leaving = zero;
        for (column, probability) in probabilities.iter_mut().enumerate() {
            if row != column {
                let mut sum = zero;
                for (growth, projector) in growth.iter().zip(&PROJECTORS) {
                    sum += *growth * projector[row][column];
                }
                // Rounding: a step of nanoseconds may come out at -1e-17.
                *probability = R::choose(zero.is_below(sum), sum, zero);
                leaving += *probability;
            }
        }
        probabilities[row] = one - leaving;
    }
    result
}

/// Every rate, for [`crate::parameters`].
#[cfg(test)]
pub(in crate::filter) fn listed() -> Vec<(&'static str, String)> {
    vec![("imm.rates_of_change", format!("{GENERATOR:?}"))]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix4;

    fn dense(matrix: &Matrix) -> Matrix4<f64> {
        Matrix4::from_fn(|row, column| matrix[row][column])
    }

    #[test]
    fn half_a_second_gives_the_tables_probabilities() {
        let p = within(0.5);
        // A generator cannot give all of a discrete table: what happens twice in a step is spread.
        let table = [
            [0.999, 0.0, 0.0005, 0.0005],
            [0.0, 0.97, 0.015, 0.015],
            [0.0, 0.008, 0.932, 0.06],
            [0.0, 0.008, 0.3, 0.692],
        ];
        let difference = (dense(&p) - dense(&table)).abs().max();
        assert!(difference < 0.004, "{difference} {p:?}");
    }

    #[test]
    fn rows_sum_to_one_and_no_probability_is_negative() {
        for duration in [0.0, 1e-9, 1e-3, 0.01, 0.5, 30.0, 1e5] {
            for row in within(duration) {
                assert!(row.iter().all(|p| (0.0..=1.0).contains(p)), "{duration} {row:?}");
                assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn a_split_step_is_the_whole_step() {
        let (a, b, whole) = (dense(&within(0.13)), dense(&within(0.41)), dense(&within(0.54)));
        let off = (a * b - whole).abs().max();
        assert!(off < 1e-12, "{off}");
    }

    #[test]
    fn agrees_with_the_power_series() {
        let step = dense(&GENERATOR) * 0.3;
        let mut term = Matrix4::identity();
        let mut sum = term;
        for order in 1..20 {
            term = term * step / f64::from(order);
            sum += term;
        }
        let off = (sum - dense(&within(0.3))).abs().max();
        assert!(off < 1e-12, "{off}");
    }
}
