//! The log through the engine: frames as they arrived, objects at every tick.

use crate::data::detection_log::{Arrival, DetectionLog};
use std::collections::BTreeMap;
use std::io::Read;
use v2x_common::fused::FusedObject;
use v2x_common::sensor::SensorDescription;
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::refusal::Disposition;

/// Time between two ticks; they are at its multiples.
pub const TICK: Span = Span::from_millis(100);

/// Who is told of the objects.
pub trait Consumer {
    /// The objects at a tick, with all that has arrived by then.
    fn tell(&mut self, at: Timestamp, objects: &[FusedObject]) -> anyhow::Result<()>;

    /// There is nothing at any tick from the first to the last of these.
    fn tell_nothing(&mut self, ticks: Ticks);

    /// So many bytes of the log have been read.
    fn tell_progress(&mut self, n_bytes: u64);
}

/// What went through.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Counts {
    /// Frames, refused ones among them.
    pub frames: u64,
    /// Detections, those of refused frames among them.
    pub detections: u64,
    /// Ticks.
    pub ticks: u64,
    /// Frames refused, by reason.
    pub refused: BTreeMap<&'static str, u64>,
    /// Time that the engine took.
    pub core: Span,
    /// From the first to the last arrival.
    pub duration: Span,
}

/// Ticks in a row; none where the first is after the last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ticks {
    next: i64,
    last: i64,
}

impl Ticks {
    /// Those of a stretch of time, its ends among them.
    pub fn within(begin: Timestamp, end: Timestamp) -> Self {
        let step = TICK.as_nanos();
        let (begin, end) = (begin.as_nanos(), end.as_nanos());
        let is_after_tick = begin.rem_euclid(step) != 0;
        Self { next: begin.div_euclid(step) + i64::from(is_after_tick), last: end.div_euclid(step) }
    }

    /// Only those within a stretch of time.
    #[must_use]
    pub fn clamped_to(self, begin: Timestamp, end: Timestamp) -> Self {
        let other = Self::within(begin, end);
        Self { next: self.next.max(other.next), last: self.last.min(other.last) }
    }

    /// How many.
    pub const fn n(self) -> u64 {
        if self.last < self.next { 0 } else { (self.last - self.next).unsigned_abs() + 1 }
    }
}

impl Iterator for Ticks {
    type Item = Timestamp;

    fn next(&mut self) -> Option<Timestamp> {
        let place = self.next;
        (place <= self.last).then(|| {
            self.next += 1;
            Timestamp::from_nanos(place * TICK.as_nanos())
        })
    }
}

/// An engine that is fed with a log.
#[derive(Debug)]
pub struct Replay {
    engine: Engine,
    description: Option<SensorDescription>,
    /// Tells how much computing time was used so far.
    stopwatch: fn() -> Span,
    counts: Counts,
}

impl Replay {
    /// Of an engine that knows nothing yet; every sensor describes itself to it so.
    pub fn new(engine: Engine, description: Option<SensorDescription>, stopwatch: fn() -> Span) -> Self {
        Self { engine, description, stopwatch, counts: Counts::default() }
    }

    /// Feeds it with the whole log.
    pub fn run<R: Read>(
        mut self,
        log: &mut DetectionLog<R>,
        consumer: &mut impl Consumer,
    ) -> anyhow::Result<Counts> {
        let Some(mut arrival) = log.next_arrival()? else { return Ok(self.counts) };
        let begin = arrival.received_at;
        // What arrives at a tick is known at it.
        let mut told_until = begin;
        loop {
            self.take(&mut arrival);
            consumer.tell_progress(log.n_bytes());
            let next = log.next_arrival()?;
            let newest = arrival.received_at;
            let until = next.as_ref().map_or(newest, |next| next.received_at);
            if until > newest {
                self.tell(Ticks::within(told_until, until - Span::from_nanos(1)), consumer)?;
                told_until = until;
            }
            match next {
                Some(next) => arrival = next,
                None => break,
            }
        }
        let end = arrival.received_at;
        self.tell(Ticks::within(told_until, end), consumer)?;
        self.counts.ticks = Ticks::within(begin, end).n();
        self.counts.duration = end - begin;
        Ok(self.counts)
    }

    fn take(&mut self, Arrival { received_at, frame }: &mut Arrival) {
        if let Some(description) = self.description {
            if frame.id.sequence == 0 {
                self.engine.handle_description(frame.id.agent, description);
            }
            frame.sensor_revision = description.revision;
        }
        self.counts.frames += 1;
        self.counts.detections += frame.detections.len() as u64;
        let begun = (self.stopwatch)();
        let disposition = self.engine.handle_frame(frame, *received_at);
        self.counts.core = self.counts.core + ((self.stopwatch)() - begun);
        if let Disposition::Refused(refusal) = disposition {
            *self.counts.refused.entry(refusal.reason()).or_default() += 1;
        }
    }

