//! Dot plots: for each category and series a mean with its spread, in panels side by side.

use crate::report::palette::{BAND, Colour, FAINT, INK, MUTED, OURS, PAPER, is_ours};
use crate::report::plot::figure_parts::{FigureParts, Layout};
use crate::report::plot::marker::Marker;
use crate::report::plot::sheet::{Anchor, Paint, Rect, Sheet, Type, corners};
use crate::report::plot::ticks::ticks;

/// A mean with its spread.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Dot {
    /// The mean.
    pub mean: f64,
    /// Half of the length of its bar.
    pub spread: f64,
    /// The published value, for comparison.
    pub published: Option<f64>,
}

/// One metric.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Panel {
    /// Label of its axis.
    pub label: String,
    /// By category and series.
    pub dots: Vec<Vec<Option<Dot>>>,
}

/// A plot of several metrics.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DotPlot {
    /// Its heading.
    pub title: String,
    /// Names of the rows.
    pub categories: Vec<String>,
    /// Names and colours of the series.
    pub series: Vec<(String, Colour)>,
    /// The metrics.
    pub panels: Vec<Panel>,
}

const PANEL_WIDTH: f64 = 250.0;
const GAP: f64 = 26.0;
const TOP: f64 = 66.0;
const CHARACTER: f64 = 6.6;

/// Width of a panel that is a drawing of its own.
const SINGLE_WIDTH: f64 = 230.0;
/// Below the panels.
const BOTTOM: f64 = 46.0;

impl DotPlot {
    /// The finished drawing.
    pub(crate) fn sheet(&self) -> Sheet {
        let (left, height) = (self.left(), self.height());
        let width = left + (PANEL_WIDTH + GAP) * self.panels.len() as f64;
        let size = (width.ceil() as u32, (TOP + height + BOTTOM).ceil() as u32);
        let mut sheet = Sheet::labelled(size, &self.title);
        sheet.text((16.0, 26.0), &self.title, text(16.0, true, INK, Anchor::Start));
        self.legend(&mut sheet);
        self.names(&mut sheet, (left, TOP));
        for (place, panel) in self.panels.iter().enumerate() {
            let x = left + (PANEL_WIDTH + GAP) * place as f64;
            let area = Rect { x, y: TOP, w: PANEL_WIDTH, h: height };
            panel.draw(&mut sheet, area, (&self.series, &self.categories));
        }
        sheet
    }

    /// The panels, each a drawing of its own.
    pub(crate) fn parts(&self) -> FigureParts {
        let (left, height, top) = (self.left() - 12.0, self.height(), 8.0);
        let size = ((left + SINGLE_WIDTH + 14.0).ceil() as u32, (top + height + BOTTOM).ceil() as u32);
        let panel = |panel: &Panel| {
            let mut sheet = Sheet::labelled(size, &format!("{}: {}", self.title, panel.label));
            self.names(&mut sheet, (left, top));
            let area = Rect { x: left, y: top, w: SINGLE_WIDTH, h: height };
            panel.draw(&mut sheet, area, (&self.series, &self.categories));
            (String::new(), sheet)
        };
        let entry = |(name, colour): (String, Option<Colour>)| {
            let mut mark = Sheet::new(16, 16);
            key(&mut mark, (8.0, 8.0), colour);
            (mark, name)
        };
        FigureParts {
            title: self.title.clone(),
            subtitle: String::new(),
            panels: self.panels.iter().map(panel).collect(),
            legend: self.entries().into_iter().map(entry).collect(),
            layout: Layout::Columns,
        }
    }

    fn row_height(&self) -> f64 {
        (13.0 * self.series.len() as f64).max(20.0) + 4.0
    }

    fn height(&self) -> f64 {
        self.row_height() * self.categories.len() as f64
    }

    /// Where the panels begin, to the right of the names of the rows.
    fn left(&self) -> f64 {
        let longest = self.categories.iter().map(|name| name.chars().count()).max().unwrap_or(0);
        24.0 + CHARACTER * longest as f64
    }

    /// The names of the rows.
    fn names(&self, sheet: &mut Sheet, (left, top): (f64, f64)) {
        for (row, category) in self.categories.iter().enumerate() {
            let y = top + self.row_height() * (row as f64 + 0.5) + 4.0;
            sheet.text((left - 10.0, y), category, text(12.0, false, INK, Anchor::End));
        }
    }

    fn legend(&self, sheet: &mut Sheet) {
        let mut x = 16.0;
        for (name, colour) in self.entries() {
            key(sheet, (x + 5.0, 46.0), colour);
            sheet.text((x + 14.0, 50.0), &name, text(12.0, false, INK, Anchor::Start));
            x += 30.0 + CHARACTER * name.chars().count() as f64;
        }
    }

    /// The series, where there are several, and what is published, which has no colour.
    fn entries(&self) -> Vec<(String, Option<Colour>)> {
        let several = self.series.iter().filter(|_| self.series.len() > 1);
        let mut entries: Vec<_> = several.map(|(name, colour)| (name.clone(), Some(*colour))).collect();
        let is_published = |dot: &Option<Dot>| dot.is_some_and(|dot| dot.published.is_some());
        if self.panels.iter().flat_map(|panel| panel.dots.iter().flatten()).any(is_published) {
            entries.push(("the paper's".to_owned(), None));
        }
        entries
    }
}

/// A mark of a legend.
fn key(sheet: &mut Sheet, at: (f64, f64), colour: Option<Colour>) {
    match colour {
        Some(colour) => Marker::Disc.draw(sheet, (at, 4.5), Paint::fill(colour)),
        None => diamond(sheet, at, INK),
    }
}

