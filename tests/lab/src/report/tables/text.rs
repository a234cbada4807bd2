//! The tables as text: terminal and Markdown.

use crate::data::noise::Shape;
use crate::drive::keyframes::setting::Setting;
use crate::report::table::Table;
use crate::report::tables::gain::gains;
use crate::report::tables::kind::Table as Kind;
use crate::report::tables::moment;
use crate::report::tables::published::FOOTNOTES;
use crate::report::tables::results::Tables;
use crate::report::tables::rows::Row;
use crate::report::tables::study::Block;
use crate::score::bootstrap::Ratio;
use crate::score::keyframes::counting::{Counting, Subset};
use crate::score::keyframes::trackers::TrackerScore;
use v2x_fusion_hub::parameters;

/// Metrics and their digits.
pub(crate) const COLUMNS: [(&str, usize); 5] =
    [("mATE m", 3), ("mADE m", 3), ("mAOE °", 2), ("precision", 4), ("recall", 4)];

impl Kind {
    /// Its heading.
    pub fn title(self) -> String {
        let text = match self {
            Self::II => "Table II: late fusion methods",
            Self::III => "Table III: one agent against two",
            Self::IV => "Table IV: others' metrics (first boxes) against the paper's",
            Self::Fig3 => "Fig. 3: errors by category",
            Self::Fig4 => "Fig. 4: what association does",
            Self::Fig5 => "Fig. 5: one moment under each method",
            Self::Robustness => "Robustness: errors of other shapes",
            Self::Nees => "Claimed accuracies: squared errors over variances, per degree of freedom",
            Self::Ablation => "Ours without its parts",
            Self::Sensors => {
                "Sensors: detection probability 0.9, 0.5 false reports a frame, partly overlapping views"
            }
        };
        text.to_owned()
    }
}

/// For a terminal: aligned, the paper's counting, all objects.
pub(crate) fn terminal(tables: &Tables) -> String {
    let mut parts = vec![headline(tables)];
    for block in &tables.blocks {
        parts.push(format!(
            "{}\n{}",
            heading(block),
            table(tables, block, (Subset::All, Counting::Table)).text()
        ));
        parts.extend(further(tables, block).iter().map(Table::text));
        parts.push(gain_lines(tables, block));
    }
    parts.push(notes());
    joined(parts)
}

/// As Markdown, with the subsets.
pub(crate) fn markdown(tables: &Tables) -> String {
    let mut parts = vec!["# Tables".to_owned(), headline(tables)];
    for block in &tables.blocks {
        parts.push(format!("## {}", heading(block)));
        parts.push(table(tables, block, (Subset::All, Counting::Table)).markdown());
        parts.extend(further(tables, block).iter().map(Table::markdown));
        parts.push(gain_lines(tables, block));
        for (what, name) in parts_of(block) {
            parts.push(format!("### {}, {name}", heading(block)));
            parts.push(table(tables, block, *what).markdown());
        }
    }
    parts.push(notes());
    joined(parts) + "\n"
}

/// Further parts of a block, with names.
pub(crate) fn parts_of(block: &Block) -> &'static [((Subset, Counting), &'static str)] {
    match block.table {
        Kind::II => &[
            ((Subset::Static, Counting::Table), "standing objects"),
            ((Subset::Moving, Counting::Table), "moving objects"),
            ((Subset::All, Counting::Printed), "counted as the paper prints its formula (over all boxes)"),
        ],
        _ => &[],
    }
}

fn joined(mut parts: Vec<String>) -> String {
    parts.retain(|part| !part.is_empty());
    parts.iter().map(|part| part.trim_end()).collect::<Vec<_>>().join("\n\n")
}

pub(crate) fn heading(block: &Block) -> String {
    let Setting { noise, shape, .. } = block.setting;
    let shape = if shape == Shape::Gaussian { String::new() } else { format!(", {}", shape.name()) };
    format!("{}, {}{shape}", block.table.title(), noise.name())
}

pub(crate) fn headline(tables: &Tables) -> String {
    let plan = &tables.plan;
    format!(
        "{}: {}\n{} trials, seed {}; errors of all boxes over true positives, mean ± standard deviation over frames; \
         the paper's value and ours less the paper's beside it. The engine's parameters are those of {}.",
        tables.dataset,
        tables.statistics.text(),
        plan.trials,
        plan.seed,
        parameters::DATE,
    )
}

pub(crate) fn table(tables: &Tables, block: &Block, what: (Subset, Counting)) -> Table {
    match block.table {
        Kind::Fig3 | Kind::Nees => by_class(tables, block),
        Kind::Sensors => of_trackers(tables, block, what),
        // The methods' figures over the whole set are no part of the picture.
        Kind::Fig5 => moment::table(tables.shown.as_ref()),
        _ => by_method(tables, block, what),
    }
}

