//! Changes of one agent's positions that are tried: other axes, the sensor's own frame, another time, a shift, a turn.

use super::{Sighting, Spot};
use std::f64::consts::{FRAC_PI_2, PI};
use v2x_common::geometry::Pose;

/// A change of positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::diagnosis) enum Change {
    /// A small one; none of them where all are zero.
    Rigid(Rigid),
    /// They were given from the sensor's pose.
    FromSensor(Axes),
    /// They were given from the sensor's place, along the axes of the map.
    FromPlace,
    /// The sensor's pose was applied twice.
    PoseTwice,
    /// They were given from the sensor's pose with other axes, and mapped as if with ours.
    AboutSensor(Axes),
    /// They were given with other axes of the map.
    OfMap(Axes),
    /// They were mapped by a pose of the sensor that is wrong.
    PoseIs(WrongPose),
    /// They were given in another unit of length, from the map's origin.
    InUnit(Unit),
    /// They were given from the sensor's pose in another unit of length, and mapped as if in ours.
    InUnitAboutSensor(Unit),
    /// They are so many times as far apart as they are given; they may be shifted as well.
    Scaled(f64),
}

/// How a sensor's pose is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::diagnosis) enum WrongPose {
    /// Its x and y are the wrong way round.
    Exchanged,
    /// Its x and y have the other sign.
    Opposite,
    /// Its x has the other sign.
    XOpposite,
    /// Its y has the other sign.
    YOpposite,
    /// Its heading has the other sign.
    YawOpposite,
    /// Its heading points backwards.
    YawBack,
    /// Its heading counts from north.
    YawFromNorth,
    /// Its heading counts from north and clockwise, as that of a compass.
    YawOfCompass,
}

impl WrongPose {
    /// The pose that is right.
    fn right(self, pose: Pose) -> Pose {
        let Pose { x, y, yaw } = pose;
        match self {
            Self::Exchanged => Pose { x: y, y: x, yaw },
            Self::Opposite => Pose { x: -x, y: -y, yaw },
            Self::XOpposite => Pose { x: -x, y, yaw },
            Self::YOpposite => Pose { x, y: -y, yaw },
            Self::YawOpposite => Pose { x, y, yaw: -yaw },
            Self::YawBack => Pose { x, y, yaw: yaw + PI },
            Self::YawFromNorth => Pose { x, y, yaw: yaw + FRAC_PI_2 },
            Self::YawOfCompass => Pose { x, y, yaw: FRAC_PI_2 - yaw },
        }
    }
}

/// A unit of length that is not the metre.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::diagnosis) enum Unit {
    Centimetre,
    Millimetre,
    Decimetre,
    Foot,
}

impl Unit {
    /// m.
    pub(in crate::diagnosis) const fn metres(self) -> f64 {
        match self {
            Self::Centimetre => 1e-2,
            Self::Millimetre => 1e-3,
            Self::Decimetre => 1e-1,
            Self::Foot => 0.3048,
        }
    }
}

/// A shift (m), a turn about the sensor or the middle of the detections (rad), and a shift along each object's velocity (s).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::diagnosis) struct Rigid {
    pub(in crate::diagnosis) by_m: [f64; 2],
    pub(in crate::diagnosis) turn_rad: f64,
    /// So much earlier the objects were where they are said to be, s.
    pub(in crate::diagnosis) earlier_s: f64,
    /// The shift may as well be one of so much along the motion, s: zero where it is one of place.
    pub(in crate::diagnosis) or_earlier_s: f64,
}

/// Which axes the two numbers were along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::diagnosis) enum Axes {
    /// Ours: ahead or east, left or north.
    Ours,
    /// The second one points the other way: ahead and right, or east and south.
    SecondReversed,
    /// The first one points the other way.
    FirstReversed,
    /// Both point the other way.
    BothReversed,
    /// The wrong way round: left and ahead, or north and east.
    Swapped,
    /// Right and ahead: y is ahead, as cameras and images have it.
    RightAhead,
}

impl Axes {
    /// Our numbers of theirs.
    pub(in crate::diagnosis) const fn ours(self, [a, b]: [f64; 2]) -> [f64; 2] {
        match self {
            Self::Ours => [a, b],
            Self::SecondReversed => [a, -b],
            Self::FirstReversed => [-a, b],
            Self::BothReversed => [-a, -b],
            Self::Swapped => [b, a],
            Self::RightAhead => [b, -a],
        }
    }
}

/// All changes that are no small ones; of those that explain as much, the last one is taken.
pub(in crate::diagnosis) const LARGE: [Change; 29] = [
    Change::InUnitAboutSensor(Unit::Foot),
    Change::InUnitAboutSensor(Unit::Decimetre),
    Change::InUnitAboutSensor(Unit::Millimetre),
    Change::InUnitAboutSensor(Unit::Centimetre),
    Change::InUnit(Unit::Foot),
    Change::InUnit(Unit::Decimetre),
    Change::InUnit(Unit::Millimetre),
    Change::InUnit(Unit::Centimetre),
    Change::PoseIs(WrongPose::YawOfCompass),
    Change::PoseIs(WrongPose::YawFromNorth),
    Change::PoseIs(WrongPose::YawBack),
    Change::PoseIs(WrongPose::YawOpposite),
    Change::PoseIs(WrongPose::YOpposite),
    Change::PoseIs(WrongPose::XOpposite),
    Change::PoseIs(WrongPose::Opposite),
    Change::PoseIs(WrongPose::Exchanged),
    Change::FromPlace,
    Change::FromSensor(Axes::Ours),
    Change::FromSensor(Axes::SecondReversed),
    Change::FromSensor(Axes::RightAhead),
    Change::FromSensor(Axes::Swapped),
    Change::PoseTwice,
    Change::AboutSensor(Axes::SecondReversed),
    Change::AboutSensor(Axes::RightAhead),
    Change::AboutSensor(Axes::Swapped),
    Change::OfMap(Axes::Swapped),
    Change::OfMap(Axes::SecondReversed),
    Change::OfMap(Axes::FirstReversed),
    Change::OfMap(Axes::BothReversed),
];

