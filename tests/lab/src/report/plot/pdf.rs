//! Sheets as PDF, with the standard fonts.

use crate::report::palette::Colour;
use crate::report::plot::sheet::{Anchor, Paint, Shape, Sheet, Type};
use pdf_writer::types::LineJoinStyle;
use pdf_writer::{Content, Name, Pdf, Ref, Str};

const REGULAR: Name<'_> = Name(b"F1");
const BOLD: Name<'_> = Name(b"F2");
/// Widths of Helvetica's characters from the space to the tilde, thousandths of the size (Adobe's font metrics for
/// the standard 14 fonts).
const WIDTHS: [u16; 95] = [
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278, 556, 556, 556, 556, 556,
    556, 556, 556, 556, 556, 278, 278, 584, 584, 584, 556, 1015, 667, 667, 722, 722, 667, 611, 778, 722, 278,
    500, 667, 556, 833, 722, 778, 667, 778, 722, 667, 611, 722, 667, 944, 667, 667, 611, 278, 278, 278, 469,
    556, 333, 556, 556, 500, 556, 556, 278, 556, 556, 222, 222, 500, 222, 833, 556, 556, 556, 556, 333, 500,
    278, 556, 500, 722, 500, 500, 500, 334, 260, 334, 584,
];
/// Approximate width of all other characters.
const OTHER_WIDTH: u16 = 556;
/// Approximate ratio of the widths of bold and regular characters.
const BOLD_WIDENS: f64 = 1.06;

impl Sheet {
    /// As a PDF document of one page.
    pub(crate) fn pdf(&self) -> Vec<u8> {
        document(self)
    }
}

/// A document of one page.
fn document(sheet: &Sheet) -> Vec<u8> {
    let [catalog, tree, page, contents, regular, bold, states] = [1, 2, 3, 4, 5, 6, 7].map(Ref::new);
    let mut pdf = Pdf::new();
    pdf.catalog(catalog).pages(tree);
    pdf.pages(tree).kids([page]).count(1);
    let opacities = opacities(sheet);
    let mut page_writer = pdf.page(page);
    page_writer.media_box(pdf_writer::Rect::new(0.0, 0.0, sheet.width as f32, sheet.height as f32));
    page_writer.parent(tree).contents(contents);
    {
        let mut resources = page_writer.resources();
        resources.fonts().pair(REGULAR, regular).pair(BOLD, bold);
        let mut all = resources.ext_g_states();
        for place in 0..opacities.len() {
            all.pair(Name(state_name(place).as_bytes()), Ref::new(states.get() + place as i32));
        }
    }
    drop(page_writer);
    for (id, base) in [(regular, Name(b"Helvetica")), (bold, Name(b"Helvetica-Bold"))] {
        pdf.type1_font(id).base_font(base).encoding_predefined(Name(b"WinAnsiEncoding"));
    }
    for (place, opacity) in opacities.iter().enumerate() {
        let mut state = pdf.ext_graphics(Ref::new(states.get() + place as i32));
        state.non_stroking_alpha(*opacity as f32).stroking_alpha(*opacity as f32);
    }
    pdf.stream(contents, &content(sheet, &opacities));
    pdf.finish()
}

fn state_name(place: usize) -> String {
    format!("G{place}")
}

/// Every opacity in use, once.
fn opacities(sheet: &Sheet) -> Vec<f64> {
    let mut opacities: Vec<f64> = vec![1.0];
    for shape in &sheet.shapes {
        if let Shape::Path { paint, .. } = shape
            && !opacities.contains(&paint.opacity)
        {
            opacities.push(paint.opacity);
        }
    }
    opacities
}

fn content(sheet: &Sheet, opacities: &[f64]) -> Vec<u8> {
    let mut content = Content::new();
    // PDF's y axis points up.
    content.transform([1.0, 0.0, 0.0, -1.0, 0.0, sheet.height as f32]);
    content.set_line_join(LineJoinStyle::RoundJoin);
    for shape in &sheet.shapes {
        match shape {
            Shape::Path { points, is_closed, paint } => {
                let place = opacities.iter().position(|one| *one == paint.opacity).unwrap_or(0);
                content.set_parameters(Name(state_name(place).as_bytes()));
                let dashes = [paint.dash as f32; 2];
                content.set_dash_pattern(dashes[..if paint.dash > 0.0 { 2 } else { 0 }].iter().copied(), 0.0);
                draw(&mut content, points, *is_closed, *paint);
            }
            Shape::Clip(rect) => {
                content.save_state();
                content.rect(rect.x as f32, rect.y as f32, rect.w as f32, rect.h as f32);
                content.clip_nonzero().end_path();
            }
            Shape::EndClip => drop(content.restore_state()),
            Shape::Text { at, text, set } => write(&mut content, *at, text, *set),
            // Nothing appears on paper.
            Shape::Hover { .. } => {}
        }
    }
    content.finish().to_vec()
}

