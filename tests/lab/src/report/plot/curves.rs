//! Curves over a common axis, in panels side by side, with a legend beside them.

use crate::report::palette::{Colour, FAINT, INK, MUTED, PAPER};
use crate::report::plot::dots::text;
use crate::report::plot::figure_parts::{FigureParts, Layout};
use crate::report::plot::marker::Marker;
use crate::report::plot::sheet::{Anchor, Paint, Rect, Sheet, corners};
use crate::report::plot::ticks::{Ticks, ticks};

const PANEL_WIDTH: f64 = 330.0;
const PANEL_HEIGHT: f64 = 260.0;
const GAP: f64 = 62.0;
const LEFT: f64 = 62.0;
const TOP: f64 = 76.0;
/// Above and below a panel that is a drawing of its own.
const SINGLE_TOP: f64 = 26.0;
const BOTTOM: f64 = 46.0;
const CHARACTER: f64 = 6.6;
const LEGEND_LINE: f64 = 19.0;
/// Curves are cut off at this multiple of the median of all points: a diverging curve would flatten all others.
const CUT_AT_MEDIANS: f64 = 4.0;
/// Curves with more points have no marks.
const MOST_MARKS: usize = 15;
/// The pointer need not be nearer to a point, px.
const REACH: f64 = 7.0;

/// How a curve is drawn.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Style {
    /// Name in the legend.
    pub name: String,
    /// Its colour.
    pub colour: Colour,
    /// Length of its dashes; 0 for a solid line.
    pub dash: f64,
    /// The mark of its points.
    pub marker: Marker,
    /// Whether only its points are marked, without a line between them.
    pub is_dotted: bool,
    /// Whether it is thicker than others, and over them.
    pub is_first: bool,
    /// Whether its points are marked, where they are few.
    pub is_marked: bool,
}

/// A point with its interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Point {
    /// Coordinate on the level axis.
    pub x: f64,
    /// The value.
    pub y: f64,
    /// Half of the length of its bar.
    pub spread: f64,
}

/// The end of an upright axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Top {
    /// This value.
    At(f64),
    /// The highest value of all curves.
    Whole,
    /// A multiple of the median: diverging curves are cut off.
    Most,
}

/// One quantity.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Panel {
    /// Label of its upright axis.
    pub label: String,
    /// By style.
    pub curves: Vec<Vec<Point>>,
    /// The end of its upright axis.
    pub top: Top,
    /// The value that is right, as a dashed line.
    pub target: Option<f64>,
    /// Values that hold for the whole width, as dashed lines in the colours of these styles.
    pub levels: Vec<(usize, f64)>,
}

/// Curves of several quantities.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CurvePlot {
    /// Its heading.
    pub title: String,
    /// What holds for all curves.
    pub subtitle: String,
    /// Label of the level axis.
    pub x_label: String,
    /// Names of the values on the level axis, where they are no numbers.
    pub x_names: Option<Vec<String>>,
    /// The styles of the curves.
    pub styles: Vec<Style>,
    /// The quantities.
    pub panels: Vec<Panel>,
}

impl CurvePlot {
    /// The finished drawing.
    pub(crate) fn sheet(&self) -> Sheet {
        let longest = self.styles.iter().map(|style| style.name.chars().count()).max().unwrap_or(0);
        let legend = 60.0 + CHARACTER * longest as f64;
        let width = LEFT + (PANEL_WIDTH + GAP) * self.panels.len() as f64 + legend;
        let height = TOP + PANEL_HEIGHT.max(LEGEND_LINE * self.styles.len() as f64) + 56.0;
        let mut sheet = Sheet::labelled((width.ceil() as u32, height.ceil() as u32), &self.title);
        sheet.text((16.0, 26.0), &self.title, text(16.0, true, INK, Anchor::Start));
        sheet.text((16.0, 45.0), &self.subtitle, text(12.0, false, INK, Anchor::Start));
        for (place, panel) in self.panels.iter().enumerate() {
            let x = LEFT + (PANEL_WIDTH + GAP) * place as f64;
            self.draw(&mut sheet, panel, Rect { x, y: TOP, w: PANEL_WIDTH, h: PANEL_HEIGHT });
        }
        for (place, style) in self.styles.iter().enumerate() {
            let y = TOP + 8.0 + LEGEND_LINE * place as f64;
            let x = width - legend;
            style.key(&mut sheet, (x, y));
            sheet.text((x + 34.0, y + 4.0), &style.name, text(12.0, false, INK, Anchor::Start));
        }
        sheet
    }

