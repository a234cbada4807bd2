//! Position and velocity: x' = F x + q, z = [x y] + r.
//!
//! Everything is computed in pairs, x with y: two lanes of one register.

use crate::values::PositionInnovation;
use serde::{Deserialize, Serialize};
use v2x_common::covariance::{Covariance2, Velocity};
use v2x_common::fused::KinematicCovariance;

/// Something of x and the same of y.
type Pair = [f64; 2];

/// Mean and covariance of (x, y, vx, vy); m, m/s. The covariance in blocks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Kinematic {
    /// Position, m.
    pub position: Pair,
    /// Velocity, m/s.
    pub velocity: Pair,
    /// Covariance of the position, m².
    pub pp: Covariance2,
    /// Cross covariance of position and velocity, m²/s.
    pub pv: Cross,
    /// Covariance of the velocity, m²/s².
    pub vv: Covariance2,
}

/// A general 2×2 matrix.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cross {
    /// x by x and y by y.
    pub along: Pair,
    /// x by y and y by x.
    pub across: Pair,
}

#[inline(always)]
fn plus(a: Pair, b: Pair) -> Pair {
    [a[0] + b[0], a[1] + b[1]]
}

#[inline(always)]
fn times(a: Pair, b: Pair) -> Pair {
    [a[0] * b[0], a[1] * b[1]]
}

#[inline(always)]
fn scaled(a: Pair, factor: f64) -> Pair {
    [a[0] * factor, a[1] * factor]
}

#[inline(always)]
fn swapped([a, b]: Pair) -> Pair {
    [b, a]
}

#[inline(always)]
fn diagonal(symmetric: &Covariance2) -> Pair {
    [symmetric.xx, symmetric.yy]
}

#[inline(always)]
fn symmetric([xx, yy]: Pair, xy: f64) -> Covariance2 {
    Covariance2 { xx, yy, xy }
}

/// The determinant times the inverse.
#[inline(always)]
fn adjugate(matrix: &Covariance2) -> Covariance2 {
    Covariance2 { xx: matrix.yy, yy: matrix.xx, xy: -matrix.xy }
}

#[inline(always)]
fn sum(a: &Covariance2, b: &Covariance2) -> Covariance2 {
    symmetric(plus(diagonal(a), diagonal(b)), a.xy + b.xy)
}

#[inline(always)]
fn times_vector(matrix: &Covariance2, vector: Pair) -> Pair {
    plus(times(diagonal(matrix), vector), scaled(swapped(vector), matrix.xy))
}

impl Cross {
    /// A symmetric matrix times this one.
    #[inline(always)]
    fn under(&self, matrix: &Covariance2) -> Self {
        let diagonal = diagonal(matrix);
        Self {
            along: plus(times(diagonal, self.along), scaled(swapped(self.across), matrix.xy)),
            across: plus(times(diagonal, self.across), scaled(swapped(self.along), matrix.xy)),
        }
    }

    /// The transposed matrix times a vector.
    #[inline(always)]
    fn transposed_times(&self, vector: Pair) -> Pair {
        plus(times(self.along, vector), swapped(times(self.across, vector)))
    }

    /// This matrix transposed times another one, where the product is symmetric.
    #[inline(always)]
    fn transposed_under(&self, other: &Self) -> Covariance2 {
        let diagonal = plus(times(self.along, other.along), swapped(times(self.across, other.across)));
        symmetric(diagonal, self.along[0] * other.across[0] + self.across[1] * other.along[1])
    }

    #[inline(always)]
    fn scaled(&self, factor: f64) -> Self {
        Self { along: scaled(self.along, factor), across: scaled(self.across, factor) }
    }

    fn transposed(&self) -> Self {
        Self { along: self.along, across: swapped(self.across) }
    }
}

impl Kinematic {
    /// The state after a first measurement; the velocity is measured, or comes from its prior.
    #[inline]
    pub fn initial(
        position: Pair,
        pp: Covariance2,
        sigma_velocity_mps: f64,
        velocity: Option<&Velocity>,
    ) -> Self {
        let vv = Covariance2::isotropic(sigma_velocity_mps);
        let mut initial = Self { position, velocity: [0.0; 2], pp, pv: Cross::default(), vv };
        if let Some(velocity) = velocity {
            initial.update_velocity(velocity);
        }
        initial
    }

