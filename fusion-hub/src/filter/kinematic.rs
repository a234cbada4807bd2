//! Position and velocity: x' = F x + q, z = [x y] + r.

use v2x_common::covariance::{Covariance2, Velocity};
use v2x_common::fused::KinematicCovariance;

/// Mean and covariance of (x, y, vx, vy); m, m/s. The covariance in blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kinematic {
    /// Position, m.
    pub position: [f64; 2],
    /// Velocity, m/s.
    pub velocity: [f64; 2],
    /// Covariance of the position, m².
    pub pp: Covariance2,
    /// Cross covariance, position by velocity: [x·vx, x·vy, y·vx, y·vy], m²/s.
    pub pv: [f64; 4],
    /// Covariance of the velocity, m²/s².
    pub vv: Covariance2,
}

/// How far a position report lies from the prediction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionInnovation {
    /// Squared Mahalanobis distance (NIS), χ² with 2 degrees of freedom.
    pub mahalanobis2: f64,
    /// Natural logarithm of the innovation's density at the report, 1/m².
    pub ln_likelihood: f64,
}

/// Inverse of a symmetric positive definite 2×2 matrix.
fn inverse(matrix: &Covariance2) -> Covariance2 {
    let determinant = matrix.determinant();
    debug_assert!(determinant > 0.0, "innovation covariance must be positive definite: {matrix:?}");
    Covariance2 { xx: matrix.yy / determinant, xy: -matrix.xy / determinant, yy: matrix.xx / determinant }
}

fn sum(a: &Covariance2, b: &Covariance2) -> Covariance2 {
    Covariance2 { xx: a.xx + b.xx, xy: a.xy + b.xy, yy: a.yy + b.yy }
}

/// A general 2×2 matrix by rows, times a symmetric one.
fn times(matrix: [f64; 4], symmetric: &Covariance2) -> [f64; 4] {
    let [a, b, c, d] = matrix;
    let Covariance2 { xx, xy, yy } = *symmetric;
    [a * xx + b * xy, a * xy + b * yy, c * xx + d * xy, c * xy + d * yy]
}

fn full(symmetric: &Covariance2) -> [f64; 4] {
    [symmetric.xx, symmetric.xy, symmetric.xy, symmetric.yy]
}

fn product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [
        a[0] * b[0] + a[1] * b[2],
        a[0] * b[1] + a[1] * b[3],
        a[2] * b[0] + a[3] * b[2],
        a[2] * b[1] + a[3] * b[3],
    ]
}

fn transposed([a, b, c, d]: [f64; 4]) -> [f64; 4] {
    [a, c, b, d]
}

/// The symmetric part of a matrix that is symmetric but for rounding.
fn symmetrised([a, b, c, d]: [f64; 4]) -> Covariance2 {
    Covariance2 { xx: a, xy: (b + c) / 2.0, yy: d }
}

/// Minus gain times innovation covariance times gain transposed, for two rows each: a − k·S·kᵀ where k·S = c.
fn reduced(a: &Covariance2, gain: [f64; 4], cross: [f64; 4]) -> Covariance2 {
    let taken = symmetrised(product(gain, transposed(cross)));
    Covariance2 { xx: a.xx - taken.xx, xy: a.xy - taken.xy, yy: a.yy - taken.yy }
}

impl Kinematic {
    /// A first report, with the velocity unknown but for its prior, or measured.
    pub fn born(
        position: [f64; 2],
        pp: Covariance2,
        sigma_velocity_mps: f64,
        velocity: Option<&Velocity>,
    ) -> Self {
        let vv = Covariance2::isotropic(sigma_velocity_mps);
        let mut born = Self { position, velocity: [0.0; 2], pp, pv: [0.0; 4], vv };
        if let Some(velocity) = velocity {
            born.update_velocity(velocity);
        }
        born
    }

    /// Moves the state by `dt_s` seconds, also backwards, with process noise of spectral density
    /// `accel_psd` (m²/s³) on each axis.
    ///
    /// The noise is the integral of white acceleration, q·[[T³/3, T²/2], [T²/2, T]]: unlike the form of
    /// Baisa 2020 it is additive, so a step that is split gives the same result.
    pub fn predict(&mut self, dt_s: f64, accel_psd: f64) {
        let dt = dt_s;
        self.position[0] += dt * self.velocity[0];
        self.position[1] += dt * self.velocity[1];
        let duration = dt.abs();
        // Going back, position and velocity noise are anticorrelated: the cross term takes dt's sign.
        let q_pp = accel_psd * duration * duration * duration / 3.0;
        let q_pv = accel_psd * dt * duration / 2.0;
        let q_vv = accel_psd * duration;
        let [a, b, c, d] = self.pv;
        let vv = self.vv;
        self.pp.xx += dt * (2.0 * a + dt * vv.xx) + q_pp;
        self.pp.xy += dt * (b + c + dt * vv.xy);
        self.pp.yy += dt * (2.0 * d + dt * vv.yy) + q_pp;
        self.pv = [a + dt * vv.xx + q_pv, b + dt * vv.xy, c + dt * vv.xy, d + dt * vv.yy + q_pv];
        self.vv.xx += q_vv;
        self.vv.yy += q_vv;
    }

