//! The outcome of each frame on a link.

use super::delay::Delay;
use super::loss::Loss;
use crate::random::{Purpose, chance, keyed_rng};
use v2x_common::id::AgentId;
use v2x_common::time::Span;

/// Properties of a link.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkConfig {
    /// Delay of a frame, independent of its size.
    pub delay: Delay,
    /// Which frames are lost.
    pub loss: Loss,
    /// Bits per second: a frame's size divided by it adds to the delay. `None`: the size does not matter.
    pub rate_bps: Option<f64>,
    /// Periods without any connection.
    pub outage: Option<Outage>,
    /// Whether a later frame may overtake an earlier one; if not, the [`super::Outbox`] delays it.
    pub reorder: bool,
}

/// There is no connection for `length` at the end of every period of `every`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outage {
    /// From the end of one outage to the end of the next.
    pub every: Span,
    /// Duration of an outage.
    pub length: Span,
}

impl Default for LinkConfig {
    /// No delay, no loss.
    fn default() -> Self {
        Self {
            delay: Delay::constant(0.0),
            loss: Loss::default(),
            rate_bps: None,
            outage: None,
            reorder: true,
        }
    }
}

/// A frame that is to be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parcel {
    /// Its number.
    pub sequence: u64,
    /// When it is sent, since the scenario's start.
    pub since_start: Span,
    /// Its size on the wire, bytes; has no effect where the link's rate is not limited.
    pub bytes: usize,
}

/// The outcome of one frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transit {
    /// It never arrives.
    Lost,
    /// It arrives `delay` after it was sent, never earlier.
    Delivered {
        /// From sending to arrival.
        delay: Span,
    },
}

/// One agent's link. The outcome of a frame is a function of (seed, agent, sequence) and, where the configuration says
/// so, of its time and size.
#[derive(Clone, Debug)]
pub struct Link {
    config: LinkConfig,
    seed: u64,
    agent: AgentId,
}

impl Link {
    /// The link of this agent.
    pub const fn new(config: LinkConfig, seed: u64, agent: AgentId) -> Self {
        Self { config, seed, agent }
    }

    /// Its properties.
    pub const fn config(&self) -> &LinkConfig {
        &self.config
    }

    /// The outcome of a frame.
    pub fn transit(&self, parcel: Parcel) -> Transit {
        let Parcel { sequence, since_start, bytes } = parcel;
        let LinkConfig { delay, loss, rate_bps, outage, .. } = &self.config;
        let mut rng = keyed_rng(self.seed, Some(&self.agent), sequence, Purpose::Link);
        let is_lost = match loss.burst {
            None => chance(&mut rng, loss.rate),
            Some(_) => loss.is_lost(sequence, |at| Loss::number(self.seed, &self.agent, at)),
        };
        let is_out = outage.is_some_and(|outage| outage.is_at(since_start));
        let is_lost_in_trace = matches!(delay, Delay::Trace(trace) if trace.at(since_start).is_lost);
        if is_lost || is_out || is_lost_in_trace {
            return Transit::Lost;
        }
        let on_the_wire_s = rate_bps.map_or(0.0, |rate| 8.0 * bytes as f64 / rate);
        Transit::Delivered { delay: Span::from_secs_f64(delay.draw(&mut rng, since_start) + on_the_wire_s) }
    }
}

