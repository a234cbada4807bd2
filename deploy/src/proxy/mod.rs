//! `v2x proxy`: a TCP link with delay and a finite rate between an agent and the hub, for programs that are not ours.

mod pipe;
mod relay;

use anyhow::{Context, bail};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinSet;
use tokio_util::sync::CancellationToken;
use v2x_agent::link::{LinkConfig, profiles};
use v2x_common::clock;
use v2x_common::id::AgentId;
use v2x_common::net::endpoint_given::{to_connect, to_listen};
use v2x_common::net::session::DEFAULT_ENDPOINT;

use pipe::Pipe;

/// Relay TCP connections between agents and the hub through a slow link
///
/// Data arrives later, complete and in order: as over TCP, nothing is ever lost. For losses use links inside agents (see
/// v2x links), or netem (deploy/links).
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x proxy --link lte-uu
  v2x proxy --link custom:delay=80ms,jitter=30ms,rate=2Mbps --back 5g-mec
  v2x agent --scenario crossing.toml --id ego --connect tcp/127.0.0.1:7448")]
pub(crate) struct ProxyArgs {
    /// Where agents connect; port 0 is a free one
    #[arg(long, value_name = "ENDPOINT", default_value = "tcp/127.0.0.1:7448", value_parser = to_listen)]
    listen: String,
    /// The hub or router behind it
    #[arg(long, value_name = "ENDPOINT", default_value = DEFAULT_ENDPOINT, value_parser = to_connect)]
    to: String,
    /// The link from agents to the hub, by name (see v2x links), without loss
    #[arg(long, value_name = "LINK")]
    link: String,
    /// The link back [default: the same]
    #[arg(long, value_name = "LINK")]
    back: Option<String>,
    /// Seed of the delays
    #[arg(long, default_value_t = 1, value_parser = v2x_common::seed::parse_seed)]
    seed: u64,
}

/// Relays until shutdown.
pub(crate) async fn run(args: &ProxyArgs, shutdown: &CancellationToken) -> anyhow::Result<()> {
    let there = lossless("--link", &args.link)?;
    let back = args.back.as_ref().map_or_else(|| Ok(there.clone()), |back| lossless("--back", back))?;
    let (listen, to) = (address("--listen", &args.listen)?, address("--to", &args.to)?);
    let listener = TcpListener::bind(listen).await.with_context(|| format!("cannot listen on {listen}"))?;
    let endpoint = format!("tcp/{}", listener.local_addr().context("asking for the real port")?);
    tracing::info!("proxy at {endpoint} for {}: {} there, {} back", args.to, args.link, args.back());
    let started_at = clock::now();
    // Dropping it at the end aborts what is still relayed.
    let mut relays = JoinSet::new();
    for connection in 0_u64.. {
        let accepted = tokio::select! {
            biased;
            () = shutdown.cancelled() => break,
            accepted = listener.accept() => accepted,
        };
        // Relays that have ended are removed from the set.
        while relays.try_join_next().is_some() {}
        let (agent, peer) = accepted.context("accepting a connection")?;
        let pipe = |link: &LinkConfig, direction: &str| {
            let name = AgentId::new(&format!("{direction}-{connection}")).context("naming a connection")?;
            Ok::<_, anyhow::Error>(Pipe::new(link.clone(), args.seed, name, started_at))
        };
        let pipes = [pipe(&there, "there")?, pipe(&back, "back")?];
        let to = to.to_owned();
        relays.spawn(async move {
            let relayed = async { relay::relay(agent, TcpStream::connect(&to).await?, pipes).await };
            match relayed.await {
                Ok([there, back]) => {
                    tracing::info!(%peer, bytes_there = there, bytes_back = back, "connection closed");
                }
                Err(error) => tracing::warn!(%peer, to, %error, "connection broken"),
            }
        });
    }
    Ok(())
}

impl ProxyArgs {
    fn back(&self) -> &str {
        self.back.as_ref().unwrap_or(&self.link)
    }
}

/// A link of this name; a link that loses frames is an error, since TCP loses nothing.
fn lossless(flag: &str, name: &str) -> anyhow::Result<LinkConfig> {
    let link = profiles::parse(name, |path| std::fs::read_to_string(path)).context(flag.to_owned())?;
    if !Pipe::can_carry(&link) {
        bail!(
            "{flag} {name}: a TCP proxy loses nothing; give the link loss=0 and no outage, \
             or see deploy/links/README.md for what can lose"
        );
    }
    Ok(link)
}

/// The address of a TCP endpoint as Zenoh writes it.
fn address<'a>(flag: &str, endpoint: &'a str) -> anyhow::Result<&'a str> {
    match endpoint.split_once('/') {
        Some(("tcp", address)) if address.contains(':') => Ok(address),
        _ => bail!("{flag} is {endpoint:?}, expected tcp/HOST:PORT"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_with_losses_and_endpoints_other_than_tcp_are_refused_by_name() {
        for link in ["pc5", "lte-uu:loss=0.1", "ideal:outage=1s,outage-every=10s"] {
            let error = lossless("--link", link).expect_err(link).to_string();
            assert!(error.contains(link) && error.contains("loses nothing"), "{error}");
        }
        assert!(lossless("--link", "pc5:loss=0").is_ok());
        for endpoint in ["127.0.0.1:7447", "udp/127.0.0.1:7447", "tcp/7447"] {
            let error = address("--to", endpoint).expect_err(endpoint).to_string();
            assert!(error.contains("tcp/HOST:PORT"), "{error}");
        }
        assert_eq!(address("--to", "tcp/[::1]:7447").unwrap(), "[::1]:7447");
    }
}
