//! How fast things move, by kinds of them: times that are numbers of frames, and places in feet.

use v2x_common::class::ClassGroup;
use v2x_common::geometry::Pose;
use v2x_common::time::Span;

/// Fewest objects of a kind, and steps of theirs.
const MIN_OBJECTS: usize = 3;
const MIN_STEPS: usize = 60;
/// Steps that are looked at.
const MAX_STEPS: usize = 100_000;
/// Steps of so many whole seconds may be of so many frames.
const FRAMES_S: std::ops::RangeInclusive<f64> = 1.0..=3.0;
/// Vehicles go so far in a frame, m: at ten frames a second up to 126 km/h. In a second most go further.
const PER_FRAME_M: std::ops::Range<f64> = 0.1..3.5;
/// Over so many frames a speed hardly changes; over so many seconds it changes by more than this part of it, in the middle.
const ROWS: usize = 5;
const SMOOTH: f64 = 0.12;
const MIN_CHANGES: usize = 12;
/// On no road do vehicles go so fast that one of twenty steps is faster, m/s: 170 km/h. People do not even run so, all the time.
const FAST_VEHICLES_MPS: f64 = 47.0;
const FAST_PEOPLE_MPS: f64 = 3.5;
/// In feet all is so many times as fast; what is faster yet is in another unit, or jumps.
const FOOT: f64 = 1.0 / 0.3048;
const FASTEST_VEHICLES_MPS: f64 = 45.0 * FOOT;
const FASTEST_PEOPLE_MPS: f64 = 3.0 * FOOT;

/// Of one kind of object.
#[derive(Clone, Debug, Default)]
struct Kind {
    n_objects: usize,
    speeds_mps: Vec<f64>,
    /// By how much the next speed of the same object is another one, as a part of the larger one.
    changes: Vec<f64>,
}

/// Of a recording.
#[derive(Clone, Debug)]
pub(super) struct Paces {
    vehicles: Kind,
    people: Kind,
    /// All times are whole seconds.
    are_whole: bool,
}

impl Default for Paces {
    fn default() -> Self {
        Self { vehicles: Kind::default(), people: Kind::default(), are_whole: true }
    }
}

impl Kind {
    fn add(&mut self, places: &[(Span, &Pose)]) {
        let speed_mps = |from: &(Span, &Pose), to: &(Span, &Pose)| {
            from.1.distance_to(to.1.x, to.1.y) / (to.0 - from.0).as_secs_f64()
        };
        self.speeds_mps.extend(places.windows(2).map(|two| speed_mps(&two[0], &two[1])));
        // Over several rows, so that what scatters does not count.
        let every: Vec<_> = places.iter().step_by(ROWS).collect();
        for three in every.windows(3) {
            let [first, second] = [0, 1].map(|k| speed_mps(three[k], three[k + 1]));
            let faster = first.max(second);
            if faster >= PER_FRAME_M.start {
                self.changes.push((first - second).abs() / faster);
            }
        }
    }

    /// The speed above which one of twenty steps is, m/s; `None` of too few.
    fn fast_mps(&self) -> Option<f64> {
        let (n, mut sorted) = (self.speeds_mps.len(), self.speeds_mps.clone());
        sorted.sort_unstable_by(f64::total_cmp);
        (self.n_objects >= MIN_OBJECTS && n >= MIN_STEPS).then(|| sorted[n * 19 / 20])
    }
}

impl Paces {
    /// Adds an object by its places in order of time.
    pub(super) fn add<'a>(
        &mut self,
        group: ClassGroup,
        places: impl Iterator<Item = (Span, &'a Pose)>,
        max_gap: Span,
    ) {
        let kind = match group {
            ClassGroup::FourWheeled => &mut self.vehicles,
            ClassGroup::Pedestrian => &mut self.people,
            _ => return,
        };
        kind.n_objects += 1;
        let places: Vec<_> = places.collect();
        self.are_whole &= places.iter().all(|(t, _)| t.as_nanos() % 1_000_000_000 == 0);
        for without_gap in places.chunk_by(|(from, _), (to, _)| *to - *from <= max_gap) {
            if kind.speeds_mps.len() < MAX_STEPS {
                kind.add(without_gap);
            }
        }
    }

    /// What looks wrong, where rows of an object are so far apart.
    pub(super) fn warnings(&self, step: Span) -> Vec<String> {
        self.frame_numbers(step.as_secs_f64()).or_else(|| self.feet()).into_iter().collect()
    }

    /// Times that count frames.
    fn frame_numbers(&self, step_s: f64) -> Option<String> {
        let fast_mps = self.vehicles.fast_mps()?;
        let mut changes = self.vehicles.changes.clone();
        changes.sort_unstable_by(f64::total_cmp);
        let is_smooth = changes.len() >= MIN_CHANGES && changes[changes.len() / 2] < SMOOTH;
        let is_of_frames = self.are_whole && FRAMES_S.contains(&step_s) && PER_FRAME_M.contains(&fast_mps);
        (is_of_frames && is_smooth).then(|| {
            format!(
                "all times are whole numbers, and no vehicle is faster than {fast_mps:.2} m/s, though each goes on evenly: t looks like numbers of \
                 frames; write seconds (t / frames a second: {:.0} km/h at 10, {:.0} km/h at 25)",
                36.0 * fast_mps,
                90.0 * fast_mps
            )
        })
    }

