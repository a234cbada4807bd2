//! The tables as files.

use super::Tables;
use super::figures::{Figure, figures};
use super::{html, latex, text};
use anyhow::Context;
use std::path::{Path, PathBuf};

/// Writes the report, its figures as SVG and PDF, and the tables as Markdown, CSV, LaTeX and JSON into a folder,
/// which is made where there is none.
pub(super) fn write(tables: &Tables, folder: &Path) -> anyhow::Result<()> {
    let plots = folder.join("plots");
    std::fs::create_dir_all(&plots).with_context(|| format!("making {}", plots.display()))?;
    let figures = figures(tables);
    let json = serde_json::to_string(&tables.rows)?;
    let mut files: Vec<(PathBuf, Vec<u8>)> = vec![
        (folder.join("report.html"), html::html(tables, &figures).into()),
        (folder.join("tables.md"), text::markdown(tables).into()),
        (folder.join("tables.csv"), table_csv(tables)?.into()),
        (folder.join("tables.tex"), latex::latex(tables).into()),
        (folder.join("tables.json"), json.into()),
    ];
    for Figure { name, plot, .. } in &figures {
        let sheet = plot.sheet();
        files.push((plots.join(format!("{name}.svg")), sheet.svg().into()));
        files.push((plots.join(format!("{name}.pdf")), sheet.pdf()));
    }
    for (path, bytes) in files {
        std::fs::write(&path, bytes).with_context(|| format!("writing {}", path.display()))?;
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
