//! Writes files that are private, and never over others in silence.

use anyhow::{Context, bail};
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::Path;

/// Makes a folder that only its owner can enter. Its parents are made, too. One that is there already is left as it is, where nobody else can write
/// to it: whoever can, replaces any file in it by his own, whatever the modes of the files.
pub(super) fn private_folder(path: &Path) -> anyhow::Result<()> {
    let mut builder = std::fs::DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(path).with_context(|| format!("making the folder {}", path.display()))?;
    #[cfg(unix)]
    refuse_writable_by_others(path)?;
    Ok(())
}

#[cfg(unix)]
fn refuse_writable_by_others(path: &Path) -> anyhow::Result<()> {
    let metadata =
        std::fs::metadata(path).with_context(|| format!("reading the mode of {}", path.display()))?;
    let mode = std::os::unix::fs::PermissionsExt::mode(&metadata.permissions());
    if mode & 0o022 != 0 {
        bail!(
            "other users of this machine can write to the folder {0} (mode {1:o}), and replace keys and certificates in it: \
             chmod go-w {0}",
            path.display(),
            mode & 0o777
        );
    }
    Ok(())
}

/// Keeps a folder with private keys out of the repository around it, if there is one: `git add .` passes it by.
pub(super) fn keep_out_of_repositories(folder: &Path) -> anyhow::Result<()> {
    let path = folder.join(".gitignore");
    if path.exists() { Ok(()) } else { create(&path, "# Private keys.\n*\n") }
}

/// What is made by these options only its owner can read.
pub(super) fn private(options: &mut OpenOptions) -> &mut OpenOptions {
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(options, 0o600);
    options
}

/// Writes a new file that only its owner can read.
pub(super) fn create(path: &Path, text: &str) -> anyhow::Result<()> {
    let file = private(OpenOptions::new().write(true).create_new(true))
        .open(path)
        .with_context(|| format!("making {}", path.display()))?;
    write(file, text).with_context(|| format!("writing {}", path.display()))
}

/// Writes a file, in place of one that is there: whoever reads it reads the old one or the new one, whole.
pub(super) fn replace(path: &Path, text: &str) -> anyhow::Result<()> {
    let Some(name) = path.file_name() else { bail!("{} names no file", path.display()) };
    let mut unfinished = name.to_owned();
    unfinished.push(".new");
    let unfinished = path.with_file_name(unfinished);
    // Of an attempt that was interrupted.
    if unfinished.exists() {
        std::fs::remove_file(&unfinished).with_context(|| format!("removing {}", unfinished.display()))?;
    }
    create(&unfinished, text)?;
    std::fs::rename(&unfinished, path).with_context(|| format!("writing {}", path.display()))
}

fn write(mut file: File, text: &str) -> std::io::Result<()> {
    file.write_all(text.as_bytes())?;
    file.sync_all()
}
