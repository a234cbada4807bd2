//! A world that another program drives, such as SUMO: where its objects are, step by step.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use v2x_common::class::Class;
use v2x_common::detection::{MAX_COORDINATE_M, MAX_SIZE_M, MIN_SIZE_M};
use v2x_common::geometry::{Pose, wrap_angle};
use v2x_common::time::{Span, Timestamp};

use super::traffic::{Format, RecordedObject, Remarks, Traffic};
use super::trajectory::{Sample, Trajectory};

/// How long places stay known.
const KEPT: Span = Span::from_millis(10_000);
/// An object without a place for longer is absent; longer with longer steps.
const LEAST_GAP: Span = Span::from_millis(2000);

/// All objects of the world at one time, as they are published on the key `v2x/{network}/sim/world`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WorldStep {
    /// Unix time at which scenario time is 0, µs.
    pub start_us: i64,
    /// Scenario time, µs.
    pub t_us: i64,
    /// All objects that are there.
    pub objects: Vec<LiveObject>,
}

/// One object at one time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LiveObject {
    /// Its number, from 1 on in order of appearance: its identity in the world.
    pub number: u32,
    /// Its name in the program that drives it, on which an agent can ride.
    pub id: String,
    /// Its class.
    pub class: Class,
    /// Middle of its body, m, east.
    pub x: f64,
    /// Middle of its body, m, north.
    pub y: f64,
    /// Heading, rad, counter-clockwise from east.
    pub yaw: f64,
    /// Across its heading, m.
    pub w: f64,
    /// Along its heading, m.
    pub d: f64,
}

/// More objects at one time are no world of ours.
const MOST: usize = 100_000;
/// Steps that are kept: ten seconds of steps of 1 ms, the shortest, and some more.
const MOST_STEPS: usize = 12_000;
/// Places that are kept, of all objects together: 32 bytes each.
const MOST_SAMPLES: usize = 4_000_000;
/// A step comes before its time, but not by more.
const FARTHEST_AHEAD: Span = Span::from_millis(30_000);
/// Numbers of the agents' own bodies.
const OF_AGENTS: std::ops::Range<u32> = 100_000..1_100_000;
/// Numbers of the agents' own bodies in a large world, from here on.
const OF_AGENTS_OF_MANY: u32 = 1_000_000_000;

/// Why a step is not used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StepError {
    /// A number that no object can have.
    #[error("object {id}: {field} is {value}")]
    Value {
        /// The object.
        id: String,
        /// Name of the field.
        field: &'static str,
        /// Its value.
        value: f64,
    },
    /// A number that is no identity.
    #[error(
        "object {id} has number {number}; expected a number of its own from 1 on that is none of an agent's body, \
         {} to {}",
        OF_AGENTS.start,
        OF_AGENTS.end - 1
    )]
    Number {
        /// The object.
        id: String,
        /// Its number.
        number: u32,
    },
    /// A time that cannot be.
    #[error(
        "it is for {t_us} µs since {start_us} µs of the Unix time, which is far ahead of this machine's clock"
    )]
    Time {
        /// Scenario time.
        t_us: i64,
        /// Of the world.
        start_us: i64,
    },
    /// More objects than are kept.
    #[error("it has {count} objects, expected at most {MOST}")]
    TooMany {
        /// How many.
        count: usize,
    },
    /// It is of a world that began at another time.
    #[error("it is of a world that began at {found_us} µs, and this one began at {expected_us} µs")]
    OtherStart {
        /// Of the step.
        found_us: i64,
        /// Of the window.
        expected_us: i64,
    },
}

impl WorldStep {
    /// Scenario time 0.
    pub fn start(&self) -> Option<Timestamp> {
        Timestamp::from_micros(self.start_us)
    }

    /// Whether it can be used now.
    fn check(&self, now: Timestamp) -> Result<(), StepError> {
        let Self { start_us, t_us, objects } = self;
        let ahead = self.start().map(|start| Span::from_micros(*t_us) - (now - start));
        if ahead.is_none_or(|ahead| ahead > FARTHEST_AHEAD) {
            return Err(StepError::Time { t_us: *t_us, start_us: *start_us });
        }
        if objects.len() > MOST {
            return Err(StepError::TooMany { count: objects.len() });
        }
        let mut numbers = BTreeSet::new();
        for object in objects {
            let LiveObject { number, id, x, y, yaw, w, d, .. } = object;
            let is_of_agent = OF_AGENTS.contains(number) || *number >= OF_AGENTS_OF_MANY;
            if *number == 0 || is_of_agent || !numbers.insert(*number) {
                return Err(StepError::Number { id: id.clone(), number: *number });
            }
            let is_place = |value: f64| value.abs() <= MAX_COORDINATE_M;
            let is_size = |value: f64| (MIN_SIZE_M..=MAX_SIZE_M).contains(&value);
            let fields = [
                ("x", *x, is_place(*x)),
                ("y", *y, is_place(*y)),
                ("yaw", *yaw, yaw.is_finite()),
                ("w", *w, is_size(*w)),
                ("d", *d, is_size(*d)),
            ];
            if let Some((field, value, _)) = fields.into_iter().find(|(.., is_valid)| !is_valid) {
                return Err(StepError::Value { id: id.clone(), field, value });
            }
        }
        Ok(())
    }
}

