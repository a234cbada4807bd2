//! Table II in LaTeX, in the paper's layout (booktabs, multirow).

use crate::data::noise::NoisePair;
use crate::report::tables::kind::Table;
use crate::report::tables::results::Tables;
use crate::report::tables::rows::Row;
use crate::score::keyframes::counting::{Counting, Subset};
use crate::score::keyframes::metrics::Value;

/// The table; best values are bold.
pub(crate) fn latex(tables: &Tables) -> String {
    let mut text = String::from(
        "% lab tables; needs \\usepackage{booktabs,multirow}\n\
         \\begin{tabular}{lllccccc}\n\\toprule\n\
         \\textbf{Detector 1} & \\textbf{Detector 2} & \\textbf{Method} & \\textbf{mATE (m)} & \\textbf{mADE (m)} & \
         \\textbf{mAOE (deg)} & \\textbf{Precision} & \\textbf{Recall} \\\\\n",
    );
    for block in tables.blocks.iter().filter(|block| block.table == Table::II) {
        let is_shown = |row: &&Row| row.subset == Subset::All && row.counting == Counting::Table;
        let rows: Vec<&Row> = tables.rows_of(block).filter(is_shown).collect();
        text += "\\midrule\n";
        for (place, row) in rows.iter().enumerate() {
            let detectors =
                if place == 0 { detectors(block.setting.noise, rows.len()) } else { " & ".to_owned() };
            text += &format!("{detectors} & \\texttt{{{}}} & {} \\\\\n", row.method, figures(row, &rows));
        }
    }
    text + "\\bottomrule\n\\end{tabular}\n"
}

fn detectors(noise: NoisePair, n_rows: usize) -> String {
    let name = |level: Option<&str>| {
        format!("\\multirow{{{n_rows}}}{{*}}{{Noise {}}}", level.unwrap_or_default().trim_start_matches('N'))
    };
    let mut levels = noise.name().split('-');
    format!("{} & {}", name(levels.next()), name(levels.next()))
}

fn figures(row: &Row, rows: &[&Row]) -> String {
    let figure = |metric: usize| {
        let is_error = metric < 3;
        let text = figure(&row.metrics.0[metric], is_error);
        let shown = |row: &Row| figure_mean(&row.metrics.0[metric], is_error);
        let others = rows.iter().filter_map(|row| row.metrics.0[metric].mean);
        let best = others.fold(None, |best: Option<f64>, value| {
            Some(best.map_or(value, |best| if is_error { best.min(value) } else { best.max(value) }))
        });
        // All values that are printed like the best one are bold.
        let is_best = best.is_some_and(|best| {
            shown(row) == figure_mean(&Value { mean: Some(best), ..Value::default() }, is_error)
        });
        if is_best { format!("$\\mathbf{{{text}}}$") } else { format!("${text}$") }
    };
    (0..5).map(figure).collect::<Vec<_>>().join(" & ")
}

fn figure_mean(value: &Value, is_error: bool) -> String {
    match value.mean {
        Some(mean) if is_error => format!("{mean:.2}"),
        Some(mean) => format!("{:.2}", 100.0 * mean),
        None => "-".to_owned(),
    }
}

fn figure(value: &Value, is_error: bool) -> String {
    match value.std {
        Some(std) if is_error => format!("{} \\pm {std:.2}", figure_mean(value, is_error)),
        _ => figure_mean(value, is_error),
    }
}
