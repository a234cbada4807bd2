//! How an agent's classes err.

use serde::{Deserialize, Serialize};

/// Costs are differences of -2 ln p.
const MINUS_TWO: f64 = -2.0;

/// The probabilities of what an agent's class is: right; of the right group, but not the class; or the rest, wrong by any.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClassLaw {
    /// That the class is right.
    pub right: f64,
    /// That only the group is.
    pub within_group: f64,
}

impl Default for ClassLaw {
    fn default() -> Self {
        Self::UNKNOWN
    }
}

impl ClassLaw {
    /// Of an agent that nothing is known of: one class in twenty is another one of the group, about, and one in a hundred
    /// and fifty of another group.
    pub const UNKNOWN: Self = Self { right: 0.9433, within_group: 0.05 };

    /// The probability that not even the group is right.
    pub const fn other(&self) -> f64 {
        1.0 - self.right - self.within_group
    }

    /// What it costs, in units of -2 ln p and more than the right class, that the class is another one of the group.
    pub fn cost_within_group(&self) -> f64 {
        (MINUS_TWO * libm::log(self.within_group / self.right)).max(0.0)
    }

    /// And that it is of another group that is confused with it.
    pub fn cost_of_other(&self) -> f64 {
        (MINUS_TWO * libm::log(self.other() / self.right)).max(0.0)
    }
}
