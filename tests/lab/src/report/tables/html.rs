//! The report as a self-contained page.

use crate::report::page::{Section, figure, notes, page};
use crate::report::table::escaped;
use crate::report::tables::figures::{Figure, kinds};
use crate::report::tables::kind::Table;
use crate::report::tables::published::FOOTNOTES;
use crate::report::tables::results::Tables;
use crate::report::tables::text;
use crate::report::tables::verdict::verdict;
use crate::score::keyframes::counting::{Counting, Subset};

/// Highlighted rows.
const MARKED: [&str; 1] = ["ours"];

/// The page.
pub(crate) fn html(tables: &Tables, figures: &[Figure]) -> String {
    let headline = escaped(&text::headline(tables)).replace('\n', "</p>\n<p>");
    let top = format!(
        "{}<p>{headline}</p>\n<p>A bar reaches one standard deviation over frames to either side; an open diamond is the \
         paper's value. All rows: <a href=\"tables.csv\">tables.csv</a>, <a href=\"tables.json\">tables.json</a>, <a \
         href=\"tables.tex\">tables.tex</a>.</p>\n",
        verdict(tables),
    );
    let mut sections: Vec<Section> =
        kinds(tables).into_iter().map(|kind| section(tables, kind, figures)).collect();
    let unmatched = format!("<p>Where the paper cannot be matched:</p>\n{}", notes(FOOTNOTES));
    sections.push(Section::new("notes", "Notes", unmatched));
    page("Late fusion of two agents: tables and figures", &top, &sections)
}

fn section(tables: &Tables, kind: Table, figures: &[Figure]) -> Section {
    let title = kind.title();
    let name = title.split(':').next().unwrap_or_default().to_owned();
    let of_kind = figures.iter().filter(|one| one.table == kind);
    let mut page: String = of_kind.map(|one| figure(&one.parts, Some(&one.name))).collect();
    for block in tables.blocks.iter().filter(|block| block.table == kind) {
        page += &format!("<h3>{}</h3>\n", escaped(&text::heading(block)));
        page += &text::table(tables, block, (Subset::All, Counting::Table)).html(&MARKED);
        page.extend(text::further(tables, block).iter().map(|further| further.html(&MARKED)));
        let gains = text::gain_lines(tables, block);
        if !gains.is_empty() {
            page += &format!("<pre>{}</pre>\n", escaped(&gains));
        }
        for (what, name) in text::parts_of(block) {
            let table = text::table(tables, block, *what).html(&MARKED);
            page += &format!("<details><summary>{}</summary>\n{table}</details>\n", escaped(name));
        }
    }
    Section { id: kind.stem().to_owned(), name, title, html: page }
}
