//! The page over HTTP.

use super::browsers::Browsers;
use super::guard;
use super::mailbox::Events;
use super::page;
use hyper::body::{Body, Bytes, Frame, Incoming};
use hyper::header::{CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HeaderName, HeaderValue};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use std::convert::Infallible;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinSet;
use tokio_util::sync::CancellationToken;

/// Connections at once; a browser keeps one open for the events and a few for files.
const MAX_CONNECTIONS: usize = 64;
/// A request must be complete after this long.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(5);
/// Bytes that wait for one browser in this program.
const WRITE_BUFFER: usize = 64 << 10;
/// How long connections may take to end.
const END_TIMEOUT: Duration = Duration::from_secs(1);

/// Nothing from other sites, no script in the page itself, no frame around it.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Answers browsers until shutdown.
pub(super) async fn serve(listener: TcpListener, browsers: Arc<Browsers>, shutdown: &CancellationToken) {
    let is_local = listener.local_addr().is_ok_and(|address| address.ip().is_loopback());
    let mut connections = JoinSet::new();
    loop {
        let has_room = connections.len() < MAX_CONNECTIONS;
        tokio::select! {
            () = shutdown.cancelled() => break,
            accepted = listener.accept(), if has_room => match accepted {
                Ok((stream, _)) => {
                    connections.spawn(connection(stream, browsers.clone(), is_local, shutdown.clone()));
                }
                Err(error) => {
                    tracing::debug!(%error, "a browser could not connect");
                    // Out of file descriptors, for example: trying again at once would only take time.
                    tokio::time::sleep(Duration::from_millis(50)).await;
                }
            },
            Some(_) = connections.join_next() => {}
        }
    }
    drop(listener);
    browsers.close();
    let ended = async { while connections.join_next().await.is_some() {} };
    if tokio::time::timeout(END_TIMEOUT, ended).await.is_err() {
        tracing::debug!("browsers did not end in time");
    }
}

async fn connection(stream: TcpStream, browsers: Arc<Browsers>, is_local: bool, shutdown: CancellationToken) {
    if let Err(error) = stream.set_nodelay(true) {
        tracing::debug!(%error, "a browser's messages may wait");
    }
    let service = service_fn(move |request| {
        let response = answer(&request, &browsers, is_local);
        async { Ok::<_, Infallible>(response) }
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(REQUEST_TIMEOUT)
        .max_buf_size(WRITE_BUFFER)
        .serve_connection(TokioIo::new(stream), service);
    tokio::pin!(connection);
    let ended = tokio::select! {
        ended = connection.as_mut() => ended,
        () = shutdown.cancelled() => {
            connection.as_mut().graceful_shutdown();
            connection.await
        }
    };
    if let Err(error) = ended {
        tracing::debug!(%error, "a browser's connection ended");
    }
}

fn answer(request: &Request<Incoming>, browsers: &Browsers, is_local: bool) -> Response<Content> {
    if let Err(refused) = guard::check(request.headers(), is_local) {
        tracing::debug!(%refused, host = ?request.headers().get("host"), "a request was refused");
        return text(StatusCode::FORBIDDEN, &refused.to_string());
    }
    if request.method() != Method::GET {
        return text(StatusCode::METHOD_NOT_ALLOWED, "only GET");
    }
    match request.uri().path() {
        "/events" => response(StatusCode::OK, "text/event-stream", Content::Events(browsers.join())),
        path => match page::file(path) {
            Some(file) => response(
                StatusCode::OK,
                file.content_type,
                Content::Whole(Some(Bytes::from_static(file.bytes))),
            ),
            None => text(StatusCode::NOT_FOUND, "no such page"),
        },
    }
}

fn text(status: StatusCode, text: &str) -> Response<Content> {
    response(status, "text/plain; charset=utf-8", Content::Whole(Some(format!("{text}\n").into())))
}

fn response(status: StatusCode, content_type: &'static str, content: Content) -> Response<Content> {
    let mut response = Response::new(content);
    *response.status_mut() = status;
    let headers = response.headers_mut();
    for (name, value) in [
        (CONTENT_TYPE, content_type),
        (CACHE_CONTROL, "no-store"),
        (CONTENT_SECURITY_POLICY, POLICY),
        (HeaderName::from_static("x-content-type-options"), "nosniff"),
        (HeaderName::from_static("referrer-policy"), "no-referrer"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}

/// The body of an answer.
#[derive(Debug)]
enum Content {
    Whole(Option<Bytes>),
    Events(Events),
}

impl Body for Content {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        match self.get_mut() {
            Self::Whole(bytes) => Poll::Ready(bytes.take().map(|bytes| Ok(Frame::data(bytes)))),
            Self::Events(events) => Pin::new(events).poll_frame(context),
        }
    }
}
