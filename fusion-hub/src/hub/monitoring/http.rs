//! Metrics and health over HTTP.

use super::exported::exposition;
use crate::hub::monitor::Monitor;
use anyhow::Context;
use hyper::body::{Body, Bytes, Frame, Incoming, SizeHint};
use hyper::header::{CACHE_CONTROL, CONTENT_TYPE, HeaderValue};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use std::collections::VecDeque;
use std::convert::Infallible;
use std::net::SocketAddr;
use std::pin::Pin;
use std::task::{Context as Waker, Poll};
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::task::{AbortHandle, JoinSet};
use tokio_util::sync::CancellationToken;
use v2x_common::clock;

/// Connections at once. A further one ends the oldest: whoever has a question asks it at once and is answered within milliseconds, and only
/// those who hold connections open for nothing become old.
const MAX_CONNECTIONS: usize = 128;
const PATIENCE: Patience = Patience { request: Duration::from_secs(1), answer: Duration::from_secs(5) };

/// How long a connection may last.
#[derive(Clone, Copy)]
struct Patience {
    /// A request must be complete after this long.
    request: Duration,
    /// An answer must be read after this long; a scrape takes milliseconds, and those who do not read are to keep nobody out.
    answer: Duration,
}

const OPEN_METRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";
const JSON: &str = "application/json";
const TEXT: &str = "text/plain; charset=utf-8";

/// An address at which a hub will be seen.
pub(in super::super) struct Server {
    listener: TcpListener,
    /// With its port.
    address: SocketAddr,
    patience: Patience,
}

impl Server {
    /// Listens; a taken address is an error that says what to do.
    pub(in super::super) async fn listen(address: SocketAddr) -> anyhow::Result<Self> {
        let listener = TcpListener::bind(address).await.with_context(|| {
            format!(
                "--metrics {address} cannot be served; port 0 takes a free one, such as --metrics 127.0.0.1:0"
            )
        })?;
        let address = listener.local_addr().context("asking for the port of --metrics")?;
        Ok(Self { listener, address, patience: PATIENCE })
    }

    /// Where it is.
    pub(in super::super) const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Answers until shutdown.
    pub(in super::super) async fn serve(self, monitor: Monitor, shutdown: CancellationToken) {
        let mut connections = JoinSet::new();
        let mut by_age = VecDeque::new();
        loop {
            tokio::select! {
                () = shutdown.cancelled() => return,
                accepted = self.listener.accept() => match accepted {
                    Ok((stream, _)) => {
                        make_room(&mut by_age);
                        let connection = connection(stream, monitor.clone(), self.patience);
                        by_age.push_back(connections.spawn(connection));
                    }
                    Err(error) => {
                        tracing::debug!(%error, "nobody could connect to the metrics");
                        // Out of file descriptors, for example: trying again at once would only take time.
                        tokio::time::sleep(Duration::from_millis(50)).await;
                    }
                },
                Some(_) = connections.join_next() => {}
            }
        }
    }
}

/// Ends the oldest connections, so that there is room for a further one.
fn make_room(by_age: &mut VecDeque<AbortHandle>) {
    by_age.retain(|connection| !connection.is_finished());
    while by_age.len() >= MAX_CONNECTIONS
        && let Some(oldest) = by_age.pop_front()
    {
        oldest.abort();
    }
}

