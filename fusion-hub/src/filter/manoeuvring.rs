//! One object's whole state under the four models of motion.

use super::imm::{self, Imm, Inflation, Moments, Move, Place};
use super::size_evidence::{LogNormal, SizeEvidence};
use super::size_priors::TrackSizePriors;
use super::{Course, Due, Filter, Heading, Holds, Motion, PoseEstimate, Size, weight_against_track};
use crate::values::PredictedMeasurement;
use crate::values::{Measurement, PositionInnovation};
use serde::{Deserialize, Serialize};
use v2x_common::class::Class;
use v2x_common::covariance::Covariance2;
use v2x_common::time::Timestamp;

/// Least standard deviation of ln size: errors of reports are correlated, so half a percent is left.
const SIZE_FLOOR_LN: f64 = 0.005;

/// Position, motion and heading under the interacting models, and the evidence of width and depth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImmState {
    at: Timestamp,
    motion: Imm,
    sizes: [SizeEvidence; 2],
}

impl ImmState {
    /// Probabilities of being parked, stopped, in smooth motion and manoeuvring; they sum to 1.
    pub fn model_probabilities(&self) -> [f64; 4] {
        self.motion.model_probabilities()
    }

    fn update_sizes(&mut self, z: &Measurement) {
        for (dimension, size) in self.sizes.iter_mut().enumerate() {
            if z.is_track {
                size.intersect(size_of(z, dimension));
                continue;
            }
            let (reported, variance, lower) = z.reported_size(dimension);
            if z.is_averaged(dimension) {
                size.average(reported, variance);
            } else {
                size.update(reported, variance, lower);
            }
        }
    }

    fn measured_at(&self, place: &Place, class: Class) -> PredictedMeasurement {
        let [width, depth] = self.sizes.map(|size| size.roughly());
        PredictedMeasurement {
            class,
            position: place.position,
            position_covariance: place.position_covariance,
            gate_covariance: place.gate_covariance,
            size: [width.mean, depth.mean],
            size_variance: [width.variance, depth.variance],
            yaw: place.yaw,
            yaw_variance: place.yaw_variance,
            report_probability: 0.5,
            by_positions: None,
        }
    }

    /// For a track of its sender: covariance intersection, with one weight for position, motion and heading.
    fn inflation(&self, z: &Measurement) -> Inflation {
        if !z.is_track {
            return Inflation::NONE;
        }
        let weight = weight_against_track(&self.motion.place().position_covariance, z);
        Inflation { prior: 1.0 / weight, report: 1.0 / (1.0 - weight) }
    }
}

impl AsRef<Imm> for ImmState {
    #[inline(always)]
    fn as_ref(&self) -> &Imm {
        &self.motion
    }
}

impl AsMut<Imm> for ImmState {
    #[inline(always)]
    fn as_mut(&mut self) -> &mut Imm {
        &mut self.motion
    }
}

/// The evidence of width (0) or depth (1) by one report.
fn size_of(z: &Measurement, dimension: usize) -> SizeEvidence {
    let (reported, variance, lower) = z.reported_size(dimension);
    if z.is_averaged(dimension) {
        SizeEvidence::of_average(reported, variance)
    } else {
        SizeEvidence::initial(reported, variance, lower)
    }
}

/// Moments as they are published.
const fn published(moments: &Moments) -> PoseEstimate {
    let Moments { position, velocity, covariance, yaw, yaw_variance, .. } = *moments;
    PoseEstimate { position, velocity, covariance, heading: Heading { mean: yaw, variance: yaw_variance } }
}

impl Filter for ImmState {
    const TOGETHER: bool = true;

    fn initial(at: Timestamp, z: &Measurement) -> Self {
        let sizes = [0, 1].map(|dimension| size_of(z, dimension));
        Self { at, motion: Imm::initial(z), sizes }
    }

    fn at(&self) -> Timestamp {
        self.at
    }

    fn predict(&mut self, to: Timestamp, class: Class) {
        let dt_s = (to - self.at).as_secs_f64();
        self.at = to;
        self.motion.predict(dt_s, class, self.sizes[1].likeliest());
    }

    fn predict_some<T: Holds<Self>>(objects: &mut [T], due: &[Due]) {
        imm::predict_some(objects, due, |state, to| Move {
            dt_s: (to - state.at).as_secs_f64(),
            length_m: state.sizes[1].likeliest(),
        });
        for Due { place, to, .. } in due {
            objects[*place].state_mut().at = *to;
        }
    }

    fn smoothed(&self, class: Class, later: &Self) -> Self {
        if later.at == self.at {
            return *later;
        }
        let dt_s = (later.at - self.at).as_secs_f64();
        let motion = self.motion.smoothed((dt_s, class, self.sizes[1].likeliest()), &later.motion);
        // A body's size does not change: its evidence holds at any time.
        Self { at: self.at, motion, sizes: later.sizes }
    }

    fn update(&mut self, z: &Measurement) -> PositionInnovation {
        let innovation = self.motion.update(z, self.inflation(z));
        self.update_sizes(z);
        innovation
    }

    fn update_some<T: Holds<Self>>(
        objects: &mut [T],
        some: &[(usize, Measurement)],
        mut take: impl FnMut(usize, PositionInnovation),
    ) {
        imm::update_some(objects, some, &mut take);
        for (place, z) in some.iter().filter(|(_, z)| imm::is_plain(z)) {
            objects[*place].state_mut().update_sizes(z);
        }
    }

    fn place_at(&self, to: Timestamp, class: Class) -> ([f64; 2], f64) {
        let place = self.predicted(to, class).motion.place();
        (place.position, place.position_covariance.max_sigma())
    }

    fn rough_position(&self) -> ([f64; 2], f64) {
        self.motion.neighbourhood()
    }

