//! Endpoints as people write them on a command line: what is no endpoint is answered with the one that is meant.

use super::endpoint;
use crate::spelling;
use std::net::Ipv6Addr;

/// The port of hubs.
const PORT: u16 = 7447;
/// Protocols with a host and a port behind them, and those with something else.
const WITH_HOSTS: [&str; 6] = ["tcp", "tls", "udp", "quic", "ws", "wss"];
const OTHERS: [&str; 5] = ["unixsock-stream", "unixpipe", "serial", "vsock", "ssb"];

/// Why a text is no endpoint.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EndpointError {
    /// Nothing.
    #[error("an endpoint is a protocol, a host and a port, such as `tcp/192.168.1.10:{PORT}`")]
    Empty,
    /// It has a space, or another character that is none of an endpoint.
    #[error("there is a space in it; several endpoints are given one by one, each with the option before it")]
    Space,
    /// Several in one.
    #[error("there is a comma in it; several endpoints are given one by one, each with the option before it")]
    Comma,
    /// It has no protocol.
    #[error("it has no protocol: write `tcp/{address}`, or `tls/{address}` with certificates")]
    NoProtocol {
        /// With a port.
        address: String,
    },
    /// It is written as an address of the web.
    #[error("write `{protocol}/{address}`: there is one slash, and no colon before it")]
    Url {
        /// The one that is meant.
        protocol: String,
        /// With a port.
        address: String,
    },
    /// A protocol that does not exist.
    #[error("unknown protocol `{protocol}`{}, expected tcp, tls, udp, quic or ws", hint(.protocol))]
    Protocol {
        /// As written.
        protocol: String,
    },
    /// It has no port.
    #[error("it has no port: write `{protocol}/{address}`; {PORT} is that of hubs")]
    NoPort {
        /// As written.
        protocol: String,
        /// With a port.
        address: String,
    },
    /// The port is no number of 1 to 65535.
    #[error("`{port}` is no port: write a number from 1 to 65535, such as `{protocol}/{host}:{PORT}`")]
    Port {
        /// As written.
        protocol: String,
        /// As written.
        host: String,
        /// As written.
        port: String,
    },
    /// An address of IPv6 without brackets.
    #[error("an address of IPv6 is in brackets: write `{protocol}/{address}`")]
    Brackets {
        /// As written.
        protocol: String,
        /// With brackets and a port.
        address: String,
    },
    /// It has no host.
    #[error("it has no host: write `{protocol}/{host}:{port}`")]
    NoHost {
        /// As written.
        protocol: String,
        /// This machine.
        host: &'static str,
        /// As written.
        port: String,
    },
}

fn hint(protocol: &str) -> String {
    let meant = spelling::nearest(protocol, WITH_HOSTS.into_iter().chain(OTHERS));
    meant.map(|meant| format!(" (did you mean `{meant}`?)")).unwrap_or_default()
}

/// An endpoint to connect to.
///
/// # Errors
/// What is wrong with it, and what is meant.
pub fn to_connect(text: &str) -> Result<String, EndpointError> {
    checked(text, 1)
}

/// An endpoint to listen on: port 0 is one that is free.
///
/// # Errors
/// What is wrong with it, and what is meant.
pub fn to_listen(text: &str) -> Result<String, EndpointError> {
    checked(text, 0)
}

fn checked(text: &str, least_port: u16) -> Result<String, EndpointError> {
    let text = text.trim();
    // An error would be printed with the key that stands in it.
    if endpoint::secrets(text).next().is_some() {
        return Ok(text.to_owned());
    }
    // Behind these stand settings, with words of their own.
    let head = text.split(['?', '#']).next().unwrap_or_default();
    if head.is_empty() {
        return Err(EndpointError::Empty);
    }
    if head.contains(char::is_whitespace) {
        return Err(EndpointError::Space);
    }
    if head.contains(',') {
        return Err(EndpointError::Comma);
    }
    if let Some((scheme, rest)) = head.split_once("://") {
        let protocol = if WITH_HOSTS.contains(&scheme) { scheme } else { "tcp" };
        let host = rest.split('/').next().unwrap_or_default();
        return Err(EndpointError::Url { protocol: protocol.to_owned(), address: with_port(host) });
    }
    let Some((protocol, address)) = head.split_once('/') else {
        return Err(EndpointError::NoProtocol { address: with_port(head) });
    };
    if OTHERS.contains(&protocol) {
        return Ok(text.to_owned());
    }
    // A host with something behind it, and no protocol before it.
    if protocol.contains([':', '.']) {
        return Err(EndpointError::NoProtocol { address: with_port(protocol) });
    }
    if !WITH_HOSTS.contains(&protocol) {
        return Err(EndpointError::Protocol { protocol: protocol.to_owned() });
    }
    check_address(protocol, address, least_port)?;
    Ok(text.to_owned())
}