    /// What a position report with covariance `r` (m²) would mean, without taking it in.
    pub fn innovation(&self, z: [f64; 2], r: &Covariance2) -> PositionInnovation {
        let s = sum(&self.pp, r);
        let inverse = inverse(&s);
        let (dx, dy) = (z[0] - self.position[0], z[1] - self.position[1]);
        let mahalanobis2 = dx * dx * inverse.xx + 2.0 * dx * dy * inverse.xy + dy * dy * inverse.yy;
        let ln_normaliser =
            libm::log(4.0 * std::f64::consts::PI * std::f64::consts::PI * s.determinant()) / 2.0;
        PositionInnovation { mahalanobis2, ln_likelihood: -mahalanobis2 / 2.0 - ln_normaliser }
    }

    /// Takes in a position report with covariance `r` (m²).
    pub fn update_position(&mut self, z: [f64; 2], r: &Covariance2) {
        let inverse = inverse(&sum(&self.pp, r));
        let (dx, dy) = (z[0] - self.position[0], z[1] - self.position[1]);
        let cross = transposed(self.pv);
        let gain_p = times(full(&self.pp), &inverse);
        let gain_v = times(cross, &inverse);
        self.apply([dx, dy], gain_p, gain_v);
        self.vv = reduced(&self.vv, gain_v, cross);
        // (I − K) P = R S⁻¹ P: no cancellation where the report is far better than the state.
        let kept = times(full(r), &inverse);
        self.pv = product(kept, self.pv);
        self.pp = symmetrised(product(kept, full(&self.pp)));
    }

    /// Takes in a velocity report.
    pub fn update_velocity(&mut self, report: &Velocity) {
        let inverse = inverse(&sum(&self.vv, &report.covariance));
        let innovation = [report.x - self.velocity[0], report.y - self.velocity[1]];
        let gain_p = times(self.pv, &inverse);
        let gain_v = times(full(&self.vv), &inverse);
        self.apply(innovation, gain_p, gain_v);
        self.pp = reduced(&self.pp, gain_p, self.pv);
        let kept = times(full(&report.covariance), &inverse);
        self.pv = transposed(product(kept, transposed(self.pv)));
        self.vv = symmetrised(product(kept, full(&self.vv)));
    }

    fn apply(&mut self, innovation: [f64; 2], gain_p: [f64; 4], gain_v: [f64; 4]) {
        let [dx, dy] = innovation;
        self.position[0] += gain_p[0] * dx + gain_p[1] * dy;
        self.position[1] += gain_p[2] * dx + gain_p[3] * dy;
        self.velocity[0] += gain_v[0] * dx + gain_v[1] * dy;
        self.velocity[1] += gain_v[2] * dx + gain_v[3] * dy;
    }

    /// The covariance in the order of the wire.
    pub fn covariance(&self) -> KinematicCovariance {
        let [a, b, c, d] = self.pv;
        [self.pp.xx, self.pp.xy, a, b, self.pp.yy, c, d, self.vv.xx, self.vv.xy, self.vv.yy]
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
            let mut state = Kinematic::born([1.0, -2.0], r0, 7.0, None);
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
            let start = Kinematic::born([0.0, 0.0], Covariance2::isotropic(0.3), 7.0, None);
            let (mut split, mut whole) = (start, start);
            parts.iter().for_each(|dt| split.predict(*dt, 2.0));
            whole.predict(parts.iter().sum(), 2.0);
            Dense::of(&whole).assert_close(&split);
        }
    }

    #[test]
    fn an_innovation_is_the_density_of_the_report() {
        let state = Kinematic::born([0.0, 0.0], Covariance2::isotropic(0.6), 7.0, None);
        let innovation = state.innovation([1.0, 0.0], &Covariance2::isotropic(0.8));
        assert!((innovation.mahalanobis2 - 1.0).abs() < 1e-12);
        let expected = -0.5 - libm::log(2.0 * std::f64::consts::PI);
        assert!((innovation.ln_likelihood - expected).abs() < 1e-12);
    }
}
