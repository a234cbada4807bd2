//! Whether an agent's pose wanders: then what stands moves in its reports, all of it at once.
//!
//! An agent alone shows it, by two of its own frames: what the tracks make of all reports does not enter. Noise of single objects
//! cancels in the products of the displacements of different ones. What creeps all one way moves in the reports of others, too: the
//! products with those are taken away. Where nobody else sees it, what goes on at a constant speed has the same displacements a
//! while before, and these are.
//!
//! Frames half a second apart show a pose that trembles, frames two seconds apart one that drifts.

use crate::values::PoseErrors;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use v2x_common::time::{Span, Timestamp};

/// Two kinds of pairs of frames.
pub(super) const SCALES: usize = 2;
/// The first frames of half or whole pairs of seconds are compared, each with the one before: the same ones for all objects.
const TURNS: [Span; SCALES] = [Span::from_millis(500), Span::from_millis(2000)];
/// With no less and no more between them.
const APART: [[Span; 2]; SCALES] =
    [[Span::from_millis(200), Span::from_millis(3000)], [Span::from_millis(1000), Span::from_millis(6000)]];
/// What other agents saw of an object so long before counts for the same time.
const BESIDE: [Span; SCALES] = [Span::from_millis(1000), Span::from_millis(4000)];
/// In an agent's own frames two seconds apart, what stands moves by less, m/s.
const STANDS_BELOW_MPS: f64 = 0.4;
/// Further than this nothing that stands is displaced, m: it is another object.
const MOST_DISPLACED_M: f64 = 4.0;
/// So many objects of a frame show what they have in common.
const LEAST_OBJECTS: f64 = 4.0;
/// And so many frames that it is not chance, by so many standard deviations of their mean.
const LEAST_FRAMES: [f64; SCALES] = [10.0, 6.0];
const SIGNIFICANT_SIGMAS: f64 = 3.0;
/// Below this nothing is corrected, m.
const LEAST_SIGMA_M: f64 = 0.2;
/// What was displaced in frames before, from these times between two reports on, in which no report is of both, and up to this age.
const BEFORE_FROM: f64 = 1.5;
const BEFORE: Span = Span::from_millis(5000);
/// Fewest such frames, and the most that are kept.
const LEAST_BEFORE: f64 = 2.0;
const MOST_BEFORE: usize = 12;
/// The most of one frame, m².
const MOST: f64 = 100.0;
/// Unit of sums: whole numbers add up to the same in any order.
const UNITS: f64 = 65_536.0;

/// Where an agent reported an object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Stood {
    pub(super) at: Timestamp,
    /// m.
    pub(super) position: [f64; 2],
    /// Direction of its longer side, rad, and the declared variance of its heading, rad², where there is one.
    pub(super) side: Option<[f32; 2]>,
}

/// How far an object that stands was displaced between two reports of one agent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Displaced {
    /// m.
    by: [f64; 2],
    after_s: f64,
    /// By how much its heading was turned, rad, and the declared variance of each report, rad².
    pub(super) turned: Option<[f64; 2]>,
    /// How far it was in the mean of what other agents report, for the same time, m.
    by_others: Option<[f64; 2]>,
}

/// How fast an object moved between two reports of one agent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Moved {
    at: Timestamp,
    /// m/s.
    velocity: [f32; 2],
}

/// What is kept of an agent's reports of one object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Standing {
    stood: [Option<Stood>; SCALES],
    moved: [Option<Moved>; SCALES],
}

impl Standing {
    /// Takes in a report: how far the object was displaced since the report that it is compared with, on each scale.
    pub(super) fn take_in(&mut self, report: Stood) -> [Option<Displaced>; SCALES] {
        std::array::from_fn(|scale| {
            let displaced = report.compare(&mut self.stood[scale], scale)?;
            self.moved[scale] = Some(Moved { at: report.at, velocity: displaced.velocity() });
            Some(displaced)
        })
    }

    /// Whether the object stands by these reports alone.
    pub(super) fn says_that_it_stands(&self) -> bool {
        let slow = self.moved[SCALES - 1];
        slow.is_some_and(|Moved { velocity: [x, y], .. }| f64::from(libm::hypotf(x, y)) < STANDS_BELOW_MPS)
    }
}

impl Displaced {
    #[expect(clippy::cast_possible_truncation, reason = "single precision is enough")]
    fn velocity(&self) -> [f32; 2] {
        self.by.map(|axis| (axis / self.after_s) as f32)
    }

