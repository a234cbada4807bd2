//! Addresses at which a program serves people or other programs beside the network.

use std::net::{Ipv4Addr, SocketAddr};

/// An address, or a port alone, which is one of this machine and of nobody else; `None` where the text is neither.
pub fn parse(text: &str) -> Option<SocketAddr> {
    let port = text.strip_prefix("localhost:").unwrap_or(text);
    let local = || port.parse().ok().map(|port| SocketAddr::from((Ipv4Addr::LOCALHOST, port)));
    text.parse().ok().or_else(local)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_alone_is_one_of_this_machine() {
        for (text, expected) in [
            ("127.0.0.1:9000", "127.0.0.1:9000"),
            ("9000", "127.0.0.1:9000"),
            ("localhost:0", "127.0.0.1:0"),
            ("0.0.0.0:80", "0.0.0.0:80"),
            ("[::1]:80", "[::1]:80"),
        ] {
            assert_eq!(parse(text).map(|address| address.to_string()), Some(expected.to_owned()));
        }
        assert_eq!([parse("crossing"), parse("host:80"), parse("")], [None; 3]);
    }
}
