//! How an agent writes its frames, where that is not as this project does: frame of coordinates, headings, order of sizes,
//! names of classes, clock. A receiver that knows this converts what it reads.

use crate::class::Class;
use crate::covariance::{Covariance2, Velocity};
use crate::detection::{Detection, DetectionFrame};
use crate::geometry::{Pose, wrap_angle};
use crate::tile::{Geodetic, LocalPlane};
use crate::time::Span;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt;

/// The conventions of one agent. The default ones are this project's own, and change no bit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Conventions {
    /// Where positions, headings and velocities are given.
    pub frame: CoordinateFrame,
    /// How headings are given.
    pub yaw: YawConvention,
    /// Whether `w` is along the heading, and `d` across it.
    pub sizes_swapped: bool,
    /// The agent's own names of classes, as it writes them.
    pub classes: BTreeMap<String, Class>,
    /// What its clock is behind: it is added to capture times.
    pub time_offset: Span,
}

/// Where positions, headings and velocities are given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum CoordinateFrame {
    /// In the map frame.
    #[default]
    Map,
    /// From a sensor at this pose: x ahead, y to the left.
    Sensor(Pose),
    /// From the agent, whose pose in the map frame is in each frame: x ahead, y to the left.
    Ego,
    /// Of positions: x is the longitude and y the latitude in degrees (WGS84); headings and velocities are in the map frame, which
    /// is the tangent plane of the earth at its origin.
    Geodetic(LocalPlane),
    /// The same, but x is the latitude and y the longitude.
    LatitudeFirst(LocalPlane),
}

/// How headings are given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct YawConvention {
    /// The unit.
    pub unit: AngleUnit,
    /// Which direction is 0.
    pub from: YawOrigin,
    /// In which direction headings grow.
    pub turn: TurnDirection,
}

/// The unit of headings, and of their standard deviations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AngleUnit {
    /// Radians.
    #[default]
    Rad,
    /// Degrees.
    Deg,
}

/// The direction whose heading is 0; in a sensor's or an agent's own frame east is ahead, and north is to the left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum YawOrigin {
    /// The x axis.
    #[default]
    East,
    /// The y axis.
    North,
}

/// In which direction headings grow, seen from above.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TurnDirection {
    /// Counter-clockwise.
    #[default]
    Ccw,
    /// Clockwise.
    Cw,
}

impl AngleUnit {
    /// An angle of this unit in radians.
    fn radians(self, angle: f64) -> f64 {
        match self {
            Self::Rad => angle,
            Self::Deg => angle * (PI / 180.0),
        }
    }
}

impl YawConvention {
    /// A heading in radians, counter-clockwise from the x axis; not wrapped.
    fn radians(self, yaw: f64) -> f64 {
        let turned = match self.turn {
            TurnDirection::Ccw => self.unit.radians(yaw),
            TurnDirection::Cw => -self.unit.radians(yaw),
        };
        match self.from {
            YawOrigin::East => turned,
            YawOrigin::North => FRAC_PI_2 + turned,
        }
    }
}

/// Why a frame cannot be converted.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum UnfitPose {
    /// Its positions are relative to its agent's pose, and it has none.
    #[error(
        "the frame has no sensor_pose, and by the hub's settings its positions are relative to that (frame = \"ego\")"
    )]
    Missing,
    /// Its pose is no place near the origin.
    #[error("sensor_pose: {0}")]
    OffOrigin(OffOrigin),
}

/// A position that should be a longitude and a latitude near an origin, and is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OffOrigin {
    /// x and y as they were written.
    pub written: [f64; 2],
    /// Whether they are a place near the origin the other way round.
    pub is_exchanged: bool,
    /// Where the origin is.
    pub origin: Geodetic,
    /// Whether x is read as the latitude.
    pub latitude_first: bool,
}

impl fmt::Display for OffOrigin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            written: [x, y],
            is_exchanged,
            origin: Geodetic { latitude_deg, longitude_deg },
            latitude_first,
        } = self;
        let read_as = if *latitude_first { "latitude, longitude" } else { "longitude, latitude" };
        write!(
            f,
            "x {x}, y {y} (read as {read_as}, in degrees) is not within 200 km of the origin (latitude {latitude_deg:.5}, \
             longitude {longitude_deg:.5})"
        )?;
        if *is_exchanged {
            f.write_str(", and is the other way round: longitude and latitude are exchanged")
        } else {
            Ok(())
        }
    }
}

