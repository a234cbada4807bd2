//! A measurement in one cache line: what tracks replay.

use super::{Measurement, ScoreBand, ScoreEvidence, SizeLaw};
use serde::{Deserialize, Serialize};
use std::f32::consts::FRAC_PI_2;
use v2x_common::class::{Class, ClassGroup};
use v2x_common::covariance::Covariance2;
use v2x_common::detection::HeadingKind;

/// Correlations are cut by this share before they are rounded, so that no covariance becomes indefinite.
const CORRELATION_KEPT: f64 = 1.0 - 1.0 / (1 << 20) as f64;

/// Of a vehicle one side is known to be longer where the logarithm of their ratio is more than this, and than so many standard
/// deviations of it.
const LONGER_LN: f32 = 0.4;
const LONGER_SIGMAS: f32 = 3.0;

/// A measurement without its velocity. Variances, sizes and headings are held in single precision, six
/// digits and more than any sensor's accuracy; positions are not.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[repr(align(64))]
pub struct CompactMeasurement {
    position: [f64; 2],
    r: [f32; 3],
    size: [f32; 2],
    relative_variance: [f32; 2],
    yaw: f32,
    yaw_variance: f32,
    detection_over_clutter: f32,
    class: Class,
    heading: HeadingKind,
    score: ScoreEvidence,
    /// Whether a velocity was reported; it is held elsewhere.
    pub has_velocity: bool,
    /// Whether it is an agent's own track.
    pub is_track: bool,
    band: ScoreBand,
    /// Place in the list of laws, and whether it holds for width (1) and depth (2).
    law: u8,
    has_law: u8,
}

/// A detection's evidence of existence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DetectionEvidence {
    /// Detection probability over clutter density, with the evidence of the score, m²; ∞ without clutter.
    pub over_clutter: f64,
    /// The evidence of its score.
    pub score: ScoreEvidence,
    /// The band of its score.
    pub band: ScoreBand,
}

/// The laws that sensors have declared: few, so that a measurement names its own in one byte.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct SizeLaws(Vec<SizeLaw>);

impl SizeLaws {
    /// The place of a law; `None` where the list is full.
    fn place(&mut self, law: &SizeLaw) -> Option<u8> {
        let known = self.0.iter().position(|known| known == law);
        let place = known.unwrap_or(self.0.len());
        let place = u8::try_from(place).ok()?;
        if known.is_none() {
            self.0.push(*law);
        }
        Some(place)
    }
}

impl CompactMeasurement {
    /// An empty one, for unused places.
    pub const BLANK: Self = Self {
        position: [0.0; 2],
        r: [0.0; 3],
        size: [0.0; 2],
        relative_variance: [0.0; 2],
        yaw: 0.0,
        yaw_variance: 0.0,
        detection_over_clutter: 0.0,
        class: Class::Unknown,
        heading: HeadingKind::Known,
        score: ScoreEvidence::NONE,
        has_velocity: false,
        is_track: false,
        band: ScoreBand::LEAST,
        law: 0,
        has_law: 0,
    };

    /// From a measurement and its evidence of existence. If more than 256 laws are in use,
    /// only mean and variance of the further ones count.
    #[expect(clippy::cast_possible_truncation, reason = "single precision is intended")]
    pub fn new(z: &Measurement, evidence: &DetectionEvidence, laws: &mut SizeLaws) -> Self {
        let law = z.size_law.iter().flatten().next().and_then(|law| laws.place(law));
        let single = |[a, b]: [f64; 2]| [a as f32, b as f32];
        Self {
            position: z.position,
            r: [z.r.xx as f32, (z.r.xy * CORRELATION_KEPT) as f32, z.r.yy as f32],
            size: single(z.size),
            relative_variance: single(z.relative_variance),
            yaw: z.yaw as f32,
            yaw_variance: z.yaw_variance as f32,
            detection_over_clutter: evidence.over_clutter as f32,
            class: z.class,
            heading: z.heading,
            score: evidence.score,
            has_velocity: z.velocity.is_some(),
            is_track: z.is_track,
            band: evidence.band,
            law: law.unwrap_or(0),
            has_law: match law {
                Some(_) => u8::from(z.size_law[0].is_some()) | (u8::from(z.size_law[1].is_some()) << 1),
                None => 0,
            },
        }
    }

