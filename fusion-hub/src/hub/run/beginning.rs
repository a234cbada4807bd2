//! What is there before the loop begins: the recording's file, and the network.

use super::super::error::HubError;
use super::super::settings::HubSettings;
use super::super::twin;
use std::path::PathBuf;
use v2x_common::id::NetworkId;
use v2x_common::keys::Keys;
use v2x_common::net::endpoint;
use v2x_common::net::session;
use v2x_common::recording::{RecordingFile, RecordingOptions};
use v2x_common::wire::Writings;
use zenoh::{Config, Session};

/// The file of the hub's own recording, if there is to be one.
pub(super) fn recording(
    record: Option<(PathBuf, RecordingOptions)>,
    settings: &HubSettings,
) -> Result<Option<RecordingFile>, HubError> {
    let Some((path, options)) = record else { return Ok(None) };
    let mut file = RecordingFile::create(&path, options)?;
    if file.path() != path {
        tracing::warn!(file = %file.path().display(), "files of this recording are there and stay: it goes on beside them");
    }
    file.read_by(&Writings::new(settings.writings()));
    Ok(Some(file))
}

/// Opens the session; refuses to where another hub of this name serves the network.
pub(super) async fn join(
    network: NetworkId,
    settings: &HubSettings,
    config: Config,
) -> Result<Session, HubError> {
    let endpoints = endpoint::all_shown(&session::listen_endpoints(&config));
    // Alone it is the router, and nobody is there before it.
    let can_have_twin = session::joins_others(&config) && !settings.standby;
    let opened = session::open(config).await;
    let session = opened.map_err(|error| HubError::Listen { endpoints, cause: error.into() })?;
    if can_have_twin
        && let Some(other) = twin::running(&session, &Keys::new(network), &settings.engine.hub).await
    {
        return Err(HubError::Twin { hub: other.hub, locators: other.locators.join(" ") });
    }
    Ok(session)
}
