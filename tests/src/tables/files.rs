//! The tables as files.

use super::Tables;
use super::{latex, text};
use anyhow::Context;
use std::path::Path;

/// Writes Markdown, CSV, LaTeX and JSON into a folder, which is made where there is none.
pub(super) fn write(tables: &Tables, folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
    let json = serde_json::to_string(&tables.rows)?;
    for (name, text) in [
        ("tables.md", text::markdown(tables)),
        ("tables.csv", table_csv(tables)?),
        ("tables.tex", latex::latex(tables)),
        ("tables.json", json),
    ] {
        let path = folder.join(name);
        std::fs::write(&path, text).with_context(|| format!("writing {}", path.display()))?;
    }
    Ok(())
}

/// All rows, with the names of the JSON ones.
pub(super) fn table_csv(tables: &Tables) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let Some(first) = tables.rows.first() else { return Ok(String::new()) };
    let metrics = first.metrics.named().map(|(name, _)| name);
    let header = ["table", "noise", "method", "counting", "subset", "trials", "told"];
    writer.write_record(header.into_iter().chain(metrics))?;
    for row in &tables.rows {
        // By their names in JSON.
        let name = |value: serde_json::Value| value.as_str().unwrap_or_default().to_owned();
        let leading = [
            row.table.to_owned(),
            row.noise.name().to_owned(),
            row.method.key().to_owned(),
            name(serde_json::to_value(row.counting)?),
            name(serde_json::to_value(row.subset)?),
            row.trials.to_string(),
            row.told.clone(),
        ];
        let metrics =
            row.metrics.named().map(|(_, value)| value.map_or(String::new(), |value| value.to_string()));
        writer.write_record(leading.into_iter().chain(metrics))?;
    }
    Ok(String::from_utf8(writer.into_inner()?)?)
}
