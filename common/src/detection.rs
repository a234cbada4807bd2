//! What an agent saw: detections, and the frame that carries them.

use crate::class::Class;
use crate::covariance::{BoxCovariance, Velocity};
use crate::geometry::{BevBox, Pose};
use crate::id::{FrameId, MapFrame};
use crate::time::Timestamp;

/// Most detections in one frame.
pub const MAX_DETECTIONS: usize = 4096;
/// Farthest that a detection may lie from its sensor along one axis, m.
pub const MAX_RANGE_M: f64 = 10_000.0;
/// Largest coordinate in the map frame, m.
pub const MAX_COORDINATE_M: f64 = 1e8;
const AT_MOST_COORDINATE: &str = "at most 1e8 m";
/// What differences of large coordinates may be off by, m.
const ROUNDING_M: f64 = 1e-6;
/// Largest width or depth, m.
pub const MAX_SIZE_M: f64 = 65.0;
/// Smallest width or depth, m.
pub const MIN_SIZE_M: f64 = 0.001;
/// Smallest variance of anything, m², rad² or m²/s²: nobody measures to 10 µm.
pub const MIN_VARIANCE: f64 = 1e-10;
/// Largest standard deviation of a position or a size, m.
pub const MAX_SIGMA_M: f64 = 70.0;
/// Largest standard deviation of a heading, rad (beyond it a heading says nothing).
pub const MAX_SIGMA_YAW_RAD: f64 = 7.0;
/// Largest heading, rad: half a turn, and what its rounding may add.
const MAX_YAW_RAD: f64 = std::f64::consts::PI + 1e-9;
/// Largest reported speed along one axis, m/s.
pub const MAX_SPEED_MPS: f64 = 150.0;

/// One object as one sensor saw it at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// What it looked like.
    pub class: Class,
    /// The detector's confidence, 0 to 1.
    pub score: f64,
    /// Where, how large, and which way, in the map frame.
    pub bev: BevBox,
    /// What the detector knows of its own error.
    pub covariance: BoxCovariance,
    /// Measured velocity, where the sensor has one.
    pub velocity: Option<Velocity>,
    /// The sender's track number: with it this is a filtered track, without it a raw detection.
    pub source_track: Option<u64>,
}

/// All that one sensor saw at one time. The order of detections means nothing; none at all means
/// "nothing seen".
#[derive(Clone, Debug, PartialEq)]
pub struct DetectionFrame {
    /// Sender and number.
    pub id: FrameId,
    /// When it was measured, by the sender's clock: untrusted.
    pub captured_at: Timestamp,
    /// Where the sensor was then.
    pub sensor_pose: Option<Pose>,
    /// Under which revision of the sensor description it was made; 0 where there is none.
    pub sensor_revision: u32,
    /// The coordinate frame of all positions; unnamed means the hub's.
    pub map_frame: Option<MapFrame>,
    /// What was seen.
    pub detections: Vec<Detection>,
}

/// A value in a frame that cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{field}{} is {value}, expected {expected}", .index.map(|i| format!(" of detection {i}")).unwrap_or_default())]
pub struct AbsurdValue {
    /// The field's name.
    pub field: &'static str,
    /// In which detection of the frame, where it is of one.
    pub index: Option<usize>,
    /// What it holds.
    pub value: f64,
    /// What it may hold.
    pub expected: &'static str,
}

impl Detection {
    /// Checks every number against the limits of this module; `origin` is the sensor's position, where known.
    #[inline]
    pub fn validate(&self, origin: Option<&Pose>) -> Result<(), AbsurdValue> {
        let is_valid = self.check_each(origin, |_, _, ok, _| if ok { Ok(()) } else { Err(()) }).is_ok();
        if is_valid { Ok(()) } else { self.find_absurd(origin) }
    }

    /// The first number that cannot be. Apart from the check without names, which nearly always is enough.
    #[cold]
    fn find_absurd(&self, origin: Option<&Pose>) -> Result<(), AbsurdValue> {
        self.check_each(origin, check)
    }

