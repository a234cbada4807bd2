//! Writing SVG: shapes in pixels, x to the right and y down.

use crate::report::palette::PAPER;
use std::fmt::{self, Display, Write};

/// A drawing under construction.
pub(super) struct Svg {
    body: String,
}

/// How a shape is drawn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Style<'a> {
    pub(super) stroke: &'a str,
    pub(super) width: f64,
    pub(super) fill: &'a str,
    /// Dash pattern in px; empty for a solid line.
    pub(super) dashes: &'a str,
    pub(super) opacity: f64,
}

impl<'a> Style<'a> {
    /// A solid line without a fill.
    pub(super) const fn line(stroke: &'a str, width: f64) -> Self {
        Self { stroke, width, fill: "none", dashes: "", opacity: 1.0 }
    }
}

impl Display for Style<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, r#"stroke="{}" stroke-width="{}" fill="{}""#, self.stroke, self.width, self.fill)?;
        if !self.dashes.is_empty() {
            write!(f, r#" stroke-dasharray="{}""#, self.dashes)?;
        }
        if self.opacity < 1.0 {
            write!(f, r#" opacity="{}""#, self.opacity)?;
        }
        Ok(())
    }
}

/// A text's size, weight and side of its anchor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Font {
    pub(super) size: f64,
    pub(super) colour: &'static str,
    pub(super) bold: bool,
    /// `start`, `middle` or `end`.
    pub(super) anchor: &'static str,
}

/// A rectangle: left, top, width, height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rect {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) w: f64,
    pub(super) h: f64,
}

impl Svg {
    /// A white sheet.
    pub(super) fn new(width: u32, height: u32) -> Self {
        let body = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
             height=\"{height}\" font-family=\"Helvetica, Arial, 'DejaVu Sans', sans-serif\" \
             stroke-linejoin=\"round\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"{PAPER}\"/>\n"
        );
        Self { body }
    }

    /// The finished document.
    pub(super) fn finish(mut self) -> String {
        self.body.push_str("</svg>\n");
        self.body
    }

    fn push(&mut self, element: fmt::Arguments<'_>) {
        self.body.write_fmt(element).expect("a String takes everything");
        self.body.push('\n');
    }

    /// Everything until [`Svg::end_clip`] is clipped at the rectangle.
    pub(super) fn begin_clip(&mut self, id: &str, Rect { x, y, w, h }: Rect) {
        self.push(format_args!(
            r#"<clipPath id="{id}"><rect x="{x:.1}" y="{y:.1}" width="{w:.1}" height="{h:.1}"/></clipPath>"#
        ));
        self.push(format_args!(r#"<g clip-path="url(#{id})">"#));
    }

    /// Ends the clipping.
    pub(super) fn end_clip(&mut self) {
        self.push(format_args!("</g>"));
    }

    /// A rectangle.
    pub(super) fn rect(&mut self, Rect { x, y, w, h }: Rect, style: Style<'_>) {
        self.push(format_args!(r#"<rect x="{x:.1}" y="{y:.1}" width="{w:.1}" height="{h:.1}" {style}/>"#));
    }

    /// A closed outline, and from the first of `tick` a line to the second.
    pub(super) fn outline(&mut self, points: &[(f64, f64)], tick: Option<[(f64, f64); 2]>, style: Style<'_>) {
        let mut path = path_data(points);
        path.push('Z');
        if let Some([(x0, y0), (x1, y1)]) = tick {
            let _ = write!(path, "M{x0:.1} {y0:.1}L{x1:.1} {y1:.1}");
        }
        self.push(format_args!(r#"<path d="{path}" {style}/>"#));
    }

    /// Straight lines from point to point.
    pub(super) fn path(&mut self, points: &[(f64, f64)], is_closed: bool, style: Style<'_>) {
        let mut path = path_data(points);
        path.push_str(if is_closed { "Z" } else { "" });
        self.push(format_args!(r#"<path d="{path}" {style}/>"#));
    }

    /// A straight line.
    pub(super) fn line(&mut self, [(x1, y1), (x2, y2)]: [(f64, f64); 2], style: Style<'_>) {
        self.push(format_args!(r#"<line x1="{x1:.1}" y1="{y1:.1}" x2="{x2:.1}" y2="{y2:.1}" {style}/>"#));
    }

    /// A text that appears while the pointer is within some pixels.
    pub(super) fn hover(&mut self, (x, y): (f64, f64), text: &str) {
        let text = Escaped(text);
        self.push(format_args!(
            r#"<circle cx="{x:.1}" cy="{y:.1}" r="7" fill="none" pointer-events="all"><title>{text}</title></circle>"#
        ));
    }

    /// A text with a white outline, readable on any background.
    pub(super) fn text(&mut self, (x, y): (f64, f64), text: &str, font: Font) {
        let Font { size, colour, bold, anchor } = font;
        let weight = if bold { "bold" } else { "normal" };
        let text = Escaped(text);
        self.push(format_args!(
            r##"<text x="{x:.1}" y="{y:.1}" font-size="{size:.1}" font-weight="{weight}" fill="{colour}" text-anchor="{anchor}" stroke="{PAPER}" stroke-width="4" paint-order="stroke">{text}</text>"##
        ));
    }
}

/// Straight lines through all points.
fn path_data(points: &[(f64, f64)]) -> String {
    let mut path = String::new();
    for (index, (x, y)) in points.iter().enumerate() {
        let command = if index == 0 { 'M' } else { 'L' };
        let _ = write!(path, "{command}{x:.1} {y:.1}");
    }
    path
}

/// Text that may contain `<`, `&` and control characters.
struct Escaped<'a>(&'a str);

impl Display for Escaped<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.chars().try_for_each(|c| match c {
            '<' => f.write_str("&lt;"),
            '>' => f.write_str("&gt;"),
            '&' => f.write_str("&amp;"),
            c if c.is_control() => f.write_char(' '),
            c => f.write_char(c),
        })
    }
}
