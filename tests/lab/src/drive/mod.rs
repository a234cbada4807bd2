//! Feeding an engine in virtual time: what arrives when, and when it is asked.

pub mod driver;
pub mod keyframes;
pub mod parallel;
pub mod publishing;
pub mod replay;
pub mod sweep;
pub mod ticks;
pub mod traffic;
pub mod virtual_run;
