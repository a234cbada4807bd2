//! A bird's-eye view of one time, in the paper's colours: truth blue, first agent red, second green, fused magenta.
//!
//! On the left the whole scene, on the right its densest region enlarged, and the legend. Other figures take its panels.

use crate::report::palette::{
    AGENTS, BAND, Colour, FAINT, INK, MUTED, OURS as FUSED, PAPER, TRUTH, TRUTH_FILL,
};
use crate::report::plot::scene::{BevScene, SceneAgent};
use crate::report::plot::sheet::{Anchor, Paint, Rect, Sheet, Type};
use v2x_agent::world::{Road, RoadKind};
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::sensor::SensorKind;

const WIDTH: u32 = 1500;
const HEIGHT: u32 = 1040;
const WHOLE: Rect = Rect { x: 20.0, y: 90.0, w: 930.0, h: 930.0 };
const DETAIL: Rect = Rect { x: 970.0, y: 90.0, w: 510.0, h: 510.0 };
const LEGEND: Rect = Rect { x: 970.0, y: 630.0, w: 510.0, h: 390.0 };

/// Half of the side of the enlarged region, m.
const DETAIL_HALF_M: f64 = 12.0;

/// The picture.
pub(crate) fn bev_sheet(scene: &BevScene) -> Sheet {
    let mut sheet = Sheet::new(WIDTH, HEIGHT);
    sheet.text((WHOLE.x, 42.0), &scene.title, font(30.0, true));
    sheet.text((WHOLE.x, 73.0), &scene.subtitle, font(20.0, false));
    let whole = Viewport::around(scene, WHOLE);
    let centre = busiest_spot(scene, DETAIL_HALF_M);
    let detail = Viewport { centre, half_m: DETAIL_HALF_M.min(whole.half_m), panel: DETAIL };
    panel(&mut sheet, scene, &whole, &Pen { grid_m: 10.0, thin: 1.4, thick: 2.2, has_letters: false });
    sheet.rect(whole.rect_of(&detail), Paint { dash: 6.0, ..Paint::line(INK, 2.0) });
    panel(&mut sheet, scene, &detail, &Pen { grid_m: 2.0, thin: 2.2, thick: 3.4, has_letters: true });
    sheet.text((DETAIL.x + 14.0, DETAIL.y + 28.0), "the dashed square, enlarged", font(18.0, false));
    legend_rows(&mut sheet, LEGEND, &legend(scene));
    sheet
}

/// A part of the map on a panel of the sheet: as wide as twice `half_m`, and as high as the panel's shape makes it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Viewport {
    pub(super) centre: (f64, f64),
    pub(super) half_m: f64,
    pub(super) panel: Rect,
}

impl Viewport {
    /// Around all covered objects, fused objects and agents.
    fn around(scene: &BevScene, panel: Rect) -> Self {
        let covered =
            scene.truth.iter().filter(|truth| truth.is_covered).map(|truth| (truth.bev.x, truth.bev.y));
        let fused = scene.fused.iter().map(|bev| (bev.x, bev.y));
        let agents = scene.agents.iter().filter_map(|agent| agent.pose).map(|pose| (pose.x, pose.y));
        let (mut low, mut high) = ((f64::MAX, f64::MAX), (f64::MIN, f64::MIN));
        for (x, y) in covered.chain(fused).chain(agents) {
            low = (low.0.min(x), low.1.min(y));
            high = (high.0.max(x), high.1.max(y));
        }
        if low.0 > high.0 {
            return Self { centre: (0.0, 0.0), half_m: 50.0, panel };
        }
        let half_m = (high.0 - low.0).max(high.1 - low.1) / 2.0 + 6.0;
        Self { centre: ((low.0 + high.0) / 2.0, (low.1 + high.1) / 2.0), half_m, panel }
    }

    fn half_height_m(&self) -> f64 {
        self.half_m * self.panel.h / self.panel.w
    }

    fn px_per_m(&self) -> f64 {
        self.panel.w / (2.0 * self.half_m)
    }

    fn px(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let scale = self.px_per_m();
        let (left, top) = (self.centre.0 - self.half_m, self.centre.1 + self.half_height_m());
        (self.panel.x + (x - left) * scale, self.panel.y + (top - y) * scale)
    }

    /// Another viewport's part of the map on this panel.
    fn rect_of(&self, other: &Self) -> Rect {
        let (x, y) = self.px((other.centre.0 - other.half_m, other.centre.1 + other.half_height_m()));
        let (w, h) = (2.0 * other.half_m * self.px_per_m(), 2.0 * other.half_height_m() * self.px_per_m());
        Rect { x, y, w, h }
    }

