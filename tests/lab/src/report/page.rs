//! A self-contained HTML page: no scripts, external style sheets or pictures. It is read on a telephone, in the dark, and on
//! paper.

use crate::report::plot::figure_parts::{FigureParts, Layout};
use crate::report::plot::sheet::Sheet;
use crate::report::table::escaped;
use jiff::Timestamp;
use v2x_common::version;

/// A panel is drawn at most so much larger than it was made.
const MOST_ENLARGED: f64 = 1.5;

const STYLE: &str = include_str!("style.css");

/// A part of a page, to which its head links.
pub(crate) struct Section {
    /// Its name in links.
    pub id: String,
    /// The text of the link.
    pub name: String,
    /// Its heading.
    pub title: String,
    /// What stands in it, as HTML.
    pub html: String,
}

impl Section {
    /// A section with its heading as its name.
    pub(crate) fn new(id: &str, title: &str, html: String) -> Self {
        Self { id: id.to_owned(), name: title.to_owned(), title: title.to_owned(), html }
    }
}

/// A page with this title: what stands at its top, links to its sections, the sections, and what wrote it.
pub(crate) fn page(title: &str, top: &str, sections: &[Section]) -> String {
    let link = |Section { id, name, .. }: &Section| format!("<a href=\"#{id}\">{}</a>\n", escaped(name));
    let section = |Section { id, title, html, .. }: &Section| {
        format!("<section>\n<h2 id=\"{id}\">{}</h2>\n{html}</section>\n", escaped(title))
    };
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\">\n<title>{0}</title>\n\
         <style>\n{STYLE}</style></head>\n<body>\n<h1>{0}</h1>\n{top}<nav>\n{1}</nav>\n{2}{3}</body>\n</html>\n",
        escaped(title),
        sections.iter().map(link).collect::<String>(),
        sections.iter().map(section).collect::<String>(),
        footer(&command(), Timestamp::now()),
    )
}

/// The command line of this program, without the folder of the program.
pub(crate) fn command() -> String {
    let mut words = std::env::args();
    let program = words.next().unwrap_or_default();
    let program =
        std::path::Path::new(&program).file_stem().unwrap_or_default().to_string_lossy().into_owned();
    std::iter::once(program).chain(words).collect::<Vec<_>>().join(" ")
}

/// What wrote the page, and when.
fn footer(command: &str, at: Timestamp) -> String {
    format!(
        "<footer>Written by <code>{}</code>, version {}, {} UTC.</footer>\n",
        escaped(command),
        version::LONG,
        at.strftime("%Y-%m-%d %H:%M")
    )
}

/// The verdict, which stands before everything else: in a word, and its reasons, one a line.
pub(crate) fn verdict_html(is_good: bool, verdict: &str, reasons: &[String]) -> String {
    let class = if is_good { "good" } else { "bad" };
    boxed(&format!("verdict {class}"), verdict, reasons)
}

/// What stands before everything else where nothing is judged.
pub(crate) fn remark_html(remark: &str, lines: &[String]) -> String {
    boxed("verdict", remark, lines)
}

fn boxed(class: &str, word: &str, reasons: &[String]) -> String {
    let reasons: String = reasons.iter().map(|reason| format!("<p>{}</p>\n", escaped(reason))).collect();
    format!("<div class=\"{class}\"><b>{}</b>\n{reasons}</div>\n", escaped(word))
}

/// A figure: its panels side by side as far as they can be read there, and one legend. With links to its files, if it has
/// some.
pub(crate) fn figure(parts: &FigureParts, file: Option<&str>) -> String {
    let FigureParts { title, subtitle, panels, legend, layout } = parts;
    let class = match layout {
        Layout::Columns => "panels",
        Layout::LargeColumns => "panels large",
        Layout::Rows => "panels rows",
    };
    let panel = |(caption, sheet): &(String, Sheet)| {
        let caption =
            if caption.is_empty() { String::new() } else { format!("<p>{}</p>\n", escaped(caption)) };
        // Letters are as large in every figure, whatever its width.
        let most = f64::from(sheet.width) * MOST_ENLARGED;
        format!("<div style=\"max-width:{most:.0}px\">{caption}{}</div>\n", sheet.svg())
    };
    let entry =
        |(mark, text): &(Sheet, String)| format!("<li>{}{}</li>\n", mark.svg().trim_end(), escaped(text));
    let entries: String = legend.iter().map(entry).collect();
    let legend =
        if entries.is_empty() { entries } else { format!("<ul class=\"legend\">\n{entries}</ul>\n") };
    let files = file.map_or_else(String::new, |name| {
        format!(
            "<figcaption>As one sheet: <a href=\"plots/{name}.svg\">{name}.svg</a>, <a \
             href=\"plots/{name}.pdf\">{name}.pdf</a></figcaption>"
        )
    });
    format!(
        "<figure><p><b>{}</b> {}</p>\n<div class=\"{class}\">\n{}</div>\n{legend}{files}</figure>\n",
        escaped(title),
        escaped(subtitle),
        panels.iter().map(panel).collect::<String>()
    )
}

