//! A report as a folder: its page, its rows, and every figure as SVG and PDF.

use crate::report::plot::sheet::Sheet;
use anyhow::Context;
use std::path::Path;

/// Writes files by name, and figures into `plots`. Missing folders are made.
pub(crate) fn write(
    folder: &Path,
    files: Vec<(&str, String)>,
    figures: impl IntoIterator<Item = (String, Sheet)>,
) -> anyhow::Result<()> {
    let plots = folder.join("plots");
    std::fs::create_dir_all(&plots).with_context(|| format!("making {}", plots.display()))?;
    let mut all: Vec<_> =
        files.into_iter().map(|(name, text)| (folder.join(name), text.into_bytes())).collect();
    for (name, sheet) in figures {
        all.push((plots.join(format!("{name}.svg")), sheet.svg().into()));
        all.push((plots.join(format!("{name}.pdf")), sheet.pdf()));
    }
    for (path, bytes) in all {
        std::fs::write(&path, bytes).with_context(|| format!("writing {}", path.display()))?;
    }
    Ok(())
}