    /// The panels, each a drawing of its own.
    pub(crate) fn parts(&self) -> FigureParts {
        let area = Rect { x: LEFT - 6.0, y: SINGLE_TOP, w: PANEL_WIDTH, h: PANEL_HEIGHT };
        let size = ((LEFT + PANEL_WIDTH + 12.0) as u32, (SINGLE_TOP + PANEL_HEIGHT + BOTTOM) as u32);
        let panel = |panel: &Panel| {
            let mut sheet = Sheet::labelled(size, &format!("{}: {}", self.title, panel.label));
            self.draw(&mut sheet, panel, area);
            (String::new(), sheet)
        };
        let entry = |style: &Style| {
            let mut mark = Sheet::new(30, 16);
            style.key(&mut mark, (2.0, 8.0));
            (mark, style.name.clone())
        };
        FigureParts {
            title: self.title.clone(),
            subtitle: self.subtitle.clone(),
            panels: self.panels.iter().map(panel).collect(),
            legend: self.styles.iter().map(entry).collect(),
            layout: Layout::Columns,
        }
    }

    fn level_ticks(&self, low: f64, high: f64) -> Vec<(f64, String)> {
        match &self.x_names {
            Some(names) => names.iter().enumerate().map(|(x, name)| (x as f64, name.clone())).collect(),
            None => {
                let ticks = ticks(low, high, 5);
                ticks.values.iter().map(|value| (*value, ticks.label(*value))).collect()
            }
        }
    }

    fn draw(&self, sheet: &mut Sheet, panel: &Panel, area: Rect) {
        let all = || self.panels.iter().flat_map(|panel| panel.curves.iter().flatten());
        let (low, high) = all().fold((f64::MAX, f64::MIN), |(low, high), p| (low.min(p.x), high.max(p.x)));
        let (low, high) = if low < high { (low, high) } else { (low - 0.5, low + 0.5) };
        let level = self.level_ticks(low, high);
        let (low, high) = level.iter().fold((low, high), |(low, high), (x, _)| (low.min(*x), high.max(*x)));
        let upright = panel.upright_ticks();
        let top = upright.values.last().copied().unwrap_or(1.0);
        let px = |x: f64| area.x + area.w * (x - low) / (high - low);
        let py = |y: f64| area.y + area.h * (1.0 - y / top);
        for (x, name) in &level {
            sheet.line(&[(px(*x), area.y), (px(*x), area.y + area.h)], (FAINT, 1.0));
            sheet.text((px(*x), area.y + area.h + 15.0), name, text(11.0, false, MUTED, Anchor::Middle));
        }
        for y in &upright.values {
            sheet.line(&[(area.x, py(*y)), (area.x + area.w, py(*y))], (FAINT, 1.0));
            let at = (area.x - 6.0, py(*y) + 4.0);
            sheet.text(at, &upright.label(*y), text(11.0, false, MUTED, Anchor::End));
        }
        if let Some(target) = panel.target.filter(|target| *target <= top) {
            let y = py(target);
            sheet.dashed(&[(area.x, y), (area.x + area.w, y)], (INK, 1.2), 5.0);
        }
        let x_unit = (&self.x_names, self.x_label.as_str());
        let scales = Scales { x: &px, y: &py, top, y_label: &panel.label, x_label: x_unit };
        for (style, y) in &panel.levels {
            let Some(style) = self.styles.get(*style).filter(|_| *y <= top) else { continue };
            let (left, right) = ((area.x, py(*y)), (area.x + area.w, py(*y)));
            sheet.dashed(&[left, right], (style.colour, 1.6), 5.0);
            let words = format!("{}: {}, mean {}", style.name, quantity(&panel.label).0, short(*y));
            sheet.hover((right.0 - REACH, right.1), REACH, words);
        }
        for is_first in [false, true] {
            let curves = panel.curves.iter().zip(&self.styles);
            for (curve, style) in curves.filter(|(_, style)| style.is_first == is_first) {
                style.draw(sheet, curve, &scales);
            }
        }
        sheet.path(&corners(area), true, Paint::line(MUTED, 1.0));
        let label = text(12.0, true, INK, Anchor::Middle);
        sheet.text((area.x + area.w / 2.0, area.y + area.h + 36.0), &self.x_label, label);
        sheet.text((area.x, area.y - 8.0), &panel.label, text(12.0, true, INK, Anchor::Start));
    }
}

