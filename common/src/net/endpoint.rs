//! Endpoints of Zenoh, as people and configurations write them: `tls/192.168.1.10:7447`, `tcp/[::1]:7447#so_sndbuf=9`.

use serde_json::Value;
use std::borrow::Cow;
use std::net::{IpAddr, Ipv6Addr};
use zenoh::Config;

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

/// What stands in place of a secret.
pub(super) const REDACTED: &str = "[redacted]";

/// The settings behind an endpoint, such as `#listen_private_key_file=key.pem;so_sndbuf=9`.
fn settings(endpoint: &str) -> impl Iterator<Item = (&str, &str)> {
    let (_, settings) = endpoint.split_once('#').unwrap_or_default();
    settings.split(';').filter_map(|setting| setting.split_once('='))
}

/// Whether the value of a setting is a secret itself.
fn is_secret(key: &str) -> bool {
    !key.ends_with("_file") && ["private_key", "password", "secret"].iter().any(|word| key.contains(word))
}

/// The secrets that stand in an endpoint.
pub(super) fn secrets(endpoint: &str) -> impl Iterator<Item = &str> {
    settings(endpoint).filter(|(key, _)| is_secret(key)).map(|(_, value)| value)
}

/// The files with private keys that an endpoint names.
pub(super) fn private_key_files(endpoint: &str) -> impl Iterator<Item = &str> {
    settings(endpoint).filter(|(key, _)| key.ends_with("private_key_file")).map(|(_, value)| value)
}

/// An endpoint for people and logs: without the private keys that may stand in it.
pub fn shown(endpoint: &str) -> Cow<'_, str> {
    let mut shown = Cow::Borrowed(endpoint);
    for secret in secrets(endpoint).filter(|secret| !secret.is_empty()) {
        shown = shown.replace(&format!("={secret}"), &format!("={REDACTED}")).into();
    }
    shown
}

/// Endpoints for people and logs, as [`shown`].
pub fn all_shown(endpoints: &[String]) -> String {
    endpoints.iter().map(|endpoint| shown(endpoint)).collect::<Vec<_>>().join(", ")
}

/// The endpoints under `connect` or `listen`: a list, with or without lists of alternatives, or one for each mode, of which
/// the configuration has one (a client listens nowhere by itself).
pub fn of_config(config: &Config, part: &str) -> Vec<String> {
    fn collect(value: &Value, mode: &str, endpoints: &mut Vec<String>) {
        match value {
            Value::String(endpoint) => endpoints.push(endpoint.clone()),
            Value::Array(values) => values.iter().for_each(|value| collect(value, mode, endpoints)),
            Value::Object(modes) => {
                if let Some(value) = modes.get(mode) {
                    collect(value, mode, endpoints);
                }
            }
            _ => {}
        }
    }
    let mode = config.get_json("mode").ok().and_then(|json| serde_json::from_str(&json).ok());
    let mode: String = mode.unwrap_or_else(|| "peer".to_owned());
    let json = config.get_json(&format!("{part}/endpoints")).unwrap_or_default();
    let mut endpoints = Vec::new();
    collect(&serde_json::from_str(&json).unwrap_or_default(), &mode, &mut endpoints);
    endpoints
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
    fn an_endpoint_is_shown_without_the_private_tls_key_that_stands_in_it() {
        let given =
            "tls/[::]:7447#listen_private_key_base64=AbC=;enable_mtls=true;connect_private_key_raw=x y";
        let expected = "tls/[::]:7447#listen_private_key_base64=[redacted];enable_mtls=true;connect_private_key_raw=[redacted]";
        assert_eq!(shown(given), expected);
        assert_eq!(secrets(given).collect::<Vec<_>>(), ["AbC=", "x y"]);
        let named = "tls/h:1?rel=1#listen_private_key_file=key.pem;listen_certificate_base64=AA";
        assert_eq!(shown(named), named, "a file is no secret, nor is a certificate");
        assert_eq!(private_key_files(named).collect::<Vec<_>>(), ["key.pem"]);
        assert_eq!(shown("tcp/127.0.0.1:7447"), "tcp/127.0.0.1:7447");
    }

    #[test]
    fn endpoints_of_this_machine_are_known() {
        let is_own = |text| Endpoint::read(text).is_some_and(|endpoint| endpoint.is_of_this_machine());
        assert!(["tcp/127.0.0.1:1", "tls/[::1]:1", "tls/::1:1", "tcp/localhost:1"].into_iter().all(is_own));
        assert!(!["tcp/0.0.0.0:1", "tcp/[::]:1", "tls/hub.example:1"].into_iter().any(is_own));
    }
}
