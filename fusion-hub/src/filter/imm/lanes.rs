//! Objects in lanes: four at once, with the bits of one object after the other.

use super::Imm;
use super::gaussian::Gaussian;
use crate::values::LANES;
use fearless_simd::{Simd, SimdFrom, f64x4};

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

    /// Sets an object to what is in its lane.
    #[inline(always)]
    pub(super) fn put_into(&self, object: &mut Imm, lane: usize) {
        put_array(&self.weights, &mut object.weights, lane);
        put_gaussian(&self.parked, &mut object.parked, lane);
        put_gaussian(&self.stopped, &mut object.stopped, lane);
        put_gaussian(&self.smooth, &mut object.smooth, lane);
        put_gaussian(&self.manoeuvre, &mut object.manoeuvre, lane);
        object.lever_m = self.lever_m[lane];
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

#[inline(always)]
fn together<const N: usize, S: Simd>(simd: S, [a, b, c, d]: [&[f64; N]; LANES]) -> [f64x4<S>; N] {
    let mut lanes = [f64x4::simd_from(simd, 0.0); N];
    for (i, lanes) in lanes.iter_mut().enumerate() {
        *lanes = f64x4::simd_from(simd, [a[i], b[i], c[i], d[i]]);
    }
    lanes
}

#[inline(always)]
fn put_gaussian<const N: usize, const T: usize, S: Simd>(
    lanes: &Gaussian<N, T, f64x4<S>>,
    into: &mut Gaussian<N, T>,
    lane: usize,
) {
    put_array(&lanes.mean, &mut into.mean, lane);
    put_array(&lanes.covariance, &mut into.covariance, lane);
}

/// What is in one lane.
#[inline(always)]
pub(super) fn put_array<const N: usize, S: Simd>(lanes: &[f64x4<S>; N], into: &mut [f64; N], lane: usize) {
    for (lanes, value) in lanes.iter().zip(into) {
        *value = lanes[lane];
    }
}

/// What is in one lane.
#[inline(always)]
pub(super) fn array_of<const N: usize, S: Simd>(lanes: &[f64x4<S>; N], lane: usize) -> [f64; N] {
    let mut array = [0.0; N];
    put_array(lanes, &mut array, lane);
    array
}
