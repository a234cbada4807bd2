//! Four objects at once, one in each lane; the bits are those of one object after the other.

use super::Imm;
use super::gaussian::Gaussian;
use super::params::Params;
use super::passage::Passage;
use crate::values::LANES;
use fearless_simd::{Level, Simd, SimdFrom, dispatch, f64x4};

/// How one object moves: for how long (s), and how long it is (m).
#[derive(Clone, Copy, Debug)]
pub(in crate::filter) struct Move {
    pub(in crate::filter) dt_s: f64,
    pub(in crate::filter) length_m: f64,
}

impl Move {
    /// Stays where it is.
    pub(super) const NONE: Self = Self { dt_s: 0.0, length_m: 0.0 };
}

/// Moves objects of classes with the same parameters of motion, each within one step ([`super::passage::is_short`]).
pub(super) fn predict(objects: &mut [Imm; LANES], moves: &[Move; LANES], params: &'static Params) {
    dispatch!(Level::new(), simd => predict_with(simd, objects, moves, params));
}

#[inline(always)]
fn predict_with<S: Simd>(
    simd: S,
    objects: &mut [Imm; LANES],
    moves: &[Move; LANES],
    params: &'static Params,
) {
    let dt_s = f64x4::simd_from(simd, [moves[0].dt_s, moves[1].dt_s, moves[2].dt_s, moves[3].dt_s]);
    let lengths = [moves[0].length_m, moves[1].length_m, moves[2].length_m, moves[3].length_m];
    let passage = Passage::short(dt_s, f64x4::simd_from(simd, lengths), params);
    let mut lanes = Imm::in_lanes(simd, objects);
    lanes.pass(&passage);
    lanes.put_into(objects);
}

impl<S: Simd> Imm<f64x4<S>> {
    #[inline(always)]
    fn in_lanes(simd: S, objects: &[Imm; LANES]) -> Self {
        let [a, b, c, d] = objects;
        Self {
            weights: together(simd, [&a.weights, &b.weights, &c.weights, &d.weights]),
            parked: gaussian_of(simd, [&a.parked, &b.parked, &c.parked, &d.parked]),
            stopped: gaussian_of(simd, [&a.stopped, &b.stopped, &c.stopped, &d.stopped]),
            smooth: gaussian_of(simd, [&a.smooth, &b.smooth, &c.smooth, &d.smooth]),
            manoeuvre: gaussian_of(simd, [&a.manoeuvre, &b.manoeuvre, &c.manoeuvre, &d.manoeuvre]),
            lever_m: f64x4::simd_from(simd, [a.lever_m, b.lever_m, c.lever_m, d.lever_m]),
        }
    }

    #[inline(always)]
    fn put_into(&self, objects: &mut [Imm; LANES]) {
        let [a, b, c, d] = objects;
        apart(&self.weights, [&mut a.weights, &mut b.weights, &mut c.weights, &mut d.weights]);
        put(&self.parked, [&mut a.parked, &mut b.parked, &mut c.parked, &mut d.parked]);
        put(&self.stopped, [&mut a.stopped, &mut b.stopped, &mut c.stopped, &mut d.stopped]);
        put(&self.smooth, [&mut a.smooth, &mut b.smooth, &mut c.smooth, &mut d.smooth]);
        put(&self.manoeuvre, [&mut a.manoeuvre, &mut b.manoeuvre, &mut c.manoeuvre, &mut d.manoeuvre]);
        [a.lever_m, b.lever_m, c.lever_m, d.lever_m] = self.lever_m.into();
    }
}

#[inline(always)]
fn gaussian_of<const N: usize, const T: usize, S: Simd>(
    simd: S,
    [a, b, c, d]: [&Gaussian<N, T>; LANES],
) -> Gaussian<N, T, f64x4<S>> {
    Gaussian {
        mean: together(simd, [&a.mean, &b.mean, &c.mean, &d.mean]),
        covariance: together(simd, [&a.covariance, &b.covariance, &c.covariance, &d.covariance]),
    }
}

#[inline(always)]
fn put<const N: usize, const T: usize, S: Simd>(
    lanes: &Gaussian<N, T, f64x4<S>>,
    [a, b, c, d]: [&mut Gaussian<N, T>; LANES],
) {
    apart(&lanes.mean, [&mut a.mean, &mut b.mean, &mut c.mean, &mut d.mean]);
    apart(&lanes.covariance, [&mut a.covariance, &mut b.covariance, &mut c.covariance, &mut d.covariance]);
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
fn apart<const N: usize, S: Simd>(lanes: &[f64x4<S>; N], [a, b, c, d]: [&mut [f64; N]; LANES]) {
    for (i, lanes) in lanes.iter().enumerate() {
        [a[i], b[i], c[i], d[i]] = (*lanes).into();
    }
}