    pub(super) fn shows(&self, x: f64, y: f64, margin_m: f64) -> bool {
        (x - self.centre.0).abs() <= self.half_m + margin_m
            && (y - self.centre.1).abs() <= self.half_height_m() + margin_m
    }
}

/// The covered object with most covered objects and boxes around it, m.
pub(super) fn busiest_spot(scene: &BevScene, half_m: f64) -> (f64, f64) {
    let boxes = || scene.agents.iter().flat_map(|agent| &agent.detections).chain(&scene.fused);
    let covered = || scene.truth.iter().filter(|truth| truth.is_covered).map(|truth| &truth.bev);
    let crowd = |centre: &BevBox| {
        let spot = Viewport { centre: (centre.x, centre.y), half_m: 0.8 * half_m, panel: DETAIL };
        covered().chain(boxes()).filter(|bev| spot.shows(bev.x, bev.y, 0.0)).count()
    };
    covered().max_by_key(|bev| crowd(bev)).map_or((0.0, 0.0), |bev| (bev.x, bev.y))
}

/// The style of a panel: line widths in px.
pub(super) struct Pen {
    pub(super) grid_m: f64,
    pub(super) thin: f64,
    pub(super) thick: f64,
    /// Whether each fused object has the letter of its class.
    pub(super) has_letters: bool,
}

/// Draws what a viewport shows.
pub(super) fn panel(sheet: &mut Sheet, scene: &BevScene, view: &Viewport, pen: &Pen) {
    sheet.clipped(view.panel, |sheet| {
        sheet.rect(view.panel, Paint::fill(BAND));
        scene.roads.iter().for_each(|line| road(sheet, view, line));
        grid(sheet, view, pen.grid_m);
        boxes(sheet, scene, view, pen);
        scene.motions.iter().for_each(|motion| arrow(sheet, view, *motion, pen));
        labels(sheet, scene, view, pen);
        scale_bar(sheet, view);
    });
    sheet.rect(view.panel, Paint::line(MUTED, 1.5));
}

/// Truth below detections below fused objects.
fn boxes(sheet: &mut Sheet, scene: &BevScene, view: &Viewport, pen: &Pen) {
    for truth in &scene.truth {
        let paint = if truth.is_covered {
            Paint { fill: Some(TRUTH_FILL), ..Paint::line(TRUTH, pen.thick) }
        } else {
            Paint { dash: 3.5, opacity: 0.5, ..Paint::line(TRUTH, pen.thin) }
        };
        bev_box(sheet, view, &truth.bev, paint);
    }
    for (agent, colour) in scene.agents.iter().zip(AGENTS.iter().cycle()) {
        agent.detections.iter().for_each(|bev| bev_box(sheet, view, bev, Paint::line(colour, pen.thin)));
    }
    scene.fused.iter().for_each(|bev| bev_box(sheet, view, bev, Paint::line(FUSED, pen.thick)));
}

/// Agents with their names, and letters of classes.
fn labels(sheet: &mut Sheet, scene: &BevScene, view: &Viewport, pen: &Pen) {
    let mut labels = Labels { taken: Vec::new(), panel: view.panel };
    for (agent, colour) in scene.agents.iter().zip(AGENTS.iter().cycle()) {
        if let Some(pose) = agent.pose.filter(|pose| view.shows(pose.x, pose.y, 0.0)) {
            marker(sheet, view, agent, (&pose, colour));
            labels.write(sheet, view.px((pose.x, pose.y)), agent.id.as_str(), 19.0);
        }
    }
    for (at, letter) in scene.letters.iter().filter(|_| pen.has_letters) {
        if view.shows(at.0, at.1, 0.0) {
            labels.write(sheet, view.px(*at), letter, 15.0);
        }
    }
}

/// An area, or a line on the ground in its true width, thin ones at least a hair.
fn road(sheet: &mut Sheet, view: &Viewport, road: &Road) {
    if road.kind == RoadKind::Area {
        let border: Vec<_> = road.points.iter().map(|point| view.px(*point)).collect();
        sheet.path(&border, true, Paint::fill(FAINT));
        return;
    }
    let colour = if road.kind == RoadKind::Surface { FAINT } else { PAPER };
    let width = (road.width_m * view.px_per_m()).max(1.0);
    for pair in road.points.windows(2) {
        sheet.line(&[view.px(pair[0]), view.px(pair[1])], (colour, width));
    }
}

