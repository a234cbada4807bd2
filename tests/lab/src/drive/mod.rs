//! Drives an engine in virtual time: arrivals, publishing instants, and the settings of the compared methods.

pub(crate) mod driver;
pub(crate) mod keyframes;
pub(crate) mod parallel;
pub(crate) mod publishing;
pub(crate) mod replay;
pub(crate) mod retrack;
pub(crate) mod sweep;
pub(crate) mod ticks;
pub(crate) mod traffic;
pub(crate) mod virtual_run;
