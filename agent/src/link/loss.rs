//! Which frames are lost: Gilbert's and Elliott's chain of good and bad times, in a bad one everything is lost.

use crate::random::{Purpose, keyed_rng, unit};
use v2x_common::id::AgentId;

/// Bursts of lost frames.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Loss {
    /// Share of the frames that are lost ("packet error rate"), 0 to 1.
    pub rate: f64,
    /// Mean length of a burst of losses, frames; `None` where each frame is lost by itself.
    pub burst: Option<f64>,
}

impl Loss {
    /// Probabilities that a loss follows a frame that arrived, and that one follows a loss. With bursts of mean
    /// length L: leaving the bad state r = 1/L, entering it p = PER / (L (1 − PER)) (LINKS.md).
    pub fn transitions(&self) -> (f64, f64) {
        match self.burst {
            None => (self.rate, self.rate),
            Some(_) if self.rate >= 1.0 => (1.0, 1.0),
            Some(length) => ((self.rate / (length * (1.0 - self.rate))).min(1.0), 1.0 - 1.0 / length),
        }
    }

    /// Whether frames with these numbers were lost, given a uniform number for each. The chain is stationary, and a
    /// frame's fate depends on its own number and those before it alone: going back, some frame's number decides
    /// its fate whatever was before.
    pub(super) fn is_lost(&self, sequence: u64, number: impl Fn(u64) -> f64) -> bool {
        let (after_arrival, after_loss) = self.transitions();
        let (low, high) = (after_arrival.min(after_loss), after_arrival.max(after_loss));
        let decided = |u: f64| if u < low { Some(true) } else { (u >= high).then_some(false) };
        let mut back = 0;
        let mut is_lost = loop {
            // Before the first frame the state is drawn from the chain's long run.
            if back > sequence {
                break number(u64::MAX) < self.rate;
            }
            if let Some(fate) = decided(number(sequence - back)) {
                break fate;
            }
            back += 1;
        };
        for sequence in (sequence + 1).saturating_sub(back)..=sequence {
            let u = number(sequence);
            is_lost = u < if is_lost { after_loss } else { after_arrival };
        }
        is_lost
    }

    /// The number of a frame for [`Loss::is_lost`].
    pub(super) fn number(seed: u64, agent: &AgentId, sequence: u64) -> f64 {
        unit(&mut keyed_rng(seed, Some(agent), sequence, Purpose::LossBurst))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fates(loss: Loss, n: u64) -> Vec<bool> {
        let agent = AgentId::new("ego").unwrap();
        (0..n).map(|sequence| loss.is_lost(sequence, |at| Loss::number(3, &agent, at))).collect()
    }

    #[test]
    fn the_error_rate_and_the_mean_burst_are_those_asked_for() {
        for (rate, burst) in [(0.1, 5.0), (0.3, 2.0), (0.02, 20.0), (0.5, 1.5)] {
            let lost = fates(Loss { rate, burst: Some(burst) }, 15_000);
            let share = lost.iter().filter(|lost| **lost).count() as f64 / lost.len() as f64;
            let bursts = lost.chunk_by(|a, b| a == b).filter(|run| run[0]).count() as f64;
            let mean = share * lost.len() as f64 / bursts;
            // A burst counts once: the relative standard error is about the square root of 2 over their number.
            let tolerance = 4.0 * (2.0 / bursts).sqrt();
            assert!((share / rate - 1.0).abs() < tolerance, "{rate} {burst}: {share}");
            assert!((mean / burst - 1.0).abs() < tolerance, "{rate} {burst}: {mean}");
        }
    }

    #[test]
    fn a_frames_fate_is_the_same_whoever_asks_first() {
        let loss = Loss { rate: 0.3, burst: Some(10.0) };
        let agent = AgentId::new("ego").unwrap();
        let lost = |sequence: u64| loss.is_lost(sequence, |at| Loss::number(3, &agent, at));
        let forward: Vec<bool> = (0..500).map(lost).collect();
        let backward: Vec<bool> = (0..500).rev().map(lost).collect();
        assert!(forward.iter().eq(backward.iter().rev()));
        // It is a chain: a frame is lost because the one before was, or because it turned bad.
        let (after_arrival, after_loss) = loss.transitions();
        for (before, sequence) in forward.iter().zip(1u64..500) {
            let limit = if *before { after_loss } else { after_arrival };
            assert_eq!(forward[sequence as usize], Loss::number(3, &agent, sequence) < limit);
        }
    }

    #[test]
    fn all_or_nothing_needs_no_chain() {
        assert!(fates(Loss { rate: 0.0, burst: Some(3.0) }, 100).iter().all(|lost| !lost));
        assert!(fates(Loss { rate: 1.0, burst: Some(3.0) }, 100).iter().all(|lost| *lost));
    }
}
