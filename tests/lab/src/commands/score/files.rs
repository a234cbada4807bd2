//! Finds an export and the output files of a method.

use crate::commands::export::manifest::{FILE_NAME, Manifest, Part};
use anyhow::{bail, ensure};
use std::path::{Path, PathBuf};

/// The folder of the export: `named` if given; otherwise the nearest folder with `export.json`, from one of the
/// paths upwards.
pub(crate) fn export_folder(named: Option<&Path>, paths: &[PathBuf]) -> anyhow::Result<PathBuf> {
    if let Some(named) = named {
        return Ok(named.to_owned());
    }
    for path in paths {
        let absolute = std::path::absolute(path)?;
        if let Some(folder) = absolute.ancestors().find(|folder| folder.join(FILE_NAME).is_file()) {
            return Ok(folder.to_owned());
        }
    }
    bail!(
        "there is no {FILE_NAME} in {} or above it; name the export's folder with --export",
        paths[0].display()
    )
}

/// One file for each part of the export; an error if one is missing.
pub(crate) fn fused_files(manifest: &Manifest, paths: &[PathBuf]) -> anyhow::Result<Vec<(Part, PathBuf)>> {
    for path in paths {
        ensure!(path.exists(), "{} is not there", path.display());
    }
    let parts: Vec<Part> = manifest.parts().collect();
    // An export of one table accepts a file of any name.
    if let ([part], [path]) = (parts.as_slice(), paths)
        && path.is_file()
    {
        return Ok(vec![(*part, path.clone())]);
    }
    let absolute = paths.iter().map(std::path::absolute).collect::<Result<Vec<_>, _>>()?;
    let (mut files, mut missing) = (Vec::new(), Vec::new());
    for part in parts {
        let wanted = manifest.path(part);
        match absolute.iter().find_map(|path| file_in(path, &wanted)) {
            Some(file) => files.push((part, file)),
            None => missing.push(wanted),
        }
    }
    let Some(first) = missing.first() else { return Ok(files) };
    let (n, of) = (missing.len(), missing.len() + files.len());
    bail!(
        "{n} of {of} files of the export have no counterpart in {}: {} is the first",
        text(paths),
        first.display()
    )
}

/// The file `wanted`, if it is `path` or inside it. `path` can be an inner folder of the layout.
fn file_in(path: &Path, wanted: &Path) -> Option<PathBuf> {
    if path.is_file() {
        return path.ends_with(wanted).then(|| path.to_owned());
    }
    let heads = wanted.ancestors().skip(1).filter(|head| path.ends_with(head));
    let mut files = heads.filter_map(|head| Some(path.join(wanted.strip_prefix(head).ok()?)));
    files.find(|file| file.is_file())
}

fn text(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
}
