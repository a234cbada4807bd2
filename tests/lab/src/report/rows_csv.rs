//! Rows as CSV, with the names of their JSON fields.

use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeSet;

/// All rows. `first` are the first columns, all others follow by name. Nested fields are named with a dot: `age_ms.p50`.
/// `full` is a row with all fields: its columns are written even if no row has them.
pub(crate) fn rows_csv<R: Serialize>(rows: &[R], first: &[&str], full: Option<&R>) -> anyhow::Result<String> {
    let full = full.map(serde_json::to_value).transpose()?.map(|full| flat(&full)).unwrap_or_default();
    let rows = rows.iter().map(|row| Ok(flat(&serde_json::to_value(row)?)));
    let rows = rows.collect::<anyhow::Result<Vec<Vec<(String, String)>>>>()?;
    // A nested field that is null in one row may have parts in another.
    let names: BTreeSet<&str> = rows.iter().flatten().chain(&full).map(|(name, _)| name.as_str()).collect();
    let others = names.iter().copied().filter(|name| !first.contains(name) && !has_parts(name, &names));
    let columns: Vec<&str> = first.iter().copied().chain(others).collect();
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(&columns)?;
    for row in &rows {
        let cell = |column: &&str| row.iter().find(|(name, _)| name == column).map_or("", |(_, cell)| cell);
        writer.write_record(columns.iter().map(cell))?;
    }
    Ok(String::from_utf8(writer.into_inner()?)?)
}

/// Whether another row has nested fields of this name.
fn has_parts(name: &str, names: &BTreeSet<&str>) -> bool {
    names.iter().any(|other| other.strip_prefix(name).is_some_and(|rest| rest.starts_with('.')))
}

fn flat(row: &Value) -> Vec<(String, String)> {
    let mut cells = Vec::new();
    for (name, value) in row.as_object().into_iter().flatten() {
        match value {
            Value::Object(_) => {
                cells.extend(flat(value).into_iter().map(|(part, cell)| (format!("{name}.{part}"), cell)));
            }
            Value::String(text) => cells.push((name.clone(), text.clone())),
            Value::Null => cells.push((name.clone(), String::new())),
            other => cells.push((name.clone(), other.to_string())),
        }
    }
    cells
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn parts_have_columns_and_what_is_missing_is_empty() {
        let rows =
            [json!({"m": "a", "age": null, "n": 1}), json!({"m": "b", "age": {"p50": 2.5}, "n": null})];
        assert_eq!(rows_csv(&rows, &["m"], None).unwrap(), "m,age.p50,n\na,,1\nb,2.5,\n");
        // The same columns where no row has an age.
        assert_eq!(rows_csv(&rows[..1], &["m"], Some(&rows[1])).unwrap(), "m,age.p50,n\na,,1\n");
    }
}
