//! The hub as a command: runs a hub from its arguments, and reports life-cycle events to its launcher.

use super::HubArgs;
use super::again::{self, Again};
use super::monitor::Monitor;
use super::monitoring::{ReadyFile, Server};
use super::run::{HubSetup, serve};
use crate::engine::Engine;
use crate::engine::EngineConfig;
use std::sync::Arc;
use tokio_util::sync::CancellationToken;
use v2x_common::net::events;

/// Runs a hub until shutdown.
pub async fn run(args: HubArgs, shutdown: CancellationToken) -> anyhow::Result<()> {
    run_with(args, shutdown, Engine::new).await
}

/// Runs a hub around an engine of your own making, for example
/// `|config| Engine::with_fusion(config, Box::new(MyMethod::default()))`.
pub async fn run_with(
    args: HubArgs,
    shutdown: CancellationToken,
    engine: impl FnOnce(EngineConfig) -> Engine,
) -> anyhow::Result<()> {
    let monitor = Monitor::default();
    let server = match args.metrics {
        Some(address) => Some(Server::listen(address).await?),
        None => None,
    };
    let mut ready_file = args.ready_file.as_deref().map(ReadyFile::claim).transpose()?;
    let setup = HubSetup {
        network: args.network,
        settings: args.settings()?,
        session: args.session_options(),
        record: args.recording(),
        monitor: server.is_some().then(|| monitor.clone()),
        began_again: again::times(),
    };
    let again = Arc::new(Again::new(args.listen.clone(), args.recording_that_is_in_the_way()));
    again::recall_breakers();
    Again::when_zenoh_is_broken(again.clone());
    let network = args.network;
    let metrics = server.as_ref().map(Server::address);
    let watched = CancellationToken::new();
    let _ends_with_this = watched.clone().drop_guard();
    if let Some(server) = server {
        tracing::info!("metrics and health at http://{}/metrics", server.address());
        tokio::spawn(server.serve(monitor, watched));
    }
    let shutdown = shutdown.child_token();
    let (ends, mut unwritten) = (shutdown.clone(), None);
    let served = Box::pin(serve(setup, shutdown, engine, |hub, locators| {
        again.note_locators(locators);
        // Whoever waits for it would wait for ever.
        if let Some(Err(error)) = ready_file.as_mut().map(|file| file.write(network, hub, locators)) {
            unwritten = Some(error);
            return ends.cancel();
        }
        if args.events {
            let event = serde_json::json!({ "locators": locators, "hub": hub, "metrics": metrics });
            events::emit("ready", &event);
        }
    }));
    let status = served.await?;
    if let Some(error) = unwritten {
        return Err(error);
    }
    if args.events {
        events::emit("stopped", &serde_json::json!({ "status": status }));
    }
    Ok(())
}
