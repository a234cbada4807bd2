//! Textbook implementations of the filter, a reference for speed and for numerical results.
//!
//! [`Dense`]: one matrix with seven states, Joseph form. [`Structured`]: separate blocks with nalgebra for position
//! and velocity, width, depth and heading, which are independent of each other.

use nalgebra::{Matrix2, Matrix4, Matrix4x2, SMatrix, SVector, Vector2, Vector4};
use v2x_common::geometry::angle_difference;
use v2x_fusion_hub::filter::{Estimate, MotionParams};
use v2x_fusion_hub::values::Measurement;

type Matrix7 = SMatrix<f64, 7, 7>;
type Matrix5 = SMatrix<f64, 5, 5>;
type Matrix5x7 = SMatrix<f64, 5, 7>;

/// [x y vx vy w d θ] and its 7×7 covariance.
#[derive(Clone, Debug)]
pub(crate) struct Dense {
    /// Mean.
    pub x: SVector<f64, 7>,
    /// Covariance.
    pub p: Matrix7,
}

/// Process noise of one axis over `dt` seconds: position, position by velocity, velocity.
fn axis_noise(dt: f64, psd: f64) -> [f64; 3] {
    let t = dt.abs();
    [psd * t * t * t / 3.0, psd * dt * t / 2.0, psd * t]
}

fn relative(z: &Measurement, size: f64, dimension: usize) -> f64 {
    z.relative_variance[dimension] * size * size
}

impl Dense {
    /// The same state as an estimate of the hub's filter.
    pub(crate) fn of(estimate: &Estimate) -> Self {
        let [x, y] = estimate.position;
        let [vx, vy] = estimate.velocity;
        let mut p = Matrix7::zeros();
        for (value, (row, column)) in estimate.covariance.into_iter().zip(v2x_common::fused::KINEMATIC_INDEX)
        {
            p[(row, column)] = value;
            p[(column, row)] = value;
        }
        p[(4, 4)] = estimate.width.variance;
        p[(5, 5)] = estimate.depth.variance;
        p[(6, 6)] = estimate.heading.variance;
        let means = [x, y, vx, vy, estimate.width.mean, estimate.depth.mean, estimate.heading.mean];
        Self { x: SVector::from(means), p }
    }

    /// x ← F x, P ← F P Fᵀ + Q.
    pub(crate) fn predict(&mut self, dt_s: f64, motion: &MotionParams) {
        let mut f = Matrix7::identity();
        f[(0, 2)] = dt_s;
        f[(1, 3)] = dt_s;
        let [pp, pv, vv] = axis_noise(dt_s, motion.accel_psd);
        let mut q = Matrix7::zeros();
        for axis in 0..2 {
            q[(axis, axis)] = pp;
            q[(axis, axis + 2)] = pv;
            q[(axis + 2, axis)] = pv;
            q[(axis + 2, axis + 2)] = vv;
        }
        q[(4, 4)] = motion.size_diffusion * dt_s.abs();
        q[(5, 5)] = q[(4, 4)];
        q[(6, 6)] = motion.yaw_diffusion * dt_s.abs();
        self.x = f * self.x;
        self.p = f * self.p * f.transpose() + q;
    }

    /// The Kalman update with z = [x y w d θ], Joseph form; `None` if the innovation covariance has no inverse.
    pub(crate) fn update(&mut self, z: &Measurement) -> Option<()> {
        let mut h = Matrix5x7::zeros();
        for (row, column) in [0, 1, 4, 5, 6].into_iter().enumerate() {
            h[(row, column)] = 1.0;
        }
        let mut r = Matrix5::zeros();
        r[(0, 0)] = z.r.xx;
        r[(0, 1)] = z.r.xy;
        r[(1, 0)] = z.r.xy;
        r[(1, 1)] = z.r.yy;
        r[(2, 2)] = relative(z, self.x[4], 0);
        r[(3, 3)] = relative(z, self.x[5], 1);
        r[(4, 4)] = z.yaw_variance;
        let reported = SVector::<f64, 5>::from([z.position[0], z.position[1], z.size[0], z.size[1], z.yaw]);
        let mut innovation = reported - h * self.x;
        innovation[4] = angle_difference(z.yaw, self.x[6]);
        let s = h * self.p * h.transpose() + r;
        let k = self.p * h.transpose() * s.cholesky()?.inverse();
        self.x += k * innovation;
        let kept = Matrix7::identity() - k * h;
        self.p = kept * self.p * kept.transpose() + k * r * k.transpose();
        Some(())
    }
}

/// A 4-state filter and three scalar filters.
#[derive(Clone, Debug)]
pub(crate) struct Structured {
    x: Vector4<f64>,
    p: Matrix4<f64>,
    /// Means and variances of width, depth and heading.
    scalars: [(f64, f64); 3],
}

