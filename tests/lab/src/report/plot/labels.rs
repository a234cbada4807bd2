//! Words beside marks, none of which lies over another or over a box.

use crate::report::plot::sheet::{Rect, Sheet, Type};

/// The labels of a panel.
pub(super) struct Labels {
    /// What labels keep clear of, if there is room: boxes.
    pub(super) boxes: Vec<Rect>,
    /// What no label lies over: other labels.
    pub(super) taken: Vec<Rect>,
    pub(super) panel: Rect,
}

impl Labels {
    /// Writes a label at the first place around its mark that is clear of boxes and labels; `false` if there is none.
    pub(super) fn write(&mut self, sheet: &mut Sheet, label: &Label<'_>) -> bool {
        let is_clear =
            |place: Rect| self.is_free(place) && self.boxes.iter().all(|one| is_apart(place, *one));
        let place = label.places().into_iter().find(|place| is_clear(*place));
        self.write_at(sheet, label, place)
    }

    /// The same over boxes if there is no other room.
    pub(super) fn write_anyhow(&mut self, sheet: &mut Sheet, label: &Label<'_>) -> bool {
        let place = label.places().into_iter().find(|place| self.is_free(*place));
        self.write(sheet, label) || self.write_at(sheet, label, place)
    }

    fn write_at(&mut self, sheet: &mut Sheet, label: &Label<'_>, place: Option<Rect>) -> bool {
        if let Some(place) = place {
            sheet.text((place.x, place.y + 0.8 * place.h), label.text, label.set);
            self.taken.push(place);
        }
        place.is_some()
    }

    fn is_free(&self, place: Rect) -> bool {
        let Rect { x, y, w, h } = place;
        let Rect { x: left, y: top, w: width, h: height } = self.panel;
        let is_inside = x >= left && y >= top && x + w <= left + width && y + h <= top + height;
        is_inside && self.taken.iter().all(|other| is_apart(place, *other))
    }
}

/// A word for a mark.
pub(super) struct Label<'a> {
    /// The mark.
    pub(super) around: Rect,
    pub(super) text: &'a str,
    pub(super) set: Type,
}

impl Label<'_> {
    /// To the right, to the left, above and below, from near to far.
    #[expect(clippy::cast_precision_loss, reason = "a count of letters")]
    fn places(&self) -> Vec<Rect> {
        let (w, h) = (0.62 * self.set.size * self.text.chars().count() as f64, 1.1 * self.set.size);
        let Rect { x: left, y: top, .. } = self.around;
        let (right, bottom) = (left + self.around.w, top + self.around.h);
        let (middle, level) = (f64::midpoint(left, right), f64::midpoint(top, bottom));
        let at = |gap: f64| {
            [
                (right + gap, level - h / 2.0),
                (left - gap - w, level - h / 2.0),
                (middle - w / 2.0, top - gap - h),
                (middle - w / 2.0, bottom + gap),
                (right + gap, top - gap - h),
                (right + gap, bottom + gap),
                (left - gap - w, top - gap - h),
                (left - gap - w, bottom + gap),
            ]
        };
        [4.0, 16.0, 30.0].into_iter().flat_map(at).map(|(x, y)| Rect { x, y, w, h }).collect()
    }
}

/// Whether two rectangles have no point in common.
pub(super) fn is_apart(a: Rect, b: Rect) -> bool {
    a.x + a.w < b.x || b.x + b.w < a.x || a.y + a.h < b.y || b.y + b.h < a.y
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::palette::INK;
    use crate::report::plot::sheet::Anchor;

    const SET: Type = Type { size: 19.0, colour: INK, bold: true, anchor: Anchor::Start };
    const PANEL: Rect = Rect { x: 20.0, y: 90.0, w: 930.0, h: 930.0 };

    fn label((x, y): (f64, f64), text: &str) -> Label<'_> {
        Label { around: Rect { x: x - 10.0, y: y - 10.0, w: 20.0, h: 20.0 }, text, set: SET }
    }

    #[test]
    fn labels_at_one_place_do_not_overlap_and_stay_in_the_panel() {
        let mut sheet = Sheet::new(1000, 1100);
        let mut labels = Labels { boxes: Vec::new(), taken: Vec::new(), panel: PANEL };
        let corner = (PANEL.x + PANEL.w - 2.0, PANEL.y + 2.0);
        for at in [(300.0, 300.0), (302.0, 301.0), (299.0, 303.0), corner, corner] {
            labels.write(&mut sheet, &label(at, "rsu-north"));
        }
        assert!(labels.taken.len() >= 4, "{:?}", labels.taken);
        for (place, label) in labels.taken.iter().enumerate() {
            assert!(labels.taken[..place].iter().all(|other| is_apart(*label, *other)), "{:?}", labels.taken);
            assert!(label.x >= PANEL.x && label.x + label.w <= PANEL.x + PANEL.w && label.y >= PANEL.y);
        }
    }

    #[test]
    fn a_label_keeps_clear_of_boxes_or_is_left_out_unless_it_must_be_there() {
        let mut sheet = Sheet::new(1000, 1100);
        let beside = Rect { x: 311.0, y: 280.0, w: 200.0, h: 40.0 };
        let mut labels = Labels { boxes: vec![beside], taken: Vec::new(), panel: PANEL };
        assert!(labels.write(&mut sheet, &label((300.0, 300.0), "car")));
        assert!(is_apart(labels.taken[0], beside), "{:?}", labels.taken);
        labels.boxes.push(PANEL);
        assert!(!labels.write(&mut sheet, &label((600.0, 600.0), "car")));
        assert!(labels.write_anyhow(&mut sheet, &label((600.0, 600.0), "ego")));
    }
}