/// A figure and a table that says the same in figures, beside each other where there is room.
pub(crate) fn beside(figure: &str, table: &str) -> String {
    format!("<div class=\"beside\">\n{figure}<div>{table}</div></div>\n")
}

/// Notes as a list. A part between `**` is bold.
pub(crate) fn notes<'a>(notes: impl IntoIterator<Item = &'a str>) -> String {
    let bold = |(place, part): (usize, &str)| {
        if place % 2 == 1 { format!("<b>{part}</b>") } else { part.to_owned() }
    };
    let item = |note: &str| {
        let note = escaped(note).into_owned();
        format!("<li>{}</li>\n", note.split("**").enumerate().map(bold).collect::<String>())
    };
    format!("<ul class=\"notes\">\n{}</ul>\n", notes.into_iter().map(item).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_has_its_panels_one_legend_and_links_to_its_files() {
        let panel = |caption: &str| (caption.to_owned(), Sheet::labelled((300, 200), "error"));
        let parts = FigureParts {
            title: "Error".to_owned(),
            subtitle: "a < b".to_owned(),
            panels: vec![panel("mATE"), panel("")],
            legend: vec![(Sheet::new(30, 20), "ours".to_owned())],
            layout: Layout::Columns,
        };
        let html = figure(&parts, Some("error"));
        assert_eq!(html.matches("<svg ").count(), 2 + 1, "{html}");
        assert_eq!(html.matches("role=\"img\" aria-label=\"error\"").count(), 2);
        for part in [
            "<p>mATE</p>",
            "a &lt; b",
            "</svg>ours</li>",
            "href=\"plots/error.svg\"",
            "href=\"plots/error.pdf\"",
        ] {
            assert!(html.contains(part), "{part} in {html}");
        }
        assert!(!figure(&parts, None).contains("href"));
    }

    #[test]
    fn the_verdict_is_escaped_and_has_its_colour() {
        let html = verdict_html(false, "Not passed", &["a < b".to_owned()]);
        assert!(html.contains("verdict bad") && html.contains("a &lt; b"), "{html}");
    }

    #[test]
    fn the_head_links_to_every_section_and_the_foot_says_what_wrote_the_page() {
        let sections = ["a", "b"].map(|id| Section::new(id, &format!("Part <{id}>"), String::new()));
        let html = page("Title", "<p>top</p>", &sections);
        for part in ["<a href=\"#a\">Part &lt;a&gt;</a>", "<h2 id=\"b\">Part &lt;b&gt;</h2>", version::LONG] {
            assert!(html.contains(part), "{part} in {html}");
        }
        let at: Timestamp = "2026-11-29T02:03:59Z".parse().unwrap();
        let foot = footer("lab tables --x <y>", at);
        assert!(
            foot.contains("<code>lab tables --x &lt;y&gt;</code>") && foot.contains("2026-11-29 02:03 UTC")
        );
    }

    #[test]
    fn nothing_is_cut_off_on_paper_or_on_a_telephone() {
        let print = STYLE.split("@media print").nth(1).unwrap();
        assert!(print.contains("overflow: visible") && print.contains("table { font-size"));
        assert!(STYLE.contains("white-space: pre-wrap") && STYLE.contains("minmax(min(100%, 320px), 1fr)"));
    }

    #[test]
    fn notes_are_a_list() {
        assert_eq!(notes(["**a** < b"]), "<ul class=\"notes\">\n<li><b>a</b> &lt; b</li>\n</ul>\n");
    }
}
