//! The 4×4 covariance of a fused object's position and velocity on the wire.

use super::{WireError, quantity};
use crate::detection::AbsurdValue;
use crate::fused::{KINEMATIC_DIAGONAL, KINEMATIC_INDEX, KinematicCovariance};
use serde::{Deserialize, Serialize};

/// Standard deviations, and correlations in the order of [`KINEMATIC_INDEX`].
#[derive(Serialize, Deserialize)]
pub(super) struct WireKinematic([u8; 4], [i8; 6]);

/// Correlations are whole 1/128, so a positive determinant is at least 128⁻⁴ and no pivot is below that.
const SMALLEST_PIVOT: f64 = 1e-9;

/// The bytes of a covariance.
///
/// Cutting correlations one by one can leave the matrix indefinite; all are then shrunk, 1/128 at a time,
/// until it is not.
pub(super) fn encode(covariance: &KinematicCovariance) -> Result<WireKinematic, WireError> {
    let variances = KINEMATIC_DIAGONAL.map(|place| covariance[place]);
    let mut sigma = [0; 4];
    for (byte, variance) in sigma.iter_mut().zip(variances) {
        *byte = quantity::metric_sigma("kinematic variance", variance)?;
    }
    for shrink in 0..128 {
        let rho = correlations(covariance, variances, 1.0 - f64::from(shrink) / 128.0)?;
        if smallest_pivot(rho) > SMALLEST_PIVOT {
            return Ok(WireKinematic(sigma, rho));
        }
    }
    Ok(WireKinematic(sigma, [0; 6]))
}

fn correlations(
    covariance: &KinematicCovariance,
    variances: [f64; 4],
    factor: f64,
) -> Result<[i8; 6], WireError> {
    let mut rho = [0; 6];
    let off_diagonal = KINEMATIC_INDEX.iter().zip(covariance).filter(|((row, column), _)| row != column);
    for (byte, ((row, column), value)) in rho.iter_mut().zip(off_diagonal) {
        let pair = (variances[*row], variances[*column]);
        *byte = quantity::correlation_byte("kinematic covariance", factor * value, pair)?;
    }
    Ok(rho)
}

/// The covariance of the bytes: positive definite, or an error.
pub(super) fn decode(WireKinematic(sigma, rho): WireKinematic) -> Result<KinematicCovariance, WireError> {
    let pivot = smallest_pivot(rho);
    if pivot <= SMALLEST_PIVOT {
        let (field, expected) = ("pivot of the kinematic covariance", "more than 0: positive definite");
        return Err(AbsurdValue { field, index: None, value: pivot, expected }.into());
    }
    let variances = sigma.map(quantity::metric_variance);
    let correlations = symmetric(rho);
    Ok(KINEMATIC_INDEX.map(|(row, column)| {
        if row == column {
            variances[row]
        } else {
            correlations[row][column] * libm::sqrt(variances[row] * variances[column])
        }
    }))
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
