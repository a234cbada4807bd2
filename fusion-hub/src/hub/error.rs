//! Why a hub does not run.

use v2x_common::id::HubId;
use v2x_common::net::session::without_places;
use v2x_common::recording::FileError;

type Cause = Box<dyn std::error::Error + Send + Sync>;

/// Why a hub does not run.
#[derive(Debug, thiserror::Error)]
pub enum HubError {
    /// The Zenoh configuration cannot be used.
    #[error("the Zenoh configuration: {0}")]
    Configuration(#[source] Cause),
    /// The endpoints cannot be listened on.
    #[error(
        "cannot listen on {endpoints} ({cause}); is another hub running there? port 0 takes a free one, such as --listen \
         tcp/127.0.0.1:0"
    )]
    Listen {
        /// The endpoints.
        endpoints: String,
        /// Zenoh's error.
        cause: Cause,
    },
    /// The hub's keys cannot be declared.
    #[error("declaring the hub {hub}: {}", without_places(&.cause.to_string()))]
    Declare {
        /// The hub.
        hub: HubId,
        /// Zenoh's error.
        cause: Cause,
    },
    /// A hub of this name runs in the network.
    #[error(
        "hub {hub} already runs in this network, at {locators}: give this one another name (--id), or end that one"
    )]
    Twin {
        /// The name.
        hub: HubId,
        /// Where the other one listens.
        locators: String,
    },
    /// The hub that it is to stand by for has its lineage, so that their ids would be the same.
    #[error("hub {hub} and this one were started in the same tenth of a second: start this one again")]
    SameLineage {
        /// The name.
        hub: HubId,
    },
    /// Its recording cannot be written.
    #[error("the recording: {0}")]
    Recording(#[from] FileError),
    /// The session did not close cleanly.
    #[error("closing the Zenoh session: {0}")]
    Close(#[source] Cause),
}
