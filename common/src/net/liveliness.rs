//! Reading which liveliness tokens there are.

use anyhow::anyhow;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::sync::oneshot;
use zenoh::Session;
use zenoh::query::Reply;

/// Takes each token that matches a key, within this time.
///
/// A router answers itself before the request returns, on the same thread and with its tables locked: what waits for room there, as Zenoh's
/// own channel of 256 answers does, would wait for ever, and all of the router with it.
///
/// # Errors
/// Where the session is closed, or the time is over.
pub async fn each_token(
    session: &Session,
    key: &str,
    within: Duration,
    take: impl FnMut(&str) + Send + 'static,
) -> anyhow::Result<()> {
    // It is dropped with the callback, when there is no further answer.
    let (ends, ended) = oneshot::channel::<()>();
    let failed = Arc::new(Mutex::new(None));
    let (take, says_why) = (Mutex::new(take), failed.clone());
    let callback = move |reply: Reply| {
        let _until_dropped = &ends;
        match reply.result() {
            Ok(sample) => {
                take.lock().unwrap_or_else(PoisonError::into_inner)(sample.key_expr().as_str());
            }
            Err(error) => {
                *says_why.lock().unwrap_or_else(PoisonError::into_inner) = Some(error.to_string());
            }
        }
    };
    let asked = session.liveliness().get(key).timeout(within).callback(callback).await;
    asked.map_err(|error| anyhow!("{error}"))?;
    let _ = ended.await;
    let failed = failed.lock().unwrap_or_else(PoisonError::into_inner).take();
    failed.map_or(Ok(()), |error| Err(anyhow!("{error}")))
}
