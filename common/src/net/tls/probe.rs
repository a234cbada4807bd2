//! Tries an endpoint that did not let Zenoh in, and says why.
//!
//! A client without a certificate, or with one of another authority, reads only "Timeout!" from Zenoh: with TLS 1.3 the hub
//! refuses after the client's handshake has ended. Here the client waits for the hub's word.

use super::credentials::TlsFiles;
use super::reason::TlsRefusal;
use rustls::pki_types::ServerName;
use rustls::{ClientConfig, ClientConnection, Error, Stream};
use serde_json::Value;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::time::Duration;
use zenoh::Config;

/// How long one step may take: a connection, an answer.
const PATIENCE: Duration = Duration::from_secs(1);
/// Endpoints that are tried at most.
const MAX_ENDPOINTS: usize = 4;

/// Why none of the endpoints of a configuration lets this client in; `None` where nothing speaks against it, or nobody
/// listens there. It takes some seconds at most.
pub async fn why_not_connected(config: Config) -> Option<String> {
    tokio::task::spawn_blocking(move || {
        let files = TlsFiles::of(&config);
        let endpoints = endpoints(&config, "connect");
        let refused = |endpoint: &String| refusal(endpoint, &files).map(|why| format!("{endpoint}: {why}"));
        endpoints.iter().take(MAX_ENDPOINTS).find_map(refused)
    })
    .await
    .ok()?
}

/// The endpoints under `connect` or `listen`: a list, with or without lists of alternatives, or one for each mode, of which
/// the configuration has one (a client listens nowhere by itself).
pub(in crate::net) fn endpoints(config: &Config, part: &str) -> Vec<String> {
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

/// Protocol and address of an endpoint, without its metadata and settings.
fn parts(endpoint: &str) -> Option<(&str, &str, &str)> {
    let (protocol, rest) = endpoint.split_once('/')?;
    let address = rest.split(['?', '#']).next()?;
    let (host, _) = address.rsplit_once(':')?;
    Some((protocol, address, host))
}

fn refusal(endpoint: &str, files: &TlsFiles) -> Option<TlsRefusal> {
    let (protocol, address, host) = parts(endpoint)?;
    let is_tls = match protocol {
        "tls" => true,
        "tcp" => false,
        _ => return None,
    };
    // Nobody listens: that is no refusal, and Zenoh tries again.
    let socket = connected(address)?;
    if !is_tls {
        return speaks_tls(socket, host).then_some(TlsRefusal::Tls);
    }
    let config = match files.client_config() {
        Ok(config) => config,
        Err(why) => return Some(TlsRefusal::OwnFiles(why)),
    };
    match handshake(socket, host, config)? {
        Failure::Silence => Some(TlsRefusal::NoTls),
        Failure::Tls(error) => Some(TlsRefusal::of(&error, host, files.has_certificate())),
    }
}

fn connected(address: &str) -> Option<TcpStream> {
    let mut addresses = address.to_socket_addrs().ok()?;
    let socket = addresses.find_map(|address| TcpStream::connect_timeout(&address, PATIENCE).ok())?;
    socket.set_read_timeout(Some(PATIENCE)).ok()?;
    socket.set_write_timeout(Some(PATIENCE)).ok()?;
    Some(socket)
}

/// How a handshake failed.
enum Failure {
    /// There was no answer.
    Silence,
    Tls(Error),
}

/// Shakes hands, and waits for a word against it.
fn handshake(mut socket: TcpStream, host: &str, config: ClientConfig) -> Option<Failure> {
    let connection = named(host).and_then(|name| ClientConnection::new(Arc::new(config), name));
    let mut connection = match connection {
        Ok(connection) => connection,
        Err(error) => return Some(Failure::Tls(error)),
    };
    let mut stream = Stream::new(&mut connection, &mut socket);
    let error = stream.flush().and_then(|()| stream.read(&mut [0])).err()?;
    if let Some(error) = error.get_ref().and_then(|inner| inner.downcast_ref::<Error>()) {
        return Some(Failure::Tls(error.clone()));
    }
    match error.kind() {
        _ if connection.is_handshaking() => Some(Failure::Silence),
        // The hub waits for the client's first message.
        ErrorKind::WouldBlock | ErrorKind::TimedOut => None,
        _ => Some(Failure::Tls(Error::General(error.to_string()))),
    }
}

fn named(host: &str) -> Result<ServerName<'static>, Error> {
    let name = ServerName::try_from(host.trim_matches(['[', ']']).to_owned());
    name.map_err(|error| Error::General(format!("{host:?}: {error}")))
}

/// Whether an endpoint answers the beginning of a TLS handshake with TLS.
fn speaks_tls(mut socket: TcpStream, host: &str) -> bool {
    let (Ok(name), Ok(config)) = (named(host), TlsFiles::default().client_config()) else { return false };
    let Ok(mut connection) = ClientConnection::new(Arc::new(config), name) else { return false };
    let mut hello = Vec::new();
    if connection.write_tls(&mut hello).is_err() || socket.write_all(&hello).is_err() {
        return false;
    }
    let mut answer = [0; 3];
    // A record of TLS: a handshake or an alert, of version 3.
    socket.read_exact(&mut answer).is_ok() && matches!(answer, [21 | 22, 3, _])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_endpoint_is_read_without_its_metadata_and_settings() {
        assert_eq!(parts("tls/10.0.0.1:7447?rel=1#so=2"), Some(("tls", "10.0.0.1:7447", "10.0.0.1")));
        assert_eq!(parts("tcp/[::1]:7447"), Some(("tcp", "[::1]:7447", "[::1]")));
        assert_eq!(parts("nonsense"), None);
    }

    #[test]
    fn nobody_who_listens_is_no_tls_refusal() {
        let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        for protocol in ["tls", "tcp", "udp"] {
            assert_eq!(refusal(&format!("{protocol}/{free}"), &TlsFiles::default()), None);
        }
    }
}
