//! Which frames are lost: the Gilbert-Elliott chain of good and bad states; in a bad state every frame is lost.

use crate::random::{Purpose, keyed_rng, unit};
use v2x_common::id::AgentId;

/// Bursts of lost frames.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Loss {
    /// Share of the frames that are lost ("packet error rate"), 0 to 1.
    pub rate: f64,
    /// Mean length of a burst of losses, frames; `None`: the losses of frames are independent.
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

    /// Whether frame `sequence` is lost, where `number` gives a uniform number for each frame. The chain is stationary.
    ///
    /// Going back from the frame, there is one whose number determines its state whatever the state before it was; from
    /// there the chain is followed forward. So any frame can be computed alone.
    pub(super) fn is_lost(&self, sequence: u64, number: impl Fn(u64) -> f64) -> bool {
        let (after_arrival, after_loss) = self.transitions();
        let (low, high) = (after_arrival.min(after_loss), after_arrival.max(after_loss));
        let decided = |u: f64| if u < low { Some(true) } else { (u >= high).then_some(false) };
        let mut back = 0;
        let mut is_lost = loop {
            // Before the first frame the state is drawn from the stationary distribution.
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

    /// The uniform number of a frame for [`Loss::is_lost`].
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
    fn the_error_rate_and_the_mean_burst_are_the_configured_ones() {
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
    fn the_outcome_of_a_frame_does_not_depend_on_the_order_of_evaluation() {
        let loss = Loss { rate: 0.3, burst: Some(10.0) };
        let agent = AgentId::new("ego").unwrap();
        let lost = |sequence: u64| loss.is_lost(sequence, |at| Loss::number(3, &agent, at));
        let forward: Vec<bool> = (0..500).map(lost).collect();
        let backward: Vec<bool> = (0..500).rev().map(lost).collect();
        assert!(forward.iter().eq(backward.iter().rev()));
        // The chain forward from frame to frame gives the same.
        let (after_arrival, after_loss) = loss.transitions();
        for (before, sequence) in forward.iter().zip(1u64..500) {
            let limit = if *before { after_loss } else { after_arrival };
            assert_eq!(forward[sequence as usize], Loss::number(3, &agent, sequence) < limit);
        }
    }

    #[test]
    fn rates_of_0_and_1_lose_none_and_all() {
        assert!(fates(Loss { rate: 0.0, burst: Some(3.0) }, 100).iter().all(|lost| !lost));
        assert!(fates(Loss { rate: 1.0, burst: Some(3.0) }, 100).iter().all(|lost| *lost));
    }
}
