//! The four models together: one mean, one covariance.

use super::gaussian::{self, Still, YAW, apart, at};
use super::likelihood::Symmetric;
use super::model::{MANOEUVRE, SMOOTH};
use super::velocity;
use crate::values::Real;
use std::f64::consts::PI;
use v2x_common::covariance::Covariance2;
use v2x_common::fused::{KINEMATIC_INDEX, KinematicCovariance};
use v2x_common::geometry::wrap_angle;

/// Angles within ± this need not be wrapped, whatever the rounding.
const SURELY_WITHIN: f64 = PI - 1e-6;
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

impl Moments {
    pub(super) fn of(moments: &MomentsOf, weights: [f64; 4]) -> Self {
        let MomentsOf { mean: [x, y, vx, vy], covariance, yaw, yaw_variance } = *moments;
        Self {
            position: [x, y],
            velocity: [vx, vy],
            covariance,
            yaw,
            yaw_variance,
            model_probabilities: weights,
        }
    }
}

/// [`Place`] of one object or of several.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaceOf<R = f64> {
    pub(super) position: [R; 2],
    pub(super) covariance: Symmetric<R>,
    pub(super) widest: Symmetric<R>,
    pub(super) yaw: R,
    pub(super) yaw_variance: R,
}

impl From<PlaceOf> for Place {
    fn from(PlaceOf { position, covariance, widest, yaw, yaw_variance }: PlaceOf) -> Self {
        let (position_covariance, gate_covariance) = (covariance.into(), widest.into());
        Self { position, position_covariance, gate_covariance, yaw, yaw_variance }
    }
}

/// [`Moments`] of one object or of several: of (x, y, vx, vy).
#[derive(Clone, Copy, Debug)]
pub(super) struct MomentsOf<R = f64> {
    pub(super) mean: [R; 4],
    pub(super) covariance: [R; 10],
    pub(super) yaw: R,
    pub(super) yaw_variance: R,
}

/// One model's (x, y, vx, vy).
pub(super) struct Kinematic<R = f64> {
    mean: [R; 4],
    covariance: [R; 10],
}

impl<R: Real> Kinematic<R> {
    #[inline(always)]
    pub(super) fn standing(state: &Still<R>) -> Self {
        let [x, y, _] = state.mean;
        let [xx, xy, yy, ..] = state.covariance;
        let zero = x.same(0.0);
        let vv = velocity::slipping(&Symmetric { xx: zero, xy: zero, yy: zero });
        let covariance = [xx, xy, zero, zero, yy, zero, zero, vv.xx, vv.xy, vv.yy];
        Self { mean: [x, y, zero, zero], covariance }
    }

