//! Curves over a common axis, in panels side by side, with a legend beside them.

use crate::report::palette::{Colour, FAINT, INK, MUTED, PAPER};
use crate::report::plot::dots::{diamond, disc, text};
use crate::report::plot::sheet::{Anchor, Paint, Rect, Sheet, corners};
use crate::report::plot::ticks::{Ticks, ticks};

const PANEL_WIDTH: f64 = 330.0;
const PANEL_HEIGHT: f64 = 260.0;
const GAP: f64 = 62.0;
const LEFT: f64 = 62.0;
const TOP: f64 = 52.0;
const CHARACTER: f64 = 6.6;
const LEGEND_LINE: f64 = 19.0;
/// Curves are cut off at this multiple of the median of all points: a diverging curve would flatten all others.
const CUT_AT_MEDIANS: f64 = 4.0;

/// How a curve is drawn.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Style {
    /// Name in the legend.
    pub name: String,
    /// Its colour.
    pub colour: Colour,
    /// Length of its dashes; 0 for a solid line.
    pub dash: f64,
    /// Whether only its points are marked, by open diamonds, without a line between them.
    pub is_dotted: bool,
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
}

/// Curves of several quantities.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CurvePlot {
    /// Its heading.
    pub title: String,
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
        let mut sheet = Sheet::new(width.ceil() as u32, height.ceil() as u32);
        sheet.text((16.0, 26.0), &self.title, text(16.0, true, INK, Anchor::Start));
        for (place, panel) in self.panels.iter().enumerate() {
            let x = LEFT + (PANEL_WIDTH + GAP) * place as f64;
            self.draw(&mut sheet, panel, Rect { x, y: TOP, w: PANEL_WIDTH, h: PANEL_HEIGHT });
        }
        self.legend(&mut sheet, width - legend);
        sheet
    }

    fn legend(&self, sheet: &mut Sheet, x: f64) {
        for (place, style) in self.styles.iter().enumerate() {
            let y = TOP + 8.0 + LEGEND_LINE * place as f64;
            style.line(sheet, &[(x, y), (x + 26.0, y)]);
            if style.is_dotted {
                diamond(sheet, (x + 13.0, y), style.colour);
            } else {
                disc(sheet, (x + 13.0, y), 3.2, Paint::fill(style.colour));
            }
            sheet.text((x + 34.0, y + 4.0), &style.name, text(12.0, false, INK, Anchor::Start));
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
        for (curve, style) in panel.curves.iter().zip(&self.styles) {
            style.draw(sheet, curve, &Scales { x: &px, y: &py, top });
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
        ticks(0.0, if high > 0.0 { high } else { 1.0 }, 5)
    }
}

/// From data to the sheet.
struct Scales<'a> {
    x: &'a dyn Fn(f64) -> f64,
    y: &'a dyn Fn(f64) -> f64,
    /// The upper border, in data.
    top: f64,
}

impl Style {
    fn line(&self, sheet: &mut Sheet, points: &[(f64, f64)]) {
        if self.is_dotted {
            return;
        }
        if self.dash > 0.0 {
            sheet.dashed(points, (self.colour, 1.8), self.dash);
        } else {
            sheet.line(points, (self.colour, 1.8));
        }
    }

    fn draw(&self, sheet: &mut Sheet, curve: &[Point], scales: &Scales<'_>) {
        let Scales { x: px, y: py, top } = *scales;
        let at = |p: &Point| (px(p.x), py(p.y));
        for pair in curve.windows(2) {
            if let Some((from, to)) = below(pair[0], pair[1], top) {
                self.line(sheet, &[at(&from), at(&to)]);
            }
        }
        for point in curve.iter().filter(|point| point.y <= top) {
            let (low, high) = ((point.y - point.spread).max(0.0), (point.y + point.spread).min(top));
            if point.spread > 0.0 {
                sheet.line(&[(px(point.x), py(low)), (px(point.x), py(high))], (self.colour, 1.0));
            }
            sheet.hover(at(point), format!("{}: {:.4} at {}", self.name, point.y, rounded(point.x)));
            // The points of a distribution are not marked: there are too many.
            if self.is_dotted {
                diamond(sheet, at(point), self.colour);
            } else if curve.len() <= 15 {
                disc(sheet, at(point), 3.2, Paint { fill: Some(self.colour), ..Paint::line(PAPER, 0.6) });
            }
        }
    }
}

/// At most two digits after the point, and none that say nothing.
fn rounded(x: f64) -> f64 {
    (x * 100.0).round() / 100.0
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

    fn plot(ys: &[f64]) -> CurvePlot {
        let curve = (0u8..).zip(ys).map(|(x, y)| Point { x: f64::from(x), y: *y, spread: 0.1 }).collect();
        let style = Style { name: "ours".to_owned(), colour: INK, dash: 0.0, is_dotted: false };
        let panel = Panel { label: "mATE (m)".to_owned(), curves: vec![curve], top: Top::Most };
        let x_label = "delay, ms".to_owned();
        CurvePlot {
            title: "Error".to_owned(),
            x_label,
            x_names: None,
            styles: vec![style],
            panels: vec![panel],
        }
    }

    #[test]
    fn labels_names_and_every_curve_are_in_the_figure() {
        let svg = plot(&[0.1, 0.2, 0.3]).sheet().svg();
        for text in ["Error", "delay, ms", "mATE (m)", "ours"] {
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
}