/// The last seconds of a world that is driven elsewhere.
#[derive(Clone, Debug)]
pub struct Window {
    start_us: i64,
    /// Their objects stay known when they have left.
    ridden: Vec<String>,
    /// By number.
    objects: BTreeMap<u32, Kept>,
    /// Times of the steps that are kept.
    steps: VecDeque<Span>,
}

#[derive(Clone, Debug)]
struct Kept {
    id: String,
    class: Class,
    w: f64,
    d: f64,
    samples: Vec<Sample>,
}

impl Window {
    /// Of a world that began at this time, µs; objects of these names stay known when they have left.
    pub const fn new(start_us: i64, ridden: Vec<String>) -> Self {
        Self { start_us, ridden, objects: BTreeMap::new(), steps: VecDeque::new() }
    }

    /// Adds a step that came now; one that is not newer than the newest changes nothing.
    pub fn push(&mut self, step: WorldStep, now: Timestamp) -> Result<(), StepError> {
        if step.start_us != self.start_us {
            return Err(StepError::OtherStart { found_us: step.start_us, expected_us: self.start_us });
        }
        step.check(now)?;
        let t = Span::from_micros(step.t_us);
        if self.steps.back().is_some_and(|newest| t <= *newest) {
            return Ok(());
        }
        self.steps.push_back(t);
        for LiveObject { number, id, class, x, y, yaw, w, d } in step.objects {
            let kept =
                self.objects.entry(number).or_insert_with(|| Kept { id, class, w, d, samples: Vec::new() });
            kept.samples.push(Sample { t, pose: Pose { x, y, yaw: wrap_angle(yaw) } });
        }
        self.forget(t - KEPT);
        while self.steps.len() > MOST_STEPS || (self.steps.len() > 2 && self.n_samples() > MOST_SAMPLES) {
            // So many at once: the older half goes.
            self.forget(self.steps[self.steps.len() / 2]);
        }
        Ok(())
    }

    fn n_samples(&self) -> usize {
        self.objects.values().map(|kept| kept.samples.len()).sum()
    }

    /// Forgets what was before a time.
    fn forget(&mut self, before: Span) {
        while self.steps.front().is_some_and(|step| *step < before) {
            self.steps.pop_front();
        }
        let Self { ridden, objects, .. } = self;
        let are_few = objects.len() <= MOST;
        objects.retain(|_, kept| {
            let n_old = kept.samples.partition_point(|sample| sample.t < before);
            kept.samples.drain(..n_old);
            !kept.samples.is_empty() || (are_few && ridden.contains(&kept.id))
        });
    }

    /// Whether it is known where everything is at a scenario time.
    pub fn covers(&self, t: Span) -> bool {
        self.known().is_some_and(|(from, to)| from <= t && t <= to)
    }

    /// The scenario times between which it is known where everything is.
    pub fn known(&self) -> Option<(Span, Span)> {
        self.steps.front().copied().zip(self.newest())
    }

    /// The newest scenario time.
    pub fn newest(&self) -> Option<Span> {
        self.steps.back().copied()
    }

