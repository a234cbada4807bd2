//! Tries an endpoint that did not let Zenoh in, and says why.
//!
//! A client without a certificate, or with one of another authority, reads only "Timeout!" from Zenoh: with TLS 1.3 the hub
//! refuses after the client's handshake has ended. Here the client waits for the hub's word.

use super::credentials::TlsFiles;
use super::reason::TlsRefusal;
use crate::clock;
use crate::net::endpoint::{self, Endpoint, shown};
use crate::time::{Span, Timestamp};
use rustls::pki_types::ServerName;
use rustls::{ClientConfig, ClientConnection, Error, Stream};
use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::time::Duration;
use zenoh::Config;

/// How long one step may take: a connection, an answer.
const PATIENCE: Duration = Duration::from_secs(1);
/// How long all steps with one endpoint may take, whatever answers there, byte by byte.
const OF_ONE: Span = Span::from_millis(2_500);
/// Endpoints that are tried at most.
const MAX_ENDPOINTS: usize = 4;
/// And all endpoints, with the time to find the addresses of their names.
const OF_ALL: Duration = Duration::from_secs(6);

/// Why none of the endpoints of a configuration lets this client in; `None` where nothing speaks against it, or nobody
/// listens there. It takes six seconds at most.
pub async fn why_not_connected(config: Config) -> Option<String> {
    let (done, answer) = tokio::sync::oneshot::channel();
    // A thread of its own: the system takes its time to find that a name has no address, and the program may end meanwhile.
    std::thread::spawn(move || {
        let files = TlsFiles::of(&config);
        let endpoints = endpoint::of_config(&config, "connect");
        let refused = |endpoint: &String| {
            let why = refusal(endpoint, &files, clock::now() + OF_ONE)?;
            Some(format!("{}: {why}", shown(endpoint)))
        };
        // Nobody waits for the answer any more: that is no fault.
        let _ = done.send(endpoints.iter().take(MAX_ENDPOINTS).find_map(refused));
    });
    tokio::time::timeout(OF_ALL, answer).await.ok()?.ok()?
}

/// Until a time, at which it is as if nobody had said anything.
fn refusal(endpoint: &str, files: &TlsFiles, until: Timestamp) -> Option<TlsRefusal> {
    let Endpoint { protocol, address, host } = Endpoint::read(endpoint)?;
    let is_tls = match protocol {
        "tls" => true,
        "tcp" => false,
        _ => return None,
    };
    // Nobody listens: that is no refusal, and Zenoh tries again.
    let socket = connected(address, until)?;
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

fn connected(address: &str, until: Timestamp) -> Option<Limited> {
    let mut addresses = address.to_socket_addrs().ok()?;
    let socket = addresses.find_map(|address| {
        let left = left(until).ok()?;
        TcpStream::connect_timeout(&address, left).ok()
    })?;
    Some(Limited { socket, until })
}

/// The time that the next step has.
fn left(until: Timestamp) -> io::Result<Duration> {
    let left = u64::try_from((until - clock::now()).as_nanos()).unwrap_or(0);
    if left == 0 { Err(ErrorKind::TimedOut.into()) } else { Ok(PATIENCE.min(Duration::from_nanos(left))) }
}

/// A connection that ends at a time: what comes byte by byte for ever does not hold its reader for ever.
struct Limited {
    socket: TcpStream,
    until: Timestamp,
}

impl Read for Limited {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.socket.set_read_timeout(Some(left(self.until)?))?;
        self.socket.read(buffer)
    }
}

impl Write for Limited {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.socket.set_write_timeout(Some(left(self.until)?))?;
        self.socket.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.socket.flush()
    }
}

/// How a handshake failed.
enum Failure {
    /// There was no answer.
    Silence,
    Tls(Error),
}

/// Shakes hands, and waits for a word against it.
fn handshake(mut socket: Limited, host: &str, config: ClientConfig) -> Option<Failure> {
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
    let name = ServerName::try_from(host.to_owned());
    name.map_err(|error| Error::General(format!("{host:?}: {error}")))
}

/// Whether an endpoint answers the beginning of a TLS handshake with TLS.
fn speaks_tls(mut socket: Limited, host: &str) -> bool {
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
    fn nobody_who_listens_is_no_tls_refusal() {
        let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        for protocol in ["tls", "tcp", "udp"] {
            assert_eq!(
                refusal(&format!("{protocol}/{free}"), &TlsFiles::default(), clock::now() + OF_ONE),
                None
            );
        }
    }

    #[test]
    fn somebody_who_answers_a_tls_handshake_byte_by_byte_holds_the_diagnosis_no_longer_than_its_limit() {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let endpoint = format!("tls/{}", listener.local_addr().unwrap());
        let slow = std::thread::spawn(move || {
            let (mut socket, _) = listener.accept().unwrap();
            socket.write_all(&[22, 3, 3, 0x40, 0]).unwrap();
            // The next byte of a record that never ends, for as long as somebody waits for it.
            socket.set_read_timeout(Some(Duration::from_millis(5))).unwrap();
            let is_there = |read: io::Result<usize>| match read {
                Ok(count) => count > 0,
                Err(error) => matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut),
            };
            while is_there(socket.read(&mut [0; 1024])) && socket.write_all(&[2]).is_ok() {}
        });
        let began_at = clock::now();
        let limit = Span::from_millis(300);
        let refused = refusal(&endpoint, &TlsFiles::default(), began_at + limit);
        assert_eq!(refused, Some(TlsRefusal::NoTls));
        let took = clock::now() - began_at;
        assert!(took >= limit && took < Span::from_millis(20_000), "{took:?}");
        slow.join().unwrap();
    }
}
