//! A table of texts: the first column is left-aligned, all others are right-aligned.

use std::borrow::Cow;

/// Cells by row. Every row has the length of the header.
pub(crate) struct Table {
    pub(crate) header: Vec<String>,
    pub(crate) rows: Vec<Vec<String>>,
}

impl Table {
    /// Aligned with spaces.
    pub(crate) fn text(&self) -> String {
        let widths = self.widths();
        let line = |row: &Vec<String>| {
            let cells = row.iter().zip(&widths).enumerate();
            let cells = cells.map(|(column, (cell, width))| match column {
                0 => format!("{cell:<width$}"),
                _ => format!("{cell:>width$}"),
            });
            cells.collect::<Vec<_>>().join("  ") + "\n"
        };
        self.lines().map(line).collect()
    }

    /// As Markdown.
    pub(crate) fn markdown(&self) -> String {
        let line = |row: &Vec<String>| format!("| {} |\n", row.join(" | "));
        let rule = format!("|---|{}\n", "---:|".repeat(self.header.len() - 1));
        let rows: String = self.rows.iter().map(line).collect();
        line(&self.header) + &rule + &rows
    }

    /// As HTML. Rows that begin with one of `marked` are highlighted.
    pub(crate) fn html(&self, marked: &[&str]) -> String {
        let cells = |tag: &str, row: &[String]| -> String {
            row.iter().map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell))).collect()
        };
        let row = |row: &Vec<String>| {
            let is_marked = row.first().is_some_and(|name| marked.contains(&name.as_str()));
            let class = if is_marked { " class=\"marked\"" } else { "" };
            format!("<tr{class}>{}</tr>\n", cells("td", row))
        };
        let rows: String = self.rows.iter().map(row).collect();
        format!(
            "<div class=\"table\"><table>\n<thead><tr>{}</tr></thead>\n<tbody>\n{rows}</tbody>\n</table></div>\n",
            cells("th", &self.header)
        )
    }

    fn widths(&self) -> Vec<usize> {
        let width_of = |column: usize| {
            let cells = self.lines().filter_map(|row| row.get(column));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        (0..self.header.len()).map(width_of).collect()
    }

    fn lines(&self) -> impl Iterator<Item = &Vec<String>> {
        std::iter::once(&self.header).chain(&self.rows)
    }
}

/// Text escaped for HTML.
pub(crate) fn escaped(text: &str) -> Cow<'_, str> {
    if !text.contains(['<', '>', '&', '"']) {
        return Cow::Borrowed(text);
    }
    Cow::Owned(text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_escaped_in_every_format() {
        let table = Table { header: vec!["a<b".to_owned()], rows: vec![vec!["\"x\" & y".to_owned()]] };
        let html = table.html(&[]);
        assert!(html.contains("<th>a&lt;b</th>") && html.contains("<td>&quot;x&quot; &amp; y</td>"));
        assert!(table.html(&["\"x\" & y"]).contains("<tr class=\"marked\">"));
    }
}
