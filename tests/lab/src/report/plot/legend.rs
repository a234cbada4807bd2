//! Legends: a small picture of each kind of mark, and what it is.

use crate::report::palette::{Colour, INK, MUTED, TRUTH};
use crate::report::plot::sheet::{Anchor, Paint, Rect, Sheet, Type};
use v2x_common::sensor::SensorKind;

/// How opaque the tint of a class is.
pub(super) const TINT_OPACITY: f64 = 0.6;
/// How the legend shows a true object.
pub(super) const TRUE_BOX: Key = Key::Box(Paint::line(TRUTH, 3.0));

/// A mark in a legend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Key {
    /// A box.
    Box(Paint),
    /// A box's inside.
    Tint(Colour),
    /// An agent's detections and its marker.
    Agent(SensorKind, Colour),
    /// Motion.
    Arrow(Colour),
    /// Nothing: the text says all.
    None,
}

impl Key {
    /// Draws it into a rectangle.
    pub(super) fn draw(self, sheet: &mut Sheet, place: Rect) {
        let middle = (place.x + place.w / 2.0, place.y + place.h / 2.0);
        match self {
            Self::Box(paint) => sheet.rect(place, paint),
            Self::Tint(colour) => {
                sheet.rect(place, Paint { opacity: TINT_OPACITY, ..Paint::fill(colour) });
                sheet.rect(place, Paint::line(MUTED, 0.8));
            }
            Self::Agent(kind, colour) => {
                sheet.rect(place, Paint::line(colour, 2.6));
                marker(sheet, (kind, colour), &Place { at: middle, yaw: 0.0, scale: 0.62 });
            }
            Self::Arrow(colour) => {
                let y = middle.1;
                arrow(sheet, [(place.x, y), (place.x + place.w, y)], (colour, 2.0));
            }
            Self::None => {}
        }
    }
}

/// Where a marker is, on the sheet, and how large.
pub(super) struct Place {
    pub(super) at: (f64, f64),
    /// Heading, rad, left about from the right.
    pub(super) yaw: f64,
    pub(super) scale: f64,
}

/// A vehicle is an arrow head in the direction of its heading, a roadside unit is a square.
pub(super) fn marker(sheet: &mut Sheet, (kind, colour): (SensorKind, Colour), place: &Place) {
    let Place { at: (x, y), yaw, scale } = *place;
    let (sin, cos) = libm::sincos(yaw);
    let shape: &[(f64, f64)] = match kind {
        SensorKind::Vehicle => &[(16.0, 0.0), (-11.0, 10.0), (-5.0, 0.0), (-11.0, -10.0)],
        SensorKind::RoadsideUnit => &[(10.0, 10.0), (-10.0, 10.0), (-10.0, -10.0), (10.0, -10.0)],
    };
    let turned = |&(ahead, left): &(f64, f64)| {
        (x + scale * (ahead * cos - left * sin), y - scale * (ahead * sin + left * cos))
    };
    let points: Vec<_> = shape.iter().map(turned).collect();
    sheet.path(&points, true, Paint { fill: Some(colour), ..Paint::line(INK, 2.0 * scale) });
}

/// An arrow; its barbs are at most a third of it.
pub(super) fn arrow(sheet: &mut Sheet, [tail, tip]: [(f64, f64); 2], line: (Colour, f64)) {
    /// Shorter ones would be a dot.
    const SHORTEST: f64 = 3.0;
    let (dx, dy) = (tip.0 - tail.0, tip.1 - tail.1);
    let length = libm::hypot(dx, dy);
    if length < SHORTEST {
        return;
    }
    let (ahead, left) = ((dx / length, dy / length), (-dy / length, dx / length));
    let barb_length = (0.35 * length).min(8.0);
    sheet.line(&[tail, tip], line);
    for side in [-0.5, 0.5] {
        let barb = |axis: fn((f64, f64)) -> f64| axis(tip) + barb_length * (side * axis(left) - axis(ahead));
        sheet.line(&[tip, (barb(|point| point.0), barb(|point| point.1))], line);
    }
}

/// The rows of a legend, one below the other.
#[expect(clippy::cast_precision_loss, reason = "counts of rows and letters")]
pub(super) fn legend_rows(sheet: &mut Sheet, place: Rect, rows: &[(Key, String)]) {
    let pitch = (place.h / rows.len() as f64).min(40.0);
    // Letters of these fonts are on average at most 0.6 em wide: long names get a smaller font.
    let longest = rows.iter().map(|(_, text)| text.chars().count()).max().unwrap_or(1);
    let size = (pitch * 0.55).min(21.0).min((place.w - 64.0) / (0.6 * longest as f64));
    let mut middle = place.y + pitch / 2.0;
    for (key, text) in rows {
        key.draw(sheet, Rect { x: place.x + 4.0, y: middle - pitch * 0.28, w: 44.0, h: pitch * 0.56 });
        sheet.text((place.x + 64.0, middle + size * 0.35), text, font(size, false));
        middle += pitch;
    }
}

/// A legend in one row.
#[expect(clippy::cast_precision_loss, reason = "a count of columns")]
pub(super) fn legend_row(sheet: &mut Sheet, place: Rect, entries: &[(Key, String)]) {
    let w = place.w / entries.len().max(1) as f64;
    let mut x = place.x;
    for entry in entries {
        legend_rows(sheet, Rect { x, w, ..place }, std::slice::from_ref(entry));
        x += w;
    }
}

/// The entries of a legend for a page, each mark as a drawing of its own.
pub(super) fn swatches(rows: Vec<(Key, String)>) -> Vec<(Sheet, String)> {
    let swatch = |(key, text): (Key, String)| {
        let mut sheet = Sheet::new(36, 22);
        key.draw(&mut sheet, Rect { x: 3.0, y: 4.0, w: 30.0, h: 14.0 });
        (sheet, text)
    };
    rows.into_iter().map(swatch).collect()
}

pub(super) const fn font(size: f64, bold: bool) -> Type {
    Type { size, colour: INK, bold, anchor: Anchor::Start }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::plot::sheet::Shape;

    fn lines(sheet: &Sheet) -> Vec<f64> {
        let length = |shape: &Shape| match shape {
            Shape::Path { points, .. } => libm::hypot(points[1].0 - points[0].0, points[1].1 - points[0].1),
            _ => 0.0,
        };
        sheet.shapes.iter().map(length).collect()
    }

    #[test]
    fn the_head_of_a_short_arrow_is_no_longer_than_its_shaft() {
        let arrow_of = |length: f64| {
            let mut sheet = Sheet::new(200, 100);
            arrow(&mut sheet, [(0.0, 0.0), (length, 0.0)], (INK, 1.0));
            lines(&sheet)
        };
        let (short, long) = (arrow_of(6.0), arrow_of(100.0));
        assert!(short.len() == 3 && short[1] < 0.5 * short[0], "{short:?}");
        assert!(long[1] < 10.0, "{long:?}");
        assert!(arrow_of(1.0).is_empty());
    }
}
