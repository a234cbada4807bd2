//! The first line of a sweep's report: ours beside the best other method, and beside our own filter without partners.

use crate::drive::sweep::method::SweepMethod;
use crate::report::page::verdict_html;
use crate::report::palette::{is_of_ours, is_ours};
use crate::report::sweep::rows::Row;

/// At how many points ours has the least error; empty where it is not compared.
pub(super) fn verdict(rows: &[Row]) -> String {
    let alone = SweepMethod::SingleOurs.key();
    let over_others = ratios(rows, |method| !is_of_ours(method));
    let over_alone = ratios(rows, |method| method == alone);
    let places = if has_several_parameters(rows) { "combinations" } else { "values" };
    let others = said(&over_others, (places, "the best other method's"));
    let partners = said(&over_alone, (places, &format!("that of our own filter without partners ({alone})")));
    let mut lines: Vec<String> = [others, partners].into_iter().flatten().collect();
    if lines.is_empty() {
        return String::new();
    }
    if over_alone.is_empty() {
        lines.push(format!("What partners add is not in it: {alone} is not among the methods."));
    }
    let all_below = |ratios: &[f64]| ratios.iter().all(|ratio| *ratio < 1.0);
    let (is_best, helps) = (all_below(&over_others), all_below(&over_alone));
    let word = match (over_others.is_empty(), is_best, helps) {
        (true, _, true) => "Partners help",
        (true, _, false) => "Partners do not always help",
        (false, true, true) => "Ours is the most accurate",
        (false, true, false) => "Ours is the most accurate, but partners do not always help",
        (false, false, _) => "Ours is not always the most accurate",
    };
    verdict_html(is_best && helps, word, &lines)
}

fn said(ratios: &[f64], (places, of_what): (&str, &str)) -> Option<String> {
    let most = ratios.iter().copied().reduce(f64::max)?;
    let least = ratios.iter().copied().fold(most, f64::min);
    let (won, all) = (ratios.iter().filter(|ratio| **ratio < 1.0).count(), ratios.len());
    Some(format!("mATE below {of_what} at {won} of {all} {places}: {least:.2} to {most:.2} ×."))
}

/// Our error over the least of these methods at the same point, where both are there. Virtual time is compared with virtual
/// time, and processes with processes.
fn ratios(rows: &[Row], is_rival: impl Fn(&str) -> bool) -> Vec<f64> {
    let point = |row: &Row| {
        (row.x_text.clone(), row.y.map(f64::to_bits), row.delta_max_ms.to_bits(), row.live, row.axis.clone())
    };
    let all = || rows.iter().filter(|row| row.subset == "all");
    let ratio = |ours: &Row| {
        let rivals = all().filter(|row| is_rival(row.method) && point(row) == point(ours));
        let least = rivals.filter_map(|row| row.mate_m).reduce(f64::min)?;
        Some(ours.mate_m? / least)
    };
    all().filter(|row| is_ours(row.method)).filter_map(ratio).collect()
}

/// Whether a point has more coordinates than the value of one axis.
fn has_several_parameters(rows: &[Row]) -> bool {
    let first = rows.first().map(|row| (row.delta_max_ms.to_bits(), row.live));
    let differs = |row: &Row| Some((row.delta_max_ms.to_bits(), row.live)) != first;
    rows.iter().any(|row| row.axis_2.is_some() || (differs(row) && !row.axis.contains("delta")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(method: &'static str, x_text: &str, mate_m: f64) -> Row {
        let (x_text, axis) = (x_text.to_owned(), "latency".to_owned());
        Row { method, x_text, axis, subset: "all", mate_m: Some(mate_m), ..Row::default() }
    }

    #[test]
    fn ours_is_compared_with_the_best_other_method_and_with_itself_alone() {
        let rows = [
            row("ours", "0", 0.1),
            row("ours-uncorrected", "0", 0.01),
            row("replay", "0", 0.2),
            row("single", "0", 0.4),
            row("single-ours", "0", 0.125),
        ];
        let html = verdict(&rows);
        assert!(html.contains("verdict good"), "{html}");
        assert!(html.contains("below the best other method's at 1 of 1 values: 0.50 to 0.50"), "{html}");
        assert!(html.contains("without partners (single-ours) at 1 of 1 values: 0.80 to 0.80"), "{html}");
        assert!(verdict(&rows[..3]).contains("single-ours is not among the methods"));
        assert_eq!(verdict(&rows[..2]), "", "nothing to compare with");
    }

    #[test]
    fn partners_that_do_not_help_are_not_good_even_where_ours_is_the_most_accurate() {
        let rows = [row("ours", "0", 0.1), row("replay", "0", 0.2), row("single-ours", "0", 0.09)];
        let html = verdict(&rows);
        assert!(html.contains("verdict bad") && html.contains("but partners do not always help"), "{html}");
    }

    #[test]
    fn processes_are_compared_with_processes_only() {
        let live = Row { live: true, ..row("replay", "0", 0.05) };
        let rows = [row("ours", "0", 0.1), row("replay", "0", 0.2), live];
        assert_eq!(ratios(&rows, |method| method == "replay"), [0.5]);
    }

    #[test]
    fn the_points_of_a_grid_are_combinations() {
        let of = |y: f64| Row { axis_2: Some("loss".to_owned()), y: Some(y), ..row("ours", "0", 0.1) };
        let rival = |y: f64| Row { method: "replay", mate_m: Some(0.2 + y), ..of(y) };
        let rows = [of(0.0), of(0.5), rival(0.0), rival(0.5)];
        assert!(verdict(&rows).contains("2 of 2 combinations: 0.14 to 0.50"), "{}", verdict(&rows));
    }
}
