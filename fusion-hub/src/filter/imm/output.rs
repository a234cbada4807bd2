//! The four models together: one mean, one covariance.

use super::gaussian::{self, Still, YAW, apart, at};
use super::likelihood::sum;
use super::model::{MANOEUVRE, SMOOTH};
use super::velocity;
use v2x_common::covariance::Covariance2;
use v2x_common::fused::{KINEMATIC_INDEX, KinematicCovariance};
use v2x_common::geometry::{angle_difference, wrap_angle};

/// Models below this probability do not widen a gate.
const IMPROBABLE: f64 = 0.01;

/// Mean and covariance of an object, in the map frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments {
    /// Position, m.
    pub position: [f64; 2],
    /// Velocity, m/s.
    pub velocity: [f64; 2],
    /// Covariance of position and velocity.
    pub covariance: KinematicCovariance,
    /// Heading, rad in (-π, π].
    pub yaw: f64,
    /// Variance of the heading, rad².
    pub yaw_variance: f64,
    /// Probabilities of being parked, stopped, in smooth motion and manoeuvring.
    pub model_probabilities: [f64; 4],
}

/// Position and heading: what gates need, at a fraction of the cost of [`Moments`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Position, m.
    pub position: [f64; 2],
    /// Covariance of the position, m².
    pub position_covariance: Covariance2,
    /// The same by the widest of the models that are not improbable: for gates, because the mixture's covariance
    /// hides its rarer models.
    pub gate_covariance: Covariance2,
    /// Heading, rad in (-π, π].
    pub yaw: f64,
    /// Variance of the heading, rad².
    pub yaw_variance: f64,
}

/// One model's (x, y, vx, vy).
pub(super) struct Kinematic {
    mean: [f64; 4],
    covariance: KinematicCovariance,
}

impl Kinematic {
    pub(super) fn standing(state: &Still) -> Self {
        let [x, y, _] = state.mean;
        let [xx, xy, yy, ..] = state.covariance;
        let vv = velocity::slipping(&Covariance2::default());
        Self { mean: [x, y, 0.0, 0.0], covariance: [xx, xy, 0.0, 0.0, yy, 0.0, 0.0, vv.xx, vv.xy, vv.yy] }
    }

    pub(super) fn moving(state: &gaussian::Full, lever_m: f64) -> Self {
        let velocity::Velocity { mean: [vx, vy], covariance: vv, cross } = velocity::velocity(state, lever_m);
        let [x, y, ..] = state.mean;
        let [xx, xy, yy, ..] = state.covariance;
        let [[x_vx, x_vy], [y_vx, y_vy], ..] = cross;
        Self { mean: [x, y, vx, vy], covariance: [xx, xy, x_vx, x_vy, yy, y_vx, y_vy, vv.xx, vv.xy, vv.yy] }
    }
}

/// The model that the others are measured from.
pub(super) fn likeliest(weights: &[f64; 4]) -> usize {
    (1..4).fold(0, |best, model| if weights[model] > weights[best] { model } else { best })
}

/// The mixture of the models; `places` are their weights, positions and headings.
pub(super) fn moments(models: &[Kinematic; 4], places: &[(f64, Still); 4]) -> Moments {
    let weights = places.map(|(weight, _)| weight);
    let own = likeliest(&weights);
    let reference = models[own].mean;
    let mut shift = [0.0; 4];
    for (model, weight) in models.iter().zip(weights) {
        for ((shift, mean), reference) in shift.iter_mut().zip(model.mean).zip(reference) {
            *shift += weight * (mean - reference);
        }
    }
    let mut covariance = [0.0; 10];
    for (model, weight) in models.iter().zip(weights) {
        let off: [f64; 4] = std::array::from_fn(|i| apart(model.mean[i] - reference[i] - shift[i]));
        for (entry, (row, column)) in KINEMATIC_INDEX.into_iter().enumerate() {
            covariance[entry] += weight * (model.covariance[entry] + off[row] * off[column]);
        }
    }
    let [x, y, vx, vy] = std::array::from_fn(|i| reference[i] + shift[i]);
    let (yaw, yaw_variance) = heading(places, own);
    Moments {
        position: [x, y],
        velocity: [vx, vy],
        covariance,
        yaw,
        yaw_variance,
        model_probabilities: weights,
    }
}

fn heading(models: &[(f64, Still); 4], own: usize) -> (f64, f64) {
    let reference = models[own].1.mean[YAW];
    let turns = models.map(|(_, model)| angle_difference(model.mean[YAW], reference));
    let shift: f64 = models.iter().zip(turns).map(|((weight, _), turn)| weight * turn).sum();
    let variance = models
        .iter()
        .zip(turns)
        .map(|((weight, model), turn)| {
            weight * (model.covariance[at(YAW, YAW)] + (turn - shift) * (turn - shift))
        })
        .sum();
    (wrap_angle(reference + shift), variance)
}

pub(super) fn place(models: &[(f64, Still); 4]) -> Place {
    let own = likeliest(&models.map(|(weight, _)| weight));
    let [x, y, _] = models[own].1.mean;
    let mut shift = [0.0; 2];
    for (weight, model) in models {
        shift[0] += weight * (model.mean[0] - x);
        shift[1] += weight * (model.mean[1] - y);
    }
    let mut covariance = Covariance2::default();
    let mut widest = Covariance2::default();
    for (weight, model) in models {
        let p = model.position_covariance();
        let (dx, dy) = (apart(model.mean[0] - x - shift[0]), apart(model.mean[1] - y - shift[1]));
        let about_mean = Covariance2 { xx: p.xx + dx * dx, xy: p.xy + dx * dy, yy: p.yy + dy * dy };
        covariance = sum(&covariance, &about_mean.scaled(*weight));
        if *weight > IMPROBABLE && about_mean.xx + about_mean.yy > widest.xx + widest.yy {
            widest = about_mean;
        }
    }
    let (yaw, yaw_variance) = heading(models, own);
    let position = [x + shift[0], y + shift[1]];
    Place { position, position_covariance: covariance, gate_covariance: widest, yaw, yaw_variance }
}

const _: () = assert!(SMOOTH == 2 && MANOEUVRE == 3, "the order of the arrays above");
