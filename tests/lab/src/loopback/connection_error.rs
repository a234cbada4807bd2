//! What can go wrong between a client and a network.

/// Why a client has no connection, or no answer.
#[derive(Debug, thiserror::Error)]
pub enum ConnectionError {
    /// No session.
    #[error("{0:#}")]
    Session(anyhow::Error),
    /// A key could not be subscribed to.
    #[error("subscribing to {expression}: {source}")]
    Subscription {
        /// The key expression.
        expression: String,
        /// Zenoh's reason.
        source: zenoh::Error,
    },
    /// The hubs could not be asked for their status.
    #[error("asking for the status: {0}")]
    Query(#[source] zenoh::Error),
    /// A hub refused to answer.
    #[error("a hub answered with an error: {0}")]
    Reply(#[source] zenoh::Error),
    /// A hub's answer cannot be read.
    #[error("a hub's status is of another version: {0}")]
    Status(#[from] serde_json::Error),
}
