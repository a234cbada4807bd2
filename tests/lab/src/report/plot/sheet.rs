//! A drawing as a list of shapes, to be written as SVG or PDF. Units are pixels (points in PDF), x to the right and
//! y down.

use crate::report::palette::Colour;

/// A rectangle: left, top, width, height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rect {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) w: f64,
    pub(crate) h: f64,
}

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
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Paint {
    /// Colour and width of the line.
    pub stroke: Option<(Colour, f64)>,
    /// Colour of the inside.
    pub fill: Option<Colour>,
    /// Lengths of dash and gap; 0 for a solid line.
    pub dash: f64,
    /// Opacity; 1 is opaque.
    pub opacity: f64,
}

impl Paint {
    /// Nothing is painted.
    pub(crate) const NONE: Self = Self { stroke: None, fill: None, dash: 0.0, opacity: 1.0 };

    /// A line without a fill.
    pub(crate) const fn line(colour: Colour, width: f64) -> Self {
        Self { stroke: Some((colour, width)), ..Self::NONE }
    }

    /// The inside without a line.
    pub(crate) const fn fill(colour: Colour) -> Self {
        Self { fill: Some(colour), ..Self::NONE }
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
        /// Its line and inside.
        paint: Paint,
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
        /// How near the pointer has to be.
        radius: f64,
        /// The text.
        text: String,
    },
    /// Until [`Shape::EndClip`], only what lies within this rectangle is drawn.
    Clip(Rect),
    /// Ends the clipping.
    EndClip,
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
    /// What it shows, for those who cannot see it; empty where the text beside it says so.
    pub label: String,
}

impl Sheet {
    /// An empty white sheet.
    pub(crate) const fn new(width: u32, height: u32) -> Self {
        Self { width, height, shapes: Vec::new(), label: String::new() }
    }

    /// An empty white sheet with a label.
    pub(crate) fn labelled((width, height): (u32, u32), label: &str) -> Self {
        Self { label: label.to_owned(), ..Self::new(width, height) }
    }

    /// Draws a line from point to point.
    pub(crate) fn line(&mut self, points: &[(f64, f64)], (colour, width): (Colour, f64)) {
        self.path(points, false, Paint::line(colour, width));
    }

    /// Draws a dashed line.
    pub(crate) fn dashed(&mut self, points: &[(f64, f64)], (colour, width): (Colour, f64), dash: f64) {
        self.path(points, false, Paint { dash, ..Paint::line(colour, width) });
    }

    /// Draws an outline, or fills it, or both.
    pub(crate) fn path(&mut self, points: &[(f64, f64)], is_closed: bool, paint: Paint) {
        self.shapes.push(Shape::Path { points: points.to_vec(), is_closed, paint });
    }

    /// Fills an outline with a transparent colour.
    pub(crate) fn shade(&mut self, points: &[(f64, f64)], fill: Colour, opacity: f64) {
        self.path(points, true, Paint { opacity, ..Paint::fill(fill) });
    }

    /// Draws a rectangle.
    pub(crate) fn rect(&mut self, rect: Rect, paint: Paint) {
        self.path(&corners(rect), true, paint);
    }

    /// What is drawn by `draw` appears only within the rectangle.
    pub(crate) fn clipped(&mut self, rect: Rect, draw: impl FnOnce(&mut Self)) {
        self.shapes.push(Shape::Clip(rect));
        draw(self);
        self.shapes.push(Shape::EndClip);
    }

    /// Writes a text.
    pub(crate) fn text(&mut self, at: (f64, f64), text: &str, set: Type) {
        self.shapes.push(Shape::Text { at, text: text.to_owned(), set });
    }

    /// Shows a text while the pointer is there.
    pub(crate) fn hover(&mut self, at: (f64, f64), radius: f64, text: String) {
        self.shapes.push(Shape::Hover { at, radius, text });
    }
}

/// The corners of a rectangle.
pub(super) fn corners(Rect { x, y, w, h }: Rect) -> [(f64, f64); 4] {
    [(x, y), (x + w, y), (x + w, y + h), (x, y + h)]
}
