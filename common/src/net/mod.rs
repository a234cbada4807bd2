//! Network and operating system, for all programs of the project.

pub mod address;
pub mod events;
pub mod logging;
pub mod queue;
pub mod session;
pub mod shutdown;
pub mod tls;
pub mod zenoh_refusals;

use std::io::Write;
use std::process::{ExitCode, Termination};

/// The exit code of a program's outcome; an error is printed with its causes.
pub fn exit_code(program: &str, outcome: anyhow::Result<impl Termination>) -> ExitCode {
    match outcome {
        Ok(done) => done.report(),
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "{program}: {error:#}");
            ExitCode::FAILURE
        }
    }
}
