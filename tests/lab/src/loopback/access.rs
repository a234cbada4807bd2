//! Access of an agent to its network.

use crate::loopback::task_group::TaskToken;
use tokio_util::sync::CancellationToken;
use v2x_common::id::NetworkId;
use v2x_common::net::session::SessionOptions;
use v2x_common::time::Timestamp;

/// The handles that an agent needs to join a network.
#[derive(Clone)]
pub(super) struct Access {
    pub(super) network: NetworkId,
    pub(super) session: SessionOptions,
    pub(super) started_at: Timestamp,
    pub(super) ended: CancellationToken,
    pub(super) token: TaskToken,
}