impl CoordinateFrame {
    /// The plane of longitudes and latitudes, and whether x is the latitude.
    const fn plane(&self) -> Option<(&LocalPlane, bool)> {
        match self {
            Self::Geodetic(plane) => Some((plane, false)),
            Self::LatitudeFirst(plane) => Some((plane, true)),
            Self::Map | Self::Sensor(_) | Self::Ego => None,
        }
    }

    /// What is wrong with a position as it is written; `None` of one near the origin, of what is no number, and in other frames.
    pub fn off_origin(&self, written: [f64; 2]) -> Option<OffOrigin> {
        let (plane, latitude_first) = self.plane()?;
        let is_place = |[x, y]: [f64; 2]| {
            let (longitude, latitude) = if latitude_first { (y, x) } else { (x, y) };
            local(plane, longitude, latitude).0.is_finite()
        };
        if !written.iter().all(|one| one.is_finite()) || is_place(written) {
            return None;
        }
        let is_exchanged = is_place([written[1], written[0]]);
        Some(OffOrigin { written, is_exchanged, origin: plane.geodetic(0.0, 0.0), latitude_first })
    }

    /// The point of a position as it is written, where that is a longitude and a latitude, m.
    fn of_degrees(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let (plane, latitude_first) = self.plane()?;
        Some(if latitude_first { local(plane, y, x) } else { local(plane, x, y) })
    }
}

impl Conventions {
    /// The class of a name.
    pub fn class(&self, name: &str) -> Option<Class> {
        self.classes.get(name).copied().or_else(|| Class::from_name(name))
    }

    /// Converts a frame that was written by them.
    ///
    /// # Errors
    /// Where positions are relative to a pose that is not there, or the pose is no place; the frame is as before then.
    pub fn convert(&self, frame: &mut DetectionFrame) -> Result<(), UnfitPose> {
        let conversion = self.conversion(frame.sensor_pose)?;
        frame.sensor_pose = conversion.sensor_pose();
        frame.captured_at += self.time_offset;
        for detection in &mut frame.detections {
            let Detection { bev, covariance, .. } = detection;
            (bev.w, bev.d) = conversion.sizes(bev.w, bev.d);
            (covariance.ww, covariance.dd) = conversion.sizes(covariance.ww, covariance.dd);
            covariance.yaw *= conversion.sigma_yaw(1.0) * conversion.sigma_yaw(1.0);
            conversion.apply(detection);
        }
        Ok(())
    }

    /// How the numbers of one frame are converted; `pose` is the sensor's pose as the frame gives it.
    ///
    /// # Errors
    /// Where positions are relative to a pose that is not there, or the pose is no place.
    pub fn conversion(&self, pose: Option<Pose>) -> Result<Conversion<'_>, UnfitPose> {
        if let Some(off) = pose.and_then(|pose| self.frame.off_origin([pose.x, pose.y])) {
            return Err(UnfitPose::OffOrigin(off));
        }
        let pose = pose.map(|Pose { x, y, yaw }| {
            let (x, y) = self.frame.of_degrees(x, y).unwrap_or((x, y));
            Pose { x, y, yaw: wrap_angle(self.yaw.radians(yaw)) }
        });
        let (sensor, carrier) = match self.frame {
            CoordinateFrame::Map | CoordinateFrame::Geodetic(_) | CoordinateFrame::LatitudeFirst(_) => {
                (pose, None)
            }
            CoordinateFrame::Sensor(sensor) => (Some(sensor), Some(sensor)),
            CoordinateFrame::Ego => (Some(pose.ok_or(UnfitPose::Missing)?), pose),
        };
        Ok(Conversion { conventions: self, sensor, carrier })
    }
}

/// The conversion of one frame's numbers.
#[derive(Clone, Copy, Debug)]
pub struct Conversion<'a> {
    conventions: &'a Conventions,
    sensor: Option<Pose>,
    /// What positions are relative to; `None` for the map.
    carrier: Option<Pose>,
}

