//! A file that is there while the hub is ready: for scripts and supervisors that cannot ask over HTTP.

use anyhow::Context;
use std::path::{Path, PathBuf};
use v2x_common::id::{HubId, NetworkId};

/// Removes the file when it is dropped.
#[derive(Debug)]
pub(in super::super) struct ReadyFile(PathBuf);

impl ReadyFile {
    /// The file of an earlier hub is removed: this one is not ready yet.
    pub(in super::super) fn claim(path: &Path) -> anyhow::Result<Self> {
        match std::fs::remove_file(path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                Err(error).with_context(|| format!("--ready-file {}", path.display()))
            }
            _ => Ok(Self(path.to_owned())),
        }
    }

    /// Says where the hub listens. Whoever sees the file sees all of it.
    pub(in super::super) fn write(
        &self,
        network: NetworkId,
        hub: HubId,
        locators: &[String],
    ) -> anyhow::Result<()> {
        let text = serde_json::json!({ "hub": hub, "network": network, "locators": locators }).to_string();
        let mut unfinished = self.0.clone().into_os_string();
        unfinished.push(".unfinished");
        std::fs::write(&unfinished, text + "\n")
            .and_then(|()| std::fs::rename(&unfinished, &self.0))
            .with_context(|| format!("--ready-file {}", self.0.display()))
    }
}

impl Drop for ReadyFile {
    fn drop(&mut self) {
        // It may never have been written.
        let _ = std::fs::remove_file(&self.0);
    }
}
