//! A table of texts: the first column is left-aligned, all others are right-aligned.

use std::borrow::Cow;

/// A table of more columns does not fit a telephone: there each row is a card.
const MOST_ON_A_TELEPHONE: usize = 5;

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

    /// As HTML. Rows that begin with one of `marked` are highlighted. Columns without any figure are left out, and columns of
    /// words may wrap.
    pub(crate) fn html(&self, marked: &[&str]) -> String {
        let columns: Vec<(usize, bool)> = (0..self.header.len())
            .filter(|column| !self.is_blank(*column))
            .map(|column| (column, self.is_of_words(column)))
            .collect();
        let is_wide = columns.len() > MOST_ON_A_TELEPHONE;
        let cells = |tag: &str, row: &[String]| -> String {
            let cell = |(column, is_of_words): &(usize, bool)| {
                let class = if *is_of_words { " class=\"words\"" } else { "" };
                let name = match self.header.get(*column) {
                    Some(name) if is_wide && tag == "td" => format!(" data-column=\"{}\"", escaped(name)),
                    _ => String::new(),
                };
                let text = row.get(*column).map_or("".into(), |cell| escaped(cell));
                format!("<{tag}{class}{name}>{text}</{tag}>")
            };
            columns.iter().map(cell).collect()
        };
        let row = |row: &Vec<String>| {
            let is_marked = row.first().is_some_and(|name| marked.contains(&name.as_str()));
            let class = if is_marked { " class=\"marked\"" } else { "" };
            format!("<tr{class}>{}</tr>\n", cells("td", row))
        };
        let rows: String = self.rows.iter().map(row).collect();
        let class = if is_wide { " class=\"wide\"" } else { "" };
        format!(
            "<div class=\"table\"><table{class}>\n<thead><tr>{}</tr></thead>\n<tbody>\n{rows}</tbody>\n</table></div>\n",
            cells("th", &self.header)
        )
    }

    /// Whether a column after the first has a dash in every row.
    fn is_blank(&self, column: usize) -> bool {
        column > 0 && !self.rows.is_empty() && self.cells(column).all(|cell| cell == "–")
    }

    /// Whether a column after the first has sentences or lists of words.
    fn is_of_words(&self, column: usize) -> bool {
        /// A number with its unit has fewer letters.
        const FEWEST_LETTERS: usize = 12;
        let letters = |cell: &String| cell.chars().filter(|c| c.is_alphabetic()).count();
        column > 0 && self.cells(column).any(|cell| letters(cell) >= FEWEST_LETTERS)
    }

    fn cells(&self, column: usize) -> impl Iterator<Item = &String> {
        self.rows.iter().filter_map(move |row| row.get(column))
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

    #[test]
    fn a_page_leaves_out_what_is_nowhere_known_and_wraps_words() {
        let texts = |cells: [&str; 4]| cells.map(str::to_owned).to_vec();
        let rows = vec![
            texts(["a", "–", "1.5", "–"]),
            texts(["b", "–", "–", "σ, past frames, class prior, size law"]),
        ];
        let html = Table { header: texts(["method", "paper", "own", "given"]), rows }.html(&[]);
        assert!(!html.contains("paper</th>") && html.contains("<th>own</th>"), "{html}");
        assert!(
            html.contains("<th class=\"words\">given</th>") && html.contains("<td class=\"words\">σ"),
            "{html}"
        );
        assert_eq!(html.matches("<td").count(), 2 * 3);
    }
}
