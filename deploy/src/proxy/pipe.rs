//! When the bytes that enter a TCP link leave it: pure.

use v2x_agent::link::{Delay, Link, LinkConfig, Loss, Parcel, Transit};
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};

/// One direction of one connection: its bytes stay in order, and share its rate.
#[derive(Debug)]
pub(super) struct Pipe {
    link: Link,
    rate_bps: Option<f64>,
    started_at: Timestamp,
    sequence: u64,
    /// When the last byte that entered has been sent.
    free_at: Timestamp,
    /// When that byte leaves.
    latest_due: Timestamp,
}

impl Pipe {
    /// Whether the link has only a delay and a rate, no losses.
    pub(super) fn can_carry(link: &LinkConfig) -> bool {
        let loses = matches!(&link.delay, Delay::Trace(trace) if trace.loses());
        link.loss == Loss::default() && link.outage.is_none() && !loses
    }

    /// The pipe of one direction of a connection; `name` decides, with the seed, its random delays.
    pub(super) fn new(mut link: LinkConfig, seed: u64, name: AgentId, started_at: Timestamp) -> Self {
        // Chunks of a stream wait for each other; frames of a link do not. So the pipe applies the rate, not the link.
        let rate_bps = link.rate_bps.take();
        Self {
            link: Link::new(link, seed, name),
            rate_bps,
            started_at,
            sequence: 0,
            free_at: started_at,
            latest_due: started_at,
        }
    }

    /// When these bytes, which enter at `now`, leave: never before earlier ones.
    pub(super) fn due(&mut self, now: Timestamp, bytes: usize) -> Timestamp {
        let sending_s = self.rate_bps.map_or(0.0, |rate| 8.0 * bytes as f64 / rate);
        self.free_at = self.free_at.max(now) + Span::from_secs_f64(sending_s);
        let parcel = Parcel { sequence: self.sequence, since_start: now - self.started_at, bytes };
        self.sequence += 1;
        let delay = match self.link.transit(parcel) {
            Transit::Delivered { delay } => delay,
            Transit::Lost => Span::ZERO,
        };
        self.latest_due = self.latest_due.max(self.free_at + delay);
        self.latest_due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pipe(delay: Delay, rate_bps: Option<f64>) -> Pipe {
        let link = LinkConfig { delay, rate_bps, ..LinkConfig::default() };
        Pipe::new(link, 1, AgentId::new("there-0").unwrap(), Timestamp::EPOCH)
    }

    fn at(millis: i64) -> Timestamp {
        Timestamp::EPOCH + Span::from_millis(millis)
    }

    #[test]
    fn every_chunk_is_delayed_by_the_links_delay() {
        let mut pipe = pipe(Delay::constant(0.08), None);
        assert_eq!([pipe.due(at(0), 100), pipe.due(at(5), 100_000)], [at(80), at(85)]);
    }

    #[test]
    fn chunks_stay_in_order_under_any_jitter() {
        let mut pipe = pipe(Delay::Uniform { low_s: 0.0, high_s: 0.2 }, None);
        let dues: Vec<_> = (0..1000).map(|millis| pipe.due(at(millis), 100)).collect();
        assert!(dues.is_sorted());
        assert!((0..1000).zip(&dues).all(|(millis, due)| *due >= at(millis) && *due <= at(millis + 200)));
        assert!(dues[500] > at(500), "they wait");
    }

    #[test]
    fn at_a_finite_rate_chunks_wait_until_earlier_ones_are_sent() {
        // 1000 bytes at 1 Mbit/s take 8 ms.
        let mut pipe = pipe(Delay::constant(0.01), Some(1e6));
        let dues = [pipe.due(at(0), 1000), pipe.due(at(0), 1000), pipe.due(at(100), 1000)];
        assert_eq!(dues, [at(18), at(26), at(118)]);
    }
}
