//! Errors between a client and a network.

/// Why a client has no connection or no reply.
#[derive(Debug, thiserror::Error)]
pub enum ConnectionError {
    /// Opening the session failed.
    #[error("{0:#}")]
    Session(anyhow::Error),
    /// Subscribing to a key expression failed.
    #[error("subscribing to {expression}: {source}")]
    Subscription {
        /// The key expression.
        expression: String,
        /// The error of Zenoh.
        source: zenoh::Error,
    },
    /// The status query failed.
    #[error("asking for the status: {0}")]
    Query(#[source] zenoh::Error),
    /// A hub replied with an error.
    #[error("a hub replied with an error: {0}")]
    Reply(#[source] zenoh::Error),
    /// The reply of a hub cannot be parsed.
    #[error("a hub's status is of another version: {0}")]
    Status(#[from] serde_json::Error),
}
