//! Sheets as SVG.

use crate::report::palette::PAPER;
use crate::report::plot::sheet::{Anchor, Paint, Rect, Shape, Sheet, Type};
use std::fmt::{self, Display, Write};

impl Sheet {
    /// As a self-contained SVG document.
    pub(crate) fn svg(&self) -> String {
        let mut svg = Svg::new((self.width, self.height), &self.label);
        for shape in &self.shapes {
            match shape {
                Shape::Path { points, is_closed, paint } => svg.path(points, *is_closed, paint),
                Shape::Clip(rect) => svg.begin_clip(*rect),
                Shape::EndClip => svg.end_clip(),
                Shape::Hover { at, radius, text } => svg.hover((*at, *radius), text),
                Shape::Text { at, text, set } => svg.text(*at, text, *set),
            }
        }
        svg.finish()
    }
}

/// A document under construction.
struct Svg {
    body: String,
}

impl Display for Paint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (stroke, width) = self.stroke.unwrap_or(("none", 0.0));
        write!(f, r#"stroke="{stroke}" stroke-width="{width}" fill="{}""#, self.fill.unwrap_or("none"))?;
        if self.dash > 0.0 {
            write!(f, r#" stroke-dasharray="{0} {0}""#, self.dash)?;
        }
        if self.opacity < 1.0 {
            write!(f, r#" opacity="{}""#, self.opacity)?;
        }
        Ok(())
    }
}

impl Svg {
    /// A white sheet.
    fn new((width, height): (u32, u32), label: &str) -> Self {
        let role = if label.is_empty() {
            "aria-hidden=\"true\"".to_owned()
        } else {
            format!("role=\"img\" aria-label=\"{}\"", Escaped(label))
        };
        let body = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
             height=\"{height}\" {role} font-family=\"Helvetica, Arial, 'DejaVu Sans', sans-serif\" \
             stroke-linejoin=\"round\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"{PAPER}\"/>\n"
        );
        Self { body }
    }

    /// The finished document.
    fn finish(mut self) -> String {
        self.body.push_str("</svg>\n");
        self.body
    }

    fn push(&mut self, element: fmt::Arguments<'_>) {
        self.body.write_fmt(element).expect("a String takes everything");
        self.body.push('\n');
    }

    /// Everything until [`Svg::end_clip`] is clipped at the rectangle. A drawing within the drawing clips without a name,
    /// which a page with several figures would have to keep apart.
    fn begin_clip(&mut self, Rect { x, y, w, h }: Rect) {
        self.push(format_args!(
            r#"<svg x="{x:.1}" y="{y:.1}" width="{w:.1}" height="{h:.1}" viewBox="{x:.1} {y:.1} {w:.1} {h:.1}">"#
        ));
    }

    /// Ends the clipping.
    fn end_clip(&mut self) {
        self.push(format_args!("</svg>"));
    }

    /// Straight lines from point to point.
    fn path(&mut self, points: &[(f64, f64)], is_closed: bool, paint: &Paint) {
        let mut path = path_data(points);
        path.push_str(if is_closed { "Z" } else { "" });
        self.push(format_args!(r#"<path d="{path}" {paint}/>"#));
    }

    /// A text that appears while the pointer is within some pixels.
    fn hover(&mut self, ((x, y), radius): ((f64, f64), f64), text: &str) {
        let text = Escaped(text);
        self.push(format_args!(
            r#"<circle cx="{x:.1}" cy="{y:.1}" r="{radius:.1}" fill="none" pointer-events="all"><title>{text}</title></circle>"#
        ));
    }

    /// A text with a white outline, readable on any background.
    fn text(&mut self, (x, y): (f64, f64), text: &str, set: Type) {
        let Type { size, colour, bold, anchor } = set;
        let weight = if bold { "bold" } else { "normal" };
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
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

/// Text that may contain `<`, `&`, quotes and control characters.
struct Escaped<'a>(&'a str);

impl Display for Escaped<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.chars().try_for_each(|c| match c {
            '<' => f.write_str("&lt;"),
            '>' => f.write_str("&gt;"),
            '&' => f.write_str("&amp;"),
            '"' => f.write_str("&quot;"),
            c if c.is_control() => f.write_char(' '),
            c => f.write_char(c),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drawing_says_what_it_shows_and_a_mark_beside_a_text_is_hidden_from_readers() {
        let labelled = Sheet::labelled((10, 10), "the \"worst\" <moment>").svg();
        assert!(
            labelled.contains(r#"role="img" aria-label="the &quot;worst&quot; &lt;moment&gt;""#),
            "{labelled}"
        );
        assert!(Sheet::new(10, 10).svg().contains("aria-hidden"));
    }

    #[test]
    fn a_text_appears_within_the_given_distance() {
        let mut sheet = Sheet::new(10, 10);
        sheet.hover((5.0, 5.0), 2.5, "0.3 m".to_owned());
        assert!(sheet.svg().contains(r#"r="2.5" fill="none" pointer-events="all"><title>0.3 m</title>"#));
    }
}