fn check_address(protocol: &str, address: &str, least_port: u16) -> Result<(), EndpointError> {
    let protocol = || protocol.to_owned();
    let is_of_tls = matches!(&*protocol(), "tls" | "quic");
    if address.parse::<Ipv6Addr>().is_ok() && !(is_of_tls && has_port_behind(address)) {
        return Err(EndpointError::Brackets { protocol: protocol(), address: with_port(address) });
    }
    let (host, port) = match address.rsplit_once(':') {
        Some((host, port)) if !address.ends_with(']') => (host, port),
        _ => return Err(EndpointError::NoPort { protocol: protocol(), address: with_port(address) }),
    };
    if host.is_empty() {
        return Err(EndpointError::NoHost { protocol: protocol(), host: "127.0.0.1", port: port.to_owned() });
    }
    if port.is_empty() {
        return Err(EndpointError::NoPort { protocol: protocol(), address: with_port(host) });
    }
    if !port.parse::<u16>().is_ok_and(|port| port >= least_port) {
        return Err(EndpointError::Port {
            protocol: protocol(),
            host: host.to_owned(),
            port: port.to_owned(),
        });
    }
    let is_bare = host.contains(':') && !host.starts_with('[');
    if is_bare && !is_of_tls {
        return Err(EndpointError::Brackets { protocol: protocol(), address: format!("[{host}]:{port}") });
    }
    Ok(())
}

/// Whether what stands before the last colon of an address of IPv6 is one, too: Zenoh's TLS takes such a one without brackets.
fn has_port_behind(address: &str) -> bool {
    address.rsplit_once(':').is_some_and(|(host, _)| host.parse::<Ipv6Addr>().is_ok())
}

/// A host with the port that it has, or that of hubs.
fn with_port(text: &str) -> String {
    let text = text.trim_end_matches(['/', ':']);
    let is_v6 = text.parse::<Ipv6Addr>().is_ok();
    let has_port = !is_v6 && !text.ends_with(']') && text.contains(':');
    match text {
        "" => endpoint::address("127.0.0.1", PORT),
        text if has_port => text.to_owned(),
        text => endpoint::address(text.trim_matches(['[', ']']), PORT),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endpoints_are_taken_as_they_are() {
        for text in [
            "tcp/127.0.0.1:7447",
            "tcp/[::1]:7447",
            "tls/::1:7447",
            "tls/[2001:db8::7]:7447#iface=eth0",
            "tls/hub.example:7447?rel=1#so_sndbuf=9",
            "udp/192.168.1.10:7447",
            "quic/h:1",
            "ws/h:80",
            "tcp/localhost:7447#note=a b, c",
            "unixsock-stream//tmp/hub.sock",
            "serial//dev/ttyUSB0#baudrate=115200",
            "host#listen_private_key_base64=AbC=",
        ] {
            assert_eq!(to_connect(text).as_deref(), Ok(text));
            assert_eq!(to_listen(text).as_deref(), Ok(text));
        }
        assert_eq!(to_connect(" tcp/h:1\n").as_deref(), Ok("tcp/h:1"));
        assert_eq!(to_listen("tcp/127.0.0.1:0").as_deref(), Ok("tcp/127.0.0.1:0"));
        assert_eq!(to_listen("tcp/[::]:0").as_deref(), Ok("tcp/[::]:0"));
    }

    #[test]
    fn what_is_no_endpoint_is_answered_with_the_one_that_is_meant() {
        for (text, words) in [
            ("host:7447", "write `tcp/host:7447`, or `tls/host:7447`"),
            ("127.0.0.1:7447", "`tcp/127.0.0.1:7447`"),
            ("127.0.0.1", "`tcp/127.0.0.1:7447`"),
            ("hub.example", "`tcp/hub.example:7447`"),
            ("hub.example/", "`tcp/hub.example:7447`"),
            ("localhost:7447/x", "`tcp/localhost:7447`"),
            ("::1", "`tcp/[::1]:7447`"),
            ("[::1]:7447", "`tcp/[::1]:7447`"),
            ("[::1]", "`tcp/[::1]:7447`"),
            ("tcp://host:7447", "write `tcp/host:7447`"),
            ("tls://host", "write `tls/host:7447`"),
            ("http://host:7447/", "write `tcp/host:7447`"),
            ("tcp/host", "it has no port: write `tcp/host:7447`"),
            ("tcp/host:", "it has no port: write `tcp/host:7447`"),
            ("tcp/[::1]", "it has no port: write `tcp/[::1]:7447`"),
            ("tcp/::1", "in brackets: write `tcp/[::1]:7447`"),
            ("tls/::1", "in brackets: write `tls/[::1]:7447`"),
            ("tcp/fe80::1%eth0:7447", "in brackets: write `tcp/[fe80::1%eth0]:7447`"),
            ("tcp/host:port", "`port` is no port"),
            ("tcp/host:70000", "`70000` is no port"),
            ("tcp/host:0", "`0` is no port"),
            ("tcp/:7447", "it has no host: write `tcp/127.0.0.1:7447`"),
            ("tcp/", "it has no port"),
            ("tpc/host:7447", "did you mean `tcp`?"),
            ("TCP/host:7447", "did you mean `tcp`?"),
            ("mqtt/host:7447", "expected tcp, tls"),
            ("tcp/host :7447", "a space"),
            ("tcp/a:1 tcp/b:1", "one by one"),
            ("tcp/a:1,tcp/b:1", "one by one"),
            ("", "such as `tcp/"),
            ("  ", "such as `tcp/"),
        ] {
            let error = to_connect(text).expect_err(text).to_string();
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
