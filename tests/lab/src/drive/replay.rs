//! A log of detections through an engine: frames as they arrived, objects at every tick.

use crate::data::csv_table::CsvError;
use crate::data::detection_log::{Arrival, DetectionLog};
use crate::drive::driver::{Consumer, Driver, Publishing};
use crate::drive::publishing::EveryTick;
use crate::drive::ticks::Ticks;
use std::collections::BTreeMap;
use std::io::Read;
use v2x_common::id::AgentId;
use v2x_common::sensor::{Accuracy, SensorDescription};
use v2x_common::time::Span;
use v2x_fusion_hub::engine::{AgentRecord, Disposition, Engine, Refusal};
use v2x_fusion_hub::learning::LearntSensorReport;
use v2x_fusion_hub::registration::AgentRegistration;

/// Counts of a replay.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Counts {
    /// Frames, refused ones included.
    pub frames: u64,
    /// Detections, those of refused frames included.
    pub detections: u64,
    /// Ticks.
    pub ticks: u64,
    /// Frames refused, by reason.
    pub refused: BTreeMap<&'static str, u64>,
    /// The engine's statistics of each sensor.
    pub sensors: BTreeMap<AgentId, SensorOutcome>,
    /// Computing time of the engine.
    pub core: Span,
    /// From the first to the last arrival.
    pub duration: Span,
}

/// What the engine found of a sensor.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct SensorOutcome {
    /// Mean normalised innovation squared of its positions for each degree of freedom.
    pub nis_per_dof: Option<f64>,
    /// Innovations in it.
    pub innovations: u64,
    /// Its clock and pose errors, where it declares its accuracy.
    pub registration: Option<AgentRegistration>,
    /// What was learnt of it.
    pub learnt: Option<LearntSensorReport>,
}

/// What is declared of the sensors of a log.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Declared {
    /// The description of every sensor; `None` where nothing is known.
    pub description: Option<SensorDescription>,
    /// The accuracy of pose and clock of every sensor.
    pub accuracy: Option<Accuracy>,
    /// The same of single sensors.
    pub accuracies: BTreeMap<AgentId, Accuracy>,
}

impl Declared {
    fn accuracy_of(&self, sensor: &AgentId) -> Option<Accuracy> {
        self.accuracies.get(sensor).copied().or(self.accuracy)
    }

    /// The description of a sensor, where more than its accuracy is declared.
    pub(crate) fn description_of(&self, sensor: &AgentId) -> Option<SensorDescription> {
        let description = self.description?;
        let accuracy = self.accuracy_of(sensor).unwrap_or(description.accuracy);
        Some(SensorDescription { accuracy, ..description })
    }

    /// Declares a sensor before its first frame. An accuracy alone says nothing of what the sensor misses.
    fn announce<P: Publishing>(&self, driver: &mut Driver<P>, sensor: AgentId) {
        match (self.description_of(&sensor), self.accuracy_of(&sensor)) {
            (Some(description), _) => driver.describe(sensor, description),
            (None, Some(accuracy)) => driver.declare_accuracy(sensor, accuracy),
            (None, None) => {}
        }
    }
}

/// An engine that replays a log.
#[derive(Debug)]
pub(crate) struct Replay {
    /// A new engine.
    pub engine: Engine,
    /// What is declared of the sensors.
    pub declared: Declared,
    /// The lag of the second list, where there is one.
    pub second_lag: Option<Span>,
    /// Returns the computing time used so far.
    pub stopwatch: fn() -> Span,
}

impl Replay {
    /// Feeds the engine with the whole log, and returns it with the counts. `watch` gets every frame, and the number of bytes read.
    pub(crate) fn run<R: Read, C: Consumer<Error: From<CsvError>>>(
        self,
        log: &mut DetectionLog<R>,
        consumer: &mut C,
        mut watch: impl FnMut(&Arrival, u64),
    ) -> Result<(Counts, Engine), C::Error> {
        let Self { mut engine, declared, second_lag, stopwatch } = self;
        for (agent, of_agent) in &log.settings().agents {
            of_agent.sensing.iter().for_each(|sensing| engine.assume(*agent, sensing));
        }
        let mut counts = Counts::default();
        let Some(mut arrival) = log.next_arrival()? else { return Ok((counts, engine)) };
        let begin = arrival.received_at;
        let mut driver = Driver::new(engine, EveryTick::from(begin)).timed_by(stopwatch);
        if second_lag.is_some() {
            driver = driver.with_second_list();
        }
        let end = loop {
            let received_at = arrival.received_at;
            driver.publish_before(received_at, consumer)?;
            if arrival.frame.id.sequence == 0 {
                declared.announce(&mut driver, arrival.frame.id.agent);
            }
            if let Some(description) = declared.description {
                arrival.frame.sensor_revision = description.revision;
            }
            let frame = &arrival.frame;
            counts.frames += 1;
            counts.detections += frame.detections.len() as u64;
            let disposition = if log.settings().listens_to(&frame.id.agent) {
                driver.arrive(frame, received_at, consumer)?
            } else {
                Disposition::Refused(Refusal::NotListenedTo)
            };
            if let Disposition::Refused(refusal) = disposition {
                *counts.refused.entry(refusal.reason()).or_default() += 1;
            }
            watch(&arrival, log.n_bytes());
            match log.next_arrival()? {
                Some(next) => arrival = next,
                None => break received_at,
            }
        };
        driver.publish_through(end, consumer)?;
        if let Some(lag) = second_lag {
            driver.conclude_second_list(end + lag, consumer)?;
        }
        counts.ticks = Ticks::within(begin, end).n();
        counts.duration = end - begin;
        counts.core = driver.engine_time();
        let engine = driver.into_engine();
        counts.sensors = outcomes(&engine);
        Ok((counts, engine))
    }
}

