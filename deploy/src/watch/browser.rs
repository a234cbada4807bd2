//! The network in a browser, until shutdown.

use super::WatchArgs;
use crate::scenarios;
use crate::web::{Scene, Site, Source};
use anyhow::ensure;
use std::net::SocketAddr;
use tokio_util::sync::CancellationToken;

/// Serves the page; it waits for a hub as long as there is none.
pub(super) async fn show(
    args: &WatchArgs,
    address: SocketAddr,
    shutdown: &CancellationToken,
) -> anyhow::Result<()> {
    let site = Site::listen(address)?;
    let scene = args.scenario.as_deref().map(|name| {
        let scenario = scenarios::choose(name)?.scenario;
        ensure!(
            scenario.world.repeats(),
            "--scenario {name}: where loop is false, only v2x up knows when the world began; use v2x up {name} --web"
        );
        Ok::<_, anyhow::Error>(Scene::of_period(&scenario, args.seed.unwrap_or(scenario.seed)))
    });
    let scene = scene.transpose()?;
    site.announce();
    let mut live =
        site.serve(Source { session: args.session_options(), network: args.network, hub: args.hub, scene });
    tokio::select! {
        failed = live.failed() => failed,
        () = shutdown.cancelled() => live.end().await,
    }
}
