//! The command line of `v2x certs`.

use super::register::Holder;
use anyhow::bail;
use std::net::Ipv6Addr;
use std::path::PathBuf;
use v2x_common::duration::parse_days;
use v2x_common::id::{AgentId, HubId, Name};

/// Make certificates, so that only your own machines take part
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x certs init --host 192.168.1.10   an authority and a hub, in folder certs
  v2x certs agent ego                  certs/agent/ego, for the machine of ego
  v2x certs viewer screen              certs/viewer/screen, which only reads
  v2x certs revoke ego                 a running hub shuts it out
  v2x certs list                       who may take part, and until when
Then, each on its machine:
  v2x hub --zenoh-config certs/hub/hub/zenoh.json5
  v2x agent --id ego --zenoh-config certs/agent/ego/zenoh.json5 \\
            --scenario crossing.toml
  v2x watch --zenoh-config certs/viewer/screen/zenoh.json5")]
pub(crate) struct CertsArgs {
    #[command(subcommand)]
    pub(super) action: Action,
    /// The folder of the authority
    #[arg(long, global = true, default_value = "certs", value_name = "DIR")]
    pub(super) dir: PathBuf,
}

#[derive(Clone, Debug, clap::Subcommand)]
pub(super) enum Action {
    /// Make an authority and its first hub's certificate
    Init(InitArgs),
    /// Make the certificate of a further hub, or with other addresses
    Hub(HubArgs),
    /// Make the certificate of an agent: it publishes under its own name
    Agent(AgentArgs),
    /// Make the certificate of a viewer: it publishes nothing
    Viewer(ViewerArgs),
    /// Shut an agent or a viewer out; a running hub follows
    Revoke(RevokeArgs),
    /// Print who may take part, and until when
    List(ListArgs),
}

#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x certs init --host 192.168.1.10   an authority and a hub at this address
  v2x certs init --dir north --name north")]
pub(super) struct InitArgs {
    /// The folder to make [default: that of --dir]
    #[arg(value_name = "DIR")]
    pub(super) folder: Option<PathBuf>,
    /// Name of the hub
    #[arg(long, default_value = "hub")]
    pub(super) name: HubId,
    #[command(flatten)]
    pub(super) place: PlaceArgs,
    /// How long the authority is valid, such as 12h or 52w; a plain number is days
    #[arg(long, default_value = "3650d", value_name = "DURATION", value_parser = days)]
    pub(super) authority_days: f64,
}

#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x certs hub south --host 192.168.1.11
  v2x certs hub hub --renew                      with the addresses it has
  v2x certs hub hub --host hub.example --renew   with a further address
  v2x certs hub hub --drop 10.0.0.7 --renew      without one of them")]
pub(super) struct HubArgs {
    /// Name of the hub
    pub(super) name: HubId,
    #[command(flatten)]
    pub(super) place: PlaceArgs,
    /// Replace the certificate, key and configuration that it has; its
    /// addresses and port stay
    #[arg(long)]
    pub(super) renew: bool,
    /// Address or DNS name that the hub no longer has, or several
    #[arg(long, value_name = "ADDR", value_parser = host, requires = "renew")]
    pub(super) drop: Vec<String>,
}

/// Where a hub is.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct PlaceArgs {
    /// Address or DNS name of the hub, or several [default: this machine]
    #[arg(long, value_name = "ADDR", value_parser = host)]
    pub(super) host: Vec<String>,
    /// Its port [default: 7447]
    #[arg(long)]
    pub(super) port: Option<u16>,
    /// How long its certificate is valid, such as 12h or 52w; a plain number is days
    #[arg(long, default_value = "365d", value_name = "DURATION", value_parser = days)]
    pub(super) days: f64,
}

#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x certs agent ego
  v2x certs agent rsu --days 30
  v2x certs agent rsu --connect 192.168.1.11 --connect 192.168.1.10
                                       the hub that stands by first")]
