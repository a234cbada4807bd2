//! SUMO as a process.

use super::client::Client;
use super::error::SumoError;
use std::collections::VecDeque;
use std::ffi::OsStr;
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
/// Time for Python to say where SUMO is.
const PYTHON_PATIENCE: Duration = Duration::from_secs(20);
/// Time between two attempts to connect, while it loads its network.
const RETRY: Duration = Duration::from_millis(100);

/// A running SUMO. Dropping it kills it.
pub(super) struct Program {
    child: Child,
    /// Its last messages, at its end.
    said: JoinHandle<VecDeque<String>>,
}

impl Program {
    /// Starts it, and connects.
    pub(super) async fn start(config: &Path) -> Result<(Self, Client, (i32, String)), SumoError> {
        if !config.is_file() {
            return Err(SumoError::NoConfiguration { path: config.to_owned(), others: others(config) });
        }
        let home = std::env::var_os("SUMO_HOME").filter(|home| !home.is_empty());
        let mut program = find(home.as_deref(), std::env::var_os("PATH").as_deref())?;
        let mut command = None;
        if home.is_none()
            && let Some(home) = home_of_wheel(&program).await
        {
            program = home.join("bin").join("sumo").with_extension(std::env::consts::EXE_EXTENSION);
            let mut own = Command::new(&program);
            own.env("PROJ_DATA", home.join("data/proj")).env("SUMO_HOME", home);
            command = Some(own);
        }
        let mut command = command.unwrap_or_else(|| Command::new(&program));
        let start = |cause| SumoError::Start { program: program.clone(), cause };
        let port = free_port().map_err(start)?;
        let mut child = command
            .arg("--configuration-file")
            .arg(config)
            .args(["--remote-port", &port.to_string(), "--num-clients", "1", "--no-step-log", "true"])
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
            match Client::connect(&address).await {
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
    let mut lines = BufReader::new(stderr).lines();
    while let Ok(Some(line)) = lines.next_line().await {
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

/// The program: of `SUMO_HOME`, else on the `PATH`.
fn find(home: Option<&OsStr>, path: Option<&OsStr>) -> Result<PathBuf, SumoError> {
    let name = format!("sumo{}", std::env::consts::EXE_SUFFIX);
    if let Some(home) = home {
        let home = PathBuf::from(home);
        let program = home.join("bin").join(name);
        return if program.is_file() { Ok(program) } else { Err(SumoError::WrongHome { home, program }) };
    }
    let folders = path.map(std::env::split_paths).into_iter().flatten();
    let found = folders.map(|folder| folder.join(&name)).find(|program| program.is_file());
    found.ok_or(SumoError::NoProgram)
}

/// Where SUMO is, if the program is the script of PyPI's wheel, which starts it as a child: started by ourselves it ends
/// with us, however that is.
async fn home_of_wheel(script: &Path) -> Option<PathBuf> {
    let text = std::fs::read_to_string(script).ok().filter(|text| text.contains("from sumo import"))?;
    let python = text.lines().next()?.strip_prefix("#!")?.trim();
    let asked =
        Command::new(python).args(["-c", "import sumo; print(sumo.SUMO_HOME)"]).kill_on_drop(true).output();
    let answer = tokio::time::timeout(PYTHON_PATIENCE, asked).await.ok()?.ok()?;
    let home = PathBuf::from(String::from_utf8(answer.stdout).ok()?.trim());
    home.join("bin").is_dir().then_some(home)
}

/// A port that is free at the moment.
fn free_port() -> std::io::Result<u16> {
    Ok(std::net::TcpListener::bind(("127.0.0.1", 0))?.local_addr()?.port())
}

/// The configurations beside a missing one, as words.
fn others(config: &Path) -> String {
    let folder = config.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    let mut names: Vec<_> = names.filter(|name| name.ends_with(".sumocfg")).collect();
    names.sort_unstable();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_program_is_said_with_how_to_install_it() {
        let message = find(None, Some(OsStr::new("/no-such-folder"))).unwrap_err().to_string();
        assert!(message.contains("pip install eclipse-sumo"), "{message}");
        let message = find(Some(OsStr::new("/no-such-home")), None).unwrap_err().to_string();
        assert!(message.starts_with("SUMO_HOME is /no-such-home, but /no-such-home/bin/sumo"), "{message}");
    }
}