    #[inline(always)]
    pub(super) fn moving(state: &gaussian::Full<R>, lever_m: R) -> Self {
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

/// What the likeliest of four models has.
#[inline(always)]
fn of_likeliest<const N: usize, R: Real>(weights: &[R; 4], of_model: impl Fn(usize) -> [R; N]) -> [R; N] {
    let (mut most, mut found) = (weights[0], of_model(0));
    for (model, weight) in weights.iter().enumerate().skip(1) {
        let is_more = most.is_below(*weight);
        most = R::choose(is_more, *weight, most);
        for (found, other) in found.iter_mut().zip(of_model(model)) {
            *found = R::choose(is_more, other, *found);
        }
    }
    found
}

/// The mixture of the models; `places` are their weights, positions and headings.
pub(super) fn moments(models: &[Kinematic; 4], places: &[(f64, Still); 4]) -> Moments {
    Moments::of(&moments_of(models, places), places.map(|(weight, _)| weight))
}

/// The same of one object or of several.
#[inline(always)]
pub(super) fn moments_of<R: Real>(models: &[Kinematic<R>; 4], places: &[(R, Still<R>); 4]) -> MomentsOf<R> {
    let weights = places.map(|(weight, _)| weight);
    let zero = weights[0].same(0.0);
    let reference = of_likeliest(&weights, |model| models[model].mean);
    let mut shift = [zero; 4];
    for (model, weight) in models.iter().zip(weights) {
        for ((shift, mean), reference) in shift.iter_mut().zip(model.mean).zip(reference) {
            *shift += weight * (mean - reference);
        }
    }
    let mut covariance = [zero; 10];
    for (model, weight) in models.iter().zip(weights) {
        let mut off = [zero; 4];
        for (i, off) in off.iter_mut().enumerate() {
            *off = apart(model.mean[i] - reference[i] - shift[i]);
        }
        for (entry, (row, column)) in KINEMATIC_INDEX.into_iter().enumerate() {
            covariance[entry] += weight * (model.covariance[entry] + off[row] * off[column]);
        }
    }
    let mut mean = reference;
    for (mean, shift) in mean.iter_mut().zip(shift) {
        *mean += shift;
    }
    let (yaw, yaw_variance) = heading(places);
    MomentsOf { mean, covariance, yaw, yaw_variance }
}

#[inline(always)]
fn heading<R: Real>(models: &[(R, Still<R>); 4]) -> (R, R) {
    let weights = models.map(|(weight, _)| weight);
    let zero = weights[0].same(0.0);
    let [reference] = of_likeliest(&weights, |model| [models[model].1.mean[YAW]]);
    let mut turns = [zero; 4];
    let mut shift = zero;
    for (turn, (weight, model)) in turns.iter_mut().zip(models) {
        *turn = wrapped_half_open(model.mean[YAW] - reference);
        shift += *weight * *turn;
    }
    let mut variance = zero;
    for (turn, (weight, model)) in turns.iter().zip(models) {
        let off = *turn - shift;
        variance += *weight * (model.covariance[at(YAW, YAW)] + off * off);
    }
    (wrapped_half_open(reference + shift), variance)
}

/// As [`wrap_angle`], into (-π, π].
#[inline(always)]
fn wrapped_half_open<R: Real>(angle: R) -> R {
    // Nearly all are.
    if R::all(angle.abs().is_below(angle.same(SURELY_WITHIN))) { angle + 0.0 } else { angle.map(wrap_angle) }
}

/// The place of a mixture of the models.
#[inline(always)]
pub(super) fn place<R: Real>(models: &[(R, Still<R>); 4]) -> PlaceOf<R> {
    let weights = models.map(|(weight, _)| weight);
    let zero = weights[0].same(0.0);
    let [x, y] = of_likeliest(&weights, |model| [models[model].1.mean[0], models[model].1.mean[1]]);
    let mut shift = [zero; 2];
    for (weight, model) in models {
        shift[0] += *weight * (model.mean[0] - x);
        shift[1] += *weight * (model.mean[1] - y);
    }
    let mut covariance = Symmetric { xx: zero, xy: zero, yy: zero };
    let mut widest = covariance;
    for (weight, model) in models {
        let p = model.position_covariance();
        let (dx, dy) = (apart(model.mean[0] - x - shift[0]), apart(model.mean[1] - y - shift[1]));
        let about_mean = Symmetric { xx: p.xx + dx * dx, xy: p.xy + dx * dy, yy: p.yy + dy * dy };
        covariance = covariance.plus(&about_mean.scaled(*weight));
        // Improbable models count as if they had no extent.
        let is_probable = zero.same(IMPROBABLE).is_below(*weight);
        let extent = R::choose(is_probable, about_mean.xx + about_mean.yy, zero);
        let is_wider = (widest.xx + widest.yy).is_below(extent);
        widest = Symmetric {
            xx: R::choose(is_wider, about_mean.xx, widest.xx),
            xy: R::choose(is_wider, about_mean.xy, widest.xy),
            yy: R::choose(is_wider, about_mean.yy, widest.yy),
        };
    }
    let (yaw, yaw_variance) = heading(models);
    PlaceOf { position: [x + shift[0], y + shift[1]], covariance, widest, yaw, yaw_variance }
}

const _: () = assert!(SMOOTH == 2 && MANOEUVRE == 3, "the order of the arrays above");

#[cfg(test)]
mod tests {
    use super::*;

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
        let Place { position, position_covariance: p, gate_covariance: gate, .. } =
            Place::from(place(&places));
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
        assert!(Place::from(place(&places)).gate_covariance.xx < xx);
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
        let Place { yaw, yaw_variance, .. } = Place::from(place(&places));
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
        let Covariance2 { xx, yy, .. } = Place::from(place(&places)).gate_covariance;
        assert_near(xx, 0.1);
        assert_near(yy, 9.0);
    }
}
