//! Endpoints of Zenoh, as people and configurations write them: `tls/192.168.1.10:7447`, `tcp/[::1]:7447#so_sndbuf=9`.

use std::borrow::Cow;
use std::net::{IpAddr, Ipv6Addr};

/// An endpoint without what may follow its address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Endpoint<'a> {
    /// Such as `tls`.
    pub protocol: &'a str,
    /// Host and port as they were written.
    pub address: &'a str,
    /// A name, or an address without brackets.
    pub host: &'a str,
}

impl<'a> Endpoint<'a> {
    /// Of a text; `None` where it has no protocol, or no port.
    pub fn read(text: &'a str) -> Option<Self> {
        let (protocol, rest) = text.split_once('/')?;
        let address = rest.split(['?', '#']).next()?;
        let (host, _) = address.rsplit_once(':')?;
        let bare = host.strip_prefix('[').and_then(|host| host.strip_suffix(']'));
        Some(Self { protocol, address, host: bare.unwrap_or(host) })
    }

    /// Whether only this machine reaches it.
    pub fn is_of_this_machine(&self) -> bool {
        self.host == "localhost" || self.host.parse::<IpAddr>().is_ok_and(|ip| ip.is_loopback())
    }
}

/// An endpoint as Zenoh's clients of TLS take it. To them what stands before the port is the name of the server, and an IPv6
/// address in brackets is no name; without brackets it is one, and is found all the same.
pub fn for_clients(endpoint: &str) -> Cow<'_, str> {
    let Some(Endpoint { protocol: "tls" | "quic", address, host }) = Endpoint::read(endpoint) else {
        return endpoint.into();
    };
    let is_bracketed = address.starts_with('[') && host.parse::<Ipv6Addr>().is_ok();
    if is_bracketed { endpoint.replacen(['[', ']'], "", 2).into() } else { endpoint.into() }
}

/// A host and a port as an address: that of IPv6 is in brackets.
pub fn address(host: &str, port: u16) -> String {
    if host.parse::<Ipv6Addr>().is_ok() { format!("[{host}]:{port}") } else { format!("{host}:{port}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_endpoint_is_read_without_its_metadata_and_settings() {
        let read =
            |text| Endpoint::read(text).map(|endpoint| (endpoint.protocol, endpoint.address, endpoint.host));
        assert_eq!(read("tls/10.0.0.1:7447?rel=1#so=2"), Some(("tls", "10.0.0.1:7447", "10.0.0.1")));
        assert_eq!(read("tcp/[::1]:7447"), Some(("tcp", "[::1]:7447", "::1")));
        assert_eq!(read("tls/::1:7447"), Some(("tls", "::1:7447", "::1")));
        assert_eq!([read("nonsense"), read("tcp/host")], [None; 2]);
    }

    #[test]
    fn an_ipv6_address_is_named_to_tls_without_brackets_and_written_with_them() {
        assert_eq!(for_clients("tls/[::1]:7447"), "tls/::1:7447");
        assert_eq!(for_clients("tls/[2001:db8::7]:7447#iface=eth0"), "tls/2001:db8::7:7447#iface=eth0");
        for same in ["tls/::1:7447", "tcp/[::1]:7447", "tls/10.0.0.1:7447", "tls/hub.example:7447", "x"] {
            assert_eq!(for_clients(same), same);
        }
        assert_eq!(address("2001:db8::7", 7447), "[2001:db8::7]:7447");
        assert_eq!(address("hub.example", 7447), "hub.example:7447");
    }

    #[test]
    fn endpoints_of_this_machine_are_known() {
        let is_own = |text| Endpoint::read(text).is_some_and(|endpoint| endpoint.is_of_this_machine());
        assert!(["tcp/127.0.0.1:1", "tls/[::1]:1", "tls/::1:1", "tcp/localhost:1"].into_iter().all(is_own));
        assert!(!["tcp/0.0.0.0:1", "tcp/[::]:1", "tls/hub.example:1"].into_iter().any(is_own));
    }
}
