//! Drives an engine in virtual time: arrivals, publishing instants, and the settings of the compared methods.

pub(crate) mod driver;
#[cfg(feature = "lab")]
pub(crate) mod found;
pub(crate) mod keyframes;
pub(crate) mod parallel;
pub(crate) mod publishing;
#[cfg(feature = "lab")]
pub(crate) mod replay;
#[cfg(feature = "lab")]
pub(crate) mod rerun;
#[cfg(feature = "lab")]
pub(crate) mod retrack;
#[cfg(feature = "lab")]
pub(crate) mod sweep;
pub(crate) mod ticks;
#[cfg(feature = "lab")]
pub(crate) mod traffic;
#[cfg(feature = "lab")]
pub(crate) mod virtual_run;
