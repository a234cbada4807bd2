//! Distance over time with piecewise constant acceleration, in closed form.

/// A ride: starts at time 0, has a duration.
#[derive(Clone, Debug)]
pub struct Profile {
    segments: Vec<Segment>,
    end: Segment,
}

/// State at the beginning of a stretch of constant acceleration: s, m, m/s, m/s².
#[derive(Clone, Copy, Debug)]
struct Segment {
    t: f64,
    s: f64,
    v: f64,
    a: f64,
}

impl Segment {
    fn at(&self, t: f64) -> (f64, f64) {
        let dt = t - self.t;
        (self.s + (self.v + self.a * dt / 2.0) * dt, self.v + self.a * dt)
    }
}

impl Profile {
    /// A ride of duration 0, the start of further segments.
    pub const fn from(distance_m: f64, speed_mps: f64) -> Self {
        Self { segments: Vec::new(), end: Segment { t: 0.0, s: distance_m, v: speed_mps, a: 0.0 } }
    }

    /// Adds a segment at the present speed.
    pub fn hold(self, duration_s: f64) -> Self {
        self.segment(duration_s, 0.0)
    }

    /// Adds a segment at the present speed up to a distance.
    pub fn cruise_to(self, distance_m: f64) -> Self {
        let duration_s = (distance_m - self.end.s) / self.end.v;
        self.hold(duration_s)
    }

    /// Adds a change of speed at a constant rate (m/s², positive).
    pub fn change_speed(self, speed_mps: f64, rate_mps2: f64) -> Self {
        let change = speed_mps - self.end.v;
        let mut changed = self.segment(change.abs() / rate_mps2, rate_mps2.copysign(change));
        changed.end.v = speed_mps;
        changed
    }

    fn segment(mut self, duration_s: f64, a: f64) -> Self {
        debug_assert!(duration_s >= 0.0, "a segment of {duration_s} s");
        let segment = Segment { a, ..self.end };
        let t = segment.t + duration_s;
        let (s, v) = segment.at(t);
        self.segments.push(segment);
        self.end = Segment { t, s, v, a: 0.0 };
        self
    }

    /// Duration, s.
    pub const fn duration_s(&self) -> f64 {
        self.end.t
    }

    /// Distance (m) and speed (m/s) at a time (s); beyond the end the last speed is kept.
    pub fn at(&self, t: f64) -> (f64, f64) {
        if t >= self.end.t {
            return self.end.at(t);
        }
        let after = self.segments.partition_point(|segment| segment.t <= t);
        self.segments[after.saturating_sub(1)].at(t)
    }
}

/// Distance that a change of speed takes, m.
pub fn speed_change_distance_m(from_mps: f64, to_mps: f64, rate_mps2: f64) -> f64 {
    (to_mps * to_mps - from_mps * from_mps).abs() / (2.0 * rate_mps2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ride_stops_and_starts_at_the_given_distances_and_times() {
        let ride =
            Profile::from(0.0, 10.0).cruise_to(20.0).change_speed(0.0, 2.0).hold(3.0).change_speed(4.0, 1.0);
        assert_eq!(ride.at(1.0), (10.0, 10.0));
        assert_eq!(ride.at(8.0), (45.0, 0.0));
        assert_eq!(ride.duration_s(), 2.0 + 5.0 + 3.0 + 4.0);
        assert_eq!(ride.at(14.0), (45.0 + 8.0, 4.0));
        assert_eq!(speed_change_distance_m(10.0, 0.0, 2.0), 25.0);
    }

    #[test]
    fn speed_is_the_derivative_of_distance() {
        let ride = Profile::from(0.0, 3.0).hold(1.0).change_speed(8.0, 1.5).hold(2.0).change_speed(0.0, 2.5);
        for step in 1..90 {
            let t = f64::from(step) * 0.1;
            let slope = (ride.at(t + 1e-5).0 - ride.at(t - 1e-5).0) / 2e-5;
            assert!((slope - ride.at(t).1).abs() < 1e-4, "at {t} s: {slope}");
        }
    }
}
