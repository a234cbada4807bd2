//! One object's whole state under the four models of motion.

use super::imm::{Imm, Inflation};
use super::size_evidence::{LogNormal, SizeEvidence};
use super::size_priors::SizePriors;
use super::state::GREATEST_WEIGHT;
use super::{Course, Estimate, Filter, Heading, Motion, Shape, intersection_weight};
use crate::values::PredictedMeasurement;
use crate::values::{Measurement, PositionInnovation};
use v2x_common::class::Class;
use v2x_common::time::Timestamp;

/// Least standard deviation of ln size: errors of reports are correlated, so half a percent is left.
const SIZE_FLOOR_LN: f64 = 0.005;

/// Position, motion and heading under the interacting models, and the evidence of width and depth.
#[derive(Clone, Copy, Debug, PartialEq)]
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

    /// For a track of its sender: covariance intersection, with one weight for position, motion and heading.
    fn inflation(&self, z: &Measurement) -> Inflation {
        if !z.is_track {
            return Inflation::NONE;
        }
        let weight = intersection_weight(&self.motion.place().position_covariance, &z.r);
        let weight = weight.clamp(0.5, GREATEST_WEIGHT);
        Inflation { prior: 1.0 / weight, report: 1.0 / (1.0 - weight) }
    }
}

impl Filter for ImmState {
    fn initial(at: Timestamp, z: &Measurement) -> Self {
        let sizes = [0, 1].map(|dimension| {
            let (reported, variance, lower) = z.reported_size(dimension);
            SizeEvidence::initial(reported, variance, lower)
        });
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
        for (dimension, size) in self.sizes.iter_mut().enumerate() {
            let (reported, variance, lower) = z.reported_size(dimension);
            if z.is_track {
                size.intersect(reported, variance, lower);
            } else {
                size.update(reported, variance, lower);
            }
        }
        innovation
    }

    fn place_at(&self, to: Timestamp, class: Class) -> ([f64; 2], f64) {
        let place = self.predicted(to, class).motion.place();
        (place.position, place.position_covariance.max_sigma())
    }

    fn rough_position(&self) -> ([f64; 2], f64) {
        self.motion.neighbourhood()
    }

    fn predicted_measurement(&self, class: Class) -> PredictedMeasurement {
        let place = self.motion.place();
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
        }
    }

    fn shape(&self, class: Class) -> Shape {
        let (yaw, yaw_variance) = self.motion.heading();
        let [width, depth] = self.sizes.map(|size| size.roughly());
        Shape {
            class,
            yaw,
            yaw_variance,
            size: [width.mean, depth.mean],
            size_variance: [width.variance, depth.variance],
        }
    }

    fn turn_round(&mut self) {
        self.motion.turn_round();
    }

    fn redirect(&mut self, course: &Course) {
        self.motion.redirect(course);
    }

    fn motion(&self) -> Motion {
        self.motion.motion()
    }

    fn size_evidence(&self) -> Option<&[SizeEvidence; 2]> {
        Some(&self.sizes)
    }

    fn estimate(&self, class: Class, priors: &SizePriors) -> Estimate {
        let moments = self.motion.moments();
        let [width, depth] = priors.sizes(class, &self.sizes).map(|size| {
            let floor = size.variance_ln + SIZE_FLOOR_LN * SIZE_FLOOR_LN;
            LogNormal { variance_ln: floor, ..size }.size()
        });
        Estimate {
            position: moments.position,
            velocity: moments.velocity,
            covariance: moments.covariance,
            width,
            depth,
            heading: Heading { mean: moments.yaw, variance: moments.yaw_variance },
        }
    }
}
