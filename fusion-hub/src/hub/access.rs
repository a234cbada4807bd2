//! The Zenoh configuration of a hub, followed while it runs: who may take part changes more often than a hub is restarted.
//!
//! Zenoh reads its access control and its certificates once, when a session is opened. So the hub opens its session anew when
//! the file is written anew; agents and consumers connect again by themselves.

use super::exposure;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};
use tokio_util::sync::CancellationToken;
use v2x_common::clock;
use v2x_common::net::session::{self, SessionOptions};
use v2x_common::net::zenoh_logs;
use v2x_common::net::zenoh_peers::{self, Sessions};
use v2x_common::net::zenoh_refusals::{ZenohRefusals, zenoh_refusals};
use v2x_common::time::{Span, Timestamp};
use zenoh::{Config, Session};

/// What Zenoh refuses is logged no more often than this.
const LOGGED_EVERY: Span = Span::from_millis(10_000);

/// Time between two attempts to join the network again.
const AGAIN_AFTER: Duration = Duration::from_secs(1);

/// A configuration that Zenoh does not take is tried again after this, the next time after twice as long. Each attempt makes
/// everybody connect anew.
const FIRST_RETRY_AFTER: Span = Span::from_millis(10_000);
/// And so on, up to this.
const RETRY_AFTER_AT_MOST: Span = Span::from_millis(320_000);

/// By what it shows that a file was written anew: time and length.
type Written = Option<(SystemTime, u64)>;

/// The file, as it was when the hub read it.
pub(super) struct Access {
    options: SessionOptions,
    /// What the session was opened with.
    in_force: Config,
    written: Written,
    /// Why the file as it is now is not followed, once that was said.
    refused: Option<String>,
    /// When what Zenoh did not take is tried again, and how long it waits then.
    again_at: Option<Timestamp>,
    retry_after: Span,
    /// The counts that were logged last, and when.
    logged: ZenohRefusals,
    logged_at: Timestamp,
}

impl Access {
    /// Of a session that is about to be opened with these options.
    pub(super) fn new(options: &SessionOptions) -> anyhow::Result<Self> {
        Self::read(options, session::hub_config)
    }

    /// When the file was written is looked at before it is read: what is written meanwhile is followed.
    fn read(
        options: &SessionOptions,
        read: impl FnOnce(&SessionOptions) -> anyhow::Result<Config>,
    ) -> anyhow::Result<Self> {
        let written = written(options.config.as_ref());
        Ok(Self {
            in_force: read(options)?,
            options: options.clone(),
            written,
            refused: None,
            again_at: None,
            retry_after: FIRST_RETRY_AFTER,
            logged: ZenohRefusals::default(),
            logged_at: Timestamp::MIN,
        })
    }

    /// What the session is opened with.
    pub(super) const fn in_force(&self) -> &Config {
        &self.in_force
    }

    /// Who is connected, and how many can be.
    pub(super) fn sessions(&self) -> Sessions {
        zenoh_peers::sessions(session::max_sessions(&self.in_force))
    }

    /// Whether the configuration that is in force is not the one in the file: a revocation in that does not hold.
    pub(super) const fn is_behind(&self) -> bool {
        self.refused.is_some()
    }

    /// The configuration, where its file was written anew, or is due to be tried again, and can be read.
    pub(super) fn changed(&mut self, now: Timestamp) -> Option<Config> {
        let written = written(self.options.config.as_ref());
        let is_new = written != self.written;
        // A file that is missing for a moment, or for ever, changes nothing.
        if written.is_none() || !(is_new || self.again_at.is_some_and(|at| now >= at)) {
            return None;
        }
        match session::hub_config(&self.options) {
            Ok(config) => {
                (self.written, self.again_at) = (written, None);
                if is_new {
                    self.retry_after = FIRST_RETRY_AFTER;
                }
                Some(config)
            }
            // Files that it names may not be there yet: it is read again, and the error is logged once.
            Err(error) => {
                self.note_refused(format!(
                    "the Zenoh configuration was written anew, but is not followed: {error:#}"
                ));
                None
            }
        }
    }

    fn note_refused(&mut self, why: String) {
        if self.refused.as_ref() != Some(&why) {
            tracing::warn!("{why}");
            self.refused = Some(why);
        }
    }