    /// Calls `check` with name, value, whether that is within its limits, and these.
    #[inline]
    fn check_each<E>(
        &self,
        origin: Option<&Pose>,
        check: impl Fn(&'static str, f64, bool, &'static str) -> Result<(), E>,
    ) -> Result<(), E> {
        let bev = &self.bev;
        let (x, y, reach_m, expected) = match origin {
            Some(pose) => (pose.x, pose.y, MAX_RANGE_M + ROUNDING_M, "within 10 km of the sensor"),
            None => (0.0, 0.0, MAX_COORDINATE_M, AT_MOST_COORDINATE),
        };
        check("x", bev.x, (bev.x - x).abs() <= reach_m, expected)?;
        check("y", bev.y, (bev.y - y).abs() <= reach_m, expected)?;
        let size = MIN_SIZE_M..=MAX_SIZE_M;
        check("w", bev.w, size.contains(&bev.w), "0.001 to 65 m")?;
        check("d", bev.d, size.contains(&bev.d), "0.001 to 65 m")?;
        check("yaw", bev.yaw, bev.yaw.abs() <= MAX_YAW_RAD, "-π to π")?;
        check("score", self.score, (0.0..=1.0).contains(&self.score), "0 to 1")?;
        let (variance_m2, expected) = (MAX_SIGMA_M * MAX_SIGMA_M, "1e-10 to 4900 m²");
        let in_range = |variance: f64, limit: f64| variance >= MIN_VARIANCE && variance <= limit;
        let BoxCovariance { position, ww, dd, yaw } = self.covariance;
        check("variance of x", position.xx, in_range(position.xx, variance_m2), expected)?;
        check("variance of y", position.yy, in_range(position.yy, variance_m2), expected)?;
        let is_definite = position.determinant() > 0.0;
        check("covariance of x and y", position.xy, is_definite, "positive definite with the variances")?;
        check("variance of w", ww, in_range(ww, variance_m2), expected)?;
        check("variance of d", dd, in_range(dd, variance_m2), expected)?;
        let yaw_limit = MAX_SIGMA_YAW_RAD * MAX_SIGMA_YAW_RAD;
        check("variance of yaw", yaw, in_range(yaw, yaw_limit), "1e-10 to 49 rad²")?;
        if let Some(velocity) = &self.velocity {
            check("velocity x", velocity.x, velocity.x.abs() <= MAX_SPEED_MPS, "at most 150 m/s")?;
            check("velocity y", velocity.y, velocity.y.abs() <= MAX_SPEED_MPS, "at most 150 m/s")?;
            let covariance = &velocity.covariance;
            let is_sure = covariance.xx.min(covariance.yy) < MIN_VARIANCE;
            let ok = covariance.is_valid() && !is_sure && covariance.max_sigma() <= MAX_SIGMA_M;
            check("velocity covariance", covariance.xx, ok, "positive definite, at most 70 m/s")?;
        }
        Ok(())
    }
}

impl DetectionFrame {
    /// A frame that saw nothing, from a sensor that is not described.
    pub const fn empty(id: FrameId, captured_at: Timestamp) -> Self {
        Self {
            id,
            captured_at,
            sensor_pose: None,
            sensor_revision: 0,
            map_frame: None,
            detections: Vec::new(),
        }
    }

    /// Checks every number of the frame; the error names the field and the detection.
    pub fn validate(&self) -> Result<(), AbsurdValue> {
        let count = self.detections.len();
        #[expect(clippy::cast_precision_loss, reason = "only printed")]
        check("number of detections", count as f64, count <= MAX_DETECTIONS, "at most 4096")?;
        validate_pose(self.sensor_pose.as_ref())?;
        validate_all(&self.detections, self.sensor_pose.as_ref())
    }
}

/// Checks a sensor's pose, where there is one.
pub(crate) fn validate_pose(pose: Option<&Pose>) -> Result<(), AbsurdValue> {
    let Some(pose) = pose else { return Ok(()) };
    check("sensor_pose.x", pose.x, pose.x.abs() <= MAX_COORDINATE_M, AT_MOST_COORDINATE)?;
    check("sensor_pose.y", pose.y, pose.y.abs() <= MAX_COORDINATE_M, AT_MOST_COORDINATE)?;
    check("sensor_pose.yaw", pose.yaw, pose.yaw.abs() <= MAX_YAW_RAD, "-π to π")
}

/// Checks all detections of a sensor at `origin`, where that is known.
pub(crate) fn validate_all(detections: &[Detection], origin: Option<&Pose>) -> Result<(), AbsurdValue> {
    for (index, detection) in detections.iter().enumerate() {
        detection.validate(origin).map_err(|absurd| AbsurdValue { index: Some(index), ..absurd })?;
    }
    Ok(())
}

/// `ok` must not hold of what is not finite.
fn check(field: &'static str, value: f64, ok: bool, expected: &'static str) -> Result<(), AbsurdValue> {
    debug_assert!(value.is_finite() || !ok, "{field} = {value} was let pass");
    if ok { Ok(()) } else { Err(AbsurdValue { field, index: None, value, expected }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::covariance::Covariance2;

    fn detection() -> Detection {
        Detection {
            class: Class::Car,
            score: 1.0,
            bev: BevBox { x: 1.0, y: 2.0, w: 1.8, d: 4.5, yaw: 0.3 },
            covariance: BoxCovariance { position: Covariance2::isotropic(0.3), ww: 0.1, dd: 0.1, yaw: 0.01 },
            velocity: None,
            source_track: None,
        }
    }

    #[test]
    fn every_absurd_number_is_named() {
        type Spoil = fn(&mut Detection);
        let cases: [(&str, Spoil); 6] = [
            ("x", |d| d.bev.x = f64::NAN),
            ("y", |d| d.bev.y = 2e4),
            ("w", |d| d.bev.w = 0.0),
            ("yaw", |d| d.bev.yaw = 4.0),
            ("covariance of x and y", |d| d.covariance.position.xy = 1.0),
            ("variance of yaw", |d| d.covariance.yaw = f64::INFINITY),
        ];
        for (field, spoil) in cases {
            let mut bad = detection();
            spoil(&mut bad);
            assert_eq!(bad.validate(Some(&Pose::default())).unwrap_err().field, field);
        }
        assert_eq!(detection().validate(None), Ok(()));
        let mut nowhere = detection();
        nowhere.bev.x = 1e300;
        assert_eq!(nowhere.validate(None).unwrap_err().field, "x");
    }
}