impl Panel {
    fn upright_ticks(&self) -> Ticks {
        let mut values: Vec<f64> =
            self.curves.iter().flatten().map(|p| p.y).filter(|y| y.is_finite()).collect();
        values.sort_unstable_by(f64::total_cmp);
        let reach = values.last().copied().unwrap_or(1.0);
        let median = values.get(values.len() / 2).copied().unwrap_or(1.0);
        let high = match self.top {
            Top::At(top) => top,
            Top::Whole => reach,
            Top::Most => reach.min(CUT_AT_MEDIANS * median),
        };
        let levels = self.levels.iter().map(|(_, y)| *y);
        let high = levels.chain(self.target).fold(high, f64::max);
        ticks(0.0, if high > 0.0 { high } else { 1.0 }, 5)
    }
}

/// From data to the sheet.
struct Scales<'a> {
    x: &'a dyn Fn(f64) -> f64,
    y: &'a dyn Fn(f64) -> f64,
    /// The upper border, in data.
    top: f64,
    /// Labels of the axes, for what appears under the pointer.
    y_label: &'a str,
    x_label: (&'a Option<Vec<String>>, &'a str),
}

impl Scales<'_> {
    /// A point of a curve in words: quantity, value, unit, and where.
    fn in_words(&self, name: &str, point: &Point) -> String {
        let (quantity, unit) = quantity(self.y_label);
        let spread = if point.spread > 0.0 { format!(" ± {}", short(point.spread)) } else { String::new() };
        let (names, label) = self.x_label;
        let x = match names {
            Some(names) => names.get(libm::round(point.x) as usize).cloned().unwrap_or_default(),
            None => {
                let unit = label.rsplit_once(", ").map_or("", |(_, unit)| unit);
                format!("{} {unit}", rounded(point.x)).trim_end().to_owned()
            }
        };
        let value = format!("{}{spread} {unit}", short(point.y));
        format!("{name}: {quantity} {} at {x}", value.trim_end())
    }
}

/// A label such as `mATE (m)` in its parts. A longer note in brackets is no unit.
fn quantity(label: &str) -> (&str, &str) {
    const LONGEST_UNIT: usize = 4;
    match label.split_once(" (").and_then(|(name, rest)| Some((name, rest.strip_suffix(')')?))) {
        Some((name, unit)) if unit.chars().count() <= LONGEST_UNIT => (name, unit),
        Some((name, _)) => (name, ""),
        None => (label, ""),
    }
}

/// Three digits that say something.
fn short(value: f64) -> String {
    let digits = match value.abs() {
        large if large >= 100.0 => 0,
        large if large >= 10.0 => 1,
        middle if middle >= 1.0 => 2,
        _ => 3,
    };
    format!("{value:.digits$}")
}

impl Style {
    const fn width(&self) -> f64 {
        if self.is_first { 2.8 } else { 1.6 }
    }

    /// Its line and mark in a legend.
    fn key(&self, sheet: &mut Sheet, (x, y): (f64, f64)) {
        self.line(sheet, &[(x, y), (x + 26.0, y)]);
        if self.is_marked {
            self.mark(sheet, (x + 13.0, y));
        }
    }

    fn mark(&self, sheet: &mut Sheet, at: (f64, f64)) {
        let outline = if self.is_dotted { (self.colour, 1.4) } else { (PAPER, 0.6) };
        let fill = (!self.is_dotted).then_some(self.colour);
        self.marker.draw(sheet, (at, 3.6), Paint { fill, ..Paint::line(outline.0, outline.1) });
    }

