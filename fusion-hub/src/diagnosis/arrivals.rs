//! When an agent's frames arrive: rate, delay, gaps, and whether two processes send them.

use super::intervals::Intervals;
use super::observation::Observation;
use serde::{Deserialize, Serialize};
use v2x_common::geometry::Pose;
use v2x_common::time::{Span, Timestamp};

/// Epochs that are remembered: two processes have two.
const N_EPOCHS: usize = 4;
/// A sensor that is further from its last place than this and what it can drive is another one, m and m/s.
const JUMP_M: f64 = 5.0;
const FASTEST_MPS: f64 = 60.0;
/// A number that is lower than the one before by more is of another count: late frames are nearer.
const FALL: u64 = 100;
/// Numbers that are this many times as many as frames are no count of frames.
const MOST_PER_FRAME: u64 = 20;

/// Frames of one stamp that say that it never changes, and how long they must have come.
const MIN_OF_ONE_STAMP: u64 = 6;
const ONE_STAMP_FOR: Span = Span::from_millis(1_500);

/// GPS counts from 6 January 1980, without leap seconds, of which there have been fewer than these.
const GPS_EPOCH: Span = Span::from_millis(315_964_800_000);
const OF_GPS: Span = Span::from_millis(60_000);

/// Of one agent.
#[derive(Clone, Debug, Default)]
pub(super) struct Arrivals {
    pub(super) frames: u64,
    /// The stamp of all frames; no stamp once there was a second one.
    stamp: Stamps,
    received: Option<(Timestamp, Timestamp)>,
    /// From capture to arrival, the shortest two and the longest two, s: a single stamp that is odd says nothing.
    shortest_s: Extremes,
    longest_s: Extremes,
    delay_sum_s: f64,
    delay_squares_s2: f64,
    epochs: Vec<u64>,
    /// How often frames of an epoch came after those of a later one.
    pub(super) epoch_returns: u64,
    numbers: Numbers,
    poses: Poses,
    intervals: Intervals,
}

/// The stamps of frames.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Stamps {
    #[default]
    None,
    One(Timestamp),
    Several,
}

/// The two least of some numbers.
#[derive(Clone, Copy, Debug, Default)]
struct Extremes([Option<f64>; 2]);

impl Extremes {
    fn note(&mut self, value: f64) {
        let [least, second] = &mut self.0;
        if least.is_none_or(|least| value < least) {
            *second = least.replace(value);
        } else if second.is_none_or(|second| value < second) {
            *second = Some(value);
        }
    }

    /// The second one, or the only one.
    fn second(&self) -> Option<f64> {
        self.0[1].or(self.0[0])
    }
}

/// The sequence numbers of the current epoch, and what was missing in earlier ones.
#[derive(Clone, Copy, Debug, Default)]
struct Numbers {
    span: Option<(u64, u64)>,
    n: u64,
    expected: u64,
    received: u64,
    last: Option<u64>,
    /// How often a number was far below the one before.
    falls: u64,
}

/// Places of the sensor that are too far from each other for one.
#[derive(Clone, Copy, Debug, Default)]
struct Poses {
    last: Option<(Pose, Timestamp)>,
    other: Option<(Pose, Timestamp)>,
    returns: u64,
}

impl Arrivals {
    pub(super) fn note(&mut self, seen: &Observation<'_>) {
        let (at, frame) = (seen.received_at, seen.frame);
        self.frames += 1;
        self.stamp = match self.stamp {
            Stamps::None => Stamps::One(frame.captured_at),
            Stamps::One(stamp) if stamp == frame.captured_at => self.stamp,
            _ => Stamps::Several,
        };
        self.received = Some(self.received.map_or((at, at), |(from, to)| (from.min(at), to.max(at))));
        let delay_s = (at - frame.captured_at).as_secs_f64();
        self.shortest_s.note(delay_s);
        self.longest_s.note(-delay_s);
        self.delay_sum_s += delay_s;
        self.delay_squares_s2 += delay_s * delay_s;
        self.note_epoch(frame.id.epoch);
        let number = seen.reported.has_sequence.then_some(frame.id.sequence);
        self.intervals.note(frame.captured_at, at, number);
        if let Some(number) = number {
            self.numbers.note(number);
        }
        if let Some(pose) = frame.sensor_pose {
            self.poses.note(pose, frame.captured_at);
        }
    }