    /// As a filter takes it, without velocity.
    #[inline(always)]
    pub fn expanded(&self, laws: &SizeLaws) -> Measurement {
        let double = |[a, b]: [f32; 2]| [f64::from(a), f64::from(b)];
        let [xx, xy, yy] = self.r.map(f64::from);
        Measurement {
            class: self.class,
            position: self.position,
            r: Covariance2 { xx, xy, yy },
            size: double(self.size),
            relative_variance: double(self.relative_variance),
            yaw: f64::from(self.yaw),
            yaw_variance: f64::from(self.yaw_variance),
            heading: self.heading,
            size_law: [1, 2].map(|bit| (self.has_law & bit != 0).then(|| laws.0[usize::from(self.law)])),
            velocity: None,
            is_track: self.is_track,
            since_last_s: f64::INFINITY,
        }
    }

    /// Heading as reported, rad.
    #[inline]
    pub fn yaw(&self) -> f64 {
        f64::from(self.yaw)
    }

    /// Direction of the longer side of a vehicle as its heading was reported, rad, and its declared variance, rad²: width and depth
    /// may be exchanged. `None` where none was reported, and where it is not known which side is longer.
    #[inline]
    pub fn longer_side(&self) -> Option<[f32; 2]> {
        let [w, d] = self.size;
        let is_vehicle = matches!(self.class.group(), ClassGroup::FourWheeled | ClassGroup::Unknown);
        if self.heading == HeadingKind::Unknown || !is_vehicle {
            return None;
        }
        let [rw, rd] = self.relative_variance;
        let known_from = (LONGER_SIGMAS * libm::sqrtf(rw + rd)).max(LONGER_LN);
        if libm::logf(w / d).abs() < known_from {
            return None;
        }
        Some([if w > d { self.yaw + FRAC_PI_2 } else { self.yaw }, self.yaw_variance])
    }

    /// Class as reported.
    #[inline]
    pub const fn class(&self) -> Class {
        self.class
    }

    /// Position, m.
    #[inline]
    pub const fn position(&self) -> [f64; 2] {
        self.position
    }

    /// The evidence of its score.
    #[inline]
    pub fn score(&self) -> ScoreEvidence {
        self.score
    }

    /// The band of its score.
    #[inline]
    pub const fn band(&self) -> ScoreBand {
        self.band
    }

    /// Detection probability over clutter density, m²; ∞ without clutter.
    #[inline]
    pub fn detection_over_clutter(&self) -> f64 {
        f64::from(self.detection_over_clutter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CERTAIN: DetectionEvidence =
        DetectionEvidence { over_clutter: f64::INFINITY, score: ScoreEvidence::NONE, band: ScoreBand::LEAST };

    #[test]
    fn a_measurement_is_one_cache_line_and_keeps_six_digits() {
        assert_eq!(size_of::<CompactMeasurement>(), 64);
        let z = Measurement {
            class: Class::Truck,
            position: [691_607.123_456, 5_334_764.654_321],
            r: Covariance2 { xx: 0.123_456_7, xy: -0.1, yy: 0.345_678_9 },
            size: [2.5, 11.1],
            relative_variance: [0.04, 0.01],
            yaw: -3.101_592,
            yaw_variance: 0.0123,
            size_law: [None; 2],
            heading: HeadingKind::Known,
            velocity: None,
            is_track: false,
            since_last_s: f64::INFINITY,
        };
        let mut laws = SizeLaws::default();
        let back = CompactMeasurement::new(&z, &CERTAIN, &mut laws).expanded(&laws);
        assert_eq!((back.position, back.class), (z.position, z.class));
        for (a, b) in [(back.r.xx, z.r.xx), (back.r.xy, z.r.xy), (back.yaw, z.yaw), (back.size[1], z.size[1])]
        {
            assert!((a / b - 1.0).abs() < 2e-6, "{a} for {b}");
        }
    }

    #[test]
    fn a_covariance_on_the_edge_stays_positive_definite() {
        let mut laws = SizeLaws::default();
        for k in 1..2000_u32 {
            let (xx, yy) = (1e-3 * f64::from(k), 1.7e-5 * f64::from(k * k));
            let xy = libm::sqrt(xx * yy) * (1.0 - 1e-12);
            let r = Covariance2 { xx, xy, yy };
            let z = Measurement {
                class: Class::Car,
                position: [0.0; 2],
                r,
                size: [1.0; 2],
                relative_variance: [0.1; 2],
                yaw: 0.0,
                yaw_variance: 0.1,
                size_law: [None; 2],
                heading: HeadingKind::Known,
                velocity: None,
                is_track: false,
                since_last_s: f64::INFINITY,
            };
            assert!(
                r.is_valid() && CompactMeasurement::new(&z, &CERTAIN, &mut laws).expanded(&laws).r.is_valid(),
                "{k}"
            );
        }
    }
}