fn outcomes(engine: &Engine) -> BTreeMap<AgentId, SensorOutcome> {
    let registrations: BTreeMap<_, _> = engine.registration().map(|one| (one.agent, one)).collect();
    let outcome = |(sensor, record): (&AgentId, &AgentRecord)| {
        let outcome = SensorOutcome {
            nis_per_dof: record.statistics.nis_per_dof(),
            innovations: record.statistics.innovations.count,
            registration: registrations.get(sensor).cloned(),
            learnt: engine.learnt(sensor),
        };
        (*sensor, outcome)
    };
    engine.agents().iter().map(outcome).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use v2x_common::fused::FusedFrame;
    use v2x_common::id::HubId;
    use v2x_common::time::Timestamp;
    use v2x_fusion_hub::engine::EngineConfig;
    use v2x_fusion_hub::fusion::Births;

    const HEADER: &str = "t_arr,t,sensor_id,class,x,y,w,d,yaw,sx,sy,sw,sd,st\n";

    /// Ticks in ms with the positions of their objects.
    #[derive(Default)]
    struct Notes {
        published: Vec<(i64, Vec<f64>)>,
        silent: u64,
    }

    impl Consumer for Notes {
        type Error = anyhow::Error;

        fn receive(&mut self, now: Timestamp, frame: &FusedFrame) -> anyhow::Result<()> {
            let places = frame.objects.iter().map(|object| object.bev.x).collect();
            self.published.push((now.as_nanos() / 1_000_000, places));
            Ok(())
        }

        fn receive_nothing(&mut self, ticks: Ticks) {
            self.silent += ticks.n();
        }
    }

    fn row(t_arr: &str, t: &str, x: f64) -> String {
        format!("{t_arr},{t},a,car,{x},0,2,4,0,0.5,0.5,0.2,0.4,0.1\n")
    }

    fn replayed(rows: &str) -> (Counts, Notes) {
        let text = format!("{HEADER}{rows}");
        let mut log = DetectionLog::new(text.as_bytes(), Path::new("log.csv")).unwrap();
        // The first detection counts.
        let config = EngineConfig::new(HubId::new("lab").unwrap(), 0);
        let engine = Engine::new(config.with_tracking(|tracking| tracking.births = Births::AtOnce));
        let mut notes = Notes::default();
        let replay =
            Replay { engine, declared: Declared::default(), second_lag: None, stopwatch: || Span::ZERO };
        let (counts, _) = replay.run(&mut log, &mut notes, |_, _| {}).unwrap();
        (counts, notes)
    }

    #[test]
    fn a_tick_uses_arrivals_up_to_its_time_and_no_later_ones() {
        let rows = row("0.05", "0.0", 1.0) + &row("0.2", "0.1", 40.0) + &row("0.3000001", "0.3", 80.0);
        let (counts, notes) = replayed(&rows);
        let published: Vec<_> = notes.published.iter().map(|(ms, places)| (*ms, places.len())).collect();
        assert_eq!(published, [(100, 1), (200, 2), (300, 2)]);
        assert_eq!((counts.frames, counts.ticks, counts.duration.as_nanos()), (3, 3, 250_000_100));
    }

    #[test]
    fn ticks_are_multiples_of_a_tenth_from_the_first_to_the_last_arrival_in_any_epoch() {
        for (first, second) in [("-0.35", "-0.1"), ("1700000000.65", "1700000000.9")] {
            let (_, notes) = replayed(&(row(first, first, 1.0) + &row(second, second, 1.0)));
            let ms: Vec<_> = notes.published.iter().map(|(ms, _)| ms % 1000).collect();
            let expected = if first.starts_with('-') { [-300, -200, -100] } else { [700, 800, 900] };
            assert_eq!(ms, expected);
        }
    }

    #[test]
    fn refusals_are_counted_by_reason() {
        let rows = row("1", "1", 1.0) + &row("1.1", "0.5", 1.0) + &row("1.2", "1.9", 1.0);
        let (counts, _) = replayed(&rows);
        assert_eq!(counts.refused, BTreeMap::from([("too_early", 1), ("too_late", 1)]));
        assert_eq!((counts.frames, counts.detections), (3, 3));
    }

    #[test]
    fn years_without_arrivals_cost_no_computing_time() {
        let rows = row("0", "0", 1.0) + &row("1700000000", "1700000000", 1.0);
        let (counts, notes) = replayed(&rows);
        assert_eq!(counts.ticks, 17_000_000_001);
        assert_eq!(notes.published.len() as u64 + notes.silent, counts.ticks);
        assert!(notes.published.len() < 1000, "{}", notes.published.len());
        assert_eq!(notes.published.last().unwrap().1.len(), 1);
    }

    #[test]
    fn an_empty_log_has_no_ticks() {
        assert_eq!(replayed("").0, Counts::default());
    }
}
