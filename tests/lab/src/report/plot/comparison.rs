//! One moment under several methods, one picture above the other: the paper's Fig. 5.

use crate::report::palette::{AGENTS, Colour, INK, OURS, TRUTH, TRUTH_FILL, is_of_ours};
use crate::report::plot::bev::{Pen, Viewport, busiest_spot, panel_in};
use crate::report::plot::figure_parts::{FigureParts, Layout};
use crate::report::plot::legend::{Key, font, legend_row, swatches};
use crate::report::plot::scene::BevScene;
use crate::report::plot::sheet::{Paint, Rect, Sheet};

const WIDTH: u32 = 1100;
const MARGIN: f64 = 20.0;
/// Height of the titles of the whole and of each picture, and of the legend.
const HEAD: f64 = 84.0;
const TITLE: f64 = 38.0;
const LEGEND: f64 = 50.0;
const PICTURE: f64 = 540.0;
/// Half of the width of what is shown, m: of a pedestrian a box is left.
const HALF_M: f64 = 32.0;
/// Size of a picture on a page, px: what is in it can be seen where the page is 400 px wide.
const PICTURE_SIZE: (u32, u32) = (760, 420);
const PEN: Pen = Pen { grid_m: 10.0, thin: 1.8, thick: 2.8, has_words: false, has_tints: false };

/// The pictures to be compared. All have the same truth and agents.
pub(crate) struct Comparison {
    /// Title.
    pub title: String,
    /// Which moment that is, and why.
    pub subtitle: String,
    /// The methods' names, with what they publish.
    pub scenes: Vec<(String, BevScene)>,
}

impl Comparison {
    /// The drawing: the densest part of the map, the same in every picture.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a positive number of pixels"
    )]
    pub(crate) fn sheet(&self) -> Sheet {
        let height = HEAD + (0..self.scenes.len()).map(|_| TITLE + PICTURE).sum::<f64>() + LEGEND;
        let mut sheet = Sheet::labelled((WIDTH, height as u32), &self.title);
        sheet.text((MARGIN, 38.0), &self.title, font(26.0, true));
        sheet.text((MARGIN, 68.0), &self.subtitle, font(17.0, false));
        let mut top = HEAD;
        for (method, scene) in &self.scenes {
            top += TITLE;
            let place = Rect { x: MARGIN, y: top, w: f64::from(WIDTH) - 2.0 * MARGIN, h: PICTURE };
            let view = self.view(place);
            sheet.text((MARGIN, top - 12.0), &title(method, scene, &view), font(20.0, true));
            panel_in(&mut sheet, scene, (&view, colour(method)), &PEN);
            top += PICTURE;
        }
        legend_row(&mut sheet, Rect { x: MARGIN, y: top + 10.0, w: 1060.0, h: 34.0 }, &self.legend());
        sheet
    }

    /// The pictures, each a drawing of its own.
    pub(crate) fn parts(&self) -> FigureParts {
        let (width, height) = (f64::from(PICTURE_SIZE.0) - 2.0, f64::from(PICTURE_SIZE.1) - 2.0);
        let view = self.view(Rect { x: 1.0, y: 1.0, w: width, h: height });
        let picture = |(method, scene): &(String, BevScene)| {
            let caption = title(method, scene, &view);
            let mut sheet = Sheet::labelled(PICTURE_SIZE, &format!("{}: {caption}", self.title));
            panel_in(&mut sheet, scene, (&view, colour(method)), &PEN);
            (caption, sheet)
        };
        FigureParts {
            title: self.title.clone(),
            subtitle: self.subtitle.clone(),
            panels: self.scenes.iter().map(picture).collect(),
            legend: swatches(self.legend()),
            layout: Layout::Rows,
        }
    }

    /// The densest part of the map.
    fn view(&self, panel: Rect) -> Viewport {
        let centre = self.scenes.first().map_or((0.0, 0.0), |(_, first)| busiest_spot(first, HALF_M));
        Viewport { centre, half_m: HALF_M, panel }
    }

    fn legend(&self) -> Vec<(Key, String)> {
        let truth = Key::Box(Paint { fill: Some(TRUTH_FILL), ..Paint::line(TRUTH, 3.0) });
        let agents = self.scenes.first().map_or(&[][..], |(_, first)| &first.agents);
        let agents = agents.iter().zip(AGENTS.iter().cycle());
        let agents = agents.map(|(agent, colour)| {
            (Key::Agent(agent.marked_as(), colour), format!("{}'s detections", agent.id))
        });
        let methods = self
            .scenes
            .iter()
            .map(|(method, _)| (Key::Box(Paint::line(colour(method), 3.6)), format!("boxes of {method}")));
        std::iter::once((truth, "truth".to_owned())).chain(agents).chain(methods).collect()
    }
}

/// Fused boxes are in our colour only where they are ours.
fn colour(method: &str) -> Colour {
    if is_of_ours(method) { OURS } else { INK }
}

/// The method, and how many boxes and objects can be counted in its picture.
fn title(method: &str, scene: &BevScene, view: &Viewport) -> String {
    let objects = scene.truth.iter().filter(|one| one.is_covered && view.shows(one.bev.x, one.bev.y, 0.0));
    let boxes = scene.fused.iter().filter(|mark| view.shows(mark.bev.x, mark.bev.y, 0.0));
    format!("{method}: here {} boxes of {} objects", boxes.count(), objects.count())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::plot::scene::{FusedMark, TrueBox};
    use v2x_common::class::Class;
    use v2x_common::geometry::BevBox;

    fn car(x: f64) -> BevBox {
        BevBox { x, y: 0.0, w: 2.0, d: 4.0, yaw: 0.0 }
    }

    fn mark(x: f64) -> FusedMark {
        FusedMark { bev: car(x), class: Class::Car, words: String::new() }
    }

    #[test]
    fn only_our_boxes_have_our_colour() {
        assert_eq!((colour("ours"), colour("ours-cv")), (OURS, OURS));
        assert_ne!(colour("nms"), OURS);
    }

    #[test]
    fn each_method_has_a_picture_of_the_same_place_with_what_can_be_counted_in_it() {
        let truth =
            [0.0, 8.0, 500.0].map(|x| TrueBox { bev: car(x), class: Class::Car, is_covered: true }).to_vec();
        let of = |fused: &[f64]| BevScene {
            truth: truth.clone(),
            fused: fused.iter().map(|x| mark(*x)).collect(),
            ..BevScene::default()
        };
        let scenes = vec![
            ("nms".to_owned(), of(&[0.1, 0.9, 8.0, 500.0])),
            ("ours".to_owned(), of(&[0.1, 8.0, 500.0])),
        ];
        let comparison = Comparison { title: "one".to_owned(), subtitle: String::new(), scenes };
        let svg = comparison.sheet().svg();
        assert!(svg.contains("nms: here 3 boxes of 2 objects"), "{svg}");
        assert!(svg.contains("ours: here 2 boxes of 2 objects"));
        let at = |text: &str| svg.find(text).unwrap();
        assert!(at("nms: here") < at("ours: here"), "one above the other");
        assert_eq!(svg.matches("<svg ").count(), 1 + 2);
        let parts = comparison.parts();
        let captions: Vec<&str> = parts.panels.iter().map(|(caption, _)| caption.as_str()).collect();
        assert_eq!(captions, ["nms: here 3 boxes of 2 objects", "ours: here 2 boxes of 2 objects"]);
        assert_eq!(parts.legend.len(), 1 + 2, "truth and the methods");
        assert!(comparison.sheet().pdf().starts_with(b"%PDF"));
    }
}
