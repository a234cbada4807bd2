//! The view of one network: its address, and the task that serves it.

use super::address;
use super::browsers::Browsers;
use super::source::Source;
use super::{feed, http};
use anyhow::Context;
use std::io::Write;
use std::net::SocketAddr;
use std::sync::Arc;
use tokio::net::TcpListener;
use tokio::task::JoinHandle;
use tokio_util::sync::{CancellationToken, DropGuard};

/// An address at which the page will be served. Browsers that come early wait.
pub(crate) struct Site {
    listener: TcpListener,
    address: SocketAddr,
}

impl Site {
    /// Listens at an address; the error of a taken one says what to do.
    pub(crate) fn listen(at: SocketAddr) -> anyhow::Result<Self> {
        let listener = address::listen(at)?;
        let address = listener.local_addr().context("asking for the page's port")?;
        Ok(Self { listener, address })
    }

    /// The same, where `--web` was given.
    pub(crate) fn listen_if_wanted(at: Option<SocketAddr>) -> anyhow::Result<Option<Self>> {
        at.map(Self::listen).transpose()
    }

    /// Prints on standard error where the page is.
    pub(crate) fn announce(&self) {
        let mut err = std::io::stderr().lock();
        let _ = writeln!(err, "live view: {}  (open it in a browser)", address::url(self.address));
        if !self.address.ip().is_loopback() {
            let _ = writeln!(err, "everybody who reaches this address can watch; there is no password");
        }
    }

    /// Serves the page in the background, until [`Live::end`] or until the handle is dropped.
    pub(crate) fn serve(self, source: Source) -> Live {
        let shutdown = CancellationToken::new();
        let task = tokio::spawn(run(self.listener, source, shutdown.clone()));
        Live { task, shutdown: shutdown.drop_guard() }
    }
}

/// A page that is served.
#[must_use = "it ends when it is dropped"]
pub(crate) struct Live {
    task: JoinHandle<anyhow::Result<()>>,
    shutdown: DropGuard,
}

impl Live {
    /// Waits until it ends by itself, which only an error makes it do. Cancel-safe.
    pub(crate) async fn failed(&mut self) -> anyhow::Result<()> {
        (&mut self.task).await.context("the live view panicked")?
    }

    /// Ends it.
    pub(crate) async fn end(self) -> anyhow::Result<()> {
        drop(self.shutdown);
        self.task.await.context("the live view panicked")?
    }
}

async fn run(listener: TcpListener, source: Source, shutdown: CancellationToken) -> anyhow::Result<()> {
    let browsers = Arc::new(Browsers::default());
    // Where the feed fails, nobody is left with a page that shows nothing.
    let stop = shutdown.child_token();
    let fed = async {
        let fed = feed::feed(&source, &browsers, &shutdown).await;
        stop.cancel();
        fed
    };
    let (fed, ()) = tokio::join!(fed, http::serve(listener, browsers.clone(), &stop));
    fed
}
