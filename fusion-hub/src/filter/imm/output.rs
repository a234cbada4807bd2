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

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    const WEIGHTS: [f64; 4] = [0.15, 0.25, 0.4, 0.2];

    /// Four models at different places, with headings on both sides of π.
    fn places() -> [(f64, Still); 4] {
        let still = |mean, covariance| Still { mean, covariance };
        let models = [
            still([10.0, -3.0, PI - 0.2], [0.5, 0.1, 0.4, 0.02, 0.03, 0.04]),
            still([10.4, -3.5, PI - 0.05], [0.7, -0.2, 0.9, 0.01, 0.02, 0.03]),
            still([9.1, -2.2, 0.1 - PI], [0.3, 0.05, 0.6, 0.02, 0.01, 0.05]),
            still([11.7, -4.0, 0.3 - PI], [1.5, 0.3, 1.2, 0.03, 0.04, 0.09]),
        ];
        std::array::from_fn(|i| (WEIGHTS[i], models[i]))
    }

    /// E[f] over the models.
    fn mean(f: impl Fn(usize) -> f64) -> f64 {
        (0..4).map(|model| WEIGHTS[model] * f(model)).sum()
    }

    #[track_caller]
    fn assert_near(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-12 * (1.0 + expected.abs()), "{found} is not {expected}");
    }

    #[test]
    fn the_likeliest_model_is_the_one_of_most_weight_wherever_it_stands() {
        for most in 0..4 {
            let mut weights = [0.1; 4];
            weights[most] = 0.7;
            assert_eq!(likeliest(&weights), most);
        }
    }

    #[test]
    fn a_place_has_the_moments_of_the_mixture_and_gates_by_its_widest_model() {
        let places = places();
        let at = |axis: usize| mean(|model| places[model].1.mean[axis]);
        let [x, y] = [at(0), at(1)];
        let Place { position, position_covariance: p, gate_covariance: gate, .. } = place(&places);
        assert_near(position[0], x);
        assert_near(position[1], y);
        let off = |model: usize| [places[model].1.mean[0] - x, places[model].1.mean[1] - y];
        let about = |model: usize| {
            let ([dx, dy], [xx, xy, yy, ..]) = (off(model), places[model].1.covariance);
            [xx + dx * dx, xy + dx * dy, yy + dy * dy]
        };
        for (found, entry) in [(p.xx, 0), (p.xy, 1), (p.yy, 2)] {
            assert_near(found, mean(|model| about(model)[entry]));
        }
        let widest = about(3);
        for (found, expected) in [gate.xx, gate.xy, gate.yy].into_iter().zip(widest) {
            assert_near(found, expected);
        }
    }

    #[test]
    fn an_improbable_model_does_not_widen_the_gate() {
        let mut places = places();
        (places[2].0, places[3].0) = (0.595, 0.005);
        let [xx, ..] = places[3].1.covariance;
        assert!(place(&places).gate_covariance.xx < xx);
    }

    #[test]
    fn headings_on_both_sides_of_pi_have_the_moments_of_the_mixture() {
        let places = places();
        // From π, counter-clockwise.
        let turns = [-0.2, -0.05, 0.1, 0.3];
        let turn = mean(|model| turns[model]);
        let variance = mean(|model| {
            places[model].1.covariance[at(YAW, YAW)] + (turns[model] - turn) * (turns[model] - turn)
        });
        let Place { yaw, yaw_variance, .. } = place(&places);
        assert_near(yaw, wrap_angle(PI + turn));
        assert_near(yaw_variance, variance);
    }

    #[test]
    fn moments_are_those_of_the_mixture() {
        let places = places();
        let models: [Kinematic; 4] = std::array::from_fn(|model| {
            let k = f64::from(u8::try_from(model).unwrap());
            let [x, y, _] = places[model].1.mean;
            Kinematic {
                mean: [x, y, 3.0 - k, 0.5 * k * k],
                covariance: std::array::from_fn(|entry| 0.1 * (k + 1.0) + entry as f64),
            }
        });
        let found = moments(&models, &places);
        let means: [f64; 4] = std::array::from_fn(|i| mean(|model| models[model].mean[i]));
        let [x, y] = found.position;
        let [vx, vy] = found.velocity;
        for (found, expected) in [x, y, vx, vy].into_iter().zip(means) {
            assert_near(found, expected);
        }
        for (entry, (row, column)) in KINEMATIC_INDEX.into_iter().enumerate() {
            let expected = mean(|model| {
                let Kinematic { mean, covariance } = &models[model];
                covariance[entry] + (mean[row] - means[row]) * (mean[column] - means[column])
            });
            assert_near(found.covariance[entry], expected);
        }
        assert_eq!(found.model_probabilities, WEIGHTS);
    }

    #[test]
    fn the_widest_model_is_that_of_the_largest_variance_over_both_axes() {
        let mut places = places();
        let standing = |xx, yy| Still { mean: [1.0, 2.0, 0.0], covariance: [xx, 0.0, yy, 0.0, 0.0, 0.1] };
        let models = [standing(0.1, 9.0), standing(5.0, 0.1), standing(0.2, 0.2), standing(0.3, 0.3)];
        places.iter_mut().zip(models).for_each(|(place, model)| place.1 = model);
        let Covariance2 { xx, yy, .. } = place(&places).gate_covariance;
        assert_near(xx, 0.1);
        assert_near(yy, 9.0);
    }
}