    /// Moves the state by `dt_s` seconds, also backwards, with process noise of spectral density
    /// `accel_psd` (m²/s³) on each axis.
    ///
    /// The noise is the integral of white acceleration, q·[[T³/3, T²/2], [T²/2, T]]: unlike the form of
    /// Baisa 2020 it is additive, so a step that is split gives the same result.
    #[inline(always)]
    pub fn predict(&mut self, dt_s: f64, accel_psd: f64) {
        let dt = dt_s;
        let (duration, dt2) = (dt.abs(), dt * dt);
        let q_vv = accel_psd * duration;
        // Going back, position and velocity noise are anticorrelated: the cross term takes dt's sign.
        let (q_pv, q_pp) = (0.5 * q_vv * dt, q_vv * dt2 * (1.0 / 3.0));
        let Self { pv, vv, .. } = *self;
        self.position = plus(self.position, scaled(self.velocity, dt));
        let pp = plus(plus(diagonal(&self.pp), [q_pp; 2]), scaled(pv.along, 2.0 * dt));
        let pp = plus(pp, scaled(diagonal(&vv), dt2));
        self.pp = symmetric(pp, (self.pp.xy + dt * (pv.across[0] + pv.across[1])) + dt2 * vv.xy);
        self.pv.along = plus(plus(pv.along, [q_pv; 2]), scaled(diagonal(&vv), dt));
        self.pv.across = plus(pv.across, [dt * vv.xy; 2]);
        self.vv = symmetric(plus(diagonal(&vv), [q_vv; 2]), vv.xy);
    }

    /// The innovation of a position with covariance `r` (m²), without an update.
    #[inline]
    pub fn innovation(&self, z: Pair, r: &Covariance2) -> PositionInnovation {
        PositionInnovation::new([z[0] - self.position[0], z[1] - self.position[1]], &sum(&self.pp, r))
    }

    /// Updates by a position with covariance `r` (m²).
    ///
    /// With S = P + R and the blocks pp, pv, vv of P: the means move by pp S⁻¹ν and pvᵀS⁻¹ν, and the blocks
    /// become pp S⁻¹R, R S⁻¹pv and vv − pvᵀS⁻¹pv. For 2×2 matrices pp S⁻¹R = (|R| pp + |pp| R) / |S|: a sum of
    /// positive definite matrices, so nothing cancels where the measurement is far more accurate than the state. S⁻¹ is
    /// its adjugate over |S|, and multiplied by last: the division runs while the products are made.
    #[inline(always)]
    pub fn update_position(&mut self, z: Pair, r: &Covariance2) -> PositionInnovation {
        let Self { position, pp, pv, vv, .. } = *self;
        let s = sum(&pp, r);
        let determinant = s.determinant();
        debug_assert!(determinant > 0.0, "innovation covariance must be positive definite: {s:?}");
        let scale = 1.0 / determinant;
        let adjugate = adjugate(&s);
        let innovation = [z[0] - position[0], z[1] - position[1]];
        let w = times_vector(&adjugate, innovation);
        self.position = plus(position, scaled(times_vector(&pp, w), scale));
        self.velocity = plus(self.velocity, scaled(pv.transposed_times(w), scale));
        let g = pv.under(&adjugate);
        let taken = pv.transposed_under(&g);
        self.vv = symmetric(plus(diagonal(&vv), scaled(diagonal(&taken), -scale)), vv.xy - taken.xy * scale);
        self.pv = g.under(r).scaled(scale);
        let (det_r, det_p) = (r.determinant(), pp.determinant());
        let kept = plus(scaled(diagonal(&pp), det_r), scaled(diagonal(r), det_p));
        self.pp = symmetric(scaled(kept, scale), (det_r * pp.xy + det_p * r.xy) * scale);
        let [x, y] = times(innovation, w);
        PositionInnovation { mahalanobis2: (x + y) * scale, determinant }
    }

    /// Multiplies the covariance by a factor.
    pub fn inflate(&mut self, factor: f64) {
        self.pp = self.pp.scaled(factor);
        self.pv = self.pv.scaled(factor);
        self.vv = self.vv.scaled(factor);
    }

    /// Updates by a velocity: as by a position, with the blocks exchanged.
    #[inline]
    pub fn update_velocity(&mut self, report: &Velocity) {
        let mut turned = Self {
            position: self.velocity,
            velocity: self.position,
            pp: self.vv,
            pv: self.pv.transposed(),
            vv: self.pp,
        };
        turned.update_position([report.x, report.y], &report.covariance);
        *self = Self {
            position: turned.velocity,
            velocity: turned.position,
            pp: turned.vv,
            pv: turned.pv.transposed(),
            vv: turned.pp,
        };
    }

    /// The covariance in the order of the wire.
    #[inline]
    pub fn covariance(&self) -> KinematicCovariance {
        let Cross { along: [x_vx, y_vy], across: [x_vy, y_vx] } = self.pv;
        let Self { pp, vv, .. } = self;
        [pp.xx, pp.xy, x_vx, x_vy, pp.yy, y_vx, y_vy, vv.xx, vv.xy, vv.yy]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Matrix2x4, Matrix4, Vector2, Vector4};
    use proptest::prelude::*;

    /// The textbook filter, dense, in Joseph form: the oracle.
    struct Dense {
        x: Vector4<f64>,
        p: Matrix4<f64>,
    }

