//! Random numbers as a function of their purpose: the same frame gives the same numbers at every hub.

use v2x_common::id::FrameId;

/// FNV-1a's offset and prime (Fowler, Noll, Vo 1991), for names.
const FNV_OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const FNV_PRIME: u64 = 0x0000_0100_0000_01b3;
/// SplitMix64's increment: the golden ratio (Steele, Lea, Flood 2014).
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// SplitMix64 (Steele, Lea, Flood 2014).
#[derive(Clone, Copy, Debug)]
pub(super) struct Chance(u64);

impl Chance {
    /// The generator of a frame.
    pub(super) fn of(frame: &FrameId) -> Self {
        let name = frame
            .agent
            .as_str()
            .bytes()
            .fold(FNV_OFFSET, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(FNV_PRIME));
        [frame.epoch, frame.sequence].into_iter().fold(Self(name), Self::about)
    }

    /// The generator of one component of the frame.
    pub(super) fn about(self, part: u64) -> Self {
        let mut chance = Self(self.0 ^ part.wrapping_mul(GOLDEN));
        Self(chance.next())
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(GOLDEN);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Uniform in (0, 1).
    pub(super) fn uniform(&mut self) -> f64 {
        // 52 bits and a half: neither end is reached.
        #[expect(clippy::cast_precision_loss, reason = "52 bits")]
        let numerator = (self.next() >> 12) as f64 + 0.5;
        numerator / 4_503_599_627_370_496.0
    }

    /// Standard Gumbel: the largest of many.
    pub(super) fn gumbel(&mut self) -> f64 {
        -libm::log(-libm::log(self.uniform()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::id::AgentId;

    fn frame(name: &str, sequence: u64) -> FrameId {
        FrameId { agent: AgentId::new(name).unwrap(), epoch: 1, sequence }
    }

    #[test]
    fn numbers_depend_on_frame_and_component_only() {
        let draw = |name, sequence, part| Chance::of(&frame(name, sequence)).about(part).uniform();
        assert_eq!(draw("ego", 1, 0), draw("ego", 1, 0));
        let others = [draw("ego", 1, 1), draw("ego", 2, 0), draw("rsu", 1, 0)];
        assert!(others.iter().all(|other| *other != draw("ego", 1, 0)));
    }

    #[test]
    fn gumbel_draws_have_the_mean_and_variance_of_the_distribution() {
        let mut chance = Chance::of(&frame("ego", 3));
        let draws: Vec<f64> = (0..100_000).map(|_| chance.gumbel()).collect();
        let mean = draws.iter().sum::<f64>() / 1e5;
        let variance = draws.iter().map(|draw| (draw - mean) * (draw - mean)).sum::<f64>() / 1e5;
        // Euler's constant and π²/6; five standard errors.
        assert!((mean - 0.577_216).abs() < 0.02, "{mean}");
        assert!((variance - 1.644_934).abs() < 0.06, "{variance}");
    }
}
