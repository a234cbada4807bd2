//! When to publish. Pure: asked after every event, and woken at its next deadline.

use serde::{Deserialize, Serialize};
use v2x_common::time::{Span, Timestamp};

/// How often a hub publishes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum PublishMode {
    /// After every accepted frame, and at a regular tick when nothing comes.
    OnUpdate {
        /// Longest time without a fused frame.
        tick: Span,
        /// Shortest time between two: updates that come faster share one.
        min_interval: Span,
    },
    /// At a fixed rate.
    Fixed {
        /// Time between two fused frames.
        interval: Span,
    },
}

/// The publishing schedule of one hub.
#[derive(Clone, Copy, Debug)]
pub struct Schedule {
    mode: PublishMode,
    last: Timestamp,
    has_update: bool,
    /// Until then the time belongs to frames that arrive.
    rests_until: Timestamp,
}

/// After a fused frame that took a time, so many times that belongs to the frames that arrive: publishing takes half of the time
/// at most, however long a list is; and a quarter where frames wait all the same.
const REST: i64 = 1;
const REST_BEHIND: i64 = 3;

impl Schedule {
    /// A schedule that begins now.
    pub const fn new(mode: PublishMode, now: Timestamp) -> Self {
        Self { mode, last: now, has_update: false, rests_until: now }
    }

    /// A frame was accepted.
    pub const fn note_update(&mut self) {
        self.has_update = true;
    }

    /// When the next fused frame is due, unless an update makes it earlier.
    pub fn next_deadline(&self) -> Timestamp {
        match self.mode {
            PublishMode::OnUpdate { tick, min_interval } if self.has_update => {
                (self.last + min_interval).max(self.rests_until).min(self.last + tick.max(min_interval))
            }
            PublishMode::OnUpdate { tick, .. } => self.last + tick,
            PublishMode::Fixed { interval } => self.last + interval,
        }
    }

    /// A fused frame took from `begun_at` to `ended_at`. `is_behind` says whether frames wait for which there was no time
    /// before.
    pub fn note_published(&mut self, begun_at: Timestamp, ended_at: Timestamp, is_behind: bool) {
        let cost = (ended_at - begun_at).max(Span::ZERO);
        let times = if is_behind { REST_BEHIND } else { REST };
        self.rests_until = ended_at + Span::from_nanos(cost.as_nanos().saturating_mul(times));
    }

    /// Whether a fused frame is due.
    pub fn is_due(&self, now: Timestamp) -> bool {
        now >= self.next_deadline()
    }

    /// Whether a fused frame is due; the answer `true` is taken as carried out.
    pub fn take_due(&mut self, now: Timestamp) -> bool {
        let due = self.next_deadline();
        if now < due {
            return false;
        }
        self.last = match self.mode {
            // A fixed rate keeps its phase, unless it has fallen behind by more than a whole step.
            PublishMode::Fixed { interval } if now - due < interval => due,
            PublishMode::Fixed { .. } | PublishMode::OnUpdate { .. } => now,
        };
        self.has_update = false;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(micros: i64) -> Timestamp {
        Timestamp::EPOCH + Span::from_micros(micros)
    }

    const ON_UPDATE: PublishMode =
        PublishMode::OnUpdate { tick: Span::from_millis(100), min_interval: Span::from_millis(2) };

    #[test]
    fn an_update_is_published_at_once_and_a_burst_only_every_2_ms() {
        let mut schedule = Schedule::new(ON_UPDATE, at(0));
        schedule.note_update();
        assert!(schedule.take_due(at(50_000)));
        let mut published = 0;
        for micros in (50_100..60_000).step_by(100) {
            schedule.note_update();
            published += usize::from(schedule.take_due(at(micros)));
        }
        assert_eq!(published, 4, "10 ms of updates every 0.1 ms");
    }

    #[test]
    fn publishing_takes_half_of_the_time_a_quarter_where_frames_wait_and_a_tick_comes_all_the_same() {
        let publish = |cost: i64, is_behind: bool| {
            let mut schedule = Schedule::new(ON_UPDATE, at(0));
            let (mut now, mut published) = (0, 0);
            while now < 1_000_000 {
                schedule.note_update();
                if schedule.take_due(at(now)) {
                    published += 1;
                    schedule.note_published(at(now), at(now + cost), is_behind);
                    now += cost;
                }
                now += 100;
            }
            published
        };
        let (ever, behind) = (publish(2000, false), publish(2000, true));
        assert!((240..=260).contains(&ever) && (120..=130).contains(&behind), "{ever} {behind}");
        let short = publish(300, false);
        assert!((450..=500).contains(&short), "short lists are published as ever: {short}");
        assert_eq!(publish(60_000, true), 10, "at 100 ms");
    }

    #[test]
    fn a_tick_comes_when_nothing_else_does() {
        let mut schedule = Schedule::new(ON_UPDATE, at(0));
        assert!(!schedule.take_due(at(99_999)));
        assert_eq!(schedule.next_deadline(), at(100_000));
        assert!(schedule.take_due(at(100_000)));
        assert_eq!(schedule.next_deadline(), at(200_000));
    }

    #[test]
    fn a_fixed_rate_ignores_updates_and_keeps_its_phase() {
        let mut schedule = Schedule::new(PublishMode::Fixed { interval: Span::from_millis(50) }, at(0));
        schedule.note_update();
        assert!(!schedule.take_due(at(49_000)));
        assert!(schedule.take_due(at(53_000)), "late by 3 ms");
        assert_eq!(schedule.next_deadline(), at(100_000));
        assert!(schedule.take_due(at(300_000)), "late by four steps");
        assert_eq!(schedule.next_deadline(), at(350_000), "no burst to catch up");
    }
}
