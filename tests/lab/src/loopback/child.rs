//! A child process: start, events and end.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{ExitStatus, Stdio};
use std::sync::Arc;
use std::time::Duration;
use tokio::io::{AsyncBufReadExt, BufReader};
use tokio::process::{ChildStdin, ChildStdout, Command};
use tokio::task::JoinSet;
use v2x_common::net::queue::DropOldestQueue;

/// Events that may wait for whoever asks for them; of more of them the oldest are dropped.
const WAITING: usize = 256;
/// Time for a child to end after it was asked to.
const END_PATIENCE: Duration = Duration::from_secs(5);

/// An error of a child process.
#[derive(Debug, thiserror::Error)]
pub enum ChildError {
    /// Starting it or waiting for it failed.
    #[error("{name}: {source}")]
    Io {
        /// Name of the child.
        name: String,
        /// The error of the system.
        source: std::io::Error,
    },
    /// It ended before the expected event.
    #[error("{name} ended ({status}) before it was {event}{}", tail(.log.as_deref()))]
    Ended {
        /// Name of the child.
        name: String,
        /// Its exit status.
        status: String,
        /// The expected event.
        event: String,
        /// Its log.
        log: Option<PathBuf>,
    },
    /// The expected event did not come in time.
    #[error("{name} was not {event} within {patience:?}{}", tail(.log.as_deref()))]
    TooSlow {
        /// Name of the child.
        name: String,
        /// The expected event.
        event: String,
        /// The time limit.
        patience: Duration,
        /// Its log.
        log: Option<PathBuf>,
    },
}

/// The last lines of a log, for an error message.
fn tail(log: Option<&Path>) -> String {
    const LINES: usize = 8;
    let Some(text) = log.and_then(|path| std::fs::read_to_string(path).ok()) else { return String::new() };
    let lines: Vec<_> = text.lines().collect();
    let last = &lines[lines.len().saturating_sub(LINES)..];
    if last.is_empty() { String::new() } else { format!("; its log ends:\n  {}", last.join("\n  ")) }
}

/// A child process that prints life-cycle events on its standard output and ends when its standard input is closed.
/// Dropping it kills it.
#[derive(Debug)]
pub struct Child {
    name: String,
    log: Option<PathBuf>,
    process: tokio::process::Child,
    // Closing this pipe asks the child to end. The system closes it if this process dies.
    stdin: Option<ChildStdin>,
    /// `None` is the end of them.
    events: Arc<DropOldestQueue<Option<Value>>>,
    /// Ends with this value.
    _reader: JoinSet<()>,
}

impl Child {
    /// Starts a child. Its log goes to the file, if there is one.
    pub fn start(
        name: &str,
        program: &Path,
        args: &[String],
        log: Option<PathBuf>,
    ) -> Result<Self, ChildError> {
        let io_error = |source| ChildError::Io { name: name.to_owned(), source };
        let stderr = match &log {
            Some(path) => Stdio::from(std::fs::File::create(path).map_err(io_error)?),
            None => Stdio::null(),
        };
        let mut command = Command::new(program);
        command.args(args).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(stderr).kill_on_drop(true);
        // Only the launcher receives Ctrl-C from the terminal; it then ends its children in order.
        #[cfg(unix)]
        command.process_group(0);
        let mut process = command.spawn().map_err(io_error)?;
        let stdin = process.stdin.take();
        let stdout = process.stdout.take().ok_or_else(|| io_error(std::io::ErrorKind::BrokenPipe.into()))?;
        let events = Arc::new(DropOldestQueue::new(WAITING));
        // Read whether anybody asks or not: a child whose pipe is full would stand still.
        let mut reader = JoinSet::new();
        reader.spawn(read_events(stdout, events.clone()));
        Ok(Self { name: name.to_owned(), log, process, stdin, events, _reader: reader })
    }

    /// Name of the child.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Process id while it runs.
    pub fn process_id(&self) -> Option<u32> {
        self.process.id()
    }