    /// The traffic of the window in scenario time, and the number of each of its objects, in rising order.
    pub fn traffic(&self) -> (Traffic, Vec<u32>) {
        let step = self.steps.iter().zip(self.steps.iter().skip(1)).map(|(a, b)| *b - *a).max();
        let step = step.unwrap_or(Span::ZERO);
        let max_gap = LEAST_GAP.max(Span::from_nanos(step.as_nanos().saturating_mul(3)));
        let object = |kept: &Kept| RecordedObject {
            name: kept.id.clone(),
            class: kept.class,
            w: kept.w,
            d: kept.d,
            trajectory: Arc::new(Trajectory::new(kept.samples.clone(), max_gap)),
        };
        let traffic = Traffic {
            format: Format::Live,
            objects: self.objects.values().map(object).collect(),
            n_rows: self.n_samples(),
            first_s: 0.0,
            length: self.newest().unwrap_or(Span::ZERO),
            step,
            max_gap,
            origin: (0.0, 0.0),
            scene: None,
            areas: Vec::new(),
            remarks: Remarks::default(),
        };
        (traffic, self.objects.keys().copied().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn car(number: u32, id: &str, x: f64) -> LiveObject {
        LiveObject { number, id: id.to_owned(), class: Class::Car, x, y: 0.0, yaw: 0.0, w: 1.8, d: 4.5 }
    }

    fn step(millis: i64, objects: Vec<LiveObject>) -> WorldStep {
        WorldStep { start_us: 7, t_us: 1000 * millis, objects }
    }

    /// A minute after the world began, so that each step of the tests has come.
    fn now() -> Timestamp {
        Timestamp::from_micros(60_000_007).unwrap()
    }

    #[test]
    fn objects_are_between_their_steps_and_leave_with_their_last_one() {
        let mut window = Window::new(7, Vec::new());
        assert!(!window.covers(Span::ZERO));
        window.push(step(0, vec![car(1, "a", 0.0)]), now()).unwrap();
        window.push(step(1000, vec![car(1, "a", 10.0), car(2, "b", 5.0)]), now()).unwrap();
        window.push(step(2000, vec![car(2, "b", 6.0)]), now()).unwrap();
        // A repeated step changes nothing.
        window.push(step(1000, vec![car(3, "c", 5.0)]), now()).unwrap();
        assert!(window.covers(Span::from_millis(2000)) && !window.covers(Span::from_millis(2001)));
        let (traffic, numbers) = window.traffic();
        assert_eq!(numbers, [1, 2]);
        let x = |index: usize, millis| {
            traffic.objects[index].trajectory.at(Span::from_millis(millis)).map(|state| state.pose.x)
        };
        assert_eq!((x(0, 500), x(0, 1500), x(1, 1500)), (Some(5.0), None, Some(5.5)));
    }

    #[test]
    fn what_left_long_ago_is_forgotten_but_for_what_is_ridden_on() {
        let mut window = Window::new(7, vec!["ego".to_owned()]);
        window.push(step(0, vec![car(1, "ego", 0.0), car(2, "b", 5.0)]), now()).unwrap();
        for second in 1..40 {
            window.push(step(1000 * second, vec![car(3, "c", 5.0)]), now()).unwrap();
        }
        let (traffic, numbers) = window.traffic();
        assert_eq!(numbers, [1, 3]);
        assert_eq!(traffic.n_rows, 11, "ten seconds of one object");
        assert!(!window.covers(Span::ZERO));
    }

    #[test]
    fn impossible_steps_are_refused_by_name() {
        let mut window = Window::new(7, Vec::new());
        let far = LiveObject { x: f64::NAN, ..car(1, "a", 0.0) };
        assert_eq!(window.push(step(0, vec![far]), now()).unwrap_err().to_string(), "object a: x is NaN");
        let other = WorldStep { start_us: 8, ..step(0, Vec::new()) };
        assert!(matches!(window.push(other, now()), Err(StepError::OtherStart { found_us: 8, .. })));
        assert_eq!(window.newest(), None);
    }

    #[test]
    fn a_step_of_a_far_time_does_not_hide_those_that_come() {
        let mut window = Window::new(7, Vec::new());
        let poison = WorldStep { t_us: i64::MAX, ..step(0, Vec::new()) };
        assert!(matches!(window.push(poison, now()), Err(StepError::Time { .. })));
        assert!(matches!(window.push(step(91_000, Vec::new()), now()), Err(StepError::Time { .. })));
        let nowhere = WorldStep { start_us: i64::MAX, ..step(0, Vec::new()) };
        assert!(matches!(
            Window::new(i64::MAX, Vec::new()).push(nowhere, now()),
            Err(StepError::Time { .. })
        ));
        window.push(step(60_000, vec![car(1, "a", 0.0)]), now()).unwrap();
        assert!(window.covers(Span::from_millis(60_000)));
    }

    #[test]
    fn numbers_of_nobody_and_of_agents_are_refused() {
        let mut window = Window::new(7, Vec::new());
        for number in [0, 100_000, 1_099_999, 1_000_000_000] {
            let refused = window.push(step(0, vec![car(number, "a", 0.0)]), now()).unwrap_err();
            assert_eq!(refused, StepError::Number { id: "a".to_owned(), number });
        }
        let twice = step(0, vec![car(1, "a", 0.0), car(1, "b", 0.0)]);
        assert!(matches!(window.push(twice, now()), Err(StepError::Number { number: 1, .. })));
        window.push(step(0, vec![car(1_100_000, "a", 0.0)]), now()).unwrap();
    }

    #[test]
    fn steps_that_come_too_often_are_not_all_kept() {
        let mut window = Window::new(7, Vec::new());
        for t_us in 0..30_000 {
            let step = WorldStep { t_us, ..step(0, vec![car(1, "a", 0.0)]) };
            window.push(step, now()).unwrap();
        }
        assert!(window.steps.len() <= MOST_STEPS && window.n_samples() <= MOST_STEPS);
        assert_eq!(window.newest(), Some(Span::from_micros(29_999)));
    }
}
