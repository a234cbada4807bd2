//! What a view shows.

use super::scene::Scene;
use v2x_common::id::{HubId, NetworkId};
use v2x_common::net::session::SessionOptions;

/// What is shown.
pub(crate) struct Source {
    /// How to reach the network.
    pub(crate) session: SessionOptions,
    /// Its name.
    pub(crate) network: NetworkId,
    /// The one hub that is believed; `None`: every one.
    pub(crate) hub: Option<HubId>,
    /// Its world, where it is simulated and known.
    pub(crate) scene: Option<Scene>,
}
