//! Objects in lanes: four at once, with the bits of one object after the other.
//!
//! Four objects that each hold four numbers are a matrix, whose transpose holds one number of all four objects in each row.

use super::Imm;
use super::gaussian::Gaussian;
use crate::values::LANES;
use fearless_simd::{Simd, SimdBase, SimdFrom, f64x4};

impl<S: Simd> Imm<f64x4<S>> {
    /// One object in each lane.
    #[inline(always)]
    pub(super) fn in_lanes(simd: S, [a, b, c, d]: [&Imm; LANES]) -> Self {
        Self {
            weights: together(simd, [&a.weights, &b.weights, &c.weights, &d.weights]),
            parked: gaussians(simd, [&a.parked, &b.parked, &c.parked, &d.parked]),
            stopped: gaussians(simd, [&a.stopped, &b.stopped, &c.stopped, &d.stopped]),
            smooth: gaussians(simd, [&a.smooth, &b.smooth, &c.smooth, &d.smooth]),
            manoeuvre: gaussians(simd, [&a.manoeuvre, &b.manoeuvre, &c.manoeuvre, &d.manoeuvre]),
            lever_m: f64x4::simd_from(simd, [a.lever_m, b.lever_m, c.lever_m, d.lever_m]),
        }
    }

    /// The object of each lane.
    #[inline(always)]
    pub(super) fn apart(&self) -> [Imm; LANES] {
        // No maps over arrays: they are calls, and copy what they map.
        let weights = apart(&self.weights);
        let (parked, parked_p) = (apart(&self.parked.mean), apart(&self.parked.covariance));
        let (stopped, stopped_p) = (apart(&self.stopped.mean), apart(&self.stopped.covariance));
        let (smooth, smooth_p) = (apart(&self.smooth.mean), apart(&self.smooth.covariance));
        let (manoeuvre, manoeuvre_p) = (apart(&self.manoeuvre.mean), apart(&self.manoeuvre.covariance));
        let of = |lane: usize| Imm {
            weights: weights[lane],
            parked: Gaussian { mean: parked[lane], covariance: parked_p[lane] },
            stopped: Gaussian { mean: stopped[lane], covariance: stopped_p[lane] },
            smooth: Gaussian { mean: smooth[lane], covariance: smooth_p[lane] },
            manoeuvre: Gaussian { mean: manoeuvre[lane], covariance: manoeuvre_p[lane] },
            lever_m: self.lever_m[lane],
        };
        [of(0), of(1), of(2), of(3)]
    }
}

#[inline(always)]
fn gaussians<const N: usize, const T: usize, S: Simd>(
    simd: S,
    [a, b, c, d]: [&Gaussian<N, T>; LANES],
) -> Gaussian<N, T, f64x4<S>> {
    Gaussian {
        mean: together(simd, [&a.mean, &b.mean, &c.mean, &d.mean]),
        covariance: together(simd, [&a.covariance, &b.covariance, &c.covariance, &d.covariance]),
    }
}

/// Arrays of four objects, one object in each lane.
#[inline(always)]
fn together<const N: usize, S: Simd>(simd: S, [a, b, c, d]: [&[f64; N]; LANES]) -> [f64x4<S>; N] {
    let mut lanes = [f64x4::simd_from(simd, 0.0); N];
    if N < LANES {
        for (i, lanes) in lanes.iter_mut().enumerate() {
            *lanes = f64x4::simd_from(simd, [a[i], b[i], c[i], d[i]]);
        }
        return lanes;
    }
    let mut next = 0;
    while next < N {
        // The last block may overlap the one before.
        let start = if next + LANES > N { N - LANES } else { next };
        let row = |array: &[f64; N]| f64x4::from_slice(simd, &array[start..start + LANES]);
        let columns = transposed([row(a), row(b), row(c), row(d)]);
        lanes[start] = columns[0];
        lanes[start + 1] = columns[1];
        lanes[start + 2] = columns[2];
        lanes[start + 3] = columns[3];
        next += LANES;
    }
    lanes
}

/// The array of each lane.
#[inline(always)]
pub(super) fn apart<const N: usize, S: Simd>(lanes: &[f64x4<S>; N]) -> [[f64; N]; LANES] {
    let mut arrays = [[0.0; N]; LANES];
    if N < LANES {
        for (i, lanes) in lanes.iter().enumerate() {
            for (lane, array) in arrays.iter_mut().enumerate() {
                array[i] = lanes[lane];
            }
        }
        return arrays;
    }
    let mut next = 0;
    while next < N {
        let start = if next + LANES > N { N - LANES } else { next };
        let rows = transposed([lanes[start], lanes[start + 1], lanes[start + 2], lanes[start + 3]]);
        rows[0].store_slice(&mut arrays[0][start..start + LANES]);
        rows[1].store_slice(&mut arrays[1][start..start + LANES]);
        rows[2].store_slice(&mut arrays[2][start..start + LANES]);
        rows[3].store_slice(&mut arrays[3][start..start + LANES]);
        next += LANES;
    }
    arrays
}

/// Rows of a matrix of four times four numbers as its columns.
#[inline(always)]
fn transposed<S: Simd>([a, b, c, d]: [f64x4<S>; LANES]) -> [f64x4<S>; LANES] {
    let ((even, odd), (even_too, odd_too)) = (a.interleave(c), b.interleave(d));
    let ((first, second), (third, fourth)) = (even.interleave(even_too), odd.interleave(odd_too));
    [first, second, third, fourth]
}

#[cfg(test)]
mod tests {
    use super::*;
    use fearless_simd::{Level, dispatch};

    #[test]
    fn objects_come_out_of_their_lanes_as_they_went_in() {
        let object = |n: f64| std::array::from_fn::<f64, 15, _>(|i| 100.0 * n + i as f64);
        let objects = [0.0, 1.0, 2.0, 3.0].map(object);
        #[inline(always)]
        fn through<const N: usize, S: Simd>(simd: S, of: [&[f64; N]; LANES]) -> [[f64; N]; LANES] {
            let lanes = together(simd, of);
            for (i, lanes) in lanes.iter().enumerate() {
                assert!((0..LANES).all(|lane| lanes[lane] == of[lane][i]), "{i} of {N}");
            }
            apart(&lanes)
        }
        fn check<const N: usize>(objects: &[[f64; 15]; LANES]) {
            let cut: [[f64; N]; LANES] = objects.map(|object| std::array::from_fn(|i| object[i]));
            let out = dispatch!(Level::new(), simd => through(simd, cut.each_ref()));
            assert_eq!(out, cut);
        }
        check::<3>(&objects);
        check::<4>(&objects);
        check::<5>(&objects);
        check::<6>(&objects);
        check::<10>(&objects);
        check::<15>(&objects);
    }
}
