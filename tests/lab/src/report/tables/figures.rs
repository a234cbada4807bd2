//! The figures of the tables.

use crate::data::noise::Shape;
use crate::report::palette::{Colour, SERIES, of_methods};
use crate::report::plot::dots::{Dot, DotPlot, Panel};
use crate::report::plot::figure_parts::FigureParts;
use crate::report::plot::sheet::Sheet;
use crate::report::tables::kind::Table;
use crate::report::tables::moment;
use crate::report::tables::results::Tables;
use crate::report::tables::rows::Row;
use crate::report::tables::study::Block;
use crate::report::tables::text;
use crate::score::keyframes::counting::{Counting, Subset};

/// Metrics with the labels of their axes.
const ERRORS: [(usize, &str); 3] = [(0, "mATE (m)"), (1, "mADE (m)"), (2, "mAOE (°)")];

/// A figure, and the name of its file.
pub(crate) struct Figure {
    pub(crate) table: Table,
    pub(crate) name: String,
    pub(crate) sheet: Sheet,
    /// The same for a page.
    pub(crate) parts: FigureParts,
}

/// All figures, by table.
pub(crate) fn figures(tables: &Tables) -> Vec<Figure> {
    let mut figures: Vec<Figure> = Vec::new();
    for table in kinds(tables) {
        let blocks: Vec<&Block> = tables.blocks.iter().filter(|block| block.table == table).collect();
        match table {
            Table::II | Table::Ablation | Table::Sensors => {
                figures.extend(blocks.iter().map(|block| by_method(tables, block)));
            }
            Table::Fig3 | Table::Nees => figures.extend(blocks.iter().map(|block| by_class(tables, block))),
            Table::III | Table::IV | Table::Fig4 => figures.push(by_block(tables, &blocks)),
            Table::Fig5 => figures.extend(tables.shown.iter().map(|shown| {
                let name = format!("{}-{}", table.stem(), shown.setting.noise.name());
                let comparison = moment::comparison(shown, text::heading(blocks[0]));
                Figure { table, name, sheet: comparison.sheet(), parts: comparison.parts() }
            })),
            Table::Robustness => {
                let noise = |block: &&Block| block.setting.noise;
                figures
                    .extend(blocks.chunk_by(|a, b| noise(a) == noise(b)).map(|part| by_block(tables, part)));
            }
        }
    }
    figures
}

/// The computed tables, in order.
pub(crate) fn kinds(tables: &Tables) -> Vec<Table> {
    let mut kinds: Vec<Table> = tables.blocks.iter().map(|block| block.table).collect();
    kinds.dedup();
    kinds
}

fn figure(block: &Block, name: String, plot: &DotPlot) -> Figure {
    Figure { table: block.table, name, sheet: plot.sheet(), parts: plot.parts() }
}

fn dot(row: &Row, metric: usize) -> Option<Dot> {
    let value = row.metrics.0[metric];
    let spread = value.std.unwrap_or(0.0);
    value.mean.map(|mean| Dot { mean, spread, published: row.paper.0[metric] })
}

/// The row of all objects, with the counting of the paper's tables.
fn row_of<'a>(tables: &'a Tables, block: &'a Block, key: &str) -> Option<&'a Row> {
    let is_it =
        |row: &&Row| row.method == key && row.subset == Subset::All && row.counting == Counting::Table;
    tables.rows_of(block).find(is_it)
}

fn coloured(block: &Block) -> Vec<(String, Colour)> {
    let colours = of_methods(block.contenders.iter().map(|one| one.key()));
    block.contenders.iter().map(|one| one.key().to_owned()).zip(colours).collect()
}

/// A row for each method.
fn by_method(tables: &Tables, block: &Block) -> Figure {
    let rows: Vec<Option<&Row>> =
        block.contenders.iter().map(|one| row_of(tables, block, one.key())).collect();
    let panel = |(metric, label): (usize, &str)| Panel {
        label: label.to_owned(),
        dots: rows.iter().map(|row| vec![row.and_then(|row| dot(row, metric))]).collect(),
    };
    let plot = DotPlot {
        title: text::heading(block),
        categories: block.contenders.iter().map(|one| one.key().to_owned()).collect(),
        series: vec![(String::new(), SERIES[0])],
        panels: ERRORS.map(panel).into(),
    };
    figure(block, format!("{}-{}", block.table.stem(), block.setting.noise.name()), &plot)
}

/// A row for each block, in it a dot for each method.
fn by_block(tables: &Tables, blocks: &[&Block]) -> Figure {
    let first = blocks[0];
    let name = |block: &Block| match (block.table, block.setting.shape) {
        (Table::Robustness, shape) => shape.name().to_owned(),
        (_, Shape::Gaussian) => block.setting.noise.name().to_owned(),
        (_, shape) => format!("{} {}", block.setting.noise.name(), shape.name()),
    };
    let panel = |(metric, label): (usize, &str)| {
        let dots = |block: &&Block| {
            let row = |key: &str| row_of(tables, block, key).and_then(|row| dot(row, metric));
            block.contenders.iter().map(|one| row(one.key())).collect()
        };
        Panel { label: label.to_owned(), dots: blocks.iter().map(dots).collect() }
    };
    let is_robustness = first.table == Table::Robustness;
    let noise = if is_robustness { format!(", {}", first.setting.noise.name()) } else { String::new() };
    let plot = DotPlot {
        title: first.table.title() + &noise,
        categories: blocks.iter().map(|block| name(block)).collect(),
        series: coloured(first),
        panels: ERRORS.map(panel).into(),
    };
    figure(first, first.table.stem().to_owned() + &noise.replace(", ", "-"), &plot)
}

/// A row for each class, in it a dot for each method.
fn by_class(tables: &Tables, block: &Block) -> Figure {
    let rows: Vec<&Row> = tables.rows_of(block).collect();
    let mut classes: Vec<_> = rows.iter().filter_map(|row| row.class).collect();
    classes.sort_unstable();
    classes.dedup();
    let panel = |label: &str, dot: &dyn Fn(&Row) -> Option<Dot>| {
        let of_class = |class| {
            let find = |key: &str| rows.iter().find(|row| row.class == Some(class) && row.method == key);
            block.contenders.iter().map(|one| find(one.key()).and_then(|row| dot(row))).collect()
        };
        Panel { label: label.to_owned(), dots: classes.iter().copied().map(of_class).collect() }
    };
    let bare = |mean: Option<f64>| mean.map(|mean| Dot { mean, ..Dot::default() });
    let panels = if block.table == Table::Fig3 {
        vec![panel("mATE (m)", &|row| dot(row, 0)), panel("mAOE (°)", &|row| dot(row, 2))]
    } else {
        vec![
            panel("position", &|row| bare(row.nees.nees_position)),
            panel("heading", &|row| bare(row.nees.nees_yaw)),
            panel("size", &|row| bare(row.nees.nees_size)),
        ]
    };
    let categories = classes.iter().map(ToString::to_string).collect();
    let plot = DotPlot { title: text::heading(block), categories, series: coloured(block), panels };
    figure(block, format!("{}-{}", block.table.stem(), block.setting.noise.name()), &plot)
}