impl Conversion<'_> {
    /// The sensor's pose in the map frame.
    pub const fn sensor_pose(&self) -> Option<Pose> {
        self.sensor
    }

    /// A heading as it was given in radians, before whole turns are taken away.
    pub fn heading(&self, yaw: f64) -> f64 {
        self.conventions.yaw.unit.radians(yaw)
    }

    /// The heading in the map frame, rad, if it were given in degrees in place of radians, or in radians in place of degrees.
    pub fn heading_in_other_unit(&self, yaw: f64) -> f64 {
        let unit = match self.conventions.yaw.unit {
            AngleUnit::Rad => AngleUnit::Deg,
            AngleUnit::Deg => AngleUnit::Rad,
        };
        let convention = YawConvention { unit, ..self.conventions.yaw };
        wrap_angle(convention.radians(yaw) + self.carrier.map_or(0.0, |carrier| carrier.yaw))
    }

    /// A standard deviation of a heading, rad.
    pub fn sigma_yaw(&self, sigma: f64) -> f64 {
        self.conventions.yaw.unit.radians(sigma)
    }

    /// Width (across the heading) and depth (along it) of what the agent calls `w` and `d`.
    pub fn sizes<T>(&self, w: T, d: T) -> (T, T) {
        if self.conventions.sizes_swapped { (d, w) } else { (w, d) }
    }

    /// Distance of a position as it was given from the sensor, m; `None` where the sensor's place is not known.
    pub fn range_m(&self, x: f64, y: f64) -> Option<f64> {
        let (x, y) = self.point(x, y);
        self.sensor.map(|sensor| sensor.distance_to(x, y))
    }

    fn point(&self, x: f64, y: f64) -> (f64, f64) {
        let in_degrees = self.conventions.frame.of_degrees(x, y);
        in_degrees.unwrap_or_else(|| self.carrier.map_or((x, y), |carrier| carrier.offset(x, y)))
    }

    /// Brings position, heading, velocity and their covariances into the map frame. Sizes and the variance of the heading are
    /// taken as they are: see [`Self::sizes`] and [`Self::sigma_yaw`].
    pub fn apply(&self, detection: &mut Detection) {
        let bev = &mut detection.bev;
        (bev.x, bev.y) = self.point(bev.x, bev.y);
        let turned_by = self.carrier.map_or(0.0, |carrier| carrier.yaw);
        bev.yaw = wrap_angle(self.conventions.yaw.radians(bev.yaw) + turned_by);
        let Some(carrier) = self.carrier else { return };
        let covariance = &mut detection.covariance.position;
        *covariance = turned_covariance(covariance, carrier.yaw);
        if let Some(Velocity { x, y, covariance }) = &mut detection.velocity {
            (*x, *y) = Pose { x: 0.0, y: 0.0, yaw: carrier.yaw }.offset(*x, *y);
            *covariance = turned_covariance(covariance, carrier.yaw);
        }
    }
}

/// A place further away is a mistake, such as latitude and longitude the wrong way round; the plane leaves the earth there.
const NEAR_ENOUGH_M: f64 = 200_000.0;

/// The point of the plane at a longitude and a latitude, m; no number where they are no place near its origin, so that the
/// detection is dropped and counted.
fn local(plane: &LocalPlane, longitude_deg: f64, latitude_deg: f64) -> (f64, f64) {
    let is_place = latitude_deg.abs() <= 90.0 && longitude_deg.abs() <= 180.0;
    let place = Geodetic { latitude_deg, longitude_deg };
    if is_place && plane.distance_m(place) <= NEAR_ENOUGH_M {
        plane.local(place)
    } else {
        (f64::NAN, f64::NAN)
    }
}

