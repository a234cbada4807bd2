//! The option `--metrics [ADDR]`: where metrics and health are served.

use std::net::{Ipv4Addr, SocketAddr};

/// Where if nothing else is said: this machine alone.
pub const DEFAULT: &str = "127.0.0.1:9464";

/// An address, or a port of this machine alone.
pub fn parse(text: &str) -> Result<SocketAddr, String> {
    let local = |port: &str| port.parse().map(|port| SocketAddr::from((Ipv4Addr::LOCALHOST, port))).ok();
    let port = text.strip_prefix("localhost:").unwrap_or(text);
    text.parse()
        .ok()
        .or_else(|| local(port))
        .ok_or_else(|| format!("write an address as {DEFAULT} or 0.0.0.0:9464, or a port of this machine"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_alone_is_one_of_this_machine_and_of_nobody_else() {
        for (text, expected) in [
            ("9464", "127.0.0.1:9464"),
            ("localhost:0", "127.0.0.1:0"),
            ("0.0.0.0:80", "0.0.0.0:80"),
            (DEFAULT, DEFAULT),
        ] {
            assert_eq!(parse(text).map(|address| address.to_string()), Ok(expected.to_owned()));
        }
        assert!(parse("metrics").unwrap_err().contains("0.0.0.0:9464"));
    }
}
