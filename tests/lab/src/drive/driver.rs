//! The one driver of engines: arrivals and publishing instants, in the order of time.
//!
//! Frames enter the engine at their time of arrival. Between two arrivals the [`Publishing`] decides when the engine
//! publishes. What is due before an arrival does not contain it.

use crate::drive::ticks::Ticks;
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::FusedFrame;
use v2x_common::id::AgentId;
use v2x_common::sensor::{Accuracy, SensorDescription};
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::engine::Disposition;
use v2x_fusion_hub::engine::{Engine, Refusal};

/// The time for which published objects hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// The instant of publishing.
    Now,
    /// An earlier time, by everything known since.
    AsOf(Timestamp),
}

/// When an engine publishes its objects.
pub trait Publishing {
    /// The next instant at which a fused frame is due without any arrival; `None` where none is planned.
    fn next_due(&self) -> Option<Timestamp>;

    /// Marks the fused frame that is due at this instant as published.
    fn take(&mut self, due: Timestamp) -> Asked;

    /// A frame has arrived. Whether a fused frame is published at once.
    fn on_arrival(&mut self, now: Timestamp, disposition: &Disposition) -> bool {
        let _ = (now, disposition);
        false
    }

    /// Leaves out everything that is due until `last`, since the engine has no tracks. Returns the instants left out.
    fn leave_out(&mut self, last: Timestamp) -> Option<Ticks> {
        let _ = last;
        None
    }
}

/// Receives the fused frames.
pub trait Consumer {
    /// Why a frame cannot be received.
    type Error;

    /// A fused frame was published at `now`.
    fn receive(&mut self, now: Timestamp, frame: &FusedFrame) -> Result<(), Self::Error>;

    /// The second list, which is a lag behind, was published. Only of a driver with [`Driver::with_second_list`].
    fn receive_lagged(&mut self, frame: &FusedFrame) -> Result<(), Self::Error> {
        let _ = frame;
        Ok(())
    }

    /// A frame arrived, accepted or not.
    fn note_arrival(&mut self, frame: &DetectionFrame, received_at: Timestamp) {
        let _ = (frame, received_at);
    }

    /// At these instants there are no objects.
    fn receive_nothing(&mut self, ticks: Ticks) {
        let _ = ticks;
    }
}

/// An engine with its publishing instants.
#[derive(Debug)]
pub struct Driver<P> {
    engine: Engine,
    publishing: P,
    stopwatch: fn() -> Span,
    engine_time: Span,
    has_second_list: bool,
}

impl<P: Publishing> Driver<P> {
    /// A driver of this engine.
    pub const fn new(engine: Engine, publishing: P) -> Self {
        let (stopwatch, engine_time) = (|| Span::ZERO, Span::ZERO);
        Self { engine, publishing, stopwatch, engine_time, has_second_list: false }
    }

    /// Counts a frame of an agent that is refused before the engine.
    pub fn refuse(&mut self, agent: AgentId, refusal: Refusal) {
        self.engine.note_refusal(agent, refusal);
    }

    /// Measures the computing time of the engine by this stopwatch, which returns the computing time used so far.
    #[must_use]
    pub fn timed_by(self, stopwatch: fn() -> Span) -> Self {
        Self { stopwatch, ..self }
    }

    /// Publishes the engine's second list, where its settings have one, behind every one of the first.
    #[must_use]
    pub fn with_second_list(self) -> Self {
        Self { has_second_list: true, ..self }
    }

    /// The computing time that the engine has taken.
    pub const fn engine_time(&self) -> Span {
        self.engine_time
    }

    /// The publishing instants.
    pub const fn publishing_mut(&mut self) -> &mut P {
        &mut self.publishing
    }

    /// The engine after everything.
    pub fn into_engine(self) -> Engine {
        self.engine
    }

    /// Goes on with a new engine.
    pub fn restart(&mut self, engine: Engine) {
        self.engine = engine;
    }

