//! Clock and pose errors of agents: estimated, published and corrected, at the engine's boundary.

mod declarations;
mod harm;
mod recovery;
mod traffic;
