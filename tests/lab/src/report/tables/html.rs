//! The report as a self-contained page.

use crate::report::page::page;
use crate::report::table::escaped;
use crate::report::tables::figures::{Figure, kinds};
use crate::report::tables::kind::Table;
use crate::report::tables::results::Tables;
use crate::report::tables::text;
use crate::score::keyframes::counting::{Counting, Subset};

/// Highlighted rows.
const MARKED: [&str; 2] = ["csba-wls", "ours"];

/// The page.
pub(crate) fn html(tables: &Tables, figures: &[Figure]) -> String {
    let kinds = kinds(tables);
    let links = kinds.iter().map(|kind| format!("<a href=\"#{}\">{}</a>", kind.stem(), short(*kind)));
    let links: String = links.collect();
    let sections: String = kinds.iter().map(|kind| section(tables, *kind, figures)).collect();
    let body = format!(
        "<h1>Late fusion of two agents: tables and figures</h1>\n\
         <p>{}</p>\n<p>A bar reaches one standard deviation over frames to either side; an open diamond is the \
         paper's value.</p>\n<nav>{links}</nav>\n{sections}<h2>Notes</h2>\n<pre>{}</pre>\n",
        escaped(&text::headline(tables)),
        escaped(&text::notes()),
    );
    page("Late fusion: tables and figures", &body)
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
