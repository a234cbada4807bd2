//! Network and operating system, for all programs of the project.

pub mod address;
pub mod endpoint;
pub mod endpoint_given;
pub mod events;
pub mod liveliness;
mod log_queue;
pub mod logging;
pub mod queue;
pub mod session;
pub mod shutdown;
pub mod tls;
pub mod zenoh_breakers;
pub mod zenoh_logs;
pub mod zenoh_panics;
pub mod zenoh_peers;
pub mod zenoh_refusals;
mod zenoh_speakers;

use std::io::Write;
use std::process::{ExitCode, Termination};

/// The exit code of a program's outcome; an error is printed with its causes.
pub fn exit_code(program: &str, outcome: anyhow::Result<impl Termination>) -> ExitCode {
    logging::flush();
    match outcome {
        Ok(done) => done.report(),
        Err(error) => {
            let message = format!("{program}: {error:#}\n");
            // As in logs: what the error quotes may hold a secret of a configuration.
            let message = tls::redacted(message.as_bytes()).unwrap_or_else(|| message.into_bytes());
            let _ = std::io::stderr().write_all(&message);
            ExitCode::FAILURE
        }
    }
}