impl Structured {
    /// The same state as the dense filter.
    pub(crate) fn of(dense: &Dense) -> Self {
        let scalar = |place: usize| (dense.x[place], dense.p[(place, place)]);
        Self {
            x: dense.x.fixed_rows::<4>(0).into_owned(),
            p: dense.p.fixed_view::<4, 4>(0, 0).into_owned(),
            scalars: [scalar(4), scalar(5), scalar(6)],
        }
    }

    /// x ← F x, P ← F P Fᵀ + Q.
    pub(crate) fn predict(&mut self, dt_s: f64, motion: &MotionParams) {
        let mut f = Matrix4::identity();
        f[(0, 2)] = dt_s;
        f[(1, 3)] = dt_s;
        let [pp, pv, vv] = axis_noise(dt_s, motion.accel_psd);
        self.x = f * self.x;
        self.p = f * self.p * f.transpose();
        for axis in 0..2 {
            self.p[(axis, axis)] += pp;
            self.p[(axis, axis + 2)] += pv;
            self.p[(axis + 2, axis)] += pv;
            self.p[(axis + 2, axis + 2)] += vv;
        }
        let diffusion = [motion.size_diffusion, motion.size_diffusion, motion.yaw_diffusion];
        for ((_, variance), diffusion) in self.scalars.iter_mut().zip(diffusion) {
            *variance += diffusion * dt_s.abs();
        }
    }

    /// The Kalman update; `None` if the innovation covariance has no inverse.
    pub(crate) fn update(&mut self, z: &Measurement) -> Option<()> {
        let r = Matrix2::new(z.r.xx, z.r.xy, z.r.xy, z.r.yy);
        let inverse = (self.p.fixed_view::<2, 2>(0, 0) + r).try_inverse()?;
        let k: Matrix4x2<f64> = self.p.fixed_view::<4, 2>(0, 0) * inverse;
        let innovation = Vector2::new(z.position[0] - self.x[0], z.position[1] - self.x[1]);
        self.x += k * innovation;
        self.p -= k * self.p.fixed_view::<2, 4>(0, 0).into_owned();
        let yaw = angle_difference(z.yaw, self.scalars[2].0);
        let innovations = [z.size[0] - self.scalars[0].0, z.size[1] - self.scalars[1].0, yaw];
        let noise = [relative(z, self.scalars[0].0, 0), relative(z, self.scalars[1].0, 1), z.yaw_variance];
        for (((mean, variance), innovation), r) in self.scalars.iter_mut().zip(innovations).zip(noise) {
            let gain = *variance / (*variance + r);
            *mean += gain * innovation;
            *variance *= 1.0 - gain;
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use v2x_common::class::Class;
    use v2x_common::covariance::Covariance2;
    use v2x_common::time::{Span, Timestamp};
    use v2x_fusion_hub::filter::size_priors::SizePriors;
    use v2x_fusion_hub::filter::{Filter, State};

    fn measurement() -> impl Strategy<Value = Measurement> {
        let position = [-5.0..5.0f64, -5.0..5.0f64];
        (position, 0.1..2.0f64, -0.9..0.9f64, [1.5..2.5f64, 3.0..6.0f64], -3.1..3.1f64).prop_map(
            |(position, sigma, rho, size, yaw)| Measurement {
                class: Class::Car,
                position,
                r: Covariance2 { xx: sigma * sigma, xy: rho * sigma * sigma, yy: sigma * sigma },
                size,
                relative_variance: [0.04, 0.09],
                yaw,
                yaw_variance: 0.05,
                size_law: [None; 2],
                heading: v2x_common::detection::HeadingKind::Known,
                velocity: None,
                is_track: false,
                since_last_s: f64::INFINITY,
            },
        )
    }

    proptest! {
        #[test]
        fn our_filter_equals_the_textbook_filter_to_one_billionth(
            first in measurement(),
            steps in prop::collection::vec((1i64..900, measurement()), 1..20),
        ) {
            let motion = MotionParams::of(Class::Car);
            let mut state = State::initial(Timestamp::EPOCH, &first);
            let mut dense = Dense::of(&state.estimate(Class::Car, &SizePriors::default().of_track(None)));
            let mut structured = Structured::of(&dense);
            for (ms, z) in steps {
                let dt = Span::from_millis(ms);
                state = state.predicted(state.at + dt, Class::Car);
                state.update(&z);
                dense.predict(dt.as_secs_f64(), &motion);
                dense.update(&z).unwrap();
                structured.predict(dt.as_secs_f64(), &motion);
                structured.update(&z).unwrap();
                let ours = Dense::of(&state.estimate(Class::Car, &SizePriors::default().of_track(None)));
                let mut difference = ours.x - dense.x;
                difference[6] = angle_difference(ours.x[6], dense.x[6]);
                prop_assert!(difference.abs().max() < 1e-9, "{difference}");
                prop_assert!((ours.p - dense.p).abs().max() < 1e-9, "{}", ours.p - dense.p);
                prop_assert!((structured.x - dense.x.fixed_rows::<4>(0)).abs().max() < 1e-9);
            }
        }
    }
}
