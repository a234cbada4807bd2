//! SUMO as a process.

use super::client::Client;
use super::error::SumoError;
use crate::sumo_home;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::process::{ExitStatus, Stdio};
use std::time::Duration;
use tokio::io::{AsyncBufReadExt, BufReader};
use tokio::process::{Child, Command};
use tokio::task::JoinHandle;

/// Its last messages that an error repeats.
const SAID: usize = 6;
/// Time for it to end after its connection was closed.
const END_PATIENCE: Duration = Duration::from_secs(3);
/// Time between two attempts to connect, while it loads its network.
const RETRY: Duration = Duration::from_millis(100);

/// Time for an answer of a SUMO that is running: of the first one, to read a large network.
const ANSWER_PATIENCE: Duration = Duration::from_secs(600);

/// A running SUMO. Dropping it kills it.
pub(super) struct Program {
    child: Child,
    /// Its last messages, at its end.
    said: JoinHandle<VecDeque<String>>,
}

impl Program {
    /// Starts it, and connects.
    pub(super) async fn start(config: &Path) -> Result<(Self, Client, (i32, String)), SumoError> {
        let command = sumo_home::command(config)?;
        let program = PathBuf::from(command.get_program());
        let start = |cause| SumoError::Start { program: program.clone(), cause };
        let port = free_port().map_err(start)?;
        let mut child = Command::from(command)
            .args(["--remote-port", &port.to_string(), "--num-clients", "1"])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .kill_on_drop(true)
            .spawn()
            .map_err(start)?;
        let said = tokio::spawn(listen(child.stderr.take()));
        let mut program = Self { child, said };
        let address = format!("127.0.0.1:{port}");
        loop {
            match Client::connect(&address, Some(ANSWER_PATIENCE)).await {
                Ok((client, version)) => return Ok((program, client, version)),
                Err(SumoError::NoAnswer { .. }) => {}
                Err(error) => return Err(program.why(error).await),
            }
            tokio::select! {
                status = program.child.wait() => return Err(program.ended(status).await),
                () = tokio::time::sleep(RETRY) => {}
            }
        }
    }

    /// The cause of an error: where it has ended, its own words.
    pub(super) async fn why(mut self, error: SumoError) -> SumoError {
        match tokio::time::timeout(END_PATIENCE, self.child.wait()).await {
            Ok(status) => self.ended(status).await,
            Err(_) => error,
        }
    }

    /// Waits until it has ended; kills it after the time limit.
    pub(super) async fn end(mut self) -> Result<(), SumoError> {
        if tokio::time::timeout(END_PATIENCE, self.child.wait()).await.is_err() {
            tracing::warn!("SUMO did not end by itself, killed");
            self.child.kill().await.map_err(SumoError::Connection)?;
        }
        Ok(())
    }

    async fn ended(self, status: std::io::Result<ExitStatus>) -> SumoError {
        let status = status.map_or_else(|error| error.to_string(), |status| status.to_string());
        let said = tokio::time::timeout(END_PATIENCE, self.said).await;
        let said = said.ok().and_then(Result::ok).unwrap_or_default();
        let said = if said.is_empty() {
            String::new()
        } else {
            format!("; it said:\n  {}", Vec::from(said).join("\n  "))
        };
        SumoError::Ended { status, said }
    }
}

/// Logs what it says, and keeps the last of it.
async fn listen(stderr: Option<tokio::process::ChildStderr>) -> VecDeque<String> {
    let mut said = VecDeque::new();
    let Some(stderr) = stderr else { return said };
    let (mut stderr, mut line) = (BufReader::new(stderr), Vec::new());
    // Not each path is UTF-8.
    while stderr.read_until(b'\n', &mut line).await.is_ok_and(|n| n > 0) {
        let bytes = std::mem::take(&mut line);
        let line = String::from_utf8_lossy(&bytes).trim_end().to_owned();
        if line.trim().is_empty() {
            continue;
        }
        tracing::warn!("SUMO: {line}");
        if said.len() == SAID {
            said.pop_front();
        }
        said.push_back(line);
    }
    said
}

/// A port that is free at the moment.
fn free_port() -> std::io::Result<u16> {
    Ok(std::net::TcpListener::bind(("127.0.0.1", 0))?.local_addr()?.port())
}
