//! A file that is there while the hub is ready: for scripts and supervisors that cannot ask over HTTP.

use anyhow::{Context, bail};
use std::fs::{File, TryLockError};
use std::io::Write;
use std::path::{Path, PathBuf};
use v2x_common::id::{HubId, NetworkId};

/// Removes the file when it is dropped, where it has written it.
#[derive(Debug)]
pub(in super::super) struct ReadyFile {
    path: PathBuf,
    /// Locked as long as the hub runs.
    written: Option<File>,
}

impl ReadyFile {
    /// The file of an earlier hub is removed: this one is not ready yet. That of a hub that runs stays, and is an error.
    pub(in super::super) fn claim(path: &Path) -> anyhow::Result<Self> {
        let claimed = || format!("--ready-file {}", path.display());
        let unwritten = Self { path: path.to_owned(), written: None };
        let file = match File::open(path) {
            Ok(file) => file,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(unwritten),
            Err(error) => return Err(error).with_context(claimed),
        };
        match file.try_lock() {
            Ok(()) => std::fs::remove_file(path).with_context(claimed)?,
            Err(TryLockError::WouldBlock) => {
                bail!("--ready-file {}: it is of a hub that runs; choose another name", path.display())
            }
            Err(TryLockError::Error(error)) => return Err(error).with_context(claimed),
        }
        Ok(unwritten)
    }

    /// Says where the hub listens. Whoever sees the file sees all of it.
    pub(in super::super) fn write(
        &mut self,
        network: NetworkId,
        hub: HubId,
        locators: &[String],
    ) -> anyhow::Result<()> {
        let text = serde_json::json!({ "hub": hub, "network": network, "locators": locators }).to_string();
        let mut unfinished = self.path.clone().into_os_string();
        unfinished.push(".unfinished");
        let write = || {
            let mut file = File::create(&unfinished)?;
            file.write_all((text + "\n").as_bytes())?;
            file.lock()?;
            std::fs::rename(&unfinished, &self.path)?;
            Ok::<_, std::io::Error>(file)
        };
        let written = write().with_context(|| format!("--ready-file {}", self.path.display()))?;
        self.written = Some(written);
        Ok(())
    }
}

impl Drop for ReadyFile {
    fn drop(&mut self) {
        if self.written.is_some() {
            // Somebody else may have removed it.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_a_restart_the_ready_file_of_a_hub_that_runs_is_left_to_it_and_that_of_an_earlier_one_is_removed() {
        let path = std::env::temp_dir().join(format!("v2x-ready-{}.json", std::process::id()));
        std::fs::write(&path, "of an earlier hub").unwrap();
        let mut running = ReadyFile::claim(&path).unwrap();
        assert!(!path.exists());
        running.write(NetworkId::new("demo").unwrap(), HubId::new("hub").unwrap(), &[]).unwrap();
        let error = format!("{:#}", ReadyFile::claim(&path).unwrap_err());
        assert!(error.contains("a hub that runs") && path.exists(), "{error}");
        drop(running);
        assert!(!path.exists());
        // One that never became ready removes nothing.
        let unready = ReadyFile::claim(&path).unwrap();
        std::fs::write(&path, "of another hub").unwrap();
        drop(unready);
        assert!(path.exists());
        std::fs::remove_file(&path).unwrap();
    }
}
