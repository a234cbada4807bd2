//! Which agents share objects, and whether a chain of them reaches a reference.

use super::settings::MEMORY_S;
use super::slot::{MAX_REGISTERED, RegistrationSlot};
use serde::{Deserialize, Serialize};

/// Fewer differences than this within the memory do not join two agents: wrong associations alone can give them.
const JOINING: f64 = 20.0;

/// Differences of each pair of agents, fading with the memory of the estimate.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Links {
    counts: Vec<f64>,
}

impl Default for Links {
    fn default() -> Self {
        Self { counts: vec![0.0; MAX_REGISTERED * MAX_REGISTERED] }
    }
}

impl Links {
    pub(super) fn note(&mut self, a: RegistrationSlot, b: RegistrationSlot, count: u32) {
        self.counts[place(a.index(), b.index())] += f64::from(count);
        self.counts[place(b.index(), a.index())] += f64::from(count);
    }

    pub(super) fn forget(&mut self, slot: RegistrationSlot) {
        for other in 0..MAX_REGISTERED {
            self.counts[place(slot.index(), other)] = 0.0;
            self.counts[place(other, slot.index())] = 0.0;
        }
    }

    pub(super) fn fade(&mut self, dt_s: f64) {
        let kept = libm::exp(-dt_s / MEMORY_S);
        self.counts.iter_mut().for_each(|count| *count *= kept);
    }

    /// Whether another agent is joined to it.
    pub(super) fn is_joined(&self, slot: RegistrationSlot) -> bool {
        (0..MAX_REGISTERED).any(|other| self.counts[place(slot.index(), other)] >= JOINING)
    }

    /// For each agent whether a chain of shared objects leads from it to a reference.
    pub(super) fn reached_from(
        &self,
        references: impl Iterator<Item = RegistrationSlot>,
    ) -> [bool; MAX_REGISTERED] {
        let mut reached = [false; MAX_REGISTERED];
        references.for_each(|slot| reached[slot.index()] = true);
        // As many rounds as the longest chain has links.
        for _ in 0..MAX_REGISTERED {
            let before = reached;
            for (agent, reached) in reached.iter_mut().enumerate() {
                *reached |= (0..MAX_REGISTERED)
                    .any(|other| before[other] && self.counts[place(agent, other)] >= JOINING);
            }
            if before == reached {
                break;
            }
        }
        reached
    }
}

fn place(row: usize, column: usize) -> usize {
    row * MAX_REGISTERED + column
}

#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    vec![("registration.joining", JOINING.to_string())]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chain_of_shared_objects_reaches_as_far_as_it_is_joined_and_fades() {
        let [unit, a, b, c, d] = [0, 1, 2, 3, 4].map(RegistrationSlot);
        let mut links = Links::default();
        links.note(c, d, 30);
        links.note(b, a, 30);
        links.note(unit, a, 30);
        links.note(b, c, 19);
        let reached = |links: &Links| links.reached_from([unit].into_iter())[..5].to_vec();
        assert_eq!(reached(&links), [true, true, true, false, false]);
        assert!(links.is_joined(d) && !links.is_joined(RegistrationSlot(5)));
        links.note(b, c, 1);
        assert_eq!(reached(&links), [true; 5]);
        links.fade(MEMORY_S);
        assert_eq!(reached(&links), [true, false, false, false, false]);
    }
}