async fn connection(stream: TcpStream, monitor: Monitor, patience: Patience) {
    let service = service_fn(move |request: Request<Incoming>| {
        let response = answer(request.method(), request.uri().path(), &monitor);
        async { Ok::<_, Infallible>(response) }
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(patience.request)
        .keep_alive(false)
        .serve_connection(TokioIo::new(stream), service);
    if let Ok(Err(error)) = tokio::time::timeout(patience.answer, connection).await {
        tracing::debug!(%error, "a connection to the metrics ended");
    }
}

fn answer(method: &Method, path: &str, monitor: &Monitor) -> Response<Whole> {
    if method != Method::GET && method != Method::HEAD {
        return response(StatusCode::METHOD_NOT_ALLOWED, TEXT, "only GET\n".to_owned());
    }
    match path {
        "/metrics" => match exposition(monitor) {
            Ok(Some(text)) => response(StatusCode::OK, OPEN_METRICS, text),
            Ok(None) => response(StatusCode::SERVICE_UNAVAILABLE, TEXT, "the hub is not ready\n".to_owned()),
            Err(error) => response(StatusCode::INTERNAL_SERVER_ERROR, TEXT, format!("{error}\n")),
        },
        "/livez" => probe(monitor.newest().and_then(|newest| newest.not_live(clock::now()))),
        "/readyz" => probe(monitor.newest().map_or_else(
            || Some("the hub is not ready".to_owned()),
            |newest| newest.not_ready(clock::now()),
        )),
        "/healthz" => {
            let reasons = monitor.newest().map_or_else(
                || vec!["the hub is not ready".to_owned()],
                |newest| newest.not_healthy(clock::now()),
            );
            let verdict = if reasons.is_empty() { "healthy" } else { "degraded" };
            let body = serde_json::json!({ "verdict": verdict, "reasons": reasons }).to_string() + "\n";
            response(status(reasons.is_empty()), JSON, body)
        }
        _ => response(
            StatusCode::NOT_FOUND,
            TEXT,
            "here are /metrics, /healthz, /readyz and /livez\n".to_owned(),
        ),
    }
}

fn status(is_good: bool) -> StatusCode {
    if is_good { StatusCode::OK } else { StatusCode::SERVICE_UNAVAILABLE }
}

/// Good, or the reason why not.
fn probe(reason: Option<String>) -> Response<Whole> {
    let is_good = reason.is_none();
    response(status(is_good), TEXT, reason.unwrap_or_else(|| "ok".to_owned()) + "\n")
}

fn response(status: StatusCode, content_type: &'static str, body: String) -> Response<Whole> {
    let mut response = Response::new(Whole(Some(body.into())));
    *response.status_mut() = status;
    response.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static(content_type));
    response.headers_mut().insert(CACHE_CONTROL, HeaderValue::from_static("no-store"));
    response
}

/// A body that is there already.
struct Whole(Option<Bytes>);

impl Body for Whole {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        _: &mut Waker<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        Poll::Ready(self.0.take().map(|bytes| Ok(Frame::data(bytes))))
    }

    fn is_end_stream(&self) -> bool {
        self.0.is_none()
    }

    fn size_hint(&self) -> SizeHint {
        SizeHint::with_exact(self.0.as_ref().map_or(0, |bytes| bytes.len() as u64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    const FOR_EVER: Duration = Duration::from_secs(3_600);

    #[tokio::test]
    async fn a_flood_of_slow_requests_for_the_metrics_ends_the_oldest_of_them_and_others_are_answered() {
        let mut server = Server::listen(SocketAddr::from(([127, 0, 0, 1], 0))).await.unwrap();
        server.patience = Patience { request: FOR_EVER, answer: FOR_EVER };
        let address = server.address();
        let serving = tokio::spawn(server.serve(Monitor::default(), CancellationToken::new()));
        let begin = async |text: &str| {
            let mut stream = TcpStream::connect(address).await.unwrap();
            stream.write_all(text.as_bytes()).await.unwrap();
            stream
        };
        let mut slow = Vec::new();
        for _ in 0..2 * MAX_CONNECTIONS {
            slow.push(begin("GET /livez HTTP/1.1\r\nX: ").await);
        }
        let mut stream = begin("GET /livez HTTP/1.1\r\nHost: hub\r\n\r\n").await;
        let mut answer = String::new();
        let answered = tokio::time::timeout(Duration::from_secs(60), stream.read_to_string(&mut answer));
        answered.await.expect("an answer in time").unwrap();
        assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
        serving.abort();
    }

    #[test]
    fn after_a_restart_a_hub_is_alive_and_neither_ready_nor_healthy_until_it_shows_itself() {
        let monitor = Monitor::default();
        let status = |path| answer(&Method::GET, path, &monitor).status().as_u16();
        assert_eq!(["/livez", "/readyz", "/healthz", "/metrics", "/"].map(status), [200, 503, 503, 503, 404]);
        assert_eq!(answer(&Method::POST, "/metrics", &monitor).status(), StatusCode::METHOD_NOT_ALLOWED);
    }
}
