//! The program as a user runs it.

mod demo;
mod mistakes;
mod proxy;
mod watch;

/// Needs to know other processes: from `/proc`.
#[cfg(target_os = "linux")]
mod endings;

mod support;