impl Outage {
    fn is_at(&self, since_start: Span) -> bool {
        let into = since_start.as_nanos().rem_euclid(self.every.as_nanos().max(1));
        into >= self.every.as_nanos() - self.length.as_nanos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn link(config: LinkConfig, agent: &str) -> Link {
        Link::new(config, 3, AgentId::new(agent).unwrap())
    }

    fn bad() -> LinkConfig {
        LinkConfig {
            delay: Delay::Normal { mean_s: 0.08, sigma_s: 0.03 },
            loss: Loss { rate: 0.1, burst: None },
            ..LinkConfig::default()
        }
    }

    fn parcel(sequence: u64) -> Parcel {
        let since_start = Span::from_millis(100 * i64::try_from(sequence).unwrap());
        Parcel { sequence, since_start, bytes: 1000 }
    }

    fn delays_s(link: &Link) -> Vec<f64> {
        (0..50_000)
            .filter_map(|sequence| match link.transit(parcel(sequence)) {
                Transit::Lost => None,
                Transit::Delivered { delay } => Some(delay.as_secs_f64()),
            })
            .collect()
    }

    #[test]
    fn loss_delay_and_jitter_are_those_of_the_configuration() {
        let delays = delays_s(&link(bad(), "ego"));
        let n = delays.len() as f64;
        let mean = delays.iter().sum::<f64>() / n;
        let std = (delays.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>() / n).sqrt();
        // Truncation at 2.67 σ moves the mean by 0.01 σ; standard errors are about 0.5 % of σ.
        assert!((n / 50_000.0 - 0.9).abs() < 0.006, "{n}");
        assert!((mean - 0.08).abs() < 0.001, "{mean}");
        assert!((std - 0.03).abs() < 0.001, "{std}");
        assert!(delays.iter().all(|d| *d >= 0.0));
    }

    #[test]
    fn a_link_without_delay_delivers_at_the_time_of_sending() {
        let transit = link(LinkConfig::default(), "ego").transit(parcel(5));
        assert_eq!(transit, Transit::Delivered { delay: Span::ZERO });
    }

    #[test]
    fn outcomes_repeat_and_differ_between_agents() {
        let (ego, again, rsu) = (link(bad(), "ego"), link(bad(), "ego"), link(bad(), "rsu"));
        assert!((0..100).all(|sequence| ego.transit(parcel(sequence)) == again.transit(parcel(sequence))));
        assert!((0..100).any(|sequence| ego.transit(parcel(sequence)) != rsu.transit(parcel(sequence))));
    }

    #[test]
    fn a_large_message_takes_longer_where_the_rate_is_finite() {
        let config =
            LinkConfig { rate_bps: Some(1e6), delay: Delay::constant(0.01), ..LinkConfig::default() };
        let of = |bytes: usize| link(config.clone(), "ego").transit(Parcel { bytes, ..parcel(1) });
        assert_eq!(of(1000), Transit::Delivered { delay: Span::from_millis(18) });
        assert_eq!(of(10_000), Transit::Delivered { delay: Span::from_millis(90) });
    }

    #[test]
    fn frames_sent_during_an_outage_are_lost() {
        let outage = Outage { every: Span::from_millis(10_000), length: Span::from_millis(2000) };
        let link = link(LinkConfig { outage: Some(outage), ..LinkConfig::default() }, "ego");
        let lost = |sequence: u64| link.transit(parcel(sequence)) == Transit::Lost;
        assert!((0..200).all(|sequence| lost(sequence) == (sequence % 100 >= 80)));
    }

    #[test]
    fn delays_have_the_moments_of_their_parameters() {
        let mean_and_median_ms = |delay: Delay| {
            let link = link(LinkConfig { delay, ..LinkConfig::default() }, "ego");
            let mut delays = delays_s(&link);
            delays.sort_unstable_by(f64::total_cmp);
            (1e3 * delays.iter().sum::<f64>() / delays.len() as f64, 1e3 * delays[delays.len() / 2])
        };
        let near = |(mean, median): (f64, f64), (m, p50): (f64, f64)| {
            assert!((mean / m - 1.0).abs() < 0.02 && (median / p50 - 1.0).abs() < 0.02, "{mean} {median}");
        };
        near(mean_and_median_ms(Delay::Uniform { low_s: 0.02, high_s: 0.06 }), (40.0, 40.0));
        // exp(σ²/2) = 1.133.
        near(mean_and_median_ms(Delay::LogNormal { median_s: 0.05, sigma_ln: 0.5 }), (56.66, 50.0));
        // Gamma(2, 2) has the median 3.357: 50 + 3.357 · 25.
        near(mean_and_median_ms(Delay::Gamma { min_s: 0.05, expected_s: 0.15 }), (150.0, 133.9));
        near(mean_and_median_ms(Delay::Frames { p: 0.3, frame_s: 0.1 }), (300.0, 300.0));
    }
}
