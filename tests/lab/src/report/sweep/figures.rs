//! The figures of a sweep.

use crate::drive::sweep::method::SweepMethod;
use crate::report::palette::{Colour, OURS, SERIES, is_ours};
use crate::report::plot::curves::{CurvePlot, Panel, Point, Style, Top};
use crate::report::plot::marker::Marker;
use crate::report::sweep::results::Results;
use crate::report::sweep::rows::{Row, mean_distribution};
use crate::report::sweep::text::{Family, families};
use crate::score::sweep::record::{PERCENTS, Record, Subset};

/// A figure, and the name of its file.
pub(crate) struct Figure {
    pub(crate) name: &'static str,
    pub(crate) plot: CurvePlot,
}

/// Dashes by family. Methods have the same colour in all families, and no two of twenty families the same dashes and marks.
const DASHES: [f64; 4] = [0.0, 7.0, 4.0, 2.0];

/// A quantity and its label.
type Quantity = (&'static str, fn(&Row) -> Option<(f64, f64)>, Top);

/// Dash and marker of the curves at one place in a list.
const fn line(place: usize) -> (f64, Marker) {
    (DASHES[place % DASHES.len()], Marker::ALL[place % Marker::ALL.len()])
}

fn bare(value: Option<f64>) -> Option<(f64, f64)> {
    value.map(|value| (value, 0.0))
}

const MATE: Quantity =
    ("mATE (m)", |row| row.mate_m.map(|m| (m, row.mate_trial_std.unwrap_or(0.0))), Top::Most);
const MAOE: Quantity = ("mAOE (°)", |row| bare(row.maoe_deg), Top::Most);

/// All figures of these results. Results of virtual time and of the network are in the same figures.
pub(crate) fn figures(rows: &[Row], results: &[Results]) -> Vec<Figure> {
    let families = families(rows);
    let Some(plan) = results.first().map(|results| &results.plan) else { return Vec::new() };
    let axis = &plan.axes[0];
    let is_numeric = axis.values.iter().all(|value| value.text.parse::<f64>().is_ok());
    let x_names = (!is_numeric).then(|| axis.values.iter().map(|value| value.text.clone()).collect());
    let plot = |title: &str, subset: Subset, quantities: &[Quantity]| CurvePlot {
        title: title.to_owned(),
        subtitle: constants(&families),
        x_label: axis.label.clone(),
        x_names: x_names.clone(),
        styles: styles(&families),
        panels: quantities.iter().map(|quantity| panel(&families, subset, *quantity)).collect(),
    };
    let errors = |subset, title: &str| plot(title, subset, &[MATE, MAOE]);
    let mut figures = vec![
        Figure { name: "error", plot: errors(Subset::All, "Error, all objects") },
        Figure { name: "error-moving", plot: errors(Subset::Moving, "Error, objects that move") },
        Figure { name: "error-fast", plot: errors(Subset::Fast, "Error, objects faster than 3 m/s") },
    ];
    let found: [Quantity; 3] = [
        ("precision", |row| bare(row.precision), Top::At(1.0)),
        ("recall", |row| bare(row.recall), Top::At(1.0)),
        ("GOSPA (m)", |row| bare(row.gospa_m), Top::Whole),
    ];
    figures.push(Figure { name: "found", plot: plot("What is found", Subset::All, &found) });
    let fates: [Quantity; 3] = [
        ("late, share", |row| bare(row.late), Top::At(1.0)),
        ("rolled back for, share", |row| bare(row.rolled_back), Top::At(1.0)),
        ("refused, share", |row| bare(row.refused), Top::At(1.0)),
    ];
    figures.push(Figure {
        name: "frames",
        plot: plot("Outcome of the other agents' frames", Subset::All, &fates),
    });
    let consistency: [Quantity; 2] = [
        ("position NEES / 2 (1 is consistent)", |row| bare(row.nees_position), Top::Most),
        ("NIS / 2 of what was associated", |row| bare(row.nis), Top::Whole),
    ];
    figures.push(Figure { name: "consistency", plot: plot("Consistency", Subset::All, &consistency) });
    let stages: [Quantity; 4] = [
        (
            "capture → send, median (ms)",
            |row| bare(row.capture_to_send_ms.map(|stage| stage.p50)),
            Top::Whole,
        ),
        ("send → arrive, median (ms)", |row| bare(row.send_to_arrive_ms.map(|stage| stage.p50)), Top::Whole),
        (
            "arrive → fused, median (ms)",
            |row| bare(row.arrive_to_fused_ms.map(|stage| stage.p50)),
            Top::Whole,
        ),
        (
            "fused → consumed, median (ms)",
            |row| bare(row.fused_to_consumed_ms.map(|stage| stage.p50)),
            Top::Whole,
        ),
    ];
    figures.push(Figure { name: "stages", plot: plot("Stage by stage", Subset::All, &stages) });
    if rows.iter().any(|row| row.cpu_share.is_some()) {
        let load: [Quantity; 1] = [("share of a core", |row| bare(row.cpu_share), Top::Whole)];
        figures
            .push(Figure { name: "processor", plot: plot("The hub's processor time", Subset::All, &load) });
    }
    figures.push(Figure { name: "age", plot: ages(results) });
    if bytes_differ(rows) {
        figures.push(Figure { name: "bytes", plot: bytes(&families) });
    }
    figures
}

/// What holds for every family.
fn constants(families: &[Family<'_>]) -> String {
    let Some(first) = families.first() else { return String::new() };
    let parts = first.parts().into_iter().filter(|part| is_constant(families, part));
    parts.collect::<Vec<_>>().join(", ")
}

fn is_constant(families: &[Family<'_>], part: &str) -> bool {
    families.iter().all(|family| family.parts().iter().any(|own| own == part))
}

/// A colour for each method, and a kind of line and mark for each family, which is named by what distinguishes it.
fn styles(families: &[Family<'_>]) -> Vec<Style> {
    let style = |(place, family): (usize, &Family<'_>)| {
        let parts: Vec<String> =
            family.parts().into_iter().filter(|part| !is_constant(families, part)).collect();
        let parts = if parts.is_empty() { String::new() } else { format!(", {}", parts.join(", ")) };
        let (dash, marker) = line(place);
        let styles = family.methods().into_iter().map(move |method| Style {
            name: format!("{method}{parts}"),
            colour: colour(method),
            dash,
            marker,
            is_dotted: family.live,
            is_first: is_ours(method),
            is_marked: true,
        });
        styles.collect::<Vec<_>>()
    };
    families.iter().enumerate().flat_map(style).collect()
}

/// Each method has the same colour in every figure, whichever are compared.
fn colour(method: &str) -> Colour {
    let place = SweepMethod::ALL.into_iter().position(|known| known.key() == method).unwrap_or(0);
    COLOURS[place]
}

/// By method, in their order.
const COLOURS: [Colour; 9] =
    [SERIES[6], SERIES[4], SERIES[5], SERIES[3], SERIES[1], SERIES[2], OURS, SERIES[7], SERIES[0]];

fn panel(families: &[Family<'_>], subset: Subset, (label, value, top): Quantity) -> Panel {
    let curve = |family: &Family<'_>, method: &str| {
        let point = |row: &Row| value(row).map(|(y, spread)| Point { x: row.x, y, spread });
        family.of(method, subset).filter_map(point).collect::<Vec<_>>()
    };
    let curves =
        |family| Family::methods(family).into_iter().map(|method| curve(family, method)).collect::<Vec<_>>();
    // Squared errors over what is promised for them.
    let target = ["NEES", "NIS"].iter().any(|name| label.contains(name)).then_some(1.0);
    Panel {
        label: label.to_owned(),
        curves: families.iter().flat_map(curves).collect(),
        top,
        target,
        levels: vec![],
    }
}

/// Distributions of the age of information at each value, of one method.
fn ages(results: &[Results]) -> CurvePlot {
    let mut styles = Vec::new();
    let mut panels = [Vec::new(), Vec::new()];
    let mut shown = None;
    for results in results {
        let method = results.plan.methods.iter().copied().find(|method| *method == SweepMethod::Ours);
        let Some(method) = method.or_else(|| results.plan.methods.last().copied()) else { continue };
        shown = Some(method);
        let live = if results.plan.live { ", live" } else { "" };
        for (number, place) in results.places.iter().enumerate() {
            let of_method = place.records.iter().find(|(known, _)| *known == method);
            let records: Vec<_> = of_method.iter().flat_map(|(_, records)| records).collect();
            let distributions: [fn(&Record) -> &Vec<f64>; 2] =
                [|record| &record.age_ms, |record| &record.other_age_ms];
            for (curves, of) in panels.iter_mut().zip(distributions) {
                let ages_ms = mean_distribution(&records, of).unwrap_or_default();
                let at =
                    |(percent, x): (&u32, &f64)| Point { x: *x, y: f64::from(*percent) / 100.0, spread: 0.0 };
                curves.push(PERCENTS.iter().zip(&ages_ms).map(at).collect());
            }
            let values: Vec<&str> = place.point.values.iter().map(|value| value.text.as_str()).collect();
            let delta_max_ms = place.point.delta_max_ms;
            let name = format!("{}, Δmax {delta_max_ms} ms{live}", values.join(", "));
            let (dash, marker) = line(number / SERIES.len());
            let dash = if results.plan.live { 3.0 } else { dash };
            let colour = SERIES[number % SERIES.len()];
            styles.push(Style {
                name,
                colour,
                dash,
                marker,
                is_dotted: false,
                is_first: false,
                is_marked: false,
            });
        }
    }
    let labels = ["share of objects at most so old", "the other agents' newest detection in them"];
    let panels = labels.into_iter().zip(panels);
    let panels = panels.map(|(label, curves)| Panel {
        label: label.to_owned(),
        curves,
        top: Top::At(1.0),
        target: None,
        levels: vec![],
    });
    CurvePlot {
        title: "Age of information of a fused object when it is published".to_owned(),
        subtitle: shown.map_or_else(String::new, |method| format!("method {}", method.key())),
        x_label: "age, ms".to_owned(),
        x_names: None,
        styles,
        panels: panels.collect(),
    }
}

/// Whether the bytes of any method differ between values by more than 5 %.
fn bytes_differ(rows: &[Row]) -> bool {
    SweepMethod::ALL.iter().any(|method| {
        let of_method = rows.iter().filter(|row| row.method == method.key()).map(|row| row.bytes_per_s);
        let (low, high) = of_method.fold((f64::MAX, 0.0_f64), |(low, high), b| (low.min(b), high.max(b)));
        high > 1.05 * low
    })
}

/// Error against bytes.
fn bytes(families: &[Family<'_>]) -> CurvePlot {
    let curve = |family: &Family<'_>, method: &str| {
        let point = |row: &Row| row.mate_m.map(|y| Point { x: row.bytes_per_s / 1e3, y, spread: 0.0 });
        let mut points: Vec<Point> = family.of(method, Subset::All).filter_map(point).collect();
        points.sort_unstable_by(|a, b| a.x.total_cmp(&b.x));
        points
    };
    let curves =
        |family| Family::methods(family).into_iter().map(|method| curve(family, method)).collect::<Vec<_>>();
    CurvePlot {
        title: "Error against bytes".to_owned(),
        subtitle: constants(families),
        x_label: "detections that arrive, kB/s".to_owned(),
        x_names: None,
        styles: styles(families),
        panels: vec![Panel {
            label: "mATE (m)".to_owned(),
            curves: families.iter().flat_map(curves).collect(),
            top: Top::Most,
            target: None,
            levels: vec![],
        }],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_has_a_colour_of_its_own_and_ours_that_of_all_figures() {
        assert_eq!(colour(SweepMethod::Ours.key()), OURS);
        let colours: std::collections::BTreeSet<_> =
            SweepMethod::ALL.map(|method| colour(method.key())).into();
        assert_eq!(colours.len(), SweepMethod::ALL.len());
    }

    #[test]
    fn families_look_different_and_only_what_differs_between_them_is_in_their_names() {
        let row = |y: u32| Row {
            method: "ours",
            axis: "latency".to_owned(),
            axis_2: Some("loss".to_owned()),
            y: Some(f64::from(y)),
            y_text: Some(y.to_string()),
            delta_max_ms: 500.0,
            ..Row::default()
        };
        let rows: Vec<Row> = (0..12).map(row).collect();
        let families = families(&rows);
        let styles = styles(&families);
        let drawn: Vec<_> = styles.iter().map(|style| (style.dash.to_bits(), style.marker)).collect();
        for (place, one) in drawn.iter().enumerate() {
            assert!(!drawn[..place].contains(one), "{place}: {one:?}");
        }
        assert_eq!((styles[3].name.as_str(), styles[3].is_first), ("ours, loss 3", true));
        assert_eq!(constants(&families), "Δmax 500 ms, virtual time");
        let one = &families[..1];
        assert_eq!(super::styles(one)[0].name, "ours");
    }

    #[test]
    fn what_is_right_is_marked_where_consistency_is_shown() {
        let target = |label| panel(&[], Subset::All, (label, |_| None, Top::Whole)).target;
        assert_eq!(
            (target("NIS / 2 of what"), target("position NEES / 2"), target("mATE (m)")),
            (Some(1.0), Some(1.0), None)
        );
    }
}
