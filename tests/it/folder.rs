//! Runs `lab` in a temporary folder.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A temporary folder in which commands run. It is deleted at the end of the test.
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

    /// Standard output of a command that must succeed.
    pub(crate) fn json(&self, arguments: &str) -> serde_json::Value {
        let output = self.lab(arguments);
        assert!(output.status.success(), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(String::from_utf8_lossy(&output.stdout).lines().count(), 1);
        serde_json::from_slice(&output.stdout).expect("JSON")
    }

    /// Standard error of a command that must fail.
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
