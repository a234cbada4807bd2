//! The report: one page that needs nothing else.

use super::Tables;
use super::figures::{Figure, kinds};
use super::rows::Table;
use super::text;
use crate::protocol::counting::{Counting, Subset};
use crate::report::table::escaped;

/// Rows that stand out.
const MARKED: [&str; 2] = ["csba-wls", "ours"];

const STYLE: &str = "\
:root { color-scheme: light; }
body { font: 15px/1.5 system-ui, sans-serif; color: #222; background: #fff; margin: 0 auto; max-width: 1500px; padding: 1rem 1.5rem 4rem; }
h1 { font-size: 1.7rem; } h2 { font-size: 1.3rem; margin-top: 2.5rem; border-bottom: 2px solid #0072b2; }
h3 { font-size: 1.05rem; margin-bottom: .3rem; }
nav a { margin-right: 1rem; } a { color: #0072b2; }
.table { overflow-x: auto; } table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; }
th, td { padding: 2px 9px; text-align: right; white-space: nowrap; border-bottom: 1px solid #e4e4e4; }
th:first-child, td:first-child { text-align: left; position: sticky; left: 0; background: #fff; }
thead th { border-bottom: 2px solid #888; } tr.marked td { background: #eaf3fa; font-weight: 600; }
figure { margin: 1rem 0; overflow-x: auto; } figcaption { font-size: 13px; color: #555; }
pre { background: #f5f6f8; padding: .6rem .8rem; overflow-x: auto; font-size: 13px; }
details { margin: .4rem 0; } summary { cursor: pointer; color: #0072b2; }
";

/// The page.
pub(super) fn html(tables: &Tables, figures: &[Figure]) -> String {
    let kinds = kinds(tables);
    let links = kinds.iter().map(|kind| format!("<a href=\"#{}\">{}</a>", kind.stem(), short(*kind)));
    let links: String = links.collect();
    let sections: String = kinds.iter().map(|kind| section(tables, *kind, figures)).collect();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\">\n<title>Late fusion: tables and figures</title>\n\
         <style>\n{STYLE}</style></head>\n<body>\n<h1>Late fusion of two agents: tables and figures</h1>\n\
         <p>{}</p>\n<p>A bar reaches one standard deviation over frames to either side; an open diamond is the \
         paper's value.</p>\n<nav>{links}</nav>\n{sections}<h2>Notes</h2>\n<pre>{}</pre>\n</body>\n</html>\n",
        escaped(&text::headline(tables)),
        escaped(&text::notes()),
    )
}

fn short(kind: Table) -> String {
    let title = kind.title();
    escaped(title.split(':').next().unwrap_or_default()).into_owned()
}

fn section(tables: &Tables, kind: Table, figures: &[Figure]) -> String {
    let mut page = format!("<h2 id=\"{}\">{}</h2>\n", kind.stem(), escaped(&kind.title()));
    for figure in figures.iter().filter(|figure| figure.table == kind) {
        let (svg, name) = (figure.plot.sheet().svg(), &figure.name);
        page += &format!(
            "<figure>\n{svg}<figcaption>plots/{name}.svg, <a href=\"plots/{name}.pdf\">plots/{name}.pdf</a>\
             </figcaption></figure>\n"
        );
    }
    for block in tables.blocks.iter().filter(|block| block.table == kind) {
        page += &format!("<h3>{}</h3>\n", escaped(&text::heading(block)));
        page += &text::table(tables, block, (Subset::All, Counting::Table)).html(&MARKED);
        let gains = text::gain_lines(tables, block);
        if !gains.is_empty() {
            page += &format!("<pre>{}</pre>\n", escaped(&gains));
        }
        for (what, name) in text::parts_of(block) {
            let table = text::table(tables, block, *what).html(&MARKED);
            page += &format!("<details><summary>{}</summary>\n{table}</details>\n", escaped(name));
        }
    }
    page
}
