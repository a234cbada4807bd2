//! The places of agents whose errors are estimated.

use serde::{Deserialize, Serialize};

/// Most agents whose errors are estimated: all of them together, so that it costs their number's cube twice a second.
pub const MAX_REGISTERED: usize = 32;

/// An agent's place among those whose errors are estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct RegistrationSlot(pub(super) u8);

impl RegistrationSlot {
    /// As an index.
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}
