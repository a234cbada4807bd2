//! The report as a self-contained page.

use crate::report::page::{page, verdict_html};
use crate::report::palette::is_ours;
use crate::report::table::escaped;
use crate::report::tables::figures::{Figure, kinds};
use crate::report::tables::kind::Table;
use crate::report::tables::results::Tables;
use crate::report::tables::rows::Row;
use crate::report::tables::study::Block;
use crate::report::tables::text;
use crate::score::keyframes::counting::{Counting, Subset};

/// Highlighted rows.
const MARKED: [&str; 1] = ["ours"];

/// The page.
pub(crate) fn html(tables: &Tables, figures: &[Figure]) -> String {
    let kinds = kinds(tables);
    let links = kinds.iter().map(|kind| format!("<a href=\"#{}\">{}</a>", kind.stem(), short(*kind)));
    let links: String = links.collect();
    let sections: String = kinds.iter().map(|kind| section(tables, *kind, figures)).collect();
    let body = format!(
        "<h1>Late fusion of two agents: tables and figures</h1>\n{}\
         <p>{}</p>\n<p>A bar reaches one standard deviation over frames to either side; an open diamond is the \
         paper's value.</p>\n<nav>{links}</nav>\n{sections}<h2>Notes</h2>\n<pre>{}</pre>\n",
        verdict(tables),
        escaped(&text::headline(tables)),
        escaped(&text::notes()),
    );
    page("Late fusion: tables and figures", &body)
}

/// In how many of the settings ours has the least position error, and by how much; empty where it is not compared.
fn verdict(tables: &Tables) -> String {
    let ratios: Vec<f64> = tables.blocks.iter().filter_map(|block| ratio(tables, block)).collect();
    let Some(largest) = ratios.iter().copied().reduce(f64::max) else { return String::new() };
    let least = ratios.iter().copied().fold(largest, f64::min);
    let won = ratios.iter().filter(|ratio| **ratio < 1.0).count();
    let all = ratios.len();
    let word = if won == all { "Ours is the most accurate" } else { "Ours is not always the most accurate" };
    let reasons = format!(
        "least position error in {won} of {all} settings; {least:.2} to {largest:.2} × that of the best other method"
    );
    verdict_html(won == all, word, &reasons)
}

/// The position error of ours over that of the best other method; variants of ours are no others.
fn ratio(tables: &Tables, block: &Block) -> Option<f64> {
    let is_counted =
        |row: &&Row| row.subset == Subset::All && row.counting == Counting::Table && row.class.is_none();
    let errors = || {
        let rows = tables.rows_of(block).filter(is_counted);
        rows.filter_map(|row| Some((row.method.as_str(), row.metrics.0[0].mean?)))
    };
    let ours = errors().find(|(method, _)| is_ours(method))?.1;
    let others = errors().filter(|(method, _)| !method.starts_with("ours")).map(|(_, error)| error);
    others.reduce(f64::min).map(|best| ours / best)
}

fn short(kind: Table) -> String {
    let title = kind.title();
    escaped(title.split(':').next().unwrap_or_default()).into_owned()
}

fn section(tables: &Tables, kind: Table, figures: &[Figure]) -> String {
    let mut page = format!("<h2 id=\"{}\">{}</h2>\n", kind.stem(), escaped(&kind.title()));
    for figure in figures.iter().filter(|figure| figure.table == kind) {
        let (svg, name) = (figure.sheet.svg(), &figure.name);
        page += &crate::report::page::figure(&svg, Some(name));
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
