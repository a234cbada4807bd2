//! The token that requests a clean end.

use std::io::Read;
use tokio_util::sync::CancellationToken;

/// A token that is cancelled by Ctrl-C, by SIGTERM, and, where `with_stdin`, by the end of standard input.
///
/// So the children of a launcher end with it: their standard input is a pipe from the launcher, which closes also when
/// the launcher is killed.
pub fn token(with_stdin: bool) -> std::io::Result<CancellationToken> {
    let token = CancellationToken::new();
    let cancelled = token.clone();
    let mut terminate = terminate_signal()?;
    tokio::spawn(async move {
        tokio::select! {
            result = tokio::signal::ctrl_c() => {
                if let Err(error) = result {
                    tracing::error!(%error, "cannot listen for Ctrl-C");
                }
            }
            () = terminate.recv() => {}
            () = cancelled.cancelled() => {}
        }
        cancelled.cancel();
    });
    if with_stdin {
        spawn_stdin_watch(token.clone());
    }
    Ok(token)
}

fn spawn_stdin_watch(token: CancellationToken) {
    // A separate thread: reading standard input cannot be cancelled, and the runtime would wait for it.
    std::thread::spawn(move || {
        let mut ignored = [0; 64];
        // The content has no meaning; only the end of the pipe has.
        while std::io::stdin().lock().read(&mut ignored).is_ok_and(|count| count > 0) {}
        token.cancel();
    });
}

#[cfg(unix)]
struct Terminate(tokio::signal::unix::Signal);

#[cfg(unix)]
fn terminate_signal() -> std::io::Result<Terminate> {
    tokio::signal::unix::signal(tokio::signal::unix::SignalKind::terminate()).map(Terminate)
}

#[cfg(unix)]
impl Terminate {
    async fn recv(&mut self) {
        self.0.recv().await;
    }
}

#[cfg(not(unix))]
struct Terminate;

#[cfg(not(unix))]
fn terminate_signal() -> std::io::Result<Terminate> {
    Ok(Terminate)
}

#[cfg(not(unix))]
impl Terminate {
    async fn recv(&mut self) {
        std::future::pending::<()>().await;
    }
}