pub(super) struct AgentArgs {
    /// The agent's id, as in its keys and frames
    pub(super) name: AgentId,
    /// It may also publish the truth of a simulation
    #[arg(long)]
    pub(super) truth: bool,
    /// How long its certificate is valid, such as 12h or 52w; a plain number is days
    #[arg(long, default_value = "365d", value_name = "DURATION", value_parser = days)]
    pub(super) days: f64,
    /// Host of a hub it connects to; several: in this order [default: every one
    /// of every hub]
    #[arg(long, value_name = "ADDR", value_parser = host)]
    pub(super) connect: Vec<String>,
    /// Replace the certificate and key that it has
    #[arg(long)]
    pub(super) renew: bool,
}

#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x certs viewer screen")]
pub(super) struct ViewerArgs {
    /// A name for the viewer
    #[arg(value_parser = viewer_name)]
    pub(super) name: String,
    /// How long its certificate is valid, such as 12h or 52w; a plain number is days
    #[arg(long, default_value = "365d", value_name = "DURATION", value_parser = days)]
    pub(super) days: f64,
    /// Host of a hub it connects to; several: in this order [default: every one
    /// of every hub]
    #[arg(long, value_name = "ADDR", value_parser = host)]
    pub(super) connect: Vec<String>,
    /// Replace the certificate and key that it has
    #[arg(long)]
    pub(super) renew: bool,
}

#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x certs revoke ego
  v2x certs revoke viewer:screen")]
pub(super) struct RevokeArgs {
    /// Its name; agent:NAME or viewer:NAME where both have it
    pub(super) name: String,
}

#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x certs list
  v2x certs list --json | jq")]
pub(super) struct ListArgs {
    /// As one line of JSON
    #[arg(long)]
    pub(super) json: bool,
}

fn days(text: &str) -> Result<f64, String> {
    const MOST: f64 = 36_500.0;
    let days = parse_days(text).map_err(|error| error.to_string())?;
    if (0.0..=MOST).contains(&days) {
        Ok(days)
    } else {
        Err(format!("{text} is not within 0 and {MOST} days"))
    }
}

/// Without protocol and port; an IPv6 address with or without brackets.
fn host(text: &str) -> Result<String, String> {
    let bare = text.strip_prefix('[').and_then(|text| text.strip_suffix(']')).unwrap_or(text);
    if let Ok(ip) = bare.parse::<Ipv6Addr>() {
        return Ok(ip.to_string());
    }
    let is_allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-');
    if text.is_empty() || !text.chars().all(is_allowed) {
        return Err(format!(
            "{text:?} is no address or name such as 192.168.1.10 or 2001:db8::7, without protocol and port"
        ));
    }
    Ok(text.to_owned())
}

fn viewer_name(text: &str) -> Result<String, String> {
    Name::new(text).map(|_| text.to_owned()).map_err(|error| error.to_string())
}

/// The one holder that a name means: `NAME`, `agent:NAME` or `viewer:NAME`.
pub(super) fn only_one<'a>(name: &str, holders: &'a mut [Holder]) -> anyhow::Result<&'a mut Holder> {
    let is_meant =
        |holder: &Holder| holder.name == name || format!("{}:{}", holder.role, holder.name) == name;
    let meant = holders.iter().filter(|holder| is_meant(holder)).count();
    if meant > 1 {
        bail!("{name} is an agent and a viewer: say agent:{name} or viewer:{name}");
    }
    match holders.iter_mut().find(|holder| is_meant(holder)) {
        Some(holder) => Ok(holder),
        None => bail!("no agent or viewer has the name {name}; see `v2x certs list`"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_host_of_certs_is_an_address_or_a_name_alone() {
        assert!(host("192.168.1.10").is_ok() && host("hub-1.local").is_ok());
        for ipv6 in ["2001:db8::7", "[2001:db8::7]", "2001:DB8:0::7"] {
            assert_eq!(host(ipv6), Ok("2001:db8::7".to_owned()));
        }
        for wrong in ["", "tls/10.0.0.1", "10.0.0.1:7447", "[::1]:7447", "fe80::1%eth0", "a b"] {
            assert!(host(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn days_of_certs_are_bounded() {
        assert_eq!(days("0.5"), Ok(0.5));
        assert_eq!(days("12h"), Ok(0.5));
        for wrong in ["-1", "1e9", "NaN", "soon"] {
            assert!(days(wrong).is_err(), "{wrong}");
        }
    }
}
