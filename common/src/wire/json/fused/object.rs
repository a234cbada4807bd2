//! One object of a fused frame as JSON, and the limits of its numbers.

use crate::class::Class;
use crate::detection::{HeadingKind, MAX_COORDINATE_M};
use crate::fused::{FusedObject, KINEMATIC_DIAGONAL, KINEMATIC_INDEX, KinematicCovariance};
use crate::geometry::{BevBox, wrap_angle};
use crate::id::{AgentId, FrameId, MeasurementId, TrackId};
use crate::time::Span;
use crate::wire::error::WireError;
use crate::wire::framing::wire_count;
use crate::wire::fused::MAX_AGENTS;
use crate::wire::json::values::{Id64, Micros};
use serde::{Deserialize, Serialize};

/// Largest width or depth, m: what 16 bits of the binary codec hold.
const MAX_SIZE_M: f64 = 65.535;
/// Names of the elements of a [`KinematicCovariance`].
const KINEMATIC_NAMES: [&str; 10] = [
    "variance of x",
    "covariance of x and y",
    "covariance of x and vx",
    "covariance of x and vy",
    "variance of y",
    "covariance of y and vx",
    "covariance of y and vy",
    "variance of vx",
    "covariance of vx and vy",
    "variance of vy",
];
/// A correlation of exactly one is written with the rounding error of its covariance.
const ROUNDING: f64 = 1e-9;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::wire::json) struct JsonObject {
    track: Id64,
    class: Class,
    class_probabilities: Vec<(Class, f64)>,
    /// Left out where there is none.
    #[serde(default, skip_serializing_if = "is_zero")]
    class_conflict: f64,
    x: f64,
    y: f64,
    w: f64,
    d: f64,
    yaw: f64,
    vx: f64,
    vy: f64,
    sigma: JsonObjectSigma,
    kinematic_covariance: KinematicCovariance,
    #[serde(default)]
    heading: HeadingKind,
    existence: f64,
    age_us: i64,
    last_measured_at: Micros,
    contributors: Vec<JsonMeasurement>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde calls it")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// Standard deviations; written for convenience, read back from the variances.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonObjectSigma {
    x: f64,
    y: f64,
    vx: f64,
    vy: f64,
    w: f64,
    d: f64,
    yaw: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonMeasurement {
    agent: AgentId,
    epoch: Id64,
    sequence: Id64,
    index: u16,
}

impl JsonObject {
    /// Checks every number against the limits of the schema. `index` is the object's place in the frame.
    pub(in crate::wire::json) fn check(&self, index: usize) -> Result<(), WireError> {
        wire_count("class probabilities", self.class_probabilities.len(), Class::ALL.len())?;
        wire_count("contributors", self.contributors.len(), MAX_AGENTS)?;
        let check = |field, value: f64, is_valid: bool, expected| {
            if is_valid { Ok(()) } else { Err(WireError::FusedValue { field, index, value, expected }) }
        };
        let finite = |field, value: f64| check(field, value, value.is_finite(), "a finite number");
        let within = |field, value: f64, (low, high): (f64, f64), expected| {
            check(field, value, value >= low && value <= high, expected)
        };
        within("x", self.x, (-MAX_COORDINATE_M, MAX_COORDINATE_M), "at most 1e8 m")?;
        within("y", self.y, (-MAX_COORDINATE_M, MAX_COORDINATE_M), "at most 1e8 m")?;
        within("w", self.w, (0.0, MAX_SIZE_M), "0 to 65.535 m")?;
        within("d", self.d, (0.0, MAX_SIZE_M), "0 to 65.535 m")?;
        [("yaw", self.yaw), ("vx", self.vx), ("vy", self.vy)]
            .into_iter()
            .try_for_each(|(f, v)| finite(f, v))?;
        within("existence", self.existence, (0.0, 1.0), "0 to 1")?;
        within("class conflict", self.class_conflict, (0.0, 1.0), "0 to 1")?;
        for &(_, probability) in &self.class_probabilities {
            within("class probability", probability, (0.0, 1.0), "0 to 1")?;
        }
        for (field, sigma) in self.sigma.named() {
            // Its square is what is kept.
            check(
                field,
                sigma,
                sigma >= 0.0 && (sigma * sigma).is_finite(),
                "at least 0, with a finite square",
            )?;
        }
        self.check_covariance(check)
    }

    /// Calls `check` with each element of the covariance: no variance is negative, no correlation beyond one.
    fn check_covariance(
        &self,
        check: impl Fn(&'static str, f64, bool, &'static str) -> Result<(), WireError>,
    ) -> Result<(), WireError> {
        let variance = |axis: usize| self.kinematic_covariance[KINEMATIC_DIAGONAL[axis]];
        for axis in 0..KINEMATIC_DIAGONAL.len() {
            let (name, value) = (KINEMATIC_NAMES[KINEMATIC_DIAGONAL[axis]], variance(axis));
            check(name, value, value >= 0.0 && value.is_finite(), "at least 0")?;
        }
        for ((name, value), (row, column)) in
            KINEMATIC_NAMES.into_iter().zip(self.kinematic_covariance).zip(KINEMATIC_INDEX)
        {
            let most = libm::sqrt(variance(row)) * libm::sqrt(variance(column)) * (1.0 + ROUNDING);
            check(name, value, value.abs() <= most, "a correlation of -1 to 1")?;
        }
        Ok(())
    }
}

impl JsonObjectSigma {
    fn named(&self) -> [(&'static str, f64); 7] {
        let Self { x, y, vx, vy, w, d, yaw } = *self;
        [
            ("sigma.x", x),
            ("sigma.y", y),
            ("sigma.vx", vx),
            ("sigma.vy", vy),
            ("sigma.w", w),
            ("sigma.d", d),
            ("sigma.yaw", yaw),
        ]
    }
}

impl From<&FusedObject> for JsonObject {
    fn from(object: &FusedObject) -> Self {
        let covariance = &object.kinematic_covariance;
        Self {
            track: Id64(object.track.0),
            class: object.class,
            class_probabilities: object.classes().collect(),
            class_conflict: object.class_conflict,
            x: object.bev.x,
            y: object.bev.y,
            w: object.bev.w,
            d: object.bev.d,
            yaw: object.bev.yaw,
            vx: object.velocity.0,
            vy: object.velocity.1,
            sigma: JsonObjectSigma {
                x: libm::sqrt(covariance[0]),
                y: libm::sqrt(covariance[4]),
                vx: libm::sqrt(covariance[7]),
                vy: libm::sqrt(covariance[9]),
                w: libm::sqrt(object.ww),
                d: libm::sqrt(object.dd),
                yaw: libm::sqrt(object.yaw_variance),
            },
            kinematic_covariance: *covariance,
            heading: object.heading,
            existence: object.existence,
            age_us: object.age.as_nanos() / 1_000,
            last_measured_at: Micros(object.last_measured_at),
            contributors: object
                .contributors
                .iter()
                .map(|measurement| JsonMeasurement {
                    agent: measurement.frame.agent,
                    epoch: Id64(measurement.frame.epoch),
                    sequence: Id64(measurement.frame.sequence),
                    index: measurement.index,
                })
                .collect(),
        }
    }
}

impl From<JsonObject> for FusedObject {
    fn from(json: JsonObject) -> Self {
        let mut object = Self {
            track: TrackId(json.track.0),
            class: json.class,
            class_probabilities: json.class_probabilities,
            class_conflict: json.class_conflict,
            bev: BevBox { x: json.x, y: json.y, w: json.w, d: json.d, yaw: wrap_angle(json.yaw) },
            velocity: (json.vx, json.vy),
            kinematic_covariance: json.kinematic_covariance,
            ww: json.sigma.w * json.sigma.w,
            dd: json.sigma.d * json.sigma.d,
            yaw_variance: json.sigma.yaw * json.sigma.yaw,
            heading: json.heading,
            existence: json.existence,
            age: Span::from_micros(json.age_us),
            last_measured_at: json.last_measured_at.0,
            contributors: json
                .contributors
                .into_iter()
                .map(|measurement| MeasurementId {
                    frame: FrameId {
                        agent: measurement.agent,
                        epoch: measurement.epoch.0,
                        sequence: measurement.sequence.0,
                    },
                    index: measurement.index,
                })
                .collect(),
        };
        object.class_probabilities = object.classes().collect();
        object
    }
}

/// JSON cannot represent a number that is not finite; the root of a negative variance is not a number.
pub(in crate::wire::json) fn check_finite(object: &FusedObject) -> Result<(), WireError> {
    let FusedObject { bev, velocity, .. } = object;
    let fields = [
        ("x", bev.x),
        ("y", bev.y),
        ("w", bev.w),
        ("d", bev.d),
        ("yaw", bev.yaw),
        ("vx", velocity.0),
        ("vy", velocity.1),
        ("sigma.w", libm::sqrt(object.ww)),
        ("sigma.d", libm::sqrt(object.dd)),
        ("sigma.yaw", libm::sqrt(object.yaw_variance)),
        ("existence", object.existence),
        ("class conflict", object.class_conflict),
    ];
    let variances = KINEMATIC_DIAGONAL.map(|place| object.kinematic_covariance[place]);
    let sigmas = variances.map(|variance| ("sigma", libm::sqrt(variance)));
    let covariance = object.kinematic_covariance.iter().map(|value| ("kinematic covariance", *value));
    let classes = object.class_probabilities.iter().map(|(_, value)| ("class probability", *value));
    match fields
        .into_iter()
        .chain(sigmas)
        .chain(covariance)
        .chain(classes)
        .find(|(_, value)| !value.is_finite())
    {
        Some((field, value)) => Err(WireError::NotEncodable { field, value }),
        None => Ok(()),
    }
}