/// R C Rᵀ for a turn by an angle (rad).
fn turned_covariance(covariance: &Covariance2, by: f64) -> Covariance2 {
    let (sin, cos) = libm::sincos(by);
    let Covariance2 { xx, xy, yy } = *covariance;
    Covariance2 {
        xx: cos * cos * xx - 2.0 * sin * cos * xy + sin * sin * yy,
        xy: sin * cos * (xx - yy) + (cos * cos - sin * sin) * xy,
        yy: sin * sin * xx + 2.0 * sin * cos * xy + cos * cos * yy,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::covariance::BoxCovariance;
    use crate::detection::HeadingKind;
    use crate::geometry::BevBox;

    fn detection(x: f64, y: f64, yaw: f64) -> Detection {
        Detection {
            class: Class::Car,
            score: 1.0,
            bev: BevBox { x, y, w: 2.0, d: 4.0, yaw },
            covariance: BoxCovariance {
                position: Covariance2 { xx: 4.0, xy: 0.0, yy: 1.0 },
                ww: 0.1,
                dd: 0.1,
                yaw: 0.01,
            },
            velocity: Some(Velocity {
                x: 3.0,
                y: 0.0,
                covariance: Covariance2 { xx: 4.0, xy: 0.0, yy: 1.0 },
            }),
            heading: HeadingKind::Known,
            source_track: None,
        }
    }

    fn converted(conventions: &Conventions, pose: Option<Pose>, mut detection: Detection) -> Detection {
        conventions.conversion(pose).unwrap().apply(&mut detection);
        detection
    }

    fn assert_near(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-9, "{found}, not {expected}");
    }

    #[test]
    fn our_own_conventions_change_no_bit() {
        let before = detection(123.456, -7.9, 2.1);
        let pose = Some(Pose { x: 1.0, y: 2.0, yaw: 0.3 });
        assert_eq!(converted(&Conventions::default(), pose, before), before);
        assert_eq!(Conventions::default().conversion(pose).unwrap().sensor_pose(), pose);
    }

    #[test]
    fn degrees_clockwise_from_north_are_headings() {
        let yaw = YawConvention { unit: AngleUnit::Deg, from: YawOrigin::North, turn: TurnDirection::Cw };
        let conventions = Conventions { yaw, ..Conventions::default() };
        // Compass: north, east, south, west.
        for (compass, expected) in [(0.0, FRAC_PI_2), (90.0, 0.0), (180.0, -FRAC_PI_2), (270.0, PI)] {
            assert_near(converted(&conventions, None, detection(0.0, 0.0, compass)).bev.yaw, expected);
        }
        assert_near(conventions.conversion(None).unwrap().sigma_yaw(180.0), PI);
    }

    #[test]
    fn what_a_sensor_sees_ahead_lies_in_the_direction_in_which_it_looks() {
        // At (100, 50), looking north: 10 m ahead and 2 m to the left is (98, 60).
        let pose = Pose { x: 100.0, y: 50.0, yaw: FRAC_PI_2 };
        let fixed = Conventions { frame: CoordinateFrame::Sensor(pose), ..Conventions::default() };
        let carried = Conventions { frame: CoordinateFrame::Ego, ..Conventions::default() };
        for (conventions, given) in [(&fixed, None), (&carried, Some(pose))] {
            let Detection { bev, covariance, velocity, .. } =
                converted(conventions, given, detection(10.0, 2.0, 0.0));
            assert_near(bev.x, 98.0);
            assert_near(bev.y, 60.0);
            assert_near(bev.yaw, FRAC_PI_2);
            let velocity = velocity.unwrap();
            assert_near(velocity.y, 3.0);
            for turned in [covariance.position, velocity.covariance] {
                assert_near(turned.xx, 1.0);
                assert_near(turned.yy, 4.0);
                assert_near(turned.xy, 0.0);
            }
            assert_eq!(conventions.conversion(given).unwrap().sensor_pose(), Some(pose));
        }
        assert_eq!(carried.conversion(None).err(), Some(UnfitPose::Missing));
    }

    #[test]
    fn a_whole_frame_is_converted_with_its_time_pose_and_sizes() {
        let agent = crate::id::AgentId::new("cam").unwrap();
        let id = crate::id::FrameId { agent, epoch: 1, sequence: 1 };
        let mut frame = DetectionFrame::empty(id, crate::time::Timestamp::EPOCH);
        frame.detections.push(detection(10.0, 2.0, 90.0));
        let conventions = Conventions {
            frame: CoordinateFrame::Sensor(Pose { x: 1.0, y: 1.0, yaw: 0.0 }),
            yaw: YawConvention { unit: AngleUnit::Deg, ..YawConvention::default() },
            sizes_swapped: true,
            time_offset: Span::from_millis(300),
            ..Conventions::default()
        };
        conventions.convert(&mut frame).unwrap();
        assert_eq!(frame.captured_at - crate::time::Timestamp::EPOCH, Span::from_millis(300));
        let Detection { bev, covariance, .. } = frame.detections[0];
        assert_eq!((bev.x, bev.y, bev.w, bev.d), (11.0, 3.0, 4.0, 2.0));
        assert_near(bev.yaw, FRAC_PI_2);
        assert_near(covariance.yaw, 0.01 * (PI / 180.0) * (PI / 180.0));
        let carried = Conventions { frame: CoordinateFrame::Ego, ..Conventions::default() };
        let mut without = DetectionFrame::empty(id, crate::time::Timestamp::EPOCH);
        assert_eq!(carried.convert(&mut without), Err(UnfitPose::Missing));
    }

    #[test]
    fn longitude_and_latitude_become_metres_east_and_north_of_the_origin() {
        let origin = Geodetic { latitude_deg: 48.137, longitude_deg: 11.575 };
        let frame = CoordinateFrame::Geodetic(LocalPlane::new(origin));
        let conventions = Conventions { frame, ..Conventions::default() };
        let at = converted(&conventions, None, detection(11.575, 48.138, 0.5)).bev;
        // A thousandth of a degree of latitude at 48° is 111.2 m.
        assert!(at.x.abs() < 1e-6 && (at.y - 111.2).abs() < 0.1 && at.yaw == 0.5, "{at:?}");
    }

    #[test]
    fn exchanged_longitudes_and_latitudes_are_told_from_other_places_and_can_be_read() {
        let plane = LocalPlane::new(Geodetic { latitude_deg: 48.137, longitude_deg: 11.575 });
        let frame = CoordinateFrame::Geodetic(plane);
        let exchanged = |frame: &CoordinateFrame, at| frame.off_origin(at).map(|off| off.is_exchanged);
        assert_eq!(exchanged(&frame, [11.575, 48.138]), None);
        assert_eq!(exchanged(&frame, [48.138, 11.575]), Some(true));
        assert_eq!(exchanged(&frame, [311.0, 200.0]), Some(false));
        assert_eq!(exchanged(&CoordinateFrame::Map, [48.138, 11.575]), None);
        let conventions = Conventions { frame, ..Conventions::default() };
        let wrong = conventions.conversion(Some(Pose { x: 48.138, y: 11.575, yaw: 0.0 }));
        assert!(wrong.unwrap_err().to_string().contains("are exchanged"));
        let frame = CoordinateFrame::LatitudeFirst(plane);
        assert_eq!(exchanged(&frame, [48.138, 11.575]), None);
        let conventions = Conventions { frame, ..Conventions::default() };
        let at = converted(&conventions, None, detection(48.138, 11.575, 0.5)).bev;
        assert!(at.x.abs() < 1e-6 && (at.y - 111.2).abs() < 0.1, "{at:?}");
    }

    #[test]
    fn what_is_no_place_near_the_origin_is_dropped_and_not_taken_for_one() {
        let plane = LocalPlane::new(Geodetic { latitude_deg: 48.137, longitude_deg: 11.575 });
        let conventions = Conventions { frame: CoordinateFrame::Geodetic(plane), ..Conventions::default() };
        // The wrong way round; metres; on the other side of the earth, which is below the origin; no numbers.
        let wrong =
            [(48.137, 11.575), (311.0, 200.0), (-168.425, -48.137), (f64::NAN, 48.0), (f64::INFINITY, 48.0)];
        for (x, y) in wrong {
            let found = converted(&conventions, None, detection(x, y, 0.0));
            assert!(found.validate(None).is_err(), "{x} {y} became {:?}", found.bev);
        }
    }

    #[test]
    fn a_covariance_that_is_turned_there_and_back_is_the_same() {
        let covariance = Covariance2 { xx: 3.0, xy: 0.7, yy: 1.0 };
        let back = turned_covariance(&turned_covariance(&covariance, 0.8), -0.8);
        assert_near(back.xx, covariance.xx);
        assert_near(back.xy, covariance.xy);
        assert_near(back.yy, covariance.yy);
    }
}
