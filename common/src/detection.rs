//! What an agent detected: detections, and the frame that contains them.

use crate::class::Class;
use crate::covariance::{BoxCovariance, Covariance2, Velocity};
use crate::geometry::{BevBox, Pose};
pub use crate::heading::HeadingKind;
use crate::id::{FrameId, MapFrame};
use crate::time::Timestamp;

/// Most detections in one frame.
pub const MAX_DETECTIONS: usize = 4096;
/// Largest distance of a detection from its sensor along one axis, m.
pub const MAX_RANGE_M: f64 = 10_000.0;
/// Largest coordinate in the map frame, m.
pub const MAX_COORDINATE_M: f64 = 1e8;
const AT_MOST_COORDINATE: &str = "at most 1e8 m";
/// Rounding error of differences of large coordinates, m.
const ROUNDING_M: f64 = 1e-6;
/// Largest width or depth, m.
pub const MAX_SIZE_M: f64 = 65.0;
/// Smallest width or depth, m.
pub const MIN_SIZE_M: f64 = 0.001;
/// Smallest variance, m², rad² or m²/s²: no sensor measures to 10 µm.
pub const MIN_VARIANCE: f64 = 1e-10;
/// Largest standard deviation of a position or a size, m.
pub const MAX_SIGMA_M: f64 = 70.0;
/// Largest standard deviation of a heading, rad (a uniform heading has 1.8 rad).
pub const MAX_SIGMA_YAW_RAD: f64 = 7.0;
/// Largest heading, rad: half a turn, and a margin for rounding.
const MAX_YAW_RAD: f64 = std::f64::consts::PI + 1e-9;
/// Largest reported speed along one axis, m/s.
pub const MAX_SPEED_MPS: f64 = 150.0;

/// One object as one sensor reports it at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// Its class by the detector.
    pub class: Class,
    /// The detector's confidence, 0 to 1.
    pub score: f64,
    /// Position, size and heading in the map frame.
    pub bev: BevBox,
    /// Covariance of the box as the detector declares it.
    pub covariance: BoxCovariance,
    /// Measured velocity, where the sensor measures it.
    pub velocity: Option<Velocity>,
    /// What is known of the heading.
    pub heading: HeadingKind,
    /// The sender's track number: with it this is the state of a filtered track, without it a raw detection.
    pub source_track: Option<u64>,
}

/// All detections of one sensor at one time. Their order has no meaning; an empty frame says that the sensor detected
/// nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct DetectionFrame {
    /// Sender and number.
    pub id: FrameId,
    /// Time of capture by the sender's clock; not trusted.
    pub captured_at: Timestamp,
    /// Pose of the sensor at that time, in the map frame.
    pub sensor_pose: Option<Pose>,
    /// Revision of the sensor description that holds for it; 0 where there is none.
    pub sensor_revision: u32,
    /// The coordinate frame of all positions; `None`: the hub's.
    pub map_frame: Option<MapFrame>,
    /// The detections.
    pub detections: Vec<Detection>,
}

/// A number in a frame that is not finite or outside of its limits.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{field}{} is {value}, expected {expected}", .index.map(|i| format!(" of detection {i}")).unwrap_or_default())]
pub struct InvalidValue {
    /// The field's name.
    pub field: &'static str,
    /// The detection's index in the frame; `None` for a value of the frame itself.
    pub index: Option<usize>,
    /// The value found, in SI units.
    pub value: f64,
    /// The allowed range, with its unit.
    pub expected: &'static str,
}

impl InvalidValue {
    /// The cause in two words, for counting beside the field's name.
    pub const fn cause(&self) -> &'static str {
        if self.value.is_finite() { "out of range" } else { "not finite" }
    }
}

impl Detection {
    /// Checks every number against the limits of this module.
    ///
    /// `origin` is the sensor's pose, where it is known: positions are then limited by the range from it, not by
    /// the size of the map. The error's `index` is `None`.
    #[inline]
    pub fn validate(&self, origin: Option<&Pose>) -> Result<(), InvalidValue> {
        let is_valid = self.check_each(origin, |_, _, ok, _| if ok { Ok(()) } else { Err(()) }).is_ok();
        if is_valid { Ok(()) } else { self.find_invalid(origin) }
    }

