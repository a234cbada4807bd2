//! The hub as a command: runs a hub from its arguments, and reports life-cycle events to its launcher.

use super::HubArgs;
use super::run::{HubSetup, serve};
use crate::engine::Engine;
use crate::engine::EngineConfig;
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
    let setup = HubSetup {
        network: args.network,
        settings: args.settings()?,
        session: args.session_options(),
        record: args.recording(),
    };
    let status = Box::pin(serve(setup, shutdown, engine, |hub, locators| {
        if args.events {
            events::emit("ready", &serde_json::json!({ "locators": locators, "hub": hub }));
        }
    }));
    let status = status.await?;
    if args.events {
        events::emit("stopped", &serde_json::json!({ "status": status }));
    }
    Ok(())
}