impl Change {
    /// Whether it draws places together, or apart.
    pub(super) const fn is_of_unit(&self) -> bool {
        matches!(self, Self::InUnit(_) | Self::InUnitAboutSensor(_))
    }

    /// The spots with the change; `None` where it needs a pose that is not there.
    pub(super) fn apply(&self, sighting: &Sighting) -> Option<Vec<Spot>> {
        let moved = |place: &dyn Fn(&Spot) -> [f64; 2]| {
            sighting.spots.iter().map(|spot| Spot { at: place(spot), ..*spot }).collect()
        };
        let offset = |pose: Pose, [ahead, left]: [f64; 2]| <[f64; 2]>::from(pose.offset(ahead, left));
        Some(match *self {
            Self::OfMap(axes) => moved(&|spot| axes.ours(spot.at)),
            Self::FromSensor(axes) => {
                let pose = sighting.pose?;
                moved(&|spot| offset(pose, axes.ours(spot.at)))
            }
            Self::FromPlace => {
                let pose = sighting.pose?;
                moved(&|spot| [spot.at[0] + pose.x, spot.at[1] + pose.y])
            }
            Self::PoseTwice => {
                let pose = sighting.pose?;
                moved(&|spot| from(pose, spot.at))
            }
            Self::AboutSensor(axes) => {
                let pose = sighting.pose?;
                moved(&|spot| offset(pose, axes.ours(from(pose, spot.at))))
            }
            Self::PoseIs(wrong) => {
                let pose = sighting.pose?;
                moved(&|spot| offset(wrong.right(pose), from(pose, spot.at)))
            }
            Self::InUnit(unit) => moved(&|spot| spot.at.map(|one| one * unit.metres())),
            Self::InUnitAboutSensor(unit) => {
                let pose = sighting.pose?;
                moved(&|spot| offset(pose, from(pose, spot.at).map(|one| one * unit.metres())))
            }
            Self::Scaled(factor) => {
                let centre = sighting.centre();
                moved(&|spot| [0, 1].map(|axis| centre[axis] + factor * (spot.at[axis] - centre[axis])))
            }
            Self::Rigid(rigid) => {
                let centre = sighting.centre();
                moved(&|spot| rigid.apply(spot, centre))
            }
        })
    }
}

/// A place as seen from a pose: ahead and left, m.
fn from(pose: Pose, [x, y]: [f64; 2]) -> [f64; 2] {
    let (sin, cos) = libm::sincos(pose.yaw);
    let (x, y) = (x - pose.x, y - pose.y);
    [x * cos + y * sin, y * cos - x * sin]
}

impl Rigid {
    fn apply(&self, spot: &Spot, centre: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = libm::sincos(self.turn_rad);
        let [x, y] = [spot.at[0] - centre[0], spot.at[1] - centre[1]];
        let turned = [centre[0] + x * cos - y * sin, centre[1] + x * sin + y * cos];
        [0, 1].map(|axis| turned[axis] + self.by_m[axis] - spot.velocity[axis] * self.earlier_s)
    }
}

impl Sighting {
    /// What a turn is about: the sensor, or the middle of the detections.
    #[expect(clippy::cast_precision_loss, reason = "a few")]
    pub(super) fn centre(&self) -> [f64; 2] {
        if let Some(pose) = self.pose {
            return [pose.x, pose.y];
        }
        let n = (self.spots.len() as f64).max(1.0);
        [0, 1].map(|axis| self.spots.iter().map(|spot| spot.at[axis]).sum::<f64>() / n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_undoes_a_mapping_gives_the_places_back() {
        let pose = Pose { x: 30.0, y: -5.0, yaw: 0.7 };
        let place = |at| Spot { at, velocity: [0.0, 0.0], variance: 0.1, size: None };
        let is_at = |change: Change, given: [f64; 2], expected: [f64; 2]| {
            let moved = change.apply(&Sighting::new(Some(pose), vec![place(given)])).unwrap()[0].at;
            assert!((0..2).all(|axis| (moved[axis] - expected[axis]).abs() < 1e-9), "{change:?}: {moved:?}");
        };
        let seen = [12.0, 3.0];
        let map = <[f64; 2]>::from(pose.offset(seen[0], seen[1]));
        is_at(Change::FromSensor(Axes::Ours), seen, map);
        is_at(Change::FromSensor(Axes::SecondReversed), [12.0, -3.0], map);
        is_at(Change::FromSensor(Axes::RightAhead), [-3.0, 12.0], map);
        is_at(Change::AboutSensor(Axes::SecondReversed), pose.offset(12.0, -3.0).into(), map);
        is_at(Change::PoseTwice, pose.offset(map[0], map[1]).into(), map);
        is_at(Change::OfMap(Axes::Swapped), [map[1], map[0]], map);
        assert!(Change::PoseTwice.apply(&Sighting::new(None, vec![place(seen)])).is_none());
    }
}
