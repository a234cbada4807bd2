//! Where the page is served.

use anyhow::{Context, anyhow};
use std::io::ErrorKind;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use tokio::net::{TcpListener, TcpSocket};
use v2x_common::net::address;

/// Where the page is served if nothing else is asked for.
const DEFAULT: &str = "127.0.0.1:8088";
/// Connections that wait to be accepted.
const BACKLOG: u32 = 64;
/// What the system holds for a browser that does not read, bytes: a newer picture is worth more than an old one.
const SEND_BUFFER: u32 = 128 << 10;

/// The option `--web [ADDR]`.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct WebArgs {
    /// Show the network in a browser, on a page at this address; port 0 picks a free port [default: 127.0.0.1:8088]
    #[arg(long, value_name = "ADDR", num_args = 0..=1, default_missing_value = DEFAULT, value_parser = parse)]
    pub(crate) web: Option<SocketAddr>,
}

/// An address, or a port of this machine alone.
fn parse(text: &str) -> Result<SocketAddr, String> {
    address::parse(text).ok_or_else(|| {
        "write an address as 127.0.0.1:8088, or a port; write --web behind a scenario's name".to_owned()
    })
}

/// Listens; a taken port is an error that says what to do.
pub(super) fn listen(address: SocketAddr) -> anyhow::Result<TcpListener> {
    let bound = bind(address).map_err(|error| match error.kind() {
        ErrorKind::AddrInUse => anyhow!(
            "{address} is taken, perhaps by another view; give another one, such as --web {}:0 for any free port",
            address.ip()
        ),
        _ => anyhow!(error),
    });
    bound.with_context(|| format!("serving the page at {address}"))
}

fn bind(address: SocketAddr) -> std::io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
    socket.set_reuseaddr(true)?;
    // Connections inherit it.
    socket.set_send_buffer_size(SEND_BUFFER)?;
    socket.bind(address)?;
    socket.listen(BACKLOG)
}

/// The address to type into a browser of this machine.
pub(super) fn url(address: SocketAddr) -> String {
    let ip = match address.ip() {
        IpAddr::V4(ip) if ip.is_unspecified() => IpAddr::V4(Ipv4Addr::LOCALHOST),
        ip => ip,
    };
    format!("http://{}/", SocketAddr::new(ip, address.port()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_or_a_port_alone_is_understood() {
        for (text, expected) in [
            ("127.0.0.1:9000", "127.0.0.1:9000"),
            ("9000", "127.0.0.1:9000"),
            ("localhost:0", "127.0.0.1:0"),
            ("[::1]:80", "[::1]:80"),
            (DEFAULT, "127.0.0.1:8088"),
        ] {
            assert_eq!(parse(text).map(|address| address.to_string()), Ok(expected.to_owned()));
        }
        assert!(parse("crossing").unwrap_err().contains("behind a scenario's name"));
    }

    #[tokio::test]
    async fn a_taken_address_is_an_error_that_names_the_flag() {
        let first = listen(SocketAddr::from((Ipv4Addr::LOCALHOST, 0))).unwrap();
        let taken = first.local_addr().unwrap();
        let message = format!("{:#}", listen(taken).unwrap_err());
        assert!(message.contains(&taken.to_string()) && message.contains("--web 127.0.0.1:0"), "{message}");
    }

    #[test]
    fn the_url_is_one_that_a_browser_of_this_machine_reaches() {
        assert_eq!(url(SocketAddr::from(([0, 0, 0, 0], 8088))), "http://127.0.0.1:8088/");
        assert_eq!(url("[::1]:80".parse().unwrap()), "http://[::1]:80/");
    }
}