impl Panel {
    fn draw(&self, sheet: &mut Sheet, area: Rect, (series, categories): (&[(String, Colour)], &[String])) {
        let dots = || self.dots.iter().flatten().flatten();
        let reach = |dot: &Dot| (dot.mean + dot.spread).max(dot.published.unwrap_or(0.0));
        let high = dots().map(reach).filter(|value| value.is_finite()).fold(0.0, f64::max);
        let ticks = ticks(0.0, if high > 0.0 { high } else { 1.0 }, 5);
        let end = ticks.values.last().copied().unwrap_or(1.0).max(high);
        let px = |value: f64| area.x + area.w * (value / end).clamp(0.0, 1.0);
        let (top, bottom) = (area.y, area.y + area.h);
        for value in &ticks.values {
            sheet.line(&[(px(*value), top), (px(*value), bottom)], (FAINT, 1.0));
            let label = ticks.label(*value);
            sheet.text((px(*value), bottom + 15.0), &label, text(11.0, false, MUTED, Anchor::Middle));
        }
        let row_height = area.h / self.dots.len().max(1) as f64;
        for (row, of_row) in self.dots.iter().enumerate() {
            if row % 2 == 1 {
                let band = Rect { y: top + row_height * row as f64, h: row_height, ..area };
                sheet.shade(&corners(band), BAND, 0.6);
            }
            let step = (row_height - 6.0) / of_row.len().max(1) as f64;
            for (place, dot) in of_row.iter().enumerate() {
                let Some(dot) = dot else { continue };
                let category = categories.get(row).map_or("", String::as_str);
                // Where a row is a method, ours has its colour too.
                let is_ours = of_row.len() == 1 && is_ours(category);
                let colour = if is_ours { OURS } else { series.get(place).map_or(INK, |(_, colour)| colour) };
                let name = series.get(place).map(|(name, _)| name.as_str()).filter(|name| !name.is_empty());
                let name = name.map_or_else(|| category.to_owned(), |name| format!("{category}, {name}"));
                let y = top + row_height * row as f64 + 3.0 + step * (place as f64 + 0.5);
                mark(sheet, dot, (y, &px), colour);
                let reach = (step / 2.0).min(7.0);
                sheet.hover((px(dot.mean), y), reach, format!("{name}: {} {}", self.label, dot.in_words()));
            }
        }
        sheet.path(&corners(area), true, Paint::line(MUTED, 1.0));
        let at = (area.x + area.w / 2.0, bottom + 34.0);
        sheet.text(at, &self.label, text(12.0, true, INK, Anchor::Middle));
    }
}

impl Dot {
    fn in_words(&self) -> String {
        let spread = if self.spread > 0.0 { format!(" ± {:.3}", self.spread) } else { String::new() };
        let paper = self.published.map_or_else(String::new, |value| format!("; the paper's {value:.3}"));
        format!("{:.3}{spread}{paper}", self.mean)
    }
}

fn mark(sheet: &mut Sheet, dot: &Dot, (y, px): (f64, &dyn Fn(f64) -> f64), colour: Colour) {
    let (low, high) = (px(dot.mean - dot.spread), px(dot.mean + dot.spread));
    sheet.line(&[(low, y), (high, y)], (colour, 1.6));
    for end in [low, high] {
        sheet.line(&[(end, y - 3.0), (end, y + 3.0)], (colour, 1.2));
    }
    if let Some(published) = dot.published {
        diamond(sheet, (px(published), y), INK);
    }
    let paint = Paint { fill: Some(colour), ..Paint::line(PAPER, 0.8) };
    Marker::Disc.draw(sheet, ((px(dot.mean), y), 4.5), paint);
}

/// The mark of a published value.
fn diamond(sheet: &mut Sheet, at: (f64, f64), colour: Colour) {
    Marker::Diamond.draw(sheet, (at, 3.6), Paint::line(colour, 1.4));
}

pub(super) const fn text(size: f64, bold: bool, colour: Colour, anchor: Anchor) -> Type {
    Type { size, bold, colour, anchor }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_category_series_and_panel_is_named() {
        let dot = Some(Dot { mean: 0.5, spread: 0.1, published: Some(0.6) });
        let plot = DotPlot {
            title: "Fig. <4>".to_owned(),
            categories: vec!["N1".to_owned(), "N3".to_owned()],
            series: vec![
                ("ours".to_owned(), crate::report::palette::SERIES[0]),
                ("theirs".to_owned(), crate::report::palette::SERIES[1]),
            ],
            panels: vec![Panel { label: "mATE (m)".to_owned(), dots: vec![vec![dot, None], vec![dot, dot]] }],
        };
        let svg = plot.sheet().svg();
        for text in
            ["Fig. &lt;4&gt;", ">N1<", ">N3<", ">ours<", ">theirs<", ">mATE (m)<", ">the paper's<", ">0.6<"]
        {
            assert!(svg.contains(text), "{text}");
        }
        // Three dots and two in the legend; three diamonds and one in the legend.
        assert_eq!(svg.matches("Z\" stroke=\"#222222\"").count(), 4);
        assert!(svg.contains("<title>N1, ours: mATE (m) 0.500 ± 0.100; the paper's 0.600</title>"), "{svg}");
        let parts = plot.parts();
        let legend: Vec<&str> = parts.legend.iter().map(|(_, name)| name.as_str()).collect();
        assert_eq!((parts.panels.len(), legend), (1, vec!["ours", "theirs", "the paper's"]));
        assert!(parts.panels[0].1.svg().contains(">N3<"), "every panel has the names of its rows");
    }
}
