//! The laboratory's command line, run in a folder of its own.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A folder of its own that goes with the test; commands run in it.
pub(crate) struct Folder(pub(crate) PathBuf);

impl Folder {
    pub(crate) fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("lab-offline-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a new folder");
        Self(path)
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        let path = self.0.join(name);
        path.parent().map(std::fs::create_dir_all).transpose().expect("a new folder");
        std::fs::write(path, text).expect("a new file");
    }

    pub(crate) fn lab(&self, arguments: &str) -> Output {
        self.command(arguments).output().expect("lab runs")
    }

    pub(crate) fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(Path::new(env!("CARGO_BIN_EXE_lab")));
        command.args(arguments.split(' ')).current_dir(&self.0);
        command
    }

    /// What it prints, where it succeeds.
    pub(crate) fn json(&self, arguments: &str) -> serde_json::Value {
        let output = self.lab(arguments);
        assert!(output.status.success(), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(String::from_utf8_lossy(&output.stdout).lines().count(), 1);
        serde_json::from_slice(&output.stdout).expect("JSON")
    }

    /// What it complains of, where it fails.
    pub(crate) fn complaint(&self, arguments: &str) -> String {
        let output = self.lab(arguments);
        assert!(!output.status.success(), "{arguments}");
        String::from_utf8(output.stderr).expect("text")
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).expect("the folder is there");
    }
}
