//! Feeding an engine in virtual time: what arrives when, and when it is asked.

pub mod keyframes;
pub mod parallel;
pub mod replay;
pub mod sweep;
pub mod traffic;
pub mod virtual_run;