    /// Places in feet.
    fn feet(&self) -> Option<String> {
        let of =
            |kind: &Kind, least: f64, most: f64| kind.fast_mps().filter(|fast| (least..most).contains(fast));
        let vehicles =
            of(&self.vehicles, FAST_VEHICLES_MPS, FASTEST_VEHICLES_MPS).map(|fast| ("vehicles", fast));
        let people = || of(&self.people, FAST_PEOPLE_MPS, FASTEST_PEOPLE_MPS).map(|fast| ("people", fast));
        let (who, fast_mps) = vehicles.or_else(people)?;
        let kmh = 3.6 * fast_mps;
        // A town in decimetres is as fast as a motorway in feet.
        let (unit, how) = match vehicles {
            Some(_) => (
                format!("feet ({:.0} km/h then) or decimetres ({:.0} km/h)", kmh / FOOT, kmh / 10.0),
                "0.3048, or 0.1",
            ),
            None => (format!("feet ({:.0} km/h then)", kmh / FOOT), "0.3048"),
        };
        Some(format!(
            "{who} go up to {fast_mps:.1} m/s ({kmh:.0} km/h): x and y look like {unit}; write metres (x · {how}), also of w and d"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Objects of some speeds (m/s), each with rows `step_s` apart by the clock, written by `write`.
    fn said(
        group: ClassGroup,
        (step_s, speeds): (f64, [f64; 4]),
        write: impl Fn(f64, f64) -> (f64, f64),
    ) -> Vec<String> {
        let (mut paces, mut usual_s) = (Paces::default(), 0.0);
        for (n, speed) in speeds.into_iter().enumerate() {
            let rows: Vec<_> = (0..60)
                .map(|k| {
                    let t = step_s * f64::from(k);
                    // It speeds up and slows down by 1.5 m/s², and scatters by centimetres.
                    let x = speed * t + 6.0 * libm::sin(0.5 * t) + 0.02 * f64::from(k * 7 % 5);
                    let (t, x) = write(t, x);
                    (Span::from_secs_f64(t), Pose { x, y: 4.0 * n as f64, yaw: 0.0 })
                })
                .collect();
            usual_s = (rows[1].0 - rows[0].0).as_secs_f64();
            paces.add(group, rows.iter().map(|(t, pose)| (*t, pose)), Span::from_secs_f64(10.0 * usual_s));
        }
        paces.warnings(Span::from_secs_f64(usual_s))
    }

    #[test]
    fn numbers_of_frames_as_times_are_named_and_whole_seconds_of_slow_traffic_are_not() {
        use ClassGroup::{FourWheeled, Pedestrian};
        let city = [8.0, 10.0, 12.0, 14.0];
        for hz in [10.0, 25.0] {
            let found = said(FourWheeled, (1.0 / hz, city), |t, x| (libm::round(hz * t), x));
            let [one] = &found[..] else { panic!("{hz} Hz: {found:?}") };
            assert!(one.contains("numbers of frames") && one.contains("write seconds"), "{one}");
        }
        assert_eq!(said(FourWheeled, (1.0, city), |t, x| (t, x)), [""; 0], "once a second");
        assert_eq!(said(FourWheeled, (0.1, city), |t, x| (t, x)), [""; 0]);
        assert_eq!(said(FourWheeled, (1.0, [1.0, 2.0, 1.5, 0.5]), |t, x| (t, 0.3 * x)), [""; 0], "a queue");
        assert_eq!(said(Pedestrian, (1.0, [1.3; 4]), |t, _| (t, 1.3 * t)), [""; 0]);
    }

    #[test]
    fn feet_are_named_where_all_goes_three_times_as_fast_and_motorways_and_people_are_not() {
        use ClassGroup::{FourWheeled, Pedestrian};
        let walk = |t: f64, factor: f64| (t, factor * 1.4 * t);
        let feet = said(FourWheeled, (0.1, [22.0, 25.0, 20.0, 26.0]), |t, x| (t, FOOT * x));
        assert!(feet.len() == 1 && feet[0].contains("feet") && feet[0].contains("0.3048"), "{feet:?}");
        let tenths = said(FourWheeled, (0.1, [8.0, 10.0, 12.0, 11.0]), |t, x| (t, 10.0 * x));
        assert!(tenths.len() == 1 && tenths[0].contains("or decimetres"), "{tenths:?}");
        let people = said(Pedestrian, (0.1, [0.0; 4]), |t, _| walk(t, FOOT));
        assert!(people.len() == 1 && people[0].contains("feet"), "{people:?}");
        assert_eq!(said(FourWheeled, (0.1, [30.0, 36.0, 40.0, 38.0]), |t, x| (t, x)), [""; 0]);
        assert_eq!(said(Pedestrian, (0.1, [0.0; 4]), |t, _| walk(t, 1.0)), [""; 0]);
    }
}
