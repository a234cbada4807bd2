//! A TCP link that can be cut and mended.

use anyhow::Context;
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinSet;
use tokio_util::sync::CancellationToken;

/// A link to a hub that can be cut.
pub(crate) struct Link {
    pub(crate) locator: String,
    is_cut: tokio::sync::watch::Sender<bool>,
    _end: tokio_util::sync::DropGuard,
}

impl Link {
    pub(crate) async fn to(hub: &str) -> anyhow::Result<Self> {
        let hub = hub.strip_prefix("tcp/").context("no TCP")?.to_owned();
        let listener = TcpListener::bind("127.0.0.1:0").await?;
        let locator = format!("tcp/{}", listener.local_addr()?);
        let (is_cut, cut) = tokio::sync::watch::channel(false);
        let end = CancellationToken::new();
        tokio::spawn(end.clone().run_until_cancelled_owned(relay(listener, hub, cut)));
        Ok(Self { locator, is_cut, _end: end.drop_guard() })
    }

    /// Closes all connections, and those that are made from now on.
    pub(crate) fn cut(&self) {
        self.is_cut.send_replace(true);
    }

    pub(crate) fn mend(&self) {
        self.is_cut.send_replace(false);
    }
}

async fn relay(listener: TcpListener, hub: String, mut cut: tokio::sync::watch::Receiver<bool>) {
    let mut connections = JoinSet::new();
    loop {
        tokio::select! {
            Ok((mut here, _)) = listener.accept() => {
                if *cut.borrow() {
                    continue;
                }
                let hub = hub.clone();
                connections.spawn(async move {
                    if let Ok(mut there) = TcpStream::connect(hub).await {
                        let _ = tokio::io::copy_bidirectional(&mut here, &mut there).await;
                    }
                });
            }
            changed = cut.changed() => {
                if changed.is_err() {
                    return;
                }
                if *cut.borrow() {
                    connections.abort_all();
                }
            }
        }
    }
}