fn by_method(tables: &Tables, block: &Block, (subset, counting): (Subset, Counting)) -> Table {
    let has_countings = block.table == Kind::IV;
    let mut header = vec!["method".to_owned()];
    if has_countings {
        header.push("counting".to_owned());
    }
    for (place, (name, _)) in COLUMNS.into_iter().enumerate() {
        let columns = [name, "paper", "diff"];
        header.extend(columns[..n_columns(place)].iter().map(|name| (*name).to_owned()));
    }
    header.push("given".to_owned());
    let is_shown = |row: &&Row| {
        let is_other = has_countings && row.counting == Counting::FirstBoxes;
        row.subset == subset && (row.counting == counting || is_other)
    };
    let row = |row: &Row| {
        let mut cells = cells(row);
        if has_countings {
            cells.insert(1, row.counting.name().to_owned());
        }
        cells
    };
    Table { header, rows: tables.rows_of(block).filter(is_shown).map(row).collect() }
}

/// Columns of a metric: the value, the paper's, and for errors the difference.
const fn n_columns(metric: usize) -> usize {
    if metric < 3 { 3 } else { 2 }
}

fn figure(value: Option<f64>, digits: usize) -> String {
    value.map_or("–".to_owned(), |value| format!("{value:.digits$}"))
}

fn cells(row: &Row) -> Vec<String> {
    let mut cells = vec![row.method.clone()];
    for (place, ((_, digits), value)) in COLUMNS.into_iter().zip(row.metrics.0).enumerate() {
        let coarse = digits - 1;
        // Precision and recall vary little. Their deviation over frames is in the files.
        let own = match (value.mean, value.std) {
            (Some(mean), Some(std)) if place < 3 => format!("{mean:.digits$}±{std:.coarse$}"),
            (mean, _) => figure(mean, digits),
        };
        let paper = row.paper.0[place];
        let difference = value.mean.zip(paper).map(|(own, paper)| own - paper);
        let difference = difference.map_or("–".to_owned(), |value| format!("{value:+.digits$}"));
        cells.extend([own, figure(paper, digits), difference].into_iter().take(n_columns(place)));
    }
    cells.push(if row.inputs.is_empty() { "–".to_owned() } else { row.inputs.clone() });
    cells
}

/// What follows a block's table where detectors err as real ones do: how well its methods track and detect.
pub(crate) fn further(tables: &Tables, block: &Block) -> Vec<Table> {
    if !block.has_trackers() {
        return Vec::new();
    }
    let table = |names: &[&str], cells: fn(&TrackerScore) -> Vec<String>| {
        let header = std::iter::once("method").chain(names.iter().copied()).map(str::to_owned).collect();
        let is_shown = |row: &&Row| row.subset == Subset::All && row.counting == Counting::Table;
        let line = |row: &Row| std::iter::once(row.method.clone()).chain(cells(&row.tracker)).collect();
        Table { header, rows: tables.rows_of(block).filter(is_shown).map(line).collect() }
    };
    let detection = table(&DETECTION, detection);
    // The table of sensors has tracking metrics beside its errors.
    if block.table == Kind::Sensors { vec![detection] } else { vec![table(&TRACKING, tracking), detection] }
}

const TRACKING: [&str; 7] = ["GOSPA m", "HOTA", "AssA", "MOTA", "IDF1", "switches", "AMOTA"];

fn tracking(score: &TrackerScore) -> Vec<String> {
    let mut cells = vec![figure(score.gospa_m, 2)];
    cells.extend([score.hota, score.assa, score.mota, score.idf1].map(|value| figure(value, 3)));
    cells.extend([figure(score.id_switches, 0), figure(score.amota, 3)]);
    cells
}

/// AP at overlaps (OpenCOOD) and at distances (nuScenes), and the parts of NDS.
const DETECTION: [&str; 13] = [
    "AP IoU .3",
    "IoU .5",
    "IoU .7",
    "AP 0.5 m",
    "1 m",
    "2 m",
    "4 m",
    "mAP",
    "ATE m",
    "ASE",
    "AOE rad",
    "AVE m/s",
    "NDS",
];

fn detection(score: &TrackerScore) -> Vec<String> {
    let values = [
        score.ap_iou_30,
        score.ap_iou_50,
        score.ap_iou_70,
        score.ap_05_m,
        score.ap_1_m,
        score.ap_2_m,
        score.ap_4_m,
        score.map,
        score.nuscenes_ate_m,
        score.nuscenes_ase,
        score.nuscenes_aoe_rad,
        score.nuscenes_ave_mps,
        score.nds_without_attributes,
    ];
    values.map(|value| figure(value, 3)).to_vec()
}

