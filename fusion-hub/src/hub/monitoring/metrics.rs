//! The option `--metrics [ADDR]`: where metrics and health are served.

use std::net::SocketAddr;
use v2x_common::net::address;

/// Where if nothing else is said: this machine alone.
pub const DEFAULT: &str = "127.0.0.1:9464";

/// An address, or a port of this machine alone.
pub fn parse(text: &str) -> Result<SocketAddr, String> {
    let wanted = || format!("write an address as {DEFAULT} or 0.0.0.0:9464, or a port of this machine");
    address::parse(text).ok_or_else(wanted)
}
