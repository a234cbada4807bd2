//! Why SUMO cannot be the world.

use crate::sumo_home::NoSumo;
use std::io;
use std::path::PathBuf;
use std::time::Duration;

/// Why SUMO cannot be the world.
#[derive(Debug, thiserror::Error)]
pub(super) enum SumoError {
    /// It is not there.
    #[error(transparent)]
    Missing(#[from] NoSumo),
    /// It does not start.
    #[error("starting {}: {cause}", program.display())]
    Start {
        /// The program.
        program: PathBuf,
        /// The cause.
        cause: io::Error,
    },
    /// It ended by itself.
    #[error("SUMO ended ({status}){said}")]
    Ended {
        /// Its exit status.
        status: String,
        /// Its last messages, or nothing.
        said: String,
    },
    /// Nobody listens there.
    #[error("no SUMO answers at {address}: {cause}; start it with --remote-port")]
    NoAnswer {
        /// Host and port.
        address: String,
        /// The cause.
        cause: io::Error,
    },
    /// It closed the connection.
    #[error("SUMO closed the connection: its simulation has ended, or it was stopped")]
    Closed,
    /// The connection broke.
    #[error("the connection to SUMO broke: {0}")]
    Connection(io::Error),
    /// No answer in time.
    #[error("SUMO did not answer within {0:?}")]
    TooSlow(Duration),
    /// It refuses a command.
    #[error("SUMO refuses command {command:#04x}: {why}")]
    Refused {
        /// Number of the command.
        command: u8,
        /// Its words.
        why: String,
    },
    /// A message that is longer than any sensible one.
    #[error("a message of SUMO has {length} bytes, expected 4 to {limit}")]
    Length {
        /// As it says.
        length: i64,
        /// At most so many.
        limit: usize,
    },
    /// A message that is no answer.
    #[error("a message of SUMO is unreadable: {0}")]
    Message(&'static str),
}