    /// Notes that Zenoh does not take the configuration at `now`: it is tried again.
    fn note_not_taken(&mut self, error: &anyhow::Error, now: Timestamp) {
        self.note_refused(format!(
            "Zenoh does not take the new configuration, which is not followed; it is tried again: {error:#}"
        ));
        self.again_at = Some(now + self.retry_after);
        self.retry_after = (self.retry_after + self.retry_after).min(RETRY_AFTER_AT_MOST);
    }

    /// Opens a session in place of one that was closed: with another configuration, or with the previous one where Zenoh does
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
                    (self.in_force, self.refused) = (config, None);
                    return Some(session);
                }
                Err(error) => self.note_not_taken(&error, clock::now()),
            }
            match session::open_in_place(self.in_force.clone(), locators).await {
                Ok(session) => return Some(session),
                Err(error) => tracing::error!(
                    "no session with the previous configuration either; trying again: {error:#}"
                ),
            }
            tokio::select! {
                () = shutdown.cancelled() => {}
                () = tokio::time::sleep(AGAIN_AFTER) => {}
            }
        }
        None
    }

    /// Warns of what Zenoh has refused since the last warning, and of what it has logged that was not printed.
    pub(super) fn log_refusals(&mut self, now: Timestamp) {
        if let Some(sum) = zenoh_logs::take_sum(now) {
            tracing::warn!("{sum}");
        }
        if now - self.logged_at < LOGGED_EVERY {
            return;
        }
        let refusals = zenoh_refusals();
        if refusals != self.logged {
            let words = refusals.in_words().unwrap_or_default();
            let newest = refusals.denied.last();
            let example = newest.map(|kind| format!(" (such as {}: {} {})", kind.who, kind.action, kind.key));
            tracing::warn!(
                "since the start {words}{}; `v2x status` has them all",
                example.unwrap_or_default()
            );
            self.logged = refusals;
            self.logged_at = now;
        }
    }
}

fn written(path: Option<&PathBuf>) -> Written {
    let metadata = std::fs::metadata(path?).ok()?;
    Some((metadata.modified().ok()?, metadata.len()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// A file with a configuration, as it was written at this second.
    fn write(name: &str, second: u64) -> SessionOptions {
        let path = std::env::temp_dir().join(format!("v2x-access-{}-{name}.json5", std::process::id()));
        fs::write(&path, "{ mode: \"router\" }").unwrap();
        let at = SystemTime::UNIX_EPOCH + Duration::from_secs(second);
        fs::File::options().write(true).open(&path).unwrap().set_modified(at).unwrap();
        SessionOptions { config: Some(path), ..SessionOptions::default() }
    }

    fn at(seconds: i64) -> Timestamp {
        Timestamp::EPOCH + Span::from_millis(1000 * seconds)
    }

    #[test]
    fn an_acl_that_zenoh_does_not_take_at_once_is_tried_again_ever_more_rarely_and_shows() {
        let mut access = Access::new(&write("again", 1)).unwrap();
        assert!(access.changed(at(0)).is_none());
        write("again", 2);
        assert!(access.changed(at(1)).is_some());
        access.note_not_taken(&anyhow::anyhow!("no such file"), at(1));
        assert!(access.is_behind() && access.changed(at(10)).is_none());
        assert!(access.changed(at(11)).is_some(), "though the file is the same");
        access.note_not_taken(&anyhow::anyhow!("no such file"), at(11));
        assert!(access.changed(at(30)).is_none() && access.changed(at(31)).is_some());
        for _ in 0..20 {
            access.note_not_taken(&anyhow::anyhow!("no such file"), at(31));
        }
        assert!(access.changed(at(31 + 320)).is_some());
        // One that is written anew is tried at once, and then as soon as the first one.
        access.note_not_taken(&anyhow::anyhow!("no such file"), at(400));
        write("again", 3);
        assert!(access.changed(at(401)).is_some());
        access.note_not_taken(&anyhow::anyhow!("no such file"), at(401));
        assert!(access.changed(at(411)).is_some());
        fs::remove_file(access.options.config.unwrap()).unwrap();
    }

    #[test]
    fn an_acl_that_is_written_while_the_hub_reads_it_is_followed() {
        let options = write("between", 1);
        let read = |options: &SessionOptions| {
            let config = session::hub_config(options);
            write("between", 2);
            config
        };
        let mut access = Access::read(&options, read).unwrap();
        assert!(access.changed(at(0)).is_some());
        fs::remove_file(options.config.unwrap()).unwrap();
    }
}