fn grid(sheet: &mut Sheet, view: &Viewport, step_m: f64) {
    let paint = Paint { opacity: 0.6, ..Paint::line(FAINT, 1.0) };
    let first = |low: f64| libm::ceil(low / step_m) * step_m;
    let Rect { x: left, y: top, w, h } = view.panel;
    let mut offset = first(view.centre.0 - view.half_m);
    while offset <= view.centre.0 + view.half_m {
        let (x, _) = view.px((offset, 0.0));
        sheet.path(&[(x, top), (x, top + h)], false, paint);
        offset += step_m;
    }
    let mut offset = first(view.centre.1 - view.half_height_m());
    while offset <= view.centre.1 + view.half_height_m() {
        let (_, y) = view.px((0.0, offset));
        sheet.path(&[(left, y), (left + w, y)], false, paint);
        offset += step_m;
    }
}

/// The box, with a tick over its front edge.
fn bev_box(sheet: &mut Sheet, view: &Viewport, bev: &BevBox, paint: Paint) {
    if !view.shows(bev.x, bev.y, bev.circumradius()) {
        return;
    }
    sheet.path(&bev.corners().map(|corner| view.px(corner)), true, paint);
    let tick = [bev.d / 4.0, bev.d / 2.0 + 0.4].map(|ahead| view.px(bev.pose().offset(ahead, 0.0)));
    sheet.path(&tick, false, Paint { fill: None, dash: 0.0, ..paint });
}

/// A vehicle is an arrow head in the direction of its heading, a roadside unit is a diamond.
fn marker(sheet: &mut Sheet, view: &Viewport, agent: &SceneAgent, (pose, colour): (&Pose, Colour)) {
    let (x, y) = view.px((pose.x, pose.y));
    let (sin, cos) = libm::sincos(pose.yaw);
    let shape: &[(f64, f64)] = match agent.kind {
        SensorKind::Vehicle => &[(16.0, 0.0), (-11.0, 10.0), (-5.0, 0.0), (-11.0, -10.0)],
        SensorKind::RoadsideUnit => &[(13.0, 0.0), (0.0, 13.0), (-13.0, 0.0), (0.0, -13.0)],
    };
    let turned = |&(ahead, left): &(f64, f64)| (x + ahead * cos - left * sin, y - ahead * sin - left * cos);
    let points: Vec<_> = shape.iter().map(turned).collect();
    sheet.path(&points, true, Paint { fill: Some(colour), ..Paint::line(INK, 2.0) });
}

/// Where the object will be in a second.
fn arrow(sheet: &mut Sheet, view: &Viewport, [from, to]: [(f64, f64); 2], pen: &Pen) {
    if !view.shows(from.0, from.1, 0.0) {
        return;
    }
    let (tail, tip) = (view.px(from), view.px(to));
    let (dx, dy) = (tip.0 - tail.0, tip.1 - tail.1);
    let length = libm::hypot(dx, dy);
    // Shorter ones would be a head alone.
    if length < 8.0 {
        return;
    }
    let (ahead, left) = ((dx / length, dy / length), (-dy / length, dx / length));
    sheet.line(&[tail, tip], (FUSED, pen.thin));
    for side in [-1.0, 1.0] {
        let barb = |axis: fn((f64, f64)) -> f64| axis(tip) - 8.0 * axis(ahead) + side * 4.0 * axis(left);
        sheet.line(&[tip, (barb(|point| point.0), barb(|point| point.1))], (FUSED, pen.thin));
    }
}

/// The labels of a panel, none of which lies over another.
struct Labels {
    taken: Vec<Rect>,
    panel: Rect,
}

impl Labels {
    /// Writes a label at the first free place beside a point; nowhere if there is none.
    #[expect(clippy::cast_precision_loss, reason = "a count of letters")]
    fn write(&mut self, sheet: &mut Sheet, (x, y): (f64, f64), label: &str, size: f64) {
        let (w, h) = (0.62 * size * label.chars().count() as f64, 1.1 * size);
        let places = [
            (x + 16.0, y - 12.0 - h / 2.0),
            (x + 16.0, y + 12.0 - h / 2.0),
            (x - 16.0 - w, y - 12.0 - h / 2.0),
            (x - 16.0 - w, y + 12.0 - h / 2.0),
            (x - w / 2.0, y - 18.0 - h),
            (x - w / 2.0, y + 18.0),
            (x + 34.0, y - h / 2.0),
            (x - 34.0 - w, y - h / 2.0),
        ];
        let free = places.into_iter().map(|(x, y)| Rect { x, y, w, h }).find(|place| self.is_free(*place));
        if let Some(place) = free {
            sheet.text((place.x, place.y + 0.8 * h), label, font(size, true));
            self.taken.push(place);
        }
    }