    fn position_variance(&self) -> f64 {
        self.motion.position_variance()
    }

    fn predicted_measurement(&self, class: Class) -> PredictedMeasurement {
        self.measured_at(&self.motion.place(), class)
    }

    fn predicted_measurements(
        states: &[Self],
        class: impl Fn(usize) -> Class,
        mut take: impl FnMut(PredictedMeasurement),
    ) {
        let mut next = states.iter().enumerate();
        imm::places_of(states, |at| {
            if let Some((place, state)) = next.next() {
                take(state.measured_at(&at, class(place)));
            }
        });
    }

    fn heading(&self) -> (f64, f64) {
        self.motion.heading()
    }

    fn rough_size(&self) -> ([f64; 2], [f64; 2]) {
        let [width, depth] = self.sizes.map(|size| size.roughly());
        ([width.mean, depth.mean], [width.variance, depth.variance])
    }

    fn turn_round(&mut self) {
        self.motion.turn_round();
    }

    fn move_to(&mut self, position: [f64; 2], covariance: &Covariance2) {
        self.motion.move_to(position, covariance);
    }

    fn widen_position(&mut self, variance: f64) {
        self.motion.widen_position(variance);
    }

    fn turn_to(&mut self, yaw: f64, variance: f64) {
        self.motion.turn_to(yaw, variance);
    }

    fn redirect(&mut self, course: &Course) {
        self.motion.redirect(course);
    }

    fn motion(&self) -> Motion {
        self.motion.motion()
    }

    #[inline]
    fn turn_rate(&self) -> f64 {
        self.motion.turn_rate()
    }

    fn size_evidence(&self) -> Option<&[SizeEvidence; 2]> {
        Some(&self.sizes)
    }

    fn pose(&self) -> PoseEstimate {
        published(&self.motion.moments())
    }

    fn poses(states: &[Self], mut take: impl FnMut(PoseEstimate)) {
        imm::moments_of_all(states, |moments| take(published(&moments)));
    }

    fn sizes(&self, class: Class, priors: &TrackSizePriors<'_>) -> [Size; 2] {
        priors.sizes(class, &self.sizes).map(|size| {
            let floor = size.variance_ln + SIZE_FLOOR_LN * SIZE_FLOOR_LN;
            LogNormal { variance_ln: floor, ..size }.size()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::Estimate;
    use crate::filter::size_priors::SizePriors;
    use v2x_common::covariance::Covariance2;
    use v2x_common::time::Span;

    fn report(is_track: bool) -> Measurement {
        Measurement {
            class: Class::Car,
            position: [1.0, 2.0],
            r: Covariance2 { xx: 0.09, xy: 0.03, yy: 0.16 },
            size: [1.8, 4.5],
            relative_variance: [0.01; 2],
            yaw: 0.3,
            yaw_variance: 0.01,
            size_law: [None; 2],
            heading: v2x_common::detection::HeadingKind::Known,
            velocity: None,
            is_track,
            since_last_s: f64::INFINITY,
        }
    }

    #[test]
    fn fifty_reports_of_one_foreign_track_count_as_one() {
        let after_repeats = |is_track| {
            let mut state = ImmState::initial(Timestamp::EPOCH, &report(is_track));
            for _ in 0..50 {
                state.update(&report(is_track));
            }
            state.predicted_measurement(Class::Car)
        };
        let (repeated, r) = (after_repeats(true), report(true).r);
        let p = repeated.position_covariance;
        assert!(p.xx >= 0.98 * r.xx && p.yy >= 0.98 * r.yy && p.xx <= 1.02 * r.xx, "{p:?}");
        assert!((repeated.size_variance[0] / (0.01 * 1.8 * 1.8) - 1.0).abs() < 0.05);
        // Independent detections, in contrast, average out.
        assert!(after_repeats(false).position_covariance.xx < 0.03 * r.xx);
    }

    #[test]
    fn a_place_at_another_time_is_that_of_the_predicted_state() {
        let mut state = ImmState::initial(Timestamp::EPOCH, &report(false));
        let to = Timestamp::EPOCH + Span::from_millis(700);
        let (position, sigma_m) = state.place_at(to, Class::Car);
        state.predict(to, Class::Car);
        let place = state.motion.place();
        assert_eq!((position, sigma_m), (place.position, place.position_covariance.max_sigma()));
        assert_eq!((state.at(), state.model_probabilities()), (to, state.motion.model_probabilities()));
        assert!(position != [1.0, 2.0] && sigma_m > 0.4);
    }

    #[test]
    fn the_priors_of_its_class_learn_from_both_sizes() {
        let state = ImmState::initial(Timestamp::EPOCH, &report(false));
        let learnt = state.size_evidence().unwrap().map(|size| size.likeliest());
        assert!((learnt[0] / 1.8 - 1.0).abs() < 0.02 && (learnt[1] / 4.5 - 1.0).abs() < 0.02, "{learnt:?}");
    }

    #[test]
    fn many_reports_of_a_size_leave_half_a_percent_of_uncertainty() {
        let z = report(false);
        let mut state = ImmState::initial(Timestamp::EPOCH, &z);
        (0..100_000)
            .for_each(|_| state.sizes.iter_mut().zip(z.size).for_each(|(size, z)| size.update(z, 0.01, 0.0)));
        let Estimate { width, depth, .. } = state.estimate(Class::Car, &SizePriors::FLAT.of_track(None));
        for (size, reported) in [width, depth].into_iter().zip(z.size) {
            assert!((size.mean / reported - 1.0).abs() < 0.02, "{size:?}");
            let sigma_ln = libm::sqrt(size.variance) / size.mean;
            assert!((sigma_ln - 0.005).abs() < 1e-4, "{sigma_ln}");
        }
    }
}
