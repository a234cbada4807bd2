//! A drawing as a list of shapes, to be written as SVG or PDF. Units are pixels (points in PDF), x to the right and
//! y down.

use crate::report::palette::Colour;
use crate::report::plot::svg::{Font, Rect, Style, Svg};

/// The side of a text's anchor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Anchor {
    /// The text begins there.
    Start,
    /// Its middle is there.
    Middle,
    /// It ends there.
    End,
}

/// How a text is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Type {
    /// Font size.
    pub size: f64,
    /// Whether it is bold.
    pub bold: bool,
    /// Its colour.
    pub colour: Colour,
    /// Where it is anchored.
    pub anchor: Anchor,
}

/// How an outline is painted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Paint {
    /// Colour and width of the line.
    pub stroke: Option<(Colour, f64)>,
    /// Colour of the inside.
    pub fill: Option<Colour>,
}

impl Paint {
    /// A line without a fill.
    pub(crate) const fn line(colour: Colour, width: f64) -> Self {
        Self { stroke: Some((colour, width)), fill: None }
    }
}

/// A shape.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Shape {
    /// Straight lines from point to point.
    Path {
        /// The points.
        points: Vec<(f64, f64)>,
        /// Whether the last point is joined with the first.
        is_closed: bool,
        /// Colour and width of the line.
        stroke: Option<(Colour, f64)>,
        /// Colour of the inside.
        fill: Option<Colour>,
        /// Lengths of dash and gap; 0 for a solid line.
        dash: f64,
        /// Opacity; 1 is opaque.
        opacity: f64,
    },
    /// A text on one line.
    Text {
        /// The anchor, on the base line.
        at: (f64, f64),
        /// The text.
        text: String,
        /// Its style.
        set: Type,
    },
    /// A text that appears while the pointer is there; not in print.
    Hover {
        /// The place.
        at: (f64, f64),
        /// The text.
        text: String,
    },
}

/// A drawing.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Sheet {
    /// Width.
    pub width: u32,
    /// Height.
    pub height: u32,
    /// Its shapes, later ones over earlier ones.
    pub shapes: Vec<Shape>,
}

impl Sheet {
    /// An empty white sheet.
    pub(crate) const fn new(width: u32, height: u32) -> Self {
        Self { width, height, shapes: Vec::new() }
    }

    /// Draws a line from point to point.
    pub(crate) fn line(&mut self, points: &[(f64, f64)], stroke: (Colour, f64)) {
        self.path(points, false, Paint { stroke: Some(stroke), fill: None });
    }

    /// Draws a dashed line.
    pub(crate) fn dashed(&mut self, points: &[(f64, f64)], stroke: (Colour, f64), dash: f64) {
        let points = points.to_vec();
        let stroke = Some(stroke);
        self.shapes.push(Shape::Path { points, is_closed: false, stroke, fill: None, dash, opacity: 1.0 });
    }

    /// Draws an outline, or fills it, or both.
    pub(crate) fn path(&mut self, points: &[(f64, f64)], is_closed: bool, paint: Paint) {
        let Paint { stroke, fill } = paint;
        let points = points.to_vec();
        self.shapes.push(Shape::Path { points, is_closed, stroke, fill, dash: 0.0, opacity: 1.0 });
    }

    /// Fills an outline with a transparent colour.
    pub(crate) fn shade(&mut self, points: &[(f64, f64)], fill: Colour, opacity: f64) {
        let points = points.to_vec();
        let fill = Some(fill);
        self.shapes.push(Shape::Path { points, is_closed: true, stroke: None, fill, dash: 0.0, opacity });
    }

    /// Writes a text.
    pub(crate) fn text(&mut self, at: (f64, f64), text: &str, set: Type) {
        self.shapes.push(Shape::Text { at, text: text.to_owned(), set });
    }

    /// Shows a text while the pointer is there.
    pub(crate) fn hover(&mut self, at: (f64, f64), text: String) {
        self.shapes.push(Shape::Hover { at, text });
    }

    /// As a self-contained SVG document.
    pub(crate) fn svg(&self) -> String {
        let mut svg = Svg::new(self.width, self.height);
        for shape in &self.shapes {
            match shape {
                Shape::Path { points, is_closed, stroke, fill, dash, opacity } => {
                    let (colour, width) = stroke.unwrap_or(("none", 0.0));
                    let dashes = if *dash > 0.0 { format!("{dash} {dash}") } else { String::new() };
                    let fill = fill.unwrap_or("none");
                    let style = Style { stroke: colour, width, fill, dashes: &dashes, opacity: *opacity };
                    svg.path(points, *is_closed, style);
                }
                Shape::Hover { at, text } => svg.hover(*at, text),
                Shape::Text { at, text, set } => {
                    let anchor = match set.anchor {
                        Anchor::Start => "start",
                        Anchor::Middle => "middle",
                        Anchor::End => "end",
                    };
                    let Type { size, bold, colour, .. } = *set;
                    svg.text(*at, text, Font { size, colour, bold, anchor });
                }
            }
        }
        svg.finish()
    }
}

/// The corners of a rectangle.
pub(super) fn corners(Rect { x, y, w, h }: Rect) -> [(f64, f64); 4] {
    [(x, y), (x + w, y), (x + w, y + h), (x, y + h)]
}