    /// An agent describes its sensor. An invalid description counts as refused.
    pub fn describe(&mut self, agent: AgentId, description: SensorDescription) {
        let accepted = self.engine.handle_description(agent, description);
        debug_assert!(accepted.is_ok(), "{accepted:?}");
    }

    /// An agent declares the accuracy of its pose and clock, and nothing else of its sensor.
    pub fn declare_accuracy(&mut self, agent: AgentId, accuracy: Accuracy) {
        self.engine.declare_accuracy(agent, accuracy);
    }

    /// A frame arrives. Everything that is due before is published first.
    pub fn arrive<C: Consumer>(
        &mut self,
        frame: &DetectionFrame,
        received_at: Timestamp,
        consumer: &mut C,
    ) -> Result<Disposition, C::Error> {
        self.publish_before(received_at, consumer)?;
        let begun = (self.stopwatch)();
        let disposition = self.engine.handle_frame(frame, received_at);
        self.engine_time = self.engine_time + ((self.stopwatch)() - begun);
        consumer.note_arrival(frame, received_at);
        if self.publishing.on_arrival(received_at, &disposition) {
            self.publish(received_at, Asked::Now, consumer)?;
        }
        Ok(disposition)
    }

    /// Publishes everything that is due before a time.
    pub fn publish_before<C: Consumer>(
        &mut self,
        until: Timestamp,
        consumer: &mut C,
    ) -> Result<(), C::Error> {
        self.publish_through(until - Span::from_nanos(1), consumer)
    }

    /// Publishes everything that is due up to a time, and at it.
    pub fn publish_through<C: Consumer>(
        &mut self,
        last: Timestamp,
        consumer: &mut C,
    ) -> Result<(), C::Error> {
        while let Some(due) = self.publishing.next_due().filter(|due| *due <= last) {
            let asked = self.publishing.take(due);
            let is_empty = self.publish(due, asked, consumer)?;
            // A log may have gaps of years.
            if is_empty
                && self.engine.counts().tracks == 0
                && let Some(ticks) = self.publishing.leave_out(last)
            {
                consumer.receive_nothing(ticks);
            }
        }
        Ok(())
    }

    /// Publishes one frame. Returns whether it has no objects.
    fn publish<C: Consumer>(
        &mut self,
        now: Timestamp,
        asked: Asked,
        consumer: &mut C,
    ) -> Result<bool, C::Error> {
        let begun = (self.stopwatch)();
        let fused = match asked {
            Asked::Now => self.engine.fused(now),
            Asked::AsOf(at) => self.engine.fused_as_of(at, at).expect("history is as long as the lag"),
        };
        self.engine_time = self.engine_time + ((self.stopwatch)() - begun);
        consumer.receive(now, fused)?;
        let is_empty = fused.objects.is_empty();
        Ok(self.publish_second(now, consumer)? && is_empty)
    }

    /// Publishes the second list alone at everything that is due up to a time: it ends a lag after the first one.
    pub fn conclude_second_list<C: Consumer>(
        &mut self,
        last: Timestamp,
        consumer: &mut C,
    ) -> Result<(), C::Error> {
        while let Some(due) = self.publishing.next_due().filter(|due| *due <= last) {
            self.publishing.take(due);
            self.publish_second(due, consumer)?;
        }
        Ok(())
    }

    /// Publishes the second list, where one is wanted. Returns whether it has no objects.
    fn publish_second<C: Consumer>(&mut self, now: Timestamp, consumer: &mut C) -> Result<bool, C::Error> {
        if !self.has_second_list {
            return Ok(true);
        }
        let begun = (self.stopwatch)();
        let lagged = self.engine.lagged(now);
        self.engine_time = self.engine_time + ((self.stopwatch)() - begun);
        let Some(lagged) = lagged else { return Ok(true) };
        consumer.receive_lagged(lagged)?;
        Ok(lagged.objects.is_empty())
    }
}