/// Errors and tracking metrics. The paper has no such table.
fn of_trackers(tables: &Tables, block: &Block, (subset, counting): (Subset, Counting)) -> Table {
    let errors = COLUMNS.into_iter().map(|(name, _)| name);
    let header = std::iter::once("method").chain(errors).chain(TRACKING).map(str::to_owned).collect();
    let is_shown = |row: &&Row| row.subset == subset && row.counting == counting;
    let line = |row: &Row| {
        let mut cells = vec![row.method.clone()];
        let errors = COLUMNS.into_iter().zip(row.metrics.0);
        cells.extend(errors.map(|((_, digits), value)| figure(value.mean, digits)));
        cells.extend(tracking(&row.tracker));
        cells
    };
    Table { header, rows: tables.rows_of(block).filter(is_shown).map(line).collect() }
}

/// A row for each class, columns for each method.
fn by_class(tables: &Tables, block: &Block) -> Table {
    let rows: Vec<&Row> = tables.rows_of(block).collect();
    let mut classes: Vec<_> = rows.iter().filter_map(|row| row.class).collect();
    classes.sort_unstable();
    classes.dedup();
    let mut header = vec!["category".to_owned()];
    for contender in &block.contenders {
        let names: &[&str] =
            if block.table == Kind::Fig3 { &["mATE m", "mAOE °"] } else { &["position", "yaw", "size"] };
        header.extend(names.iter().map(|name| format!("{} {name}", contender.key())));
    }
    let line = |class| {
        let mut cells = vec![format!("{class}")];
        for contender in &block.contenders {
            let row = rows.iter().find(|row| row.class == Some(class) && row.method == contender.key());
            let error = |place: usize| row.and_then(|row| row.metrics.0[place].mean);
            let nees = row.map(|row| row.nees).unwrap_or_default();
            if block.table == Kind::Fig3 {
                cells.extend([figure(error(0), 3), figure(error(2), 2)]);
            } else {
                let figures = [nees.nees_position, nees.nees_yaw, nees.nees_size];
                cells.extend(figures.map(|value| figure(value, 2)));
            }
        }
        cells
    };
    Table { header, rows: classes.into_iter().map(line).collect() }
}

/// What is said below a block's table: for Table II the gain of ours over least squares, alone and filtered, for all
/// objects and for subsets.
pub(crate) fn gain_lines(tables: &Tables, block: &Block) -> String {
    if block.table == Kind::Fig5 {
        return tables.shown.iter().map(moment::which).collect();
    }
    let trackers = block.has_trackers().then(|| TRACKERS.to_owned());
    let gains = if block.table == Kind::II { gains_of(tables, block) } else { Vec::new() };
    gains.into_iter().chain(trackers).collect::<Vec<_>>().join("\n")
}

const TRACKERS: &str = "Methods without memory name every box anew in every frame: of them HOTA, AssA, IDF1, switches and AMOTA \
     say only that, and they have no velocity, which is an error of the whole speed. NDS is that of nuScenes without attributes: \
     (5 mAP + Σ max(0, 1 − error)) / 9.";

fn gains_of(tables: &Tables, block: &Block) -> Vec<String> {
    let line = |other: &str, (subset, name): (Subset, &str)| {
        let [ate, ade, aoe] = gains(tables, block.setting, (other, "ours"), subset)?;
        if [ate, ade, aoe].iter().all(|gain| !gain.ratio.is_finite()) {
            // No such objects.
            return None;
        }
        let figure = |Ratio { ratio, low, high }| {
            if ratio.is_finite() { format!("{ratio:.2}× [{low:.2}, {high:.2}]") } else { "–".to_owned() }
        };
        Some(format!(
            "ours over {other}, {name}: mATE {}, mADE {}, mAOE {} (95 %, bootstrap over scenes)",
            figure(ate),
            figure(ade),
            figure(aoe)
        ))
    };
    let subsets = [(Subset::All, "all objects"), (Subset::Static, "standing"), (Subset::Moving, "moving")];
    let lines = subsets.map(|subset| line("csba-wls", subset));
    let filtered = line("csba-wls-cv", subsets[0]);
    lines.into_iter().chain([filtered]).flatten().collect()
}

pub(crate) fn notes() -> String {
    let notes: Vec<String> = FOOTNOTES.iter().map(|note| format!("- {note}")).collect();
    format!("Where the paper cannot be matched:\n\n{}", notes.join("\n"))
}