    fn note_epoch(&mut self, epoch: u64) {
        if self.epochs.last() == Some(&epoch) {
            return;
        }
        self.numbers.begin();
        if let Some(place) = self.epochs.iter().position(|known| *known == epoch) {
            self.epochs.remove(place);
            self.epoch_returns += 1;
        } else if self.epochs.len() >= N_EPOCHS {
            self.epochs.remove(0);
        }
        self.epochs.push(epoch);
    }

    /// Whether all frames of a while have one stamp.
    pub(super) fn is_one_stamp(&self) -> bool {
        let is_one = matches!(self.stamp, Stamps::One(_));
        is_one && self.frames >= MIN_OF_ONE_STAMP && self.lasted() >= ONE_STAMP_FOR
    }

    /// Whether its capture times count from 1980, as GPS does, in place of 1970.
    pub(super) fn counts_from_1980(&self) -> bool {
        let off = self.delay().map(|(least, _)| (least - GPS_EPOCH).abs());
        self.frames >= MIN_OF_ONE_STAMP && off.is_some_and(|off| off <= OF_GPS)
    }

    /// From the first frame to the last one.
    pub(super) fn lasted(&self) -> Span {
        self.received.map_or(Span::ZERO, |(from, to)| to - from)
    }

    /// Frames per second; `None` of less than a few.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub(super) fn rate_hz(&self) -> Option<f64> {
        let (from, to) = self.received?;
        let seconds = (to - from).as_secs_f64();
        (self.frames > 2 && seconds > 0.0).then(|| (self.frames - 1) as f64 / seconds)
    }

    /// The shortest and the longest delay from capture to arrival, but for one frame each.
    pub(super) fn delay(&self) -> Option<(Span, Span)> {
        let (least, most) = (self.shortest_s.second()?, -self.longest_s.second()?);
        Some((Span::from_secs_f64(least), Span::from_secs_f64(most)))
    }

    /// Standard deviation of the delay, s.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub(super) fn jitter_s(&self) -> f64 {
        let n = (self.frames as f64).max(1.0);
        let mean = self.delay_sum_s / n;
        libm::sqrt((self.delay_squares_s2 / n - mean * mean).max(0.0))
    }

    /// By how much its stamps scatter, s, where it is they that do, and not the link.
    pub(super) fn scatter_of_stamps_s(&self) -> Option<f64> {
        self.intervals.scatter_of_stamps_s()
    }

    /// The mean delay, s.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub(super) fn mean_delay_s(&self) -> f64 {
        self.delay_sum_s / (self.frames as f64).max(1.0)
    }

    /// Frames that are missing, and frames that were sent, by their numbers; `None` where those do not count frames.
    pub(super) fn missing(&self) -> Option<(u64, u64)> {
        let mut numbers = self.numbers;
        numbers.begin();
        let counts_frames = numbers.received > 0 && numbers.expected <= MOST_PER_FRAME * numbers.received;
        counts_frames.then(|| (numbers.expected.saturating_sub(numbers.received), numbers.expected))
    }

    /// How often its numbers fell back.
    pub(super) const fn falls(&self) -> u64 {
        self.numbers.falls
    }

    /// How often the sensor was back at a place from which it had jumped away.
    pub(super) const fn place_returns(&self) -> u64 {
        self.poses.returns
    }
}

impl Numbers {
    fn note(&mut self, number: u64) {
        // Without epochs an agent that is started again begins to count anew.
        if self.last.replace(number).is_some_and(|last| number.saturating_add(FALL) < last) {
            self.begin();
            self.falls += 1;
        }
        self.span =
            Some(self.span.map_or((number, number), |(least, most)| (least.min(number), most.max(number))));
        self.n += 1;
    }

    /// Begins another epoch.
    fn begin(&mut self) {
        if let Some((least, most)) = self.span.take() {
            self.expected = self.expected.saturating_add((most - least).saturating_add(1));
            self.received += self.n;
        }
        self.n = 0;
    }
}

impl Poses {
    fn note(&mut self, pose: Pose, at: Timestamp) {
        let is_near = |known: Option<(Pose, Timestamp)>| {
            known.is_some_and(|(known, then)| {
                let reach_m = JUMP_M + FASTEST_MPS * (at - then).abs().as_secs_f64();
                known.distance_to(pose.x, pose.y) <= reach_m
            })
        };
        if self.last.is_some() && !is_near(self.last) {
            self.returns += u64::from(is_near(self.other));
            self.other = self.last;
        }
        self.last = Some((pose, at));
    }
}