    /// Notes what others saw of the same object on a scale by about the same time.
    pub(super) fn beside<'a>(
        &mut self,
        at: Timestamp,
        scale: usize,
        others: impl Iterator<Item = &'a Standing>,
    ) {
        let (mut sum, mut n) = ([0.0; 2], 0.0);
        for Moved { velocity, .. } in others
            .filter_map(|other| other.moved[scale])
            .filter(|other| (at - other.at).abs() < BESIDE[scale])
        {
            sum = [sum[0] + f64::from(velocity[0]), sum[1] + f64::from(velocity[1])];
            n += 1.0;
        }
        self.by_others = (n > 0.0).then(|| sum.map(|axis| axis / n * self.after_s));
    }
}

impl Stood {
    /// Compares a report with that of the turn before, whose place it takes.
    fn compare(self, earlier: &mut Option<Self>, scale: usize) -> Option<Displaced> {
        let turn = |at: Timestamp| at.as_nanos().div_euclid(TURNS[scale].as_nanos());
        if earlier.is_some_and(|earlier| turn(earlier.at) == turn(self.at)) {
            return None;
        }
        let before = earlier.replace(self)?;
        let [least, most] = APART[scale];
        let after = self.at - before.at;
        let by = [self.position[0] - before.position[0], self.position[1] - before.position[1]];
        let is_near = libm::hypot(by[0], by[1]) <= MOST_DISPLACED_M;
        let turned = before.side.zip(self.side).map(|([before, variance_before], [now, variance])| {
            [f64::from(now - before), f64::from((variance_before + variance) / 2.0)]
        });
        (least <= after && after <= most && is_near).then(|| Displaced {
            by,
            after_s: after.as_secs_f64(),
            turned,
            by_others: None,
        })
    }
}

/// Displacements in one frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct FrameSums {
    at: Timestamp,
    n: f64,
    by: [f64; 2],
    squares: f64,
    after_s: f64,
    /// Of those that others report, too: how many, and both displacements.
    n_shared: f64,
    by_shared: [f64; 2],
    by_others: [f64; 2],
}

impl FrameSums {
    fn at(at: Timestamp) -> Self {
        Self {
            at,
            n: 0.0,
            by: [0.0; 2],
            squares: 0.0,
            after_s: 0.0,
            n_shared: 0.0,
            by_shared: [0.0; 2],
            by_others: [0.0; 2],
        }
    }

    /// The mean displacement.
    fn common(&self) -> Common {
        Common { at: self.at, by: self.by.map(|axis| axis / (UNITS * self.n)) }
    }

    /// Variance along an axis that the displacements have in common, m², as that of the pose, beyond what goes on as before; below 0
    /// by chance.
    fn variance(&self, before: &VecDeque<Common>) -> Option<f64> {
        let Self { n, by: [x, y], squares, after_s, .. } = *self;
        if n < LEAST_OBJECTS {
            return None;
        }
        let after_s = after_s / (UNITS * n);
        let products = ((x * x + y * y) / UNITS - squares) / (UNITS * n * (n - 1.0));
        let as_elsewhere = self.as_others_see().or_else(|| self.as_before(after_s, before))?;
        Some(PoseErrors::by_displacement((products - as_elsewhere) / 2.0, after_s))
    }

    /// Product of the mean displacement with that which other agents see, m².
    fn as_others_see(&self) -> Option<f64> {
        let Self { n_shared, by_shared: [x, y], by_others: [other_x, other_y], .. } = *self;
        let unit = UNITS * n_shared;
        (n_shared >= LEAST_OBJECTS).then(|| (x * other_x + y * other_y) / (unit * unit))
    }

    /// The same with that of a while before.
    fn as_before(&self, after_s: f64, before: &VecDeque<Common>) -> Option<f64> {
        let (mut going_on, mut n_before) = ([0.0; 2], 0.0);
        for one in before {
            let age = self.at - one.at;
            if age <= BEFORE && age.as_secs_f64() >= BEFORE_FROM * after_s {
                going_on = [going_on[0] + one.by[0], going_on[1] + one.by[1]];
                n_before += 1.0;
            }
        }
        if n_before < LEAST_BEFORE {
            return None;
        }
        let [now_x, now_y] = self.common().by;
        Some((now_x * going_on[0] + now_y * going_on[1]) / n_before)
    }
}

/// What the displacements of a frame have in common.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Common {
    at: Timestamp,
    /// m.
    by: [f64; 2],
}

/// What the frames of one agent show of its pose.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct PoseCounts {
    scales: [ScaleCounts; SCALES],
}

impl PoseCounts {
    /// Adds displacements in a frame.
    pub(super) fn add(&mut self, at: Timestamp, displaced: &[Option<Displaced>; SCALES]) {
        for (counts, displaced) in self.scales.iter_mut().zip(displaced) {
            if let Some(displaced) = displaced {
                counts.add(at, displaced);
            }
        }
    }

