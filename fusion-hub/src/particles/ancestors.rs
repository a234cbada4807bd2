//! Drawing particles by their weights.

/// The ancestor of each particle.
#[derive(Debug, Default)]
pub(super) struct Ancestors {
    of: Vec<Option<usize>>,
    surplus: Vec<usize>,
}

impl Ancestors {
    /// Systematic resampling (Kitagawa 1996) from one number in (0, 1). A particle that survives is its own
    /// ancestor: so hypotheses stay consistent across components where possible.
    pub(super) fn draw(&mut self, weights: &[f64], uniform: f64) {
        self.of.clear();
        self.surplus.clear();
        #[expect(clippy::cast_precision_loss, reason = "at most 64")]
        let step = weights.iter().sum::<f64>() / weights.len() as f64;
        let (mut next, mut sum) = (uniform * step, 0.0);
        for (particle, weight) in weights.iter().enumerate() {
            sum += weight;
            let survives = next < sum;
            self.of.push(survives.then_some(particle));
            if survives {
                next += step;
            }
            while next < sum {
                self.surplus.push(particle);
                next += step;
            }
        }
        // Rounding may leave the last one out.
        let last = self.of.iter().rev().flatten().next().copied().unwrap_or(0);
        let mut surplus = self.surplus.iter().copied();
        for ancestor in self.of.iter_mut().filter(|ancestor| ancestor.is_none()) {
            *ancestor = Some(surplus.next().unwrap_or(last));
        }
    }

    /// The ancestor of this one.
    pub(super) fn of(&self, particle: usize) -> usize {
        self.of[particle].unwrap_or(particle)
    }

    /// Exchanges two particles.
    pub(super) fn swap(&mut self, a: usize, b: usize) {
        self.of.swap(a, b);
    }

    /// The ancestor of the first particle becomes that of all.
    pub(super) fn follow_first(&mut self) {
        let first = self.of.first().copied().flatten();
        self.of.fill(first);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(weights: &[f64], uniform: f64) -> Vec<usize> {
        let mut ancestors = Ancestors::default();
        ancestors.draw(weights, uniform);
        (0..weights.len()).map(|particle| ancestors.of(particle)).collect()
    }

    #[test]
    fn particles_of_equal_weight_are_their_own_ancestors() {
        for uniform in [0.001, 0.5, 0.999] {
            assert_eq!(drawn(&[0.3; 7], uniform), [0, 1, 2, 3, 4, 5, 6]);
        }
    }

    #[test]
    fn the_number_of_descendants_is_proportional_to_the_weight() {
        assert_eq!(drawn(&[0.0, 3.0, 0.0, 1.0], 0.5), [1, 1, 1, 3]);
        assert_eq!(drawn(&[1.0, 0.0, 0.0], 0.5), [0, 0, 0]);
    }

    #[test]
    fn surviving_particles_keep_their_places() {
        assert_eq!(drawn(&[2.0, 0.0, 1.0, 1.0], 0.5), [0, 0, 2, 3]);
    }
}
