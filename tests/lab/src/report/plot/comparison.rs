//! One moment under several methods, one picture above the other: the paper's Fig. 5.

use crate::report::palette::AGENTS;
use crate::report::plot::bev::{FUSED_BOX, Pen, TRUE_BOX, Viewport, busiest_spot, font, legend_row, panel};
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
        let mut sheet = Sheet::new(WIDTH, height as u32);
        sheet.text((MARGIN, 38.0), &self.title, font(26.0, true));
        sheet.text((MARGIN, 68.0), &self.subtitle, font(17.0, false));
        let Some((_, first)) = self.scenes.first() else { return sheet };
        let centre = busiest_spot(first, HALF_M);
        let mut top = HEAD;
        for (method, scene) in &self.scenes {
            top += TITLE;
            let place = Rect { x: MARGIN, y: top, w: f64::from(WIDTH) - 2.0 * MARGIN, h: PICTURE };
            let view = Viewport { centre, half_m: HALF_M, panel: place };
            sheet.text((MARGIN, top - 12.0), &title(method, scene, &view), font(20.0, true));
            panel(&mut sheet, scene, &view, &Pen { grid_m: 10.0, thin: 1.8, thick: 2.8, has_letters: false });
            top += PICTURE;
        }
        legend_row(&mut sheet, Rect { x: MARGIN, y: top + 10.0, w: 1060.0, h: 34.0 }, &legend(first));
        sheet
    }
}

/// The method, and how many boxes and objects can be counted in its picture.
fn title(method: &str, scene: &BevScene, view: &Viewport) -> String {
    let objects = scene.truth.iter().filter(|one| one.is_covered && view.shows(one.bev.x, one.bev.y, 0.0));
    let boxes = scene.fused.iter().filter(|bev| view.shows(bev.x, bev.y, 0.0));
    format!("{method}: here {} boxes of {} objects", boxes.count(), objects.count())
}

fn legend(scene: &BevScene) -> Vec<(Paint, String)> {
    let agents = scene.agents.iter().zip(AGENTS.iter().cycle());
    let agents =
        agents.map(|(agent, colour)| (Paint::line(colour, 2.6), format!("{}'s detections", agent.id)));
    let truth = std::iter::once((TRUE_BOX, "truth".to_owned()));
    truth.chain(agents).chain([(FUSED_BOX, "fused".to_owned())]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::plot::scene::TrueBox;
    use v2x_common::geometry::BevBox;

    fn car(x: f64) -> BevBox {
        BevBox { x, y: 0.0, w: 2.0, d: 4.0, yaw: 0.0 }
    }

    #[test]
    fn each_method_has_a_picture_of_the_same_place_with_what_can_be_counted_in_it() {
        let truth = [0.0, 8.0, 500.0].map(|x| TrueBox { bev: car(x), is_covered: true }).to_vec();
        let of = |fused: &[f64]| BevScene {
            truth: truth.clone(),
            fused: fused.iter().map(|x| car(*x)).collect(),
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
        assert!(comparison.sheet().pdf().starts_with(b"%PDF"));
    }
}
