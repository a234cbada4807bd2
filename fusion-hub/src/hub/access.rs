//! The Zenoh configuration of a hub, followed while it runs: who may take part changes more often than a hub is restarted.
//!
//! Zenoh reads its access control and its certificates once, when a session is opened. So the hub opens its session anew when
//! the file is written anew; agents and consumers connect again by themselves.

use super::exposure;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};
use tokio_util::sync::CancellationToken;
use v2x_common::net::session::{self, SessionOptions};
use v2x_common::net::zenoh_refusals::{ZenohRefusals, zenoh_refusals};
use v2x_common::time::{Span, Timestamp};
use zenoh::{Config, Session};

/// What Zenoh refuses is told no more often than this.
const TOLD_EVERY: Span = Span::from_millis(10_000);

/// Time between two attempts to join the network again.
const AGAIN_AFTER: Duration = Duration::from_secs(1);

/// The file, as it was when the hub read it.
pub(super) struct Access {
    options: SessionOptions,
    /// What the session was opened with.
    in_force: Config,
    written_at: Option<SystemTime>,
    /// Why the file as it is now is not followed, once that was said.
    refused: Option<String>,
    told: ZenohRefusals,
    told_at: Timestamp,
}

impl Access {
    /// Of a session that is about to be opened with these options.
    pub(super) fn new(options: SessionOptions, in_force: Config) -> Self {
        let written_at = written_at(options.config.as_ref());
        Self {
            options,
            in_force,
            written_at,
            refused: None,
            told: ZenohRefusals::default(),
            told_at: Timestamp::MIN,
        }
    }

    /// The configuration, where its file was written anew and can be read.
    pub(super) fn changed(&mut self) -> Option<Config> {
        let written_at = written_at(self.options.config.as_ref());
        // A file that is missing for a moment, or for ever, changes nothing.
        if written_at.is_none() || written_at == self.written_at {
            return None;
        }
        match session::hub_config(&self.options) {
            Ok(config) => {
                (self.written_at, self.refused) = (written_at, None);
                Some(config)
            }
            // Perhaps files that it names are on their way: it is looked at again, and told once.
            Err(error) => {
                let why = format!("{error:#}");
                if self.refused.as_ref() != Some(&why) {
                    tracing::warn!("the Zenoh configuration was written anew, but is not followed: {why}");
                    self.refused = Some(why);
                }
                None
            }
        }
    }

    /// Opens a session in place of one that was closed: with another configuration, or with the former one where Zenoh does
    /// not take that. Tries again until one of them is taken (certificates may be on their way, the port still in use), or until
    /// shutdown (`None`).
    pub(super) async fn reopen(
        &mut self,
        config: Config,
        locators: &[String],
        shutdown: &CancellationToken,
    ) -> Option<Session> {
        if let Some(warning) = exposure::warning(&config) {
            tracing::warn!("{warning}");
        }
        while !shutdown.is_cancelled() {
            match session::open_in_place(config.clone(), locators).await {
                Ok(session) => {
                    self.in_force = config;
                    return Some(session);
                }
                Err(error) => {
                    tracing::warn!(
                        "Zenoh does not take the new configuration, which is not followed: {error:#}"
                    );
                }
            }
            match session::open_in_place(self.in_force.clone(), locators).await {
                Ok(session) => return Some(session),
                Err(error) => tracing::error!("nor the former one; trying again: {error:#}"),
            }
            tokio::select! {
                () = shutdown.cancelled() => {}
                () = tokio::time::sleep(AGAIN_AFTER) => {}
            }
        }
        None
    }

    /// Warns of what Zenoh has refused since the last warning.
    pub(super) fn tell_refusals(&mut self, now: Timestamp) {
        if now - self.told_at < TOLD_EVERY {
            return;
        }
        let refusals = zenoh_refusals();
        if refusals != self.told {
            let words = refusals.in_words().unwrap_or_default();
            let newest = refusals.denied.last();
            let example = newest.map(|kind| format!(" (such as {}: {} {})", kind.who, kind.action, kind.key));
            tracing::warn!(
                "since the start {words}{}; `v2x status` has them all",
                example.unwrap_or_default()
            );
            self.told = refusals;
            self.told_at = now;
        }
    }
}

fn written_at(path: Option<&PathBuf>) -> Option<SystemTime> {
    std::fs::metadata(path?).ok()?.modified().ok()
}