    /// The first invalid number. Apart from the check without names, which is the fast and usual one.
    #[cold]
    fn find_invalid(&self, origin: Option<&Pose>) -> Result<(), InvalidValue> {
        self.check_each(origin, check)
    }

    /// Calls `check` with each field's name, its value, whether that is valid, and the allowed range.
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
            let (Covariance2 { xx, yy, xy }, expected) = (velocity.covariance, "1e-10 to 4900 m²/s²");
            check("variance of velocity x", xx, in_range(xx, variance_m2), expected)?;
            check("variance of velocity y", yy, in_range(yy, variance_m2), expected)?;
            let is_definite = velocity.covariance.determinant() > 0.0;
            check("covariance of the velocity", xy, is_definite, "positive definite with the variances")?;
        }
        Ok(())
    }
}

impl DetectionFrame {
    /// A frame without detections, of a sensor without description.
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

    /// Checks every number against the limits of this module: finite, in range, covariances positive definite,
    /// headings in [-π, π], at most [`MAX_DETECTIONS`] detections.
    ///
    /// These are the limits of the wire's decoders: what passes here is as safe as what was decoded. Allocates
    /// nothing. The error is of the first value that fails.
    pub fn validate(&self) -> Result<(), InvalidValue> {
        self.validate_head()?;
        validate_all(&self.detections, self.sensor_pose.as_ref())
    }

    /// Checks what is of the frame and not of one detection: the pose and the number of detections. Without these no
    /// detection of the frame can be used.
    pub fn validate_head(&self) -> Result<(), InvalidValue> {
        let count = self.detections.len();
        #[expect(clippy::cast_precision_loss, reason = "only printed")]
        check("number of detections", count as f64, count <= MAX_DETECTIONS, "at most 4096")?;
        validate_pose(self.sensor_pose.as_ref())
    }
}

/// Checks a sensor's pose, where there is one.
pub(crate) fn validate_pose(pose: Option<&Pose>) -> Result<(), InvalidValue> {
    let Some(pose) = pose else { return Ok(()) };
    check("sensor_pose.x", pose.x, pose.x.abs() <= MAX_COORDINATE_M, AT_MOST_COORDINATE)?;
    check("sensor_pose.y", pose.y, pose.y.abs() <= MAX_COORDINATE_M, AT_MOST_COORDINATE)?;
    check("sensor_pose.yaw", pose.yaw, pose.yaw.abs() <= MAX_YAW_RAD, "-π to π")
}

/// Checks all detections of a sensor at `origin`, where that is known.
pub(crate) fn validate_all(detections: &[Detection], origin: Option<&Pose>) -> Result<(), InvalidValue> {
    for (index, detection) in detections.iter().enumerate() {
        detection.validate(origin).map_err(|invalid| InvalidValue { index: Some(index), ..invalid })?;
    }
    Ok(())
}

