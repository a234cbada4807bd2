//! The link between an agent and the hub: when a frame arrives, if it does.

use v2x_common::id::AgentId;
use v2x_common::time::Span;

use crate::random::{Purpose, chance, keyed_rng, truncated_normal};

/// How a link treats frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkConfig {
    /// Mean delay before truncation at 0, s.
    pub delay_s: f64,
    /// Standard deviation of the delay before truncation at 0, s.
    pub jitter_s: f64,
    /// Probability that a frame never arrives, independent of all others.
    pub loss: f64,
    /// Whether a later frame may overtake an earlier one; if not, the [`crate::outbox::Outbox`] holds it back.
    pub reorder: bool,
}

impl Default for LinkConfig {
    /// No delay, no loss.
    fn default() -> Self {
        Self { delay_s: 0.0, jitter_s: 0.0, loss: 0.0, reorder: true }
    }
}

/// What happens to one frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transit {
    /// It never arrives.
    Lost,
    /// It arrives `delay` after its capture, never earlier.
    Delivered {
        /// From capture to arrival.
        delay: Span,
    },
}

/// One agent's link. A frame's fate depends on (seed, agent, sequence) alone.
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

    /// How it treats frames.
    pub const fn config(&self) -> &LinkConfig {
        &self.config
    }

    /// The fate of the frame with this number: lost with probability `loss`; else a delay from
    /// Normal(`delay_s`, `jitter_s`²) truncated below at 0.
    pub fn transit(&self, sequence: u64) -> Transit {
        let mut rng = keyed_rng(self.seed, Some(&self.agent), sequence, Purpose::Link);
        if chance(&mut rng, self.config.loss) {
            return Transit::Lost;
        }
        let LinkConfig { delay_s, jitter_s, .. } = self.config;
        let delay_s = truncated_normal(&mut rng, delay_s, jitter_s, (0.0, f64::INFINITY));
        Transit::Delivered { delay: Span::from_secs_f64(delay_s) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn link(config: LinkConfig, agent: &str) -> Link {
        Link::new(config, 3, AgentId::new(agent).unwrap())
    }

    const BAD: LinkConfig = LinkConfig { delay_s: 0.08, jitter_s: 0.03, loss: 0.1, reorder: true };

    fn delays_s(link: &Link) -> Vec<f64> {
        (0..50_000)
            .filter_map(|sequence| match link.transit(sequence) {
                Transit::Lost => None,
                Transit::Delivered { delay } => Some(delay.as_secs_f64()),
            })
            .collect()
    }

    #[test]
    fn loss_delay_and_jitter_are_those_of_the_configuration() {
        let delays = delays_s(&link(BAD, "ego"));
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
    fn a_link_without_delay_delivers_at_once() {
        let transit = link(LinkConfig::default(), "ego").transit(5);
        assert_eq!(transit, Transit::Delivered { delay: Span::ZERO });
    }

    #[test]
    fn fates_repeat_and_differ_between_agents() {
        let (ego, again, rsu) = (link(BAD, "ego"), link(BAD, "ego"), link(BAD, "rsu"));
        assert!((0..100).all(|sequence| ego.transit(sequence) == again.transit(sequence)));
        assert!((0..100).any(|sequence| ego.transit(sequence) != rsu.transit(sequence)));
    }
}
