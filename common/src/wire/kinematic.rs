//! The 4×4 covariance of a fused object's position and velocity on the wire.

use super::error::WireError;
use super::quantity;
use crate::detection::InvalidValue;
use crate::fused::{KINEMATIC_DIAGONAL, KINEMATIC_INDEX, KinematicCovariance};

/// Standard deviations, and correlations in the order of [`KINEMATIC_INDEX`].
pub(super) type WireKinematic = ([u8; 4], [i8; 6]);

/// Places of the off-diagonal elements in a [`KinematicCovariance`].
const OFF_DIAGONAL: [usize; 6] = [1, 2, 3, 5, 6, 8];

/// The bytes of a covariance.
///
/// Rounding the correlations one by one can make the matrix indefinite; all are then reduced, by 1/128 at a time,
/// until it is positive definite.
pub(super) fn encode(covariance: &KinematicCovariance) -> Result<WireKinematic, WireError> {
    let variances = KINEMATIC_DIAGONAL.map(|place| covariance[place]);
    let mut sigma = [0; 4];
    for (byte, variance) in sigma.iter_mut().zip(variances) {
        *byte = quantity::metric_sigma("kinematic variance", variance)?;
    }
    let roots = roots(variances);
    for shrink in 0..128 {
        let rho = correlations(covariance, &roots, 1.0 - f64::from(shrink) / 128.0)?;
        if is_positive_definite(rho) {
            return Ok((sigma, rho));
        }
    }
    Ok((sigma, [0; 6]))
}

/// The square roots of the products of two variances.
#[inline]
fn roots(variances: [f64; 4]) -> [f64; 6] {
    OFF_DIAGONAL.map(|place| {
        let (row, column) = KINEMATIC_INDEX[place];
        (variances[row] * variances[column]).sqrt()
    })
}

#[inline]
fn correlations(
    covariance: &KinematicCovariance,
    roots: &[f64; 6],
    factor: f64,
) -> Result<[i8; 6], WireError> {
    let mut rho = [0; 6];
    for ((byte, place), root) in rho.iter_mut().zip(OFF_DIAGONAL).zip(roots) {
        *byte = quantity::correlation_byte("kinematic covariance", factor * covariance[place], *root)?;
    }
    Ok(rho)
}

/// The covariance of the bytes: positive definite, or an error.
pub(super) fn decode((sigma, rho): WireKinematic) -> Result<KinematicCovariance, WireError> {
    if !is_positive_definite(rho) {
        let (field, expected) = ("pivot of the kinematic covariance", "more than 0: positive definite");
        let value = smallest_pivot(rho);
        return Err(InvalidValue { field, index: None, value, expected }.into());
    }
    let variances = sigma.map(quantity::metric_variance);
    let roots = roots(variances);
    let mut covariance = [0.0; 10];
    for (place, variance) in KINEMATIC_DIAGONAL.into_iter().zip(variances) {
        covariance[place] = variance;
    }
    for (place, (byte, root)) in OFF_DIAGONAL.into_iter().zip(rho.into_iter().zip(roots)) {
        covariance[place] = quantity::correlation(byte) * root;
    }
    Ok(covariance)
}

/// Sylvester's criterion, in whole 1/128: exact, and without a division.
#[inline]
fn is_positive_definite(rho: [i8; 6]) -> bool {
    const ONE: i64 = 128;
    let [a, b, c, d, e, f] = rho.map(|byte| i64::from(byte.max(-127)));
    let minor_2 = ONE * ONE - a * a;
    // Schur complement of the first two rows: the lower 2×2 block, times its determinant.
    let p = minor_2 * ONE - ONE * (b * b + d * d) + 2 * a * b * d;
    let q = minor_2 * f - ONE * (b * c + d * e) + a * (b * e + c * d);
    let r = minor_2 * ONE - ONE * (c * c + e * e) + 2 * a * c * e;
    // Any correlation is below one, which makes the first two minors positive.
    p > 0 && p * r > q * q
}

fn symmetric(rho: [i8; 6]) -> [[f64; 4]; 4] {
    let mut matrix = [[1.0; 4]; 4];
    let off_diagonal = KINEMATIC_INDEX.into_iter().filter(|(row, column)| row != column);
    for ((row, column), byte) in off_diagonal.zip(rho) {
        matrix[row][column] = quantity::correlation(byte);
        matrix[column][row] = matrix[row][column];
    }
    matrix
}

/// The smallest pivot of the correlation matrix, or the first that is not positive.
#[cold]
fn smallest_pivot(rho: [i8; 6]) -> f64 {
    let mut matrix = symmetric(rho);
    let mut smallest = f64::INFINITY;
    for k in 0..4 {
        let pivot_row = matrix[k];
        smallest = smallest.min(pivot_row[k]);
        if smallest <= 0.0 {
            return smallest;
        }
        for row in &mut matrix[k + 1..] {
            let factor = row[k] / pivot_row[k];
            for (value, above) in row.iter_mut().zip(pivot_row) {
                *value -= factor * above;
            }
        }
    }
    smallest
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Correlations are whole 1/128, so a positive determinant is at least 128⁻⁴ and no pivot is below that.
    const SMALLEST_PIVOT: f64 = 1e-9;

    fn byte() -> impl Strategy<Value = i8> {
        prop_oneof![any::<i8>(), -3..=3i8, 120..=127i8, prop::sample::select(vec![0, 64, -64, 127, -128])]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]
        #[test]
        fn whole_minors_and_rounded_pivots_agree(rho in prop::array::uniform6(byte())) {
            prop_assert_eq!(is_positive_definite(rho), smallest_pivot(rho) > SMALLEST_PIVOT);
        }

        /// One correlation is chosen so that the determinant is as near to zero as whole steps allow.
        #[test]
        fn they_agree_at_the_edge(rho in prop::array::uniform6(byte()), place in 0..6usize) {
            let mut rho = rho;
            for byte in i8::MIN..=i8::MAX {
                rho[place] = byte;
                prop_assert_eq!(is_positive_definite(rho), smallest_pivot(rho) > SMALLEST_PIVOT, "{:?}", rho);
            }
        }
    }
}
