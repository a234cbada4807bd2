//! Runs `v2x`, reads its output, and waits until it and all its children have ended.

use anyhow::{Context, anyhow, ensure};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::Duration;
use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader, Lines};
use tokio::process::{Child, ChildStderr, ChildStdout, Command};

/// How long any one event may take on a busy machine.
pub(crate) const TIMEOUT: Duration = Duration::from_secs(60);

/// An empty folder of one test's own.
pub(crate) fn folder(test: &str) -> anyhow::Result<PathBuf> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    if folder.exists() {
        std::fs::remove_dir_all(&folder).with_context(|| format!("emptying {}", folder.display()))?;
    }
    std::fs::create_dir_all(&folder).with_context(|| format!("making {}", folder.display()))?;
    Ok(folder)
}

/// A running `v2x`. Dropping it kills it.
pub(crate) struct V2x {
    process: Child,
    stdout: BufReader<ChildStdout>,
    stderr: Lines<BufReader<ChildStderr>>,
    stderr_so_far: Vec<String>,
}

/// How `v2x` ended.
#[derive(Debug)]
pub(crate) struct Ending {
    /// `None` where a signal ended it.
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl V2x {
    /// Starts it in this folder.
    ///
    /// Its standard output is a pipe that each of its children holds too, as descriptor 3: the pipe ends
    /// when the last of them does.
    pub(crate) fn start(folder: &Path, args: &[&str]) -> anyhow::Result<Self> {
        let mut process = Command::new("sh")
            .args(["-c", r#"exec "$0" "$@" 3>&1"#, env!("CARGO_BIN_EXE_v2x")])
            .args(args)
            .current_dir(folder)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .kill_on_drop(true)
            .spawn()
            .context("starting v2x")?;
        let stdout = process.stdout.take().context("stdout is piped")?;
        let stderr = process.stderr.take().context("stderr is piped")?;
        Ok(Self {
            process,
            stdout: BufReader::new(stdout),
            stderr: BufReader::new(stderr).lines(),
            stderr_so_far: Vec::new(),
        })
    }

    /// Waits for the line of standard error that contains this text; earlier lines are skipped.
    pub(crate) async fn stderr_line(&mut self, text: &str) -> anyhow::Result<String> {
        let awaited = async {
            while let Some(line) = self.stderr.next_line().await? {
                self.stderr_so_far.push(line.clone());
                if line.contains(text) {
                    return Ok(Some(line));
                }
            }
            Ok::<_, std::io::Error>(None)
        };
        let line = tokio::time::timeout(TIMEOUT, awaited).await;
        let line =
            line.map_err(|_| anyhow!("it did not print {text:?}, but {:#?}", self.stderr_so_far))??;
        line.ok_or_else(|| anyhow!("it ended before it printed {text:?}: {:#?}", self.stderr_so_far))
    }

    /// Its next line of standard output.
    pub(crate) async fn line(&mut self) -> anyhow::Result<String> {
        let mut line = String::new();
        let read = tokio::time::timeout(TIMEOUT, self.stdout.read_line(&mut line));
        read.await.context("no line on standard output")??;
        Ok(line)
    }

    /// Waits until it and everything that it started have ended.
    pub(crate) async fn end(mut self) -> anyhow::Result<Ending> {
        let Self { process, stdout: pipe, stderr, stderr_so_far } = &mut self;
        let mut stdout = String::new();
        let lines = async {
            while let Some(line) = stderr.next_line().await? {
                stderr_so_far.push(line);
            }
            Ok(())
        };
        // At the same time: what prints more than a pipe holds does not end before it is read.
        let all = async { tokio::try_join!(process.wait(), pipe.read_to_string(&mut stdout), lines) };
        let ended = tokio::time::timeout(TIMEOUT, all).await;
        let printed = &self.stderr_so_far;
        let (status, ..) =
            ended.map_err(|_| anyhow!("it, or what it started, does not end; it printed {printed:#?}"))??;
        Ok(Ending { code: status.code(), stdout, stderr: self.stderr_so_far.join("\n") })
    }

    /// Its process id.
    pub(crate) fn process_id(&self) -> anyhow::Result<u32> {
        self.process.id().context("it has ended")
    }
}

/// A command in a terminal of its own, by the program `script`. Dropping it kills it.
#[cfg(target_os = "linux")]
pub(crate) struct Terminal {
    process: Child,
    output: ChildStdout,
    seen: Vec<u8>,
}

#[cfg(target_os = "linux")]
impl Terminal {
    pub(crate) fn start(folder: &Path, command: &str) -> anyhow::Result<Self> {
        let mut process = Command::new("script")
            .args(["--quiet", "--return", "--command", command, "/dev/null"])
            .current_dir(folder)
            .env("TERM", "xterm-256color")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .kill_on_drop(true)
            .spawn()
            .context("starting script, of util-linux")?;
        let output = process.stdout.take().context("stdout is piped")?;
        Ok(Self { process, output, seen: Vec::new() })
    }

    /// Waits until the terminal has been sent this text, after what was waited for before.
    pub(crate) async fn wait_for(&mut self, text: &str) -> anyhow::Result<()> {
        let awaited = async {
            loop {
                let place = self.seen.windows(text.len()).position(|bytes| bytes == text.as_bytes());
                if let Some(place) = place {
                    self.seen.drain(..place + text.len());
                    return Ok(());
                }
                let mut more = [0; 4096];
                let count = self.output.read(&mut more).await?;
                anyhow::ensure!(count > 0, "the terminal was closed");
                self.seen.extend(&more[..count]);
            }
        };
        let waited = tokio::time::timeout(TIMEOUT, awaited).await;
        let seen = || String::from_utf8_lossy(&self.seen).into_owned();
        waited
            .unwrap_or_else(|_| Err(anyhow!("timeout")))
            .with_context(|| format!("no {text:?} in {:?}", seen()))
    }

    /// Presses keys.
    pub(crate) async fn press(&mut self, keys: &[u8]) -> anyhow::Result<()> {
        let stdin = self.process.stdin.as_mut().context("stdin is piped")?;
        stdin.write_all(keys).await?;
        stdin.flush().await.context("pressing a key")
    }
}

/// A port that was free a moment ago, for what cannot be asked which one it took.
pub(crate) fn free_port() -> anyhow::Result<u16> {
    Ok(std::net::TcpListener::bind("127.0.0.1:0")?.local_addr()?.port())
}

/// Runs `v2x` to its end.
pub(crate) async fn run(folder: &Path, args: &[&str]) -> anyhow::Result<Ending> {
    V2x::start(folder, args)?.end().await
}

/// A network that stays up, of this name; returns it with the hub's endpoint.
pub(crate) async fn up(folder: &Path, network: &str) -> anyhow::Result<(V2x, String)> {
    up_with(folder, "crossing", network).await
}

/// The same, of a scenario.
pub(crate) async fn up_with(folder: &Path, scenario: &str, network: &str) -> anyhow::Result<(V2x, String)> {
    let args = ["up", scenario, "--listen", "tcp/127.0.0.1:0", "--network", network, "--out", "run"];
    let mut up = V2x::start(folder, &args)?;
    let line = up.stderr_line(" is up: hub at ").await?;
    let endpoint = line.split_whitespace().find(|word| word.starts_with("tcp/")).context("no endpoint")?;
    Ok((up, endpoint.trim_end_matches(',').to_owned()))
}

/// Sends a signal.
pub(crate) async fn send(signal: &str, process_id: u32) -> anyhow::Result<()> {
    let args = ["-s", signal, &process_id.to_string()];
    let status = Command::new("kill").args(args).status().await.context("running kill")?;
    ensure!(status.success(), "kill {args:?}: {status}");
    Ok(())
}
