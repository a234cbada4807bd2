//! Retrodiction: the smoothing step of Rauch, Tung & Striebel (1965), for any two normal vectors
//! whose covariance with each other is known.

/// A symmetric matrix, written out.
pub(super) type Square<const N: usize> = [[f64; N]; N];

/// A later vector: as predicted, and as smoothed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Later<'a, const N: usize> {
    /// Covariance as predicted.
    pub(super) predicted: &'a Square<N>,
    /// Smoothed mean less the predicted mean.
    pub(super) shift: &'a [f64; N],
    /// Smoothed covariance.
    pub(super) covariance: &'a Square<N>,
}

/// The shift of an earlier vector's mean and its smoothed covariance, given a later vector.
///
/// `covariance` is the earlier one's as filtered and `cross` its covariance with the later one.
/// With the gain C = cross · predicted⁻¹ the two are C · shift and covariance − C crossᵀ + C · later · Cᵀ.
/// `None` where what was predicted is not positive definite.
pub(super) fn retrodicted<const M: usize, const N: usize>(
    covariance: &Square<M>,
    cross: &[[f64; N]; M],
    later: Later<'_, N>,
) -> Option<([f64; M], Square<M>)> {
    let factor = cholesky(later.predicted)?;
    let whitened = cross.map(|row| forward(&factor, row));
    let gain = whitened.map(|row| backward(&factor, row));
    let carried = gain.map(|row| times(later.covariance, &row));
    let shift = gain.map(|row| dot(&row, later.shift));
    let mut smoothed = *covariance;
    for row in 0..M {
        for column in 0..=row {
            let entry = covariance[row][column] - dot(&whitened[row], &whitened[column])
                + dot(&gain[row], &carried[column]);
            smoothed[row][column] = entry;
            smoothed[column][row] = entry;
        }
    }
    Some((shift, smoothed))
}

fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn times<const N: usize>(matrix: &Square<N>, vector: &[f64; N]) -> [f64; N] {
    matrix.map(|row| dot(&row, vector))
}

/// The lower factor L of L Lᵀ.
fn cholesky<const N: usize>(matrix: &Square<N>) -> Option<Square<N>> {
    let mut factor = [[0.0; N]; N];
    for row in 0..N {
        for column in 0..=row {
            let known: f64 = (0..column).map(|k| factor[row][k] * factor[column][k]).sum();
            let rest = matrix[row][column] - known;
            if row > column {
                factor[row][column] = rest / factor[column][column];
            } else if rest > 0.0 {
                factor[row][row] = libm::sqrt(rest);
            } else {
                return None;
            }
        }
    }
    Some(factor)
}

/// L⁻¹ v.
fn forward<const N: usize>(factor: &Square<N>, mut v: [f64; N]) -> [f64; N] {
    for row in 0..N {
        let known: f64 = (0..row).map(|k| factor[row][k] * v[k]).sum();
        v[row] = (v[row] - known) / factor[row][row];
    }
    v
}

/// L⁻ᵀ v.
fn backward<const N: usize>(factor: &Square<N>, mut v: [f64; N]) -> [f64; N] {
    for row in (0..N).rev() {
        let known: f64 = (row + 1..N).map(|k| factor[k][row] * v[k]).sum();
        v[row] = (v[row] - known) / factor[row][row];
    }
    v
}
