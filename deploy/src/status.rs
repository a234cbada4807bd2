//! `v2x status`: the status of the hubs of a network.

use crate::output;
use anyhow::{Context, bail};
use std::io::Write;
use std::path::PathBuf;
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::id::NetworkId;
use v2x_common::net::session::{self, SessionOptions};
use v2x_fusion_hub::hub::{HubStatus, RegistrationStatus};

#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x status
  v2x status --connect tcp/192.168.1.10:7447 | jq '.agents[] | {id, accepted, refused}'")]
pub(crate) struct StatusArgs {
    /// The network of the hubs
    #[arg(long, default_value = "demo")]
    network: NetworkId,
    /// The hub or router to connect to; may be given more than once [default: tcp/127.0.0.1:7447]
    #[arg(long, value_name = "ENDPOINT")]
    connect: Vec<String>,
    /// A Zenoh configuration file that replaces our defaults
    #[arg(long, value_name = "FILE")]
    zenoh_config: Option<PathBuf>,
    /// Seconds to wait for a hub
    #[arg(long, default_value_t = 5.0, value_name = "SECONDS")]
    wait: f64,
}

/// Prints each hub's status as JSON, and on standard error the errors of agents' clocks and poses in words.
pub(crate) async fn run(args: &StatusArgs, shutdown: &CancellationToken) -> anyhow::Result<()> {
    let options = SessionOptions {
        config: args.zenoh_config.clone(),
        connect: args.connect.clone(),
        listen: Vec::new(),
    };
    let timeout = Duration::try_from_secs_f64(args.wait).context("--wait is no number of seconds")?;
    let opened = session::open_patiently(session::client_config(&options)?, Some(timeout), shutdown);
    let Some(session) = opened.await.context("start a hub with `v2x up crossing`, or give --connect")? else {
        return Ok(());
    };
    let statuses = v2x_lab::loopback::hub_status::query(&session, args.network).await;
    session::close(session).await?;
    let statuses = statuses?;
    if statuses.is_empty() {
        bail!("no hub of network {} answered; is --network right?", args.network);
    }
    for status in statuses {
        let json = serde_json::to_string_pretty(&status)? + "\n";
        if output::print(&json)? == output::Output::Closed {
            break;
        }
        print_registration(&status);
    }
    Ok(())
}

/// On standard error: standard output is JSON alone.
fn print_registration(status: &HubStatus) {
    let mut err = std::io::stderr().lock();
    for agent in &status.agents {
        if let Some(words) = agent.registration.as_ref().and_then(RegistrationStatus::in_words) {
            // A closed standard error is no fault of the status.
            let _ = writeln!(err, "{}: {words}", agent.id);
        }
    }
}