/// `ok` must be false for a value that is not finite.
fn check(field: &'static str, value: f64, ok: bool, expected: &'static str) -> Result<(), InvalidValue> {
    debug_assert!(value.is_finite() || !ok, "{field} = {value} was accepted");
    if ok { Ok(()) } else { Err(InvalidValue { field, index: None, value, expected }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::id::AgentId;

    fn detection() -> Detection {
        Detection {
            class: Class::Car,
            score: 1.0,
            bev: BevBox { x: 1.0, y: 2.0, w: 1.8, d: 4.5, yaw: 0.3 },
            covariance: BoxCovariance { position: Covariance2::isotropic(0.3), ww: 0.1, dd: 0.1, yaw: 0.01 },
            velocity: None,
            heading: HeadingKind::Known,
            source_track: None,
        }
    }

    fn frame(detections: Vec<Detection>) -> DetectionFrame {
        let id = FrameId { agent: AgentId::new("a").unwrap(), epoch: 0, sequence: 0 };
        let sensor_pose = Some(Pose::default());
        DetectionFrame { sensor_pose, detections, ..DetectionFrame::empty(id, Timestamp::EPOCH) }
    }

    type Field = (&'static str, fn(&mut Detection) -> &mut f64);
    type PoseField = (&'static str, fn(&mut Pose) -> &mut f64);

    fn velocity(detection: &mut Detection) -> &mut Velocity {
        let at_rest = Velocity { x: 0.0, y: 0.0, covariance: Covariance2::isotropic(0.5) };
        detection.velocity.get_or_insert(at_rest)
    }

    /// Every number of a detection, by the name that errors use.
    const FIELDS: [Field; 17] = [
        ("x", |d| &mut d.bev.x),
        ("y", |d| &mut d.bev.y),
        ("w", |d| &mut d.bev.w),
        ("d", |d| &mut d.bev.d),
        ("yaw", |d| &mut d.bev.yaw),
        ("score", |d| &mut d.score),
        ("variance of x", |d| &mut d.covariance.position.xx),
        ("variance of y", |d| &mut d.covariance.position.yy),
        ("covariance of x and y", |d| &mut d.covariance.position.xy),
        ("variance of w", |d| &mut d.covariance.ww),
        ("variance of d", |d| &mut d.covariance.dd),
        ("variance of yaw", |d| &mut d.covariance.yaw),
        ("velocity x", |d| &mut velocity(d).x),
        ("velocity y", |d| &mut velocity(d).y),
        ("variance of velocity x", |d| &mut velocity(d).covariance.xx),
        ("variance of velocity y", |d| &mut velocity(d).covariance.yy),
        ("covariance of the velocity", |d| &mut velocity(d).covariance.xy),
    ];

    #[test]
    fn a_number_that_is_not_finite_or_too_large_is_refused_by_index_and_name() {
        for (field, of) in FIELDS {
            for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e9, -1e9] {
                let mut bad = detection();
                *of(&mut bad) = value;
                let error = frame(vec![detection(), bad]).validate().unwrap_err();
                assert_eq!((error.field, error.index), (field, Some(1)), "{value}");
                assert_eq!(error.value.to_bits(), value.to_bits());
            }
        }
    }

    #[test]
    fn values_just_beyond_a_limit_are_refused() {
        let cases: [(Field, f64); 8] = [
            (FIELDS[1], 1.001 * MAX_RANGE_M),
            (FIELDS[2], 0.0),
            (FIELDS[3], 1.001 * MAX_SIZE_M),
            (FIELDS[4], 4.0),
            (FIELDS[8], 1.0),
            (FIELDS[9], 0.0),
            (FIELDS[11], 50.0),
            (FIELDS[15], 5000.0),
        ];
        for ((field, of), value) in cases {
            let mut bad = detection();
            *of(&mut bad) = value;
            assert_eq!(bad.validate(Some(&Pose::default())).unwrap_err().field, field);
        }
    }

    #[test]
    fn a_frame_is_checked_as_a_whole() {
        assert_eq!(frame(vec![detection()]).validate(), Ok(()));
        let fields: [PoseField; 3] = [
            ("sensor_pose.x", |pose| &mut pose.x),
            ("sensor_pose.y", |pose| &mut pose.y),
            ("sensor_pose.yaw", |pose| &mut pose.yaw),
        ];
        for (field, of) in fields {
            let mut bad = frame(vec![detection()]);
            *of(bad.sensor_pose.as_mut().unwrap()) = f64::NAN;
            let error = bad.validate().unwrap_err();
            assert_eq!((error.field, error.index), (field, None));
        }
        let too_many = frame(vec![detection(); MAX_DETECTIONS + 1]).validate_head().unwrap_err();
        assert_eq!(too_many.field, "number of detections");
        let mut bad = frame(vec![detection()]);
        bad.detections[0].bev.w = 0.0;
        assert_eq!(bad.validate_head(), Ok(()), "one impossible detection does not spoil the frame");
    }

    #[test]
    fn without_a_sensor_pose_a_position_is_limited_by_the_map() {
        assert_eq!(detection().validate(None), Ok(()));
        let mut far = detection();
        far.bev.x = 1e300;
        assert_eq!(far.validate(None).unwrap_err().field, "x");
    }
}