    /// At the end of an epoch, counts its frames.
    pub(super) fn settle(&mut self) {
        self.scales.iter_mut().for_each(ScaleCounts::settle);
    }

    /// Lets what was counted fade.
    pub(super) fn scale(&mut self, factor: f64) {
        self.scales.iter_mut().for_each(|counts| counts.scale(factor));
    }

    /// Variance of the position of the pose along an axis, m²; 0 where none is significant.
    pub(super) fn variance(&self) -> f64 {
        let of_scales = self.scales.iter().zip(LEAST_FRAMES);
        of_scales.map(|(counts, least)| counts.variance(least)).fold(0.0, f64::max)
    }
}

/// The same by one kind of pairs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct ScaleCounts {
    /// Of this epoch.
    of_epoch: Vec<FrameSums>,
    /// Frames before, in order.
    before: VecDeque<Common>,
    frames: f64,
    variances: f64,
    squares: f64,
}

impl ScaleCounts {
    /// Adds a displacement in a frame.
    fn add(&mut self, at: Timestamp, displaced: &Displaced) {
        let Displaced { by, after_s, by_others, .. } = *displaced;
        let place = self.of_epoch.iter().position(|frame| frame.at == at).unwrap_or_else(|| {
            self.of_epoch.push(FrameSums::at(at));
            self.of_epoch.len() - 1
        });
        let frame = &mut self.of_epoch[place];
        frame.n += 1.0;
        frame.by[0] += libm::round(by[0] * UNITS);
        frame.by[1] += libm::round(by[1] * UNITS);
        frame.squares += libm::round((by[0] * by[0] + by[1] * by[1]) * UNITS);
        frame.after_s += libm::round(after_s * UNITS);
        if let Some(by_others) = by_others {
            frame.n_shared += 1.0;
            for axis in [0, 1] {
                frame.by_shared[axis] += libm::round(by[axis] * UNITS);
                frame.by_others[axis] += libm::round(by_others[axis] * UNITS);
            }
        }
    }

    /// At the end of an epoch, counts its frames.
    fn settle(&mut self) {
        self.of_epoch.sort_by_key(|frame| frame.at);
        for frame in self.of_epoch.drain(..) {
            let variance = frame.variance(&self.before);
            if frame.n >= LEAST_OBJECTS {
                if self.before.len() >= MOST_BEFORE {
                    self.before.pop_front();
                }
                self.before.push_back(frame.common());
            }
            if let Some(variance) = variance {
                let variance = variance.clamp(-MOST, MOST);
                self.frames += 1.0;
                self.variances += libm::round(variance * UNITS);
                self.squares += libm::round(variance * variance * UNITS);
            }
        }
    }

    /// Lets what was counted fade.
    fn scale(&mut self, factor: f64) {
        for sum in [&mut self.frames, &mut self.variances, &mut self.squares] {
            *sum *= factor;
        }
    }