/// How an agent's frames arrive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Transport {
    /// Frames a second.
    pub rate_hz: f64,
    /// Mean time from capture to arrival, ms, by the agent's and the hub's clocks.
    pub delay_ms: f64,
    /// Its standard deviation, ms.
    pub jitter_ms: f64,
    /// Share of frames that are missing by their sequence numbers; `None` where those do not count frames.
    pub missing: Option<f64>,
}

impl Transport {
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub(super) fn of(arrivals: &Arrivals) -> Option<Self> {
        Some(Self {
            rate_hz: arrivals.rate_hz()?,
            delay_ms: 1e3 * arrivals.mean_delay_s(),
            jitter_ms: 1e3 * arrivals.jitter_s(),
            missing: arrivals.missing().map(|(missing, sent)| missing as f64 / (sent as f64).max(1.0)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::detection::DetectionFrame;
    use v2x_common::id::{AgentId, FrameId};
    use v2x_common::reported::Reported;

    fn note(arrivals: &mut Arrivals, (epoch, sequence): (u64, u64), at_ms: i64, x: f64) {
        let id = FrameId { agent: AgentId::new("a").unwrap(), epoch, sequence };
        let captured_at = Timestamp::EPOCH + Span::from_millis(at_ms);
        let frame = DetectionFrame {
            sensor_pose: Some(Pose { x, y: 0.0, yaw: 0.0 }),
            ..DetectionFrame::empty(id, captured_at)
        };
        let reported = Reported { has_sequence: true, ..Reported::default() };
        let received_at = captured_at + Span::from_millis(if sequence % 2 == 0 { 20 } else { 40 });
        arrivals.note(&Observation { frame: &frame, reported: &reported, received_at });
    }

    #[test]
    fn rate_delay_jitter_and_missing_frames_are_those_of_the_frames() {
        let mut arrivals = Arrivals::default();
        (0..50).filter(|k| k % 5 != 1).for_each(|k| {
            note(&mut arrivals, (7, k), 100 * i64::try_from(k).unwrap(), 0.1 * k as f64);
        });
        assert_eq!(arrivals.missing(), Some((10, 50)));
        assert_eq!(arrivals.delay(), Some((Span::from_millis(20), Span::from_millis(40))));
        assert!(
            (arrivals.jitter_s() - 0.01).abs() < 0.001 && (arrivals.rate_hz().unwrap() - 8.0).abs() < 0.1
        );
        assert_eq!((arrivals.epoch_returns, arrivals.place_returns()), (0, 0));
    }

    #[test]
    fn a_fault_of_two_processes_under_one_name_is_distinguished_from_a_restart() {
        let (mut restarted, mut two) = (Arrivals::default(), Arrivals::default());
        for k in 0..20 {
            note(&mut restarted, (u64::from(k >= 10), k % 10), 100 * i64::try_from(k).unwrap(), 0.0);
            note(
                &mut two,
                (k % 2, k / 2),
                100 * i64::try_from(k).unwrap(),
                if k % 2 == 0 { 0.0 } else { 80.0 },
            );
        }
        assert_eq!(
            (restarted.epoch_returns, restarted.place_returns(), restarted.missing()),
            (0, 0, Some((0, 20)))
        );
        assert_eq!((two.epoch_returns, two.place_returns()), (18, 18));
    }

    #[test]
    fn a_stamp_that_never_changes_is_seen_after_some_frames_and_not_beside_another_one() {
        let mut arrivals = Arrivals::default();
        let mut note = |captured_ms: i64, received_ms: i64| {
            let at = |ms: i64| Timestamp::EPOCH + Span::from_millis(ms);
            let id = FrameId { agent: AgentId::new("a").unwrap(), epoch: 0, sequence: 0 };
            let frame = DetectionFrame::empty(id, at(captured_ms));
            let received_at = at(received_ms);
            arrivals.note(&Observation { frame: &frame, reported: &Reported::default(), received_at });
            arrivals.is_one_stamp()
        };
        let seen: Vec<_> = (0..20).map(|k| note(5, 100 * k)).collect();
        assert_eq!(seen.iter().position(|seen| *seen), Some(15), "{seen:?}");
        assert!(!note(6, 2_000) && !note(5, 2_100));
    }

    #[test]
    fn numbers_that_are_times_count_no_frames() {
        let mut arrivals = Arrivals::default();
        (0..10).for_each(|k| note(&mut arrivals, (0, 100_000 * k), 100 * i64::try_from(k).unwrap(), 0.0));
        assert_eq!(arrivals.missing(), None);
    }
}