    impl Dense {
        fn of(state: &Kinematic) -> Self {
            let mut p = Matrix4::zeros();
            for (value, (row, column)) in
                state.covariance().into_iter().zip(v2x_common::fused::KINEMATIC_INDEX)
            {
                p[(row, column)] = value;
                p[(column, row)] = value;
            }
            let [x, y] = state.position;
            let [vx, vy] = state.velocity;
            Self { x: Vector4::new(x, y, vx, vy), p }
        }

        fn predict(&mut self, dt: f64, q: f64) {
            let mut f = Matrix4::identity();
            f[(0, 2)] = dt;
            f[(1, 3)] = dt;
            let t = dt.abs();
            let mut noise = Matrix4::zeros();
            for axis in 0..2 {
                noise[(axis, axis)] = q * t * t * t / 3.0;
                noise[(axis, axis + 2)] = q * dt * t / 2.0;
                noise[(axis + 2, axis)] = q * dt * t / 2.0;
                noise[(axis + 2, axis + 2)] = q * t;
            }
            self.x = f * self.x;
            self.p = f * self.p * f.transpose() + noise;
        }

        fn update(&mut self, h: &Matrix2x4<f64>, z: [f64; 2], r: &Covariance2) {
            let r = Matrix2::new(r.xx, r.xy, r.xy, r.yy);
            let s = h * self.p * h.transpose() + r;
            let k = self.p * h.transpose() * s.try_inverse().unwrap();
            self.x += k * (Vector2::new(z[0], z[1]) - h * self.x);
            let kept = Matrix4::identity() - k * h;
            self.p = kept * self.p * kept.transpose() + k * r * k.transpose();
        }

        fn assert_close(&self, state: &Kinematic) {
            let other = Self::of(state);
            let scale = self.p.abs().max().max(1.0);
            assert!((self.x - other.x).abs().max() < 1e-9 * (1.0 + self.x.abs().max()));
            assert!((self.p - other.p).abs().max() < 1e-9 * scale, "{} {}", self.p, other.p);
        }
    }

    #[inline]
    fn covariance() -> impl Strategy<Value = Covariance2> {
        (0.05..3.0f64, 0.05..3.0f64, -0.95..0.95f64).prop_map(|(sx, sy, rho)| Covariance2 {
            xx: sx * sx,
            xy: rho * sx * sy,
            yy: sy * sy,
        })
    }

    proptest! {
        #[test]
        fn agrees_with_the_dense_textbook_filter(
            r0 in covariance(),
            steps in prop::collection::vec(
                (-0.5..1.0f64, [-9.0..9.0f64, -9.0..9.0f64], covariance(), any::<bool>()), 1..12),
        ) {
            let mut state = Kinematic::initial([1.0, -2.0], r0, 7.0, None);
            let mut dense = Dense::of(&state);
            for (dt, z, r, is_velocity) in steps {
                state.predict(dt, 1.3);
                dense.predict(dt, 1.3);
                if is_velocity {
                    state.update_velocity(&Velocity { x: z[0], y: z[1], covariance: r });
                    dense.update(&Matrix2x4::new(0., 0., 1., 0., 0., 0., 0., 1.), z, &r);
                } else {
                    state.update_position(z, &r);
                    dense.update(&Matrix2x4::new(1., 0., 0., 0., 0., 1., 0., 0.), z, &r);
                }
                dense.assert_close(&state);
            }
        }

        #[test]
        fn a_split_step_is_the_whole_step(parts in prop::collection::vec(0.001..0.5f64, 1..8)) {
            let start = Kinematic::initial([0.0, 0.0], Covariance2::isotropic(0.3), 7.0, None);
            let (mut split, mut whole) = (start, start);
            parts.iter().for_each(|dt| split.predict(*dt, 2.0));
            whole.predict(parts.iter().sum(), 2.0);
            Dense::of(&whole).assert_close(&split);
        }
    }

    #[test]
    fn an_innovation_is_measured_by_both_covariances() {
        let mut state = Kinematic::initial([0.0, 0.0], Covariance2::isotropic(0.6), 7.0, None);
        let r = Covariance2 { xx: 0.64, xy: 0.0, yy: 0.64 };
        let innovation = state.innovation([1.0, 0.0], &r);
        assert!((innovation.mahalanobis2 - 1.0).abs() < 1e-12);
        assert!((innovation.determinant - 1.0).abs() < 1e-12);
        let taken = state.update_position([1.0, 0.0], &r);
        assert!((taken.mahalanobis2 - 1.0).abs() < 1e-12 && taken.determinant == innovation.determinant);
    }

    #[test]
    fn an_innovation_is_from_the_state_to_the_position() {
        let mut state = Kinematic::initial([3.0, -4.0], Covariance2::isotropic(0.6), 7.0, None);
        let r = Covariance2 { xx: 0.14, xy: 0.0, yy: 0.14 };
        let innovation = state.innovation([4.0, -2.0], &r);
        assert!((innovation.mahalanobis2 - 10.0).abs() < 1e-12);
        assert!((state.update_position([4.0, -2.0], &r).mahalanobis2 - 10.0).abs() < 1e-12);
    }
}