fn draw(content: &mut Content, points: &[(f64, f64)], is_closed: bool, paint: Paint) {
    let Paint { stroke, fill, .. } = paint;
    for (place, (x, y)) in points.iter().enumerate() {
        if place == 0 {
            content.move_to(*x as f32, *y as f32);
        } else {
            content.line_to(*x as f32, *y as f32);
        }
    }
    if is_closed {
        content.close_path();
    }
    if let Some((colour, width)) = stroke {
        let [r, g, b] = rgb(colour);
        content.set_stroke_rgb(r, g, b).set_line_width(width as f32);
    }
    if let Some(colour) = fill {
        let [r, g, b] = rgb(colour);
        content.set_fill_rgb(r, g, b);
    }
    match (stroke.is_some(), fill.is_some()) {
        (true, true) => content.fill_nonzero_and_stroke(),
        (true, false) => content.stroke(),
        (false, true) => content.fill_nonzero(),
        (false, false) => content.end_path(),
    };
}

fn write(content: &mut Content, (x, y): (f64, f64), text: &str, set: Type) {
    let encoded: Vec<u8> = text.chars().map(win_ansi).collect();
    let shift = match set.anchor {
        Anchor::Start => 0.0,
        Anchor::Middle => width(&encoded, set) / 2.0,
        Anchor::End => width(&encoded, set),
    };
    let [r, g, b] = rgb(set.colour);
    content.set_parameters(Name(state_name(0).as_bytes()));
    content.begin_text().set_fill_rgb(r, g, b);
    content.set_font(if set.bold { BOLD } else { REGULAR }, set.size as f32);
    // The text is not mirrored.
    content.set_text_matrix([1.0, 0.0, 0.0, -1.0, (x - shift) as f32, y as f32]);
    content.show(Str(&encoded)).end_text();
}

fn width(encoded: &[u8], set: Type) -> f64 {
    let of = |byte: &u8| {
        let place = usize::from(byte.wrapping_sub(b' '));
        f64::from(WIDTHS.get(place).copied().unwrap_or(OTHER_WIDTH))
    };
    let widen = if set.bold { BOLD_WIDENS } else { 1.0 };
    encoded.iter().map(of).sum::<f64>() * set.size / 1000.0 * widen
}

/// A character in WinAnsiEncoding, which is the code point for most Latin characters.
fn win_ansi(c: char) -> u8 {
    match c {
        '–' => 0x96,
        '—' => 0x97,
        '…' => 0x85,
        '’' => 0x92,
        'σ' => b's',
        _ => u8::try_from(u32::from(c)).unwrap_or(b'?'),
    }
}

/// Of `#rrggbb`; black for anything else.
fn rgb(colour: Colour) -> [f32; 3] {
    let part = |place: usize| {
        let digits = colour.get(1 + 2 * place..3 + 2 * place).unwrap_or("00");
        f32::from(u8::from_str_radix(digits, 16).unwrap_or(0)) / 255.0
    };
    [part(0), part(1), part(2)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_parsed_by_component() {
        assert_eq!(rgb("#ff0080"), [1.0, 0.0, 128.0 / 255.0]);
    }

    #[test]
    fn texts_end_where_they_are_anchored() {
        let set = Type { size: 10.0, bold: false, colour: "#000000", anchor: Anchor::End };
        // Helvetica: "m" 833, "i" 222.
        assert!((width(b"mi", set) - 10.55).abs() < 1e-9);
        assert_eq!("°±×–".chars().map(win_ansi).collect::<Vec<_>>(), [0xb0, 0xb1, 0xd7, 0x96]);
    }

    #[test]
    fn a_document_has_one_page_with_all_elements() {
        let mut sheet = Sheet::new(200, 100);
        sheet.line(&[(0.0, 0.0), (200.0, 100.0)], ("#ff0000", 2.0));
        sheet.shade(&[(0.0, 0.0), (10.0, 0.0), (0.0, 10.0)], "#00ff00", 0.25);
        sheet.text(
            (10.0, 20.0),
            "mATE",
            Type { size: 10.0, bold: true, colour: "#000000", anchor: Anchor::Start },
        );
        let pdf = sheet.pdf();
        let text = String::from_utf8_lossy(&pdf);
        assert!(text.starts_with("%PDF-") && text.trim_end().ends_with("%%EOF"));
        for part in ["/MediaBox [0 0 200 100]", "/Helvetica-Bold", "(mATE)", "1 0 0 RG", "/ca 0.25"] {
            assert!(text.contains(part), "{part}");
        }
    }
}
