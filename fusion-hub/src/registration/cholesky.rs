//! Small dense symmetric matrices, stored by rows in a slice.

/// A matrix that is not positive definite, to the precision of the numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("not positive definite")]
pub(super) struct NotPositiveDefinite;

/// Inverts a symmetric positive definite n×n matrix in its place; `scratch` is as large.
///
/// By its Cholesky factor: A = L Lᵀ, A⁻¹ = L⁻ᵀ L⁻¹ (Golub & Van Loan, *Matrix Computations*, section 4.2).
pub(super) fn invert(a: &mut [f64], scratch: &mut [f64], n: usize) -> Result<(), NotPositiveDefinite> {
    factor(a, n)?;
    // scratch = (L⁻¹)ᵀ, so that both loops below run along rows.
    for column in 0..n {
        for row in 0..n {
            let rhs = if row == column { 1.0 } else { 0.0 };
            scratch[column * n + row] = if row < column {
                0.0
            } else {
                let known = &scratch[column * n + column..column * n + row];
                let sum: f64 = a[row * n + column..row * n + row].iter().zip(known).map(|(l, x)| l * x).sum();
                (rhs - sum) / a[row * n + row]
            };
        }
    }
    for row in 0..n {
        for column in 0..=row {
            let [x, y] = [row, column].map(|k| &scratch[k * n + row..(k + 1) * n]);
            let sum: f64 = x.iter().zip(y).map(|(x, y)| x * y).sum();
            a[row * n + column] = sum;
            a[column * n + row] = sum;
        }
    }
    Ok(())
}

/// Overwrites the lower triangle with the Cholesky factor.
pub(super) fn factor(a: &mut [f64], n: usize) -> Result<(), NotPositiveDefinite> {
    for row in 0..n {
        for column in 0..=row {
            let (above, below) = (&a[column * n..column * n + column], &a[row * n..row * n + column]);
            let sum: f64 = above.iter().zip(below).map(|(x, y)| x * y).sum();
            let rest = a[row * n + column] - sum;
            a[row * n + column] = if row > column {
                rest / a[column * n + column]
            } else if rest > 0.0 && rest.is_finite() {
                libm::sqrt(rest)
            } else {
                return Err(NotPositiveDefinite);
            };
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    #[test]
    fn the_inverse_is_that_of_a_linear_algebra_library() {
        for n in [1_usize, 2, 5, 12] {
            let root = DMatrix::from_fn(n, n, |i, j| libm::sin(1.0 + (3 * i + 7 * j) as f64));
            let matrix = &root * root.transpose() + DMatrix::identity(n, n) * 0.1;
            let (mut ours, mut scratch) = (matrix.as_slice().to_vec(), vec![f64::NAN; n * n]);
            invert(&mut ours, &mut scratch, n).unwrap();
            let expected = matrix.try_inverse().unwrap();
            let worst = ours.iter().zip(expected.as_slice()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-10, "{worst} for n = {n}");
        }
    }

    #[test]
    fn a_matrix_without_inverse_is_an_error() {
        let mut scratch = [0.0; 4];
        assert_eq!(invert(&mut [1.0, 1.0, 1.0, 1.0], &mut scratch, 2), Err(NotPositiveDefinite));
        assert_eq!(invert(&mut [f64::NAN, 0.0, 0.0, 1.0], &mut scratch, 2), Err(NotPositiveDefinite));
    }
}