    fn line(&self, sheet: &mut Sheet, points: &[(f64, f64)]) {
        if self.is_dotted {
            return;
        }
        if self.dash > 0.0 {
            sheet.dashed(points, (self.colour, self.width()), self.dash);
        } else {
            sheet.line(points, (self.colour, self.width()));
        }
    }

    fn draw(&self, sheet: &mut Sheet, curve: &[Point], scales: &Scales<'_>) {
        let Scales { x: px, y: py, top, .. } = *scales;
        let at = |p: &Point| (px(p.x), py(p.y));
        for part in parts_below(curve, top) {
            self.line(sheet, &part.iter().map(at).collect::<Vec<_>>());
        }
        let pitches = curve.windows(2).map(|pair| (px(pair[1].x) - px(pair[0].x)).abs());
        let pitch = pitches.filter(|pitch| *pitch > 0.0).fold(2.0 * REACH, f64::min);
        for point in curve.iter().filter(|point| point.y <= top) {
            let (low, high) = ((point.y - point.spread).max(0.0), (point.y + point.spread).min(top));
            if point.spread > 0.0 {
                sheet.line(&[(px(point.x), py(low)), (px(point.x), py(high))], (self.colour, 1.0));
            }
            // The points of a distribution are not marked: there are too many.
            if self.is_dotted || self.is_marked && curve.len() <= MOST_MARKS {
                self.mark(sheet, at(point));
            }
            sheet.hover(at(point), (pitch / 2.0).max(1.0), scales.in_words(&self.name, point));
        }
    }
}

/// At most two digits after the point, and none that say nothing.
fn rounded(x: f64) -> f64 {
    (x * 100.0).round() / 100.0
}

/// The parts of a curve that are below the upper border.
fn parts_below(curve: &[Point], top: f64) -> Vec<Vec<Point>> {
    let mut parts: Vec<Vec<Point>> = Vec::new();
    for pair in curve.windows(2) {
        let Some((from, to)) = below(pair[0], pair[1], top) else { continue };
        match parts.last_mut().filter(|part| part.last() == Some(&from)) {
            Some(part) => part.push(to),
            None => parts.push(vec![from, to]),
        }
    }
    parts
}

