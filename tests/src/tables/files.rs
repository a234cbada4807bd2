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

/// The first columns; all others follow by name.
const FIRST_COLUMNS: [&str; 9] =
    ["table", "noise", "shape", "method", "counting", "subset", "class", "trials", "told"];

/// All rows, with the names of the JSON ones.
pub(super) fn table_csv(tables: &Tables) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let rows = tables.rows.iter().map(serde_json::to_value).collect::<Result<Vec<_>, _>>()?;
    let fields = rows.first().and_then(serde_json::Value::as_object);
    let others = fields.into_iter().flat_map(|fields| fields.keys()).map(String::as_str);
    let others = others.filter(|name| !FIRST_COLUMNS.contains(name));
    let columns: Vec<&str> = FIRST_COLUMNS.into_iter().chain(others).collect();
    writer.write_record(&columns)?;
    for row in &rows {
        writer.write_record(columns.iter().map(|column| match &row[column] {
            serde_json::Value::String(text) => text.clone(),
            serde_json::Value::Null => String::new(),
            number => number.to_string(),
        }))?;
    }
    Ok(String::from_utf8(writer.into_inner()?)?)
}