    /// The next event, or `None` after the last one. Cancel-safe. Of a child that nobody has asked for long only the newest are there.
    pub async fn next_event(&mut self) -> Option<Value> {
        let event = self.events.pop().await;
        if event.is_none() {
            self.events.push(None);
        }
        event
    }

    /// Waits for an event of this kind and skips others.
    pub async fn expect_event(&mut self, kind: &str, patience: Duration) -> Result<Value, ChildError> {
        let awaited = async {
            while let Some(event) = self.next_event().await {
                if event["event"] == kind {
                    return Some(event);
                }
            }
            None
        };
        match tokio::time::timeout(patience, awaited).await {
            Ok(Some(event)) => Ok(event),
            Ok(None) => Err(self.ended_before(kind).await),
            Err(_) => Err(ChildError::TooSlow {
                name: self.name.clone(),
                event: kind.to_owned(),
                patience,
                log: self.log.clone(),
            }),
        }
    }

    /// The error of a child that ended before an expected event.
    pub async fn ended_before(&mut self, event: &str) -> ChildError {
        let status = match tokio::time::timeout(END_PATIENCE, self.process.wait()).await {
            Ok(Ok(status)) => status.to_string(),
            Ok(Err(error)) => error.to_string(),
            Err(_) => "its output is closed".to_owned(),
        };
        ChildError::Ended { name: self.name.clone(), status, event: event.to_owned(), log: self.log.clone() }
    }

    /// Asks the child to end, without waiting.
    pub fn ask_to_end(&mut self) {
        self.stdin = None;
    }

    /// Asks the child to end, waits, and kills it after the time limit. Returns its last event of this kind.
    pub async fn end(mut self, last_words: &str) -> Result<(ExitStatus, Option<Value>), ChildError> {
        self.ask_to_end();
        let words = async {
            let mut found = None;
            while let Some(event) = self.next_event().await {
                if event["event"] == last_words {
                    found = Some(event);
                }
            }
            found
        };
        let words = tokio::time::timeout(END_PATIENCE, words).await.unwrap_or_default();
        let io_error = |source| ChildError::Io { name: self.name.clone(), source };
        let status = match tokio::time::timeout(END_PATIENCE, self.process.wait()).await {
            Ok(status) => status.map_err(io_error)?,
            Err(_) => {
                tracing::warn!(child = self.name, "did not end by itself, killed");
                self.process.start_kill().map_err(io_error)?;
                self.process.wait().await.map_err(io_error)?
            }
        };
        Ok((status, words))
    }

    /// Kills the child.
    pub async fn kill(mut self) -> Result<(), ChildError> {
        let name = self.name.clone();
        self.process.kill().await.map_err(|source| ChildError::Io { name, source })
    }
}

/// Puts the events of a child into a queue, to the end of its output.
async fn read_events(stdout: ChildStdout, events: Arc<DropOldestQueue<Option<Value>>>) {
    let mut output = BufReader::new(stdout);
    let mut line = Vec::new();
    while output.read_until(b'\n', &mut line).await.is_ok_and(|read| read > 0) {
        if let Ok(event) = serde_json::from_slice(&line) {
            events.push(Some(event));
        }
        line.clear();
    }
    events.push(None);
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_child_that_prints_more_than_anybody_reads_goes_on_and_its_last_events_are_kept() {
        // Far more than a pipe holds, 64 KiB.
        let script = r#"i=0; while [ $i -lt 4000 ]; do echo '{"event":"progress","text":"0123456789012345678901234567890"}'; i=$((i+1)); done; echo '{"event":"stopped"}'"#;
        let args = ["-c".to_owned(), script.to_owned()];
        let mut child = Child::start("printer", Path::new("/bin/sh"), &args, None).unwrap();
        let ended = tokio::time::timeout(Duration::from_secs(60), child.process.wait()).await;
        assert!(ended.expect("it waits for its reader").unwrap().success());
        let last_words = child.expect_event("stopped", Duration::from_secs(60)).await.unwrap();
        assert_eq!(last_words["event"], "stopped");
        assert_eq!(child.next_event().await, None);
        assert_eq!(child.next_event().await, None, "and so it stays");
    }
}
