//! Frames in transit: delay, order and size. They are the same for every method.

use crate::drive::traffic::SendTimes;
use crate::score::sweep::record::{Record, Reference, distribution};
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};

/// A frame within this time of the newest stamp is not late (ε_s of the paper).
const SYNCHRONOUS: Span = Span::from_millis(10);

/// One frame that arrived.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ArrivedFrame {
    /// Its agent.
    pub agent: AgentId,
    /// Time stamp by the agent's clock.
    pub stamp: Timestamp,
    /// When it was captured and sent.
    pub times: SendTimes,
    /// When it arrived.
    pub at: Timestamp,
    /// Its size on the wire, bytes.
    pub bytes: usize,
}

/// Adds the frames that a hub received in a run of this duration, in order of arrival.
pub(crate) fn add_transit(record: &mut Record, heard: &[ArrivedFrame], reference: Reference, duration: Span) {
    let mut newest_stamp = None;
    for frame in heard {
        if frame.agent != reference.agent {
            record.frames.arrived += 1;
            record.frames.late +=
                u64::from(newest_stamp.is_some_and(|newest| newest - frame.stamp > SYNCHRONOUS));
        }
        newest_stamp = newest_stamp.max(Some(frame.stamp));
    }
    record.bytes_per_s = heard.iter().map(|frame| frame.bytes as f64).sum::<f64>() / duration.as_secs_f64();
    let millis = |of: fn(&ArrivedFrame) -> Span| {
        let examined = heard.iter().filter(|frame| reference.examines(&frame.agent));
        distribution(examined.map(|frame| of(frame).as_millis_f64()).collect())
    };
    record.capture_to_send_ms = millis(|frame| frame.times.sent_at - frame.times.captured_at);
    record.send_to_arrive_ms = millis(|frame| frame.at - frame.times.sent_at);
    let examined = heard.iter().filter(|frame| reference.examines(&frame.agent));
    let delays: Vec<f64> =
        examined.map(|frame| (frame.at - frame.times.captured_at).as_millis_f64()).collect();
    record.delay_ms = (!delays.is_empty()).then(|| delays.iter().sum::<f64>() / delays.len() as f64);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::fixture::at_ms;

    fn arrived(agent: &str, captured_ms: i64, stamp_ms: i64, arrived_ms: i64) -> ArrivedFrame {
        let (captured_at, sent_at) = (at_ms(captured_ms), at_ms(captured_ms + 5));
        let agent = AgentId::new(agent).unwrap();
        ArrivedFrame {
            agent,
            stamp: at_ms(stamp_ms),
            times: SendTimes { captured_at, sent_at },
            at: at_ms(arrived_ms),
            bytes: 100,
        }
    }

    #[test]
    fn a_frame_is_late_if_its_stamp_is_before_that_of_an_earlier_arrival() {
        let heard = [
            arrived("rsu", 0, 0, 0),
            arrived("car", 0, 0, 50),
            arrived("rsu", 100, 100, 100),
            arrived("car", 50, 50, 120),
            // Its clock is ahead.
            arrived("car", 100, 160, 170),
        ];
        let reference = Reference { agent: AgentId::new("rsu").unwrap(), is_alone: false };
        let mut record = Record::default();
        add_transit(&mut record, &heard, reference, Span::from_millis(500));
        assert_eq!((record.frames.arrived, record.frames.late, record.bytes_per_s), (3, 1, 1000.0));
        // 50, 70 and 70 ms of the car, 5 of which before it sent them.
        assert_eq!((record.delay_ms, record.send_to_arrive_ms[11]), (Some(190.0 / 3.0), 65.0));
    }
}