    fn tell(&mut self, mut ticks: Ticks, consumer: &mut impl Consumer) -> anyhow::Result<()> {
        while let Some(at) = ticks.next() {
            let begun = (self.stopwatch)();
            let fused = self.engine.fused(at);
            self.counts.core = self.counts.core + ((self.stopwatch)() - begun);
            let objects = &fused.objects;
            // With a lag objects hold for an earlier time than that at which they are told.
            consumer.tell(fused.fused_at, objects)?;
            // A log may be silent for years.
            if objects.is_empty() && self.engine.n_tracks() == 0 {
                consumer.tell_nothing(ticks);
                return Ok(());
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use v2x_common::id::HubId;
    use v2x_fusion_hub::config::EngineConfig;

    const HEADER: &str = "t_arr,t,sensor_id,class,x,y,w,d,yaw,sx,sy,sw,sd,st\n";

    /// Ticks with the places and tracks of their objects.
    #[derive(Default)]
    struct Notes {
        told: Vec<(i64, Vec<f64>)>,
        silent: u64,
    }

    impl Consumer for Notes {
        fn tell(&mut self, at: Timestamp, objects: &[FusedObject]) -> anyhow::Result<()> {
            let places = objects.iter().map(|object| object.bev.x).collect();
            self.told.push((at.as_nanos() / 1_000_000, places));
            Ok(())
        }

        fn tell_nothing(&mut self, ticks: Ticks) {
            self.silent += ticks.n();
        }

        fn tell_progress(&mut self, _: u64) {}
    }

    fn row(t_arr: &str, t: &str, x: f64) -> String {
        format!("{t_arr},{t},a,car,{x},0,2,4,0,0.5,0.5,0.2,0.4,0.1\n")
    }

    fn replayed(rows: &str) -> (Counts, Notes) {
        let text = format!("{HEADER}{rows}");
        let mut log = DetectionLog::new(text.as_bytes(), Path::new("log.csv")).unwrap();
        let engine = Engine::new(EngineConfig::new(HubId::new("lab").unwrap(), 0));
        let mut notes = Notes::default();
        let counts = Replay::new(engine, None, || Span::ZERO).run(&mut log, &mut notes).unwrap();
        (counts, notes)
    }

    #[test]
    fn a_tick_knows_what_arrived_at_it_and_nothing_later() {
        let rows = row("0.05", "0.0", 1.0) + &row("0.2", "0.1", 40.0) + &row("0.3000001", "0.3", 80.0);
        let (counts, notes) = replayed(&rows);
        let told: Vec<_> = notes.told.iter().map(|(ms, places)| (*ms, places.len())).collect();
        assert_eq!(told, [(100, 1), (200, 2), (300, 2)]);
        assert_eq!((counts.frames, counts.ticks, counts.duration.as_nanos()), (3, 3, 250_000_100));
    }

    #[test]
    fn ticks_are_multiples_of_a_tenth_from_the_first_to_the_last_arrival_in_any_epoch() {
        for (first, second) in [("-0.35", "-0.1"), ("1700000000.65", "1700000000.9")] {
            let (_, notes) = replayed(&(row(first, first, 1.0) + &row(second, second, 1.0)));
            let ms: Vec<_> = notes.told.iter().map(|(ms, _)| ms % 1000).collect();
            let expected = if first.starts_with('-') { [-300, -200, -100] } else { [700, 800, 900] };
            assert_eq!(ms, expected);
        }
        assert_eq!(Ticks::within(Timestamp::from_nanos(1), Timestamp::from_nanos(2)).n(), 0);
        assert_eq!(Ticks::within(Timestamp::EPOCH, Timestamp::EPOCH).n(), 1);
    }

    #[test]
    fn refusals_are_counted_by_reason() {
        let rows = row("1", "1", 1.0) + &row("1.1", "0.5", 1.0) + &row("1.2", "1.9", 1.0);
        let (counts, _) = replayed(&rows);
        assert_eq!(counts.refused, BTreeMap::from([("too_early", 1), ("too_late", 1)]));
        assert_eq!((counts.frames, counts.detections), (3, 3));
    }

    #[test]
    fn years_of_silence_take_no_time() {
        let rows = row("0", "0", 1.0) + &row("1700000000", "1700000000", 1.0);
        let (counts, notes) = replayed(&rows);
        assert_eq!(counts.ticks, 17_000_000_001);
        assert_eq!(notes.told.len() as u64 + notes.silent, counts.ticks);
        assert!(notes.told.len() < 1000, "{}", notes.told.len());
        assert_eq!(notes.told.last().unwrap().1.len(), 1);
    }

    #[test]
    fn an_empty_log_has_no_ticks() {
        assert_eq!(replayed("").0, Counts::default());
    }
}