    /// Variance of the position of the pose along an axis, m²; 0 where none is significant.
    fn variance(&self, least_frames: f64) -> f64 {
        if self.frames < least_frames {
            return 0.0;
        }
        let mean = self.variances / (UNITS * self.frames);
        let of_mean = (self.squares / (UNITS * self.frames) - mean * mean).max(0.0) / self.frames;
        let is_significant = mean > SIGNIFICANT_SIGMAS * libm::sqrt(of_mean);
        if is_significant && mean >= LEAST_SIGMA_M * LEAST_SIGMA_M { mean } else { 0.0 }
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(super) fn listed() -> (&'static str, String) {
    (
        "learning.pose",
        format!(
            "{:?} s apart, {LEAST_OBJECTS} objects, {LEAST_FRAMES:?} frames, {SIGNIFICANT_SIGMAS} sigma, from {LEAST_SIGMA_M} m on, displaced by {MOST_DISPLACED_M} m at most, beyond what others see within {:?} s or {LEAST_BEFORE} to {MOST_BEFORE} frames of {} s before, from {BEFORE_FROM} of them on, stands below {STANDS_BELOW_MPS} m/s",
            APART.map(|apart| apart.map(Span::as_secs_f64)),
            BESIDE.map(Span::as_secs_f64),
            BEFORE.as_secs_f64()
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The variance by frames a second apart, each of so many objects that are displaced by a function of frame and object.
    fn variance(n_objects: i32, displaced: impl Fn(i32, i32) -> f64) -> f64 {
        variance_beside(n_objects, displaced, None)
    }

    /// The same beside another agent, which sees the objects displaced by a function of the frame.
    fn variance_beside(
        n_objects: i32,
        displaced: impl Fn(i32, i32) -> f64,
        elsewhere: Option<fn(i32) -> f64>,
    ) -> f64 {
        let mut counts = PoseCounts::default();
        let mut known = vec![(Standing::default(), Standing::default()); usize::try_from(n_objects).unwrap()];
        for second in 0..30 {
            let at = Timestamp::EPOCH + Span::from_millis(1000 * i64::from(second));
            for (object, (own, other)) in (0..).zip(&mut known) {
                let report = |off: f64| {
                    let x = 10.0 * f64::from(object) + off;
                    Stood { at, position: [x, x], side: None }
                };
                if let Some(elsewhere) = elsewhere {
                    other.take_in(report(elsewhere(second)));
                }
                let mut of_scales = own.take_in(report(displaced(second, object)));
                for (scale, displaced) in of_scales.iter_mut().enumerate() {
                    displaced.iter_mut().for_each(|one| one.beside(at, scale, std::iter::once(&*other)));
                }
                counts.add(at, &of_scales);
            }
            counts.settle();
        }
        counts.variance()
    }

    #[test]
    fn what_all_standing_objects_have_in_common_is_the_poses() {
        let swings = |second: i32| if second % 2 == 0 { 0.3 } else { -0.3 };
        let seen = variance(6, |second, _| swings(second));
        let expected = PoseErrors::by_displacement(0.36, 1.0);
        // What swings has, in the mean of a few frames before, not quite nothing in common with them.
        assert!((seen - expected).abs() < 0.05 * expected, "{seen} {expected}");
        let few = variance(3, |second, _| swings(second));
        assert_eq!(few, 0.0, "of three objects nothing is said");
    }

    #[test]
    fn what_walks_or_creeps_all_one_way_is_none_of_the_poses() {
        assert_eq!(variance(12, |second, _| 0.9 * f64::from(second)), 0.0);
        let each_its_own = |second: i32, object: i32| (0.5 + 0.1 * f64::from(object % 5)) * f64::from(second);
        assert_eq!(variance(12, each_its_own), 0.0);
    }

    #[test]
    fn what_another_agent_sees_tells_a_pose_that_drifts_from_what_creeps() {
        let drifts = |second: i32| 0.3 * f64::from(second % 16);
        let creeps = |second: i32| 0.3 * f64::from(second);
        assert_eq!(variance(6, |second, _| creeps(second)), 0.0, "nobody can know");
        let seen = variance_beside(6, |second, _| drifts(second), Some(|_| 0.0));
        assert!(seen > 0.05, "{seen}");
        assert_eq!(variance_beside(6, |second, _| creeps(second), Some(creeps)), 0.0);
        assert_eq!(variance_beside(6, |_, _| 0.0, Some(drifts)), 0.0, "it is the other's");
    }

    #[test]
    fn by_an_agents_own_reports_what_hardly_moves_in_two_seconds_stands() {
        let after = |speed_mps: f64| {
            let mut own = Standing::default();
            for ms in (0..5000).step_by(100) {
                let x = speed_mps * f64::from(ms) / 1000.0;
                let at = Timestamp::EPOCH + Span::from_millis(i64::from(ms));
                own.take_in(Stood { at, position: [x, 0.0], side: None });
            }
            own.says_that_it_stands()
        };
        assert!(after(0.0) && after(0.3) && !after(0.6) && !Standing::default().says_that_it_stands());
    }

    #[test]
    fn noise_of_single_objects_and_errors_that_stay_are_none_of_the_poses() {
        // Every object by itself: the products of different ones average to zero.
        let by_itself =
            |second: i32, object: i32| if (second * 7 + object * object * 3) % 5 < 2 { 0.4 } else { -0.3 };
        assert_eq!(variance(12, by_itself), 0.0);
        assert_eq!(variance(12, |_, _| 1.0), 0.0, "an offset");
    }

    #[test]
    fn another_object_is_no_displacement_and_frames_are_compared_once_a_turn() {
        let stood = |ms: i64, x: f64| Stood {
            at: Timestamp::EPOCH + Span::from_millis(ms),
            position: [x, 0.0],
            side: None,
        };
        let mut earlier = None;
        assert_eq!(stood(100, 0.0).compare(&mut earlier, 0), None);
        assert_eq!(stood(400, 0.0).compare(&mut earlier, 0), None, "the same turn");
        let displaced = stood(600, 0.5).compare(&mut earlier, 0);
        assert_eq!(
            displaced,
            Some(Displaced { by: [0.5, 0.0], after_s: 0.5, turned: None, by_others: None })
        );
        assert_eq!(stood(2000, 20.0).compare(&mut earlier, 0), None, "too far");
        assert_eq!(stood(9000, 20.0).compare(&mut earlier, 0), None, "too long ago");
    }
}
