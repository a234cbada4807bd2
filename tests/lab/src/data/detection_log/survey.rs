//! Statistics of the sensors of a log, gathered frame by frame.

use super::arrival::Arrival;
use super::holes::Holes;
use super::time_units::{Progress, TimeUnits};
use std::collections::BTreeMap;
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};

/// Statistics of one sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SensorSurvey {
    /// Frames.
    pub frames: u64,
    /// Detections, impossible ones left out.
    pub detections: u64,
    /// Capture times, the earliest and the latest.
    pub captured: (Timestamp, Timestamp),
    /// From capture to arrival, the shortest and the longest.
    pub delay: (Span, Span),
    /// Frames without any detection whose sensor's place is not known.
    pub empty_without_place: u64,
    /// How its times of capture go on.
    captures: Progress,
    /// How its times of arrival go on.
    arrivals: Progress,
}

/// All sensors of a log.
#[derive(Clone, Debug, Default)]
pub(crate) struct Survey {
    sensors: BTreeMap<AgentId, SensorSurvey>,
    holes: BTreeMap<AgentId, Holes>,
}

impl Survey {
    /// Adds a frame.
    pub(crate) fn add(&mut self, arrival: &Arrival) {
        let Arrival { received_at, frame, .. } = arrival;
        let (at, delay) = (frame.captured_at, *received_at - frame.captured_at);
        let sensor = self.sensors.entry(frame.id.agent).or_insert(SensorSurvey {
            frames: 0,
            detections: 0,
            captured: (at, at),
            delay: (delay, delay),
            empty_without_place: 0,
            captures: Progress::from(at),
            arrivals: Progress::from(*received_at),
        });
        sensor.frames += 1;
        self.holes.entry(frame.id.agent).or_insert_with(|| Holes::from(at)).note(at);
        sensor.empty_without_place += u64::from(frame.detections.is_empty() && frame.sensor_pose.is_none());
        sensor.captures.note(at);
        sensor.arrivals.note(*received_at);
        sensor.detections += frame.detections.len() as u64;
        sensor.captured = (sensor.captured.0.min(at), sensor.captured.1.max(at));
        sensor.delay = (sensor.delay.0.min(delay), sensor.delay.1.max(delay));
    }

    /// Times without a frame of it, the longest first, and its usual interval, s.
    pub(crate) fn holes(&self, sensor: &AgentId) -> (Vec<(Timestamp, Timestamp)>, f64) {
        self.holes.get(sensor).map(Holes::found).unwrap_or_default()
    }

    /// The sensors by name.
    pub(crate) const fn sensors(&self) -> &BTreeMap<AgentId, SensorSurvey> {
        &self.sensors
    }
}

impl SensorSurvey {
    /// The units that its times seem to be in, where they are not both seconds.
    pub(crate) fn time_units(&self) -> Option<TimeUnits> {
        TimeUnits::of(&self.captures, &self.arrivals)
    }

    /// By how much its times of capture and of arrival go on over the log.
    pub(crate) fn spans(&self) -> [Span; 2] {
        [self.captures.span(), self.arrivals.span()]
    }

    /// Frames per second; `None` of a single instant.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub(crate) fn rate_hz(&self) -> Option<f64> {
        let seconds = (self.captured.1 - self.captured.0).as_secs_f64();
        (seconds > 0.0 && self.frames > 1).then(|| (self.frames - 1) as f64 / seconds)
    }
}

#[cfg(test)]
mod tests {
    use super::super::DetectionLog;
    use super::*;
    use std::path::Path;

    #[test]
    fn rate_and_delay_are_of_each_sensor() {
        let text = "t_arr,t,sensor_id,class,x,y,w,d,yaw,sx,sy,sw,sd,st\n\
            0.1,0.0,a,car,0,0,4.5,1.8,0,1,1,1,1,1\n0.1,0.0,a,pedestrian,0,0,0.8,0.5,0,1,1,1,1,1\n\
            0.3,0.1,a,car,0,0,1.8,4.5,0,1,1,1,1,1\n0.3,0.25,b,,,,,,,,,,,\n0.4,0.2,a,,,,,,,,,,,\n";
        let mut log = DetectionLog::new(text.as_bytes(), Path::new("log.csv")).unwrap();
        let mut survey = Survey::default();
        while let Some(arrival) = log.next_arrival().unwrap() {
            survey.add(&arrival);
        }
        let sensor = |name: &str| survey.sensors()[&AgentId::new(name).unwrap()];
        let a = sensor("a");
        assert_eq!((a.frames, a.detections), (3, 3));
        assert!((a.rate_hz().unwrap() - 10.0).abs() < 1e-9);
        assert_eq!(a.delay, (Span::from_millis(100), Span::from_millis(200)));
        assert_eq!((sensor("b").frames, sensor("b").rate_hz()), (1, None));
    }
}
