//! Plane curves of straight lines and circular arcs, by arc length, in closed form.

use std::f64::consts::PI;

use v2x_common::geometry::{Pose, wrap_angle};

/// A curve; its heading is its tangent.
#[derive(Clone, Debug)]
pub struct Path {
    segments: Vec<Segment>,
    length: f64,
    closed: bool,
}

#[derive(Clone, Copy, Debug)]
struct Segment {
    /// Arc length at its beginning, m.
    from: f64,
    start: Pose,
    /// Left turns are positive, 1/m.
    curvature: f64,
}

impl Segment {
    fn at(&self, s: f64) -> Pose {
        let Pose { x, y, yaw } = self.start;
        let ds = s - self.from;
        let (sin, cos) = libm::sincos(yaw);
        if self.curvature == 0.0 {
            return Pose { x: x + ds * cos, y: y + ds * sin, yaw };
        }
        let turned = yaw + self.curvature * ds;
        let (sin_turned, cos_turned) = libm::sincos(turned);
        Pose {
            x: x + (sin_turned - sin) / self.curvature,
            y: y - (cos_turned - cos) / self.curvature,
            yaw: wrap_angle(turned),
        }
    }
}

impl Path {
    /// A path of length 0, the start of further segments.
    pub fn from(start: Pose) -> Self {
        Self { segments: vec![Segment { from: 0.0, start, curvature: 0.0 }], length: 0.0, closed: false }
    }

    /// Adds a straight segment.
    pub fn line(self, length_m: f64) -> Self {
        self.segment(length_m, 0.0)
    }

    /// Adds an arc; left turns are positive.
    pub fn arc(self, turn_rad: f64, radius_m: f64) -> Self {
        let curvature = turn_rad.signum() / radius_m;
        self.segment(turn_rad.abs() * radius_m, curvature)
    }

    fn segment(mut self, length_m: f64, curvature: f64) -> Self {
        debug_assert!(length_m >= 0.0, "a segment of {length_m} m");
        let start = self.end();
        let segment = Segment { from: self.length, start, curvature };
        if self.length == 0.0 {
            self.segments.clear();
        }
        self.segments.push(segment);
        self.length += length_m;
        self
    }

    /// Declares that the end is the beginning; [`Self::at`] then continues at the beginning.
    pub fn close(mut self) -> Self {
        let (start, end) = (self.segments[0].start, self.end());
        debug_assert!(start.distance_to(end.x, end.y) < 1e-6, "from {start:?} to {end:?}");
        debug_assert!(wrap_angle(start.yaw - end.yaw).abs() < 1e-6, "from {start:?} to {end:?}");
        self.closed = true;
        self
    }

    /// A closed rectangle with rounded corners, from `start` on along the first side; right turns where
    /// `turn` is negative, else left. Sides are given from corner to corner; `start` is one radius behind a corner.
    pub fn rounded_rectangle(start: Pose, sides_m: (f64, f64), radius_m: f64, turn: f64) -> Self {
        let corner = turn.signum() * PI / 2.0;
        let mut path = Self::from(start);
        for side_m in [sides_m.0, sides_m.1, sides_m.0, sides_m.1] {
            path = path.line(side_m - 2.0 * radius_m).arc(corner, radius_m);
        }
        path.close()
    }

    /// Length, m.
    pub const fn length(&self) -> f64 {
        self.length
    }

    /// The pose at an arc length (m). Open paths continue straight beyond their ends.
    pub fn at(&self, s: f64) -> Pose {
        let s = if self.closed { s - self.length * libm::floor(s / self.length) } else { s };
        let after = self.segments.partition_point(|segment| segment.from <= s);
        self.segments[after.saturating_sub(1)].at(s)
    }

    fn end(&self) -> Pose {
        self.segments[self.segments.len() - 1].at(self.length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_quarter_turn_to_the_right_ends_at_the_expected_pose() {
        let path = Path::from(Pose { x: 0.0, y: 0.0, yaw: PI / 2.0 }).line(10.0).arc(-PI / 2.0, 5.0);
        let end = path.at(path.length());
        assert!(
            (end.x - 5.0).abs() < 1e-12 && (end.y - 15.0).abs() < 1e-12 && end.yaw.abs() < 1e-12,
            "{end:?}"
        );
    }

    #[test]
    fn a_closed_path_continues_at_its_beginning() {
        let path = Path::rounded_rectangle(Pose { x: 3.0, y: 1.0, yaw: 0.4 }, (30.0, 20.0), 4.0, -1.0);
        let (first, second) = (path.at(7.0), path.at(7.0 + 3.0 * path.length()));
        assert!(first.distance_to(second.x, second.y) < 1e-9);
    }

    proptest! {
        #[test]
        fn one_step_of_arc_length_is_one_step_along_the_heading(s in 0.0..200.0f64) {
            let path = Path::rounded_rectangle(Pose::default(), (30.0, 20.0), 4.0, 1.0);
            let h = 1e-4;
            let (behind, here, ahead) = (path.at(s - h), path.at(s), path.at(s + h));
            let (sin, cos) = libm::sincos(here.yaw);
            // The curvature jumps at most by 1/4 within the step.
            prop_assert!(((ahead.x - behind.x) / (2.0 * h) - cos).abs() < 1e-4);
            prop_assert!(((ahead.y - behind.y) / (2.0 * h) - sin).abs() < 1e-4);
        }
    }
}
