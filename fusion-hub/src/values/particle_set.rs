//! Sets of particles.

use serde::{Deserialize, Serialize};

/// Most particles.
pub const MAX_PARTICLES: u32 = 64;

/// The particles that hold a version of a track.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ParticleSet(u64);

impl ParticleSet {
    /// Every particle, whatever their number.
    pub const ALL: Self = Self(u64::MAX);
    /// No particle.
    pub const NONE: Self = Self(0);

    /// Whether this particle is one of them.
    pub const fn holds(self, particle: u32) -> bool {
        self.0 >> particle & 1 == 1
    }

    /// Whether the leading particle is one of them.
    pub const fn leads(self) -> bool {
        self.holds(0)
    }

    /// Whether it contains all particles.
    pub const fn is_all(self) -> bool {
        self.0 == u64::MAX
    }

    /// Whether it is empty.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Adds one.
    pub const fn insert(&mut self, particle: u32) {
        self.0 |= 1 << particle;
    }

    /// Takes one away.
    pub const fn remove(&mut self, particle: u32) {
        self.0 &= !(1 << particle);
    }

    /// Adds those of another set.
    pub const fn join(&mut self, other: Self) {
        self.0 |= other.0;
    }

    /// How many of the first `n` particles are among them.
    pub const fn count(self, n: u32) -> u32 {
        self.among(n).count_ones()
    }

    /// The same set among `n` particles in all.
    #[must_use]
    pub const fn of(self, n: u32) -> Self {
        if self.among(n) == all(n) { Self::ALL } else { Self(self.among(n)) }
    }

    const fn among(self, n: u32) -> u64 {
        self.0 & all(n)
    }
}

const fn all(n: u32) -> u64 {
    u64::MAX >> (MAX_PARTICLES - n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_of_all_n_particles_is_the_set_of_all() {
        for n in [2, 8, 64] {
            let mut set = ParticleSet::NONE;
            for particle in 0..n {
                assert!(!set.of(n).is_all());
                set.insert(particle);
            }
            assert!(set.of(n).is_all());
            assert_eq!((set.count(n), ParticleSet::ALL.count(n)), (n, n));
        }
    }
}
