//! The four models of motion, by their places in all arrays.

/// At rest; never moves.
pub(super) const PARKED: usize = 0;
/// At rest; may start.
pub(super) const STOPPED: usize = 1;
/// In steady motion.
pub(super) const SMOOTH: usize = 2;
/// In motion, with turns and changes of speed.
pub(super) const MANOEUVRE: usize = 3;