    fn is_free(&self, Rect { x, y, w, h }: Rect) -> bool {
        let Rect { x: left, y: top, w: width, h: height } = self.panel;
        let is_inside = x >= left && y >= top && x + w <= left + width && y + h <= top + height;
        let is_apart = |other: &Rect| {
            x + w < other.x || other.x + other.w < x || y + h < other.y || other.y + other.h < y
        };
        is_inside && self.taken.iter().all(is_apart)
    }
}

/// The longest of 1, 2, 5, 10 … m that is at most a quarter of the panel.
fn scale_bar(sheet: &mut Sheet, view: &Viewport) {
    let lengths = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0];
    let length_m = lengths.into_iter().rfind(|length| *length <= view.half_m / 2.0).unwrap_or(1.0);
    let (x, y) = (view.panel.x + 18.0, view.panel.y + view.panel.h - 18.0);
    let end = x + length_m * view.px_per_m();
    for line in [[(x, y), (end, y)], [(x, y - 6.0), (x, y + 6.0)], [(end, y - 6.0), (end, y + 6.0)]] {
        sheet.line(&line, (INK, 3.0));
    }
    let middle = Type { anchor: Anchor::Middle, ..font(18.0, false) };
    sheet.text((f64::midpoint(x, end), y - 11.0), &format!("{length_m} m"), middle);
}

/// What each kind of box is, and how many there are.
fn legend(scene: &BevScene) -> Vec<(Paint, String)> {
    let n_covered = scene.truth.iter().filter(|truth| truth.is_covered).count();
    let n_others = scene.truth.len() - n_covered;
    let mut rows = vec![(TRUE_BOX, format!("truth: {n_covered} objects in view for 1 s"))];
    if n_others > 0 {
        let dashed = Paint { dash: 3.5, opacity: 0.5, ..Paint::line(TRUTH, 2.0) };
        rows.push((dashed, format!("truth not (yet) in view: {n_others} objects")));
    }
    for (agent, colour) in scene.agents.iter().zip(AGENTS.iter().cycle()) {
        let when =
            agent.offset.map_or_else(String::new, |offset| format!(" at {:+.0} ms", offset.as_millis_f64()));
        let (id, kind, n) = (agent.id, agent.kind.name(), agent.detections.len());
        rows.push((Paint::line(colour, 2.6), format!("{id} ({kind}): {n} detections{when}")));
    }
    rows.push((FUSED_BOX, format!("fused: {} objects", scene.fused.len())));
    if !scene.motions.is_empty() {
        rows.push((Paint::NONE, "arrow: the way of one second".to_owned()));
    }
    if !scene.letters.is_empty() {
        rows.push((Paint::NONE, "letter: class, as C car, P pedestrian, T truck".to_owned()));
    }
    rows
}

/// How the legend shows a true object, and a fused one.
pub(super) const TRUE_BOX: Paint = Paint { fill: Some(TRUTH_FILL), ..Paint::line(TRUTH, 3.0) };
pub(super) const FUSED_BOX: Paint = Paint::line(FUSED, 3.6);

/// The rows of a legend, one below the other.
#[expect(clippy::cast_precision_loss, reason = "counts of rows and letters")]
pub(super) fn legend_rows(sheet: &mut Sheet, place: Rect, rows: &[(Paint, String)]) {
    let pitch = (place.h / rows.len() as f64).min(40.0);
    // Letters of these fonts are on average at most 0.6 em wide: long names get a smaller font.
    let longest = rows.iter().map(|(_, text)| text.chars().count()).max().unwrap_or(1);
    let size = (pitch * 0.55).min(21.0).min((place.w - 64.0) / (0.6 * longest as f64));
    let mut middle = place.y + pitch / 2.0;
    for (paint, text) in rows {
        sheet.rect(Rect { x: place.x + 4.0, y: middle - pitch * 0.28, w: 44.0, h: pitch * 0.56 }, *paint);
        sheet.text((place.x + 64.0, middle + size * 0.35), text, font(size, false));
        middle += pitch;
    }
}

/// A legend in one row.
#[expect(clippy::cast_precision_loss, reason = "a count of columns")]
pub(super) fn legend_row(sheet: &mut Sheet, place: Rect, entries: &[(Paint, String)]) {
    let w = place.w / entries.len().max(1) as f64;
    let mut x = place.x;
    for entry in entries {
        legend_rows(sheet, Rect { x, w, ..place }, std::slice::from_ref(entry));
        x += w;
    }
}

pub(super) const fn font(size: f64, bold: bool) -> Type {
    Type { size, colour: INK, bold, anchor: Anchor::Start }
}

#[cfg(test)]
mod tests;
