//! The publishing instants of a live hub, of a log, and of keyframes.

use crate::drive::driver::{Asked, Publishing};
use crate::drive::ticks::Ticks;
use std::collections::VecDeque;
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::engine::Disposition;
use v2x_fusion_hub::engine::{PublishMode, Schedule};

/// Publishes as a live hub does.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AsHub(Schedule);

impl AsHub {
    /// A hub that starts at this time.
    pub(crate) const fn new(mode: PublishMode, start: Timestamp) -> Self {
        Self(Schedule::new(mode, start))
    }
}

impl Publishing for AsHub {
    fn next_due(&self) -> Option<Timestamp> {
        Some(self.0.next_deadline())
    }

    fn take(&mut self, due: Timestamp) -> Asked {
        self.0.take_due(due);
        Asked::Now
    }

    fn on_arrival(&mut self, now: Timestamp, disposition: &Disposition) -> bool {
        if matches!(disposition, Disposition::Accepted { .. }) {
            self.0.note_update();
        }
        self.0.take_due(now)
    }
}

/// Publishes at every tick from a time on. What arrives at a tick is contained in the frame of this tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EveryTick(Ticks);

impl EveryTick {
    /// Ticks from this time on.
    pub(crate) fn from(begin: Timestamp) -> Self {
        Self(Ticks::within(begin, Timestamp::MAX))
    }
}

impl Publishing for EveryTick {
    fn next_due(&self) -> Option<Timestamp> {
        self.0.first()
    }

    fn take(&mut self, _: Timestamp) -> Asked {
        self.0.next();
        Asked::Now
    }

    fn leave_out(&mut self, last: Timestamp) -> Option<Ticks> {
        self.0.leave_out(last)
    }
}

/// Publishes the objects of every requested keyframe: at once, or after a lag.
#[derive(Clone, Debug)]
pub(crate) struct OfKeyframes {
    /// Zero: at once.
    lag: Span,
    asked: VecDeque<Timestamp>,
}

impl OfKeyframes {
    /// A keyframe is published this long after its own time.
    pub(crate) const fn new(lag: Span) -> Self {
        Self { lag, asked: VecDeque::new() }
    }

    /// Requests a keyframe. Times must not decrease.
    pub(crate) fn ask(&mut self, at: Timestamp) {
        self.asked.push_back(at);
    }
}

impl Publishing for OfKeyframes {
    fn next_due(&self) -> Option<Timestamp> {
        self.asked.front().map(|at| *at + self.lag)
    }

    fn take(&mut self, due: Timestamp) -> Asked {
        let at = self.asked.pop_front().unwrap_or(due);
        if self.lag > Span::ZERO { Asked::AsOf(at) } else { Asked::Now }
    }
}