/// The part of a line that is below the upper border.
fn below(from: Point, to: Point, top: f64) -> Option<(Point, Point)> {
    let crossing = || {
        let share = (top - from.y) / (to.y - from.y);
        Point { x: from.x + share * (to.x - from.x), y: top, spread: 0.0 }
    };
    match (from.y <= top, to.y <= top) {
        (true, true) => Some((from, to)),
        (true, false) => Some((from, crossing())),
        (false, true) => Some((crossing(), to)),
        (false, false) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn style(name: &str) -> Style {
        let marker = Marker::Disc;
        let name = name.to_owned();
        Style { name, colour: INK, dash: 0.0, marker, is_dotted: false, is_first: false, is_marked: true }
    }

    fn plot(ys: &[f64]) -> CurvePlot {
        let curve = (0u8..).zip(ys).map(|(x, y)| Point { x: f64::from(x), y: *y, spread: 0.1 }).collect();
        let label = "mATE (m)".to_owned();
        CurvePlot {
            title: "Error".to_owned(),
            subtitle: "virtual time".to_owned(),
            x_label: "delay, ms".to_owned(),
            x_names: None,
            styles: vec![style("ours")],
            panels: vec![Panel { label, curves: vec![curve], top: Top::Most, target: None, levels: vec![] }],
        }
    }

    #[test]
    fn labels_names_and_every_curve_are_in_the_figure() {
        let svg = plot(&[0.1, 0.2, 0.3]).sheet().svg();
        for text in ["Error", "delay, ms", "mATE (m)", "ours", "virtual time"] {
            assert!(svg.contains(text), "{text}");
        }
    }

    #[test]
    fn a_curve_beyond_the_range_is_clipped_at_the_border() {
        let top = 4.0;
        let point = |x: f64, y: f64| Point { x, y, spread: 0.0 };
        let (from, to) = below(point(0.0, 2.0), point(1.0, 10.0), top).unwrap();
        assert_eq!((from.y, to.x, to.y), (2.0, 0.25, 4.0));
        assert_eq!(below(point(0.0, 5.0), point(1.0, 10.0), top), None);
        let panel = &plot(&[1.0, 1.0, 1.0, 1.0, 100.0]).panels[0];
        assert!(*panel.upright_ticks().values.last().unwrap() <= 5.0);
    }

    #[test]
    fn a_plot_without_points_is_valid() {
        assert!(plot(&[]).sheet().svg().contains("mATE"));
        assert!(plot(&[f64::NAN]).sheet().svg().contains("mATE"));
    }

    #[test]
    fn a_point_is_named_with_quantity_unit_and_place_and_its_reach_ends_halfway_to_the_next() {
        let svg = plot(&[0.1, 0.2, 0.3]).sheet().svg();
        assert!(svg.contains("<title>ours: mATE 0.200 ± 0.100 m at 1 ms</title>"), "{svg}");
        let many = plot(&[0.1; 166]).sheet().svg();
        assert!(svg.contains("r=\"7.0\"") && !many.contains("r=\"7.0\"") && many.contains("r=\"1.0\""));
        let named =
            CurvePlot { x_names: Some(vec!["never".to_owned(), "often".to_owned()]), ..plot(&[0.1, 0.2]) };
        assert!(named.sheet().svg().contains("m at often</title>"));
        assert_eq!(quantity("position NEES / 2 (1 is consistent)"), ("position NEES / 2", ""));
    }

    #[test]
    fn the_emphasised_curve_is_drawn_last_and_thicker() {
        let mut plot = plot(&[0.1, 0.2]);
        let other = plot.panels[0].curves[0].clone();
        plot.panels[0].curves.push(other);
        plot.styles[0].is_first = true;
        plot.styles.push(Style { colour: MUTED, ..style("other") });
        let svg = plot.parts().panels[0].1.svg();
        let (thick, thin) =
            ("stroke=\"#222222\" stroke-width=\"2.8\"", "stroke=\"#666666\" stroke-width=\"1.6\"");
        assert!(svg.find(thick).unwrap() > svg.rfind(thin).unwrap(), "{svg}");
    }

    #[test]
    fn the_right_value_is_a_dashed_line_in_the_panel() {
        let mut plot = plot(&[0.1, 0.2]);
        assert!(!plot.sheet().svg().contains("stroke-dasharray"));
        plot.panels[0].target = Some(1.0);
        assert!(plot.sheet().svg().contains("stroke-dasharray"));
        assert!(*plot.panels[0].upright_ticks().values.last().unwrap() >= 1.0);
    }

    #[test]
    fn a_value_that_holds_for_the_whole_width_is_dashed_in_its_colour_and_within_the_panel() {
        let mut plot = plot(&[0.1, 0.2]);
        plot.panels[0].levels = vec![(0, 0.7)];
        let svg = plot.sheet().svg();
        assert!(
            svg.contains("stroke-dasharray") && svg.contains("<title>ours: mATE, mean 0.700</title>"),
            "{svg}"
        );
        assert!(*plot.panels[0].upright_ticks().values.last().unwrap() >= 0.7);
    }

    #[test]
    fn a_curve_is_one_line_as_far_as_it_is_within_the_panel() {
        let curve: Vec<Point> = (0..6)
            .map(|k| Point { x: f64::from(k), y: if k == 3 { 9.0 } else { 1.0 }, spread: 0.0 })
            .collect();
        let parts: Vec<usize> = parts_below(&curve, 4.0).iter().map(Vec::len).collect();
        assert_eq!(parts, [4, 3], "to the border and from it");
        assert_eq!(parts_below(&curve[..3], 4.0).len(), 1);
    }

    #[test]
    fn every_panel_is_a_drawing_of_its_own_with_one_legend_for_all() {
        let mut plot = plot(&[0.1, 0.2]);
        plot.panels.push(plot.panels[0].clone());
        let parts = plot.parts();
        assert_eq!((parts.panels.len(), parts.legend.len()), (2, 1));
        assert!(parts.panels.iter().all(|(_, sheet)| sheet.width < 420 && !sheet.label.is_empty()));
    }
}
