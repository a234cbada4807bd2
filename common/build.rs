//! Finds the commit that is built. Without git, or outside of this repository, it is unknown.

use std::path::Path;
use std::process::Command;

fn main() {
    let is_release = std::env::var("PROFILE").is_ok_and(|profile| profile == "release");
    let commit = commit().unwrap_or_else(|| "unknown".to_owned());
    // Everything depends on this crate. A debug build does not follow commits, because each would build all of it again.
    println!("cargo::rustc-env=V2X_COMMIT={commit}{}", if is_release { "" } else { "+dev" });
    println!("cargo::rerun-if-changed=build.rs");
    if !is_release {
        return;
    }
    // Both change with every commit and checkout, and with nothing else: an edit alone does not build everything again.
    for name in ["HEAD", "logs/HEAD"] {
        if let Some(path) = git(&["rev-parse", "--git-path", name]).filter(|path| Path::new(path).exists()) {
            println!("cargo::rerun-if-changed={path}");
        }
    }
}

fn commit() -> Option<String> {
    // The sources may lie, without their own history, in somebody else's repository.
    git(&["ls-files", "--error-unmatch", "build.rs"])?;
    let commit = git(&["rev-parse", "--short=12", "HEAD"])?;
    let is_clean = git(&["status", "--porcelain", "--untracked-files=no"])?.is_empty();
    Some(if is_clean { commit } else { commit + "+dirty" })
}

fn git(args: &[&str]) -> Option<String> {
    let output = Command::new("git").args(args).output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}
