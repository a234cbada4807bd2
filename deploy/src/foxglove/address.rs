//! Where viewers connect.

use std::net::SocketAddr;
use v2x_common::net::address;

/// Where viewers look if nothing else is said.
const DEFAULT: &str = "127.0.0.1:8765";

/// The option `--foxglove [ADDR]`.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct FoxgloveArgs {
    /// Serve the network to Foxglove or Lichtblick at this address, as they expect it [default: 127.0.0.1:8765]; of a
    /// v2x that was built with --features foxglove
    #[arg(
        long,
        value_name = "ADDR",
        num_args = 0..=1,
        default_missing_value = DEFAULT,
        value_parser = parse,
        conflicts_with_all = ["json", "record", "web", "delta", "tile", "lagged"]
    )]
    pub(crate) foxglove: Option<SocketAddr>,
}

/// An address, or a port of this machine alone.
fn parse(text: &str) -> Result<SocketAddr, String> {
    address::parse(text).ok_or_else(|| format!("write an address as {DEFAULT}, or a port"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_or_a_port_of_this_machine_is_understood() {
        assert_eq!(parse("9000").map(|address| address.to_string()), Ok("127.0.0.1:9000".to_owned()));
        assert_eq!(parse("[::1]:80").map(|address| address.to_string()), Ok("[::1]:80".to_owned()));
        assert!(parse("crossing").unwrap_err().contains(DEFAULT));
    }
}
