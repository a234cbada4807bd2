//! A bird's-eye view of one time, in the paper's colours: truth blue, first agent red, second green, fused magenta; the
//! inside of a box has the tint of its class.
//!
//! On the left the whole scene, on the right its densest region enlarged, and the legend. Other figures take its panels.

use crate::report::palette::{
    AGENTS, BAND, Colour, FAINT, INK, MUTED, OURS as FUSED, PAPER, ROAD, TRUTH, TRUTH_FILL,
};
use crate::report::plot::classes::{GROUPS, group_name, tint, word};
use crate::report::plot::figure_parts::{FigureParts, Layout};
use crate::report::plot::labels::{Label, Labels};
use crate::report::plot::legend::{
    Key, Place, TINT_OPACITY, TRUE_BOX, arrow, font, legend_rows, marker, swatches,
};
use crate::report::plot::scene::BevScene;
use crate::report::plot::sheet::{Anchor, Paint, Rect, Sheet, Type};
use v2x_agent::world::{Road, RoadKind};
use v2x_common::class::{Class, ClassGroup};
use v2x_common::geometry::BevBox;
use v2x_common::sensor::SensorKind;
use v2x_common::time::Span;

const WIDTH: u32 = 1500;
const HEIGHT: u32 = 1070;
const WHOLE: Rect = Rect { x: 20.0, y: 120.0, w: 930.0, h: 930.0 };
const DETAIL: Rect = Rect { x: 970.0, y: 120.0, w: 510.0, h: 510.0 };
const LEGEND: Rect = Rect { x: 970.0, y: 650.0, w: 510.0, h: 400.0 };
/// The side of a panel on a page, px: its text can be read where the page is 400 px wide.
const SIDE: u32 = 620;

/// Most lines of the grid in each direction.
const MOST_LINES: f64 = 60.0;

/// Half of the side of the enlarged region, m.
const DETAIL_HALF_M: f64 = 12.0;
/// What stands above the enlarged region.
const ENLARGED: &str = "the dashed square, enlarged: where most objects are";
const OVERVIEW_PEN: Pen = Pen { grid_m: 10.0, thin: 1.4, thick: 2.2, has_words: false, has_tints: true };
const DETAIL_PEN: Pen = Pen { grid_m: 2.0, thin: 2.2, thick: 3.4, has_words: true, has_tints: true };

/// The picture.
pub(crate) fn bev_sheet(scene: &BevScene) -> Sheet {
    let mut sheet = Sheet::labelled((WIDTH, HEIGHT), &scene.title);
    sheet.text((WHOLE.x, 42.0), &scene.title, font(30.0, true));
    sheet.text((WHOLE.x, 73.0), &scene.subtitle, font(20.0, false));
    overview(&mut sheet, scene, WHOLE);
    sheet.text((DETAIL.x, DETAIL.y - 12.0), enlarged_words(scene), font(18.0, false));
    let words = detail(&mut sheet, scene, DETAIL);
    legend_rows(&mut sheet, LEGEND, &legend(scene, &words));
    sheet
}

/// The parts of the picture: the whole, the enlarged region, the legend.
pub(crate) fn bev_parts(scene: &BevScene) -> FigureParts {
    let place = Rect { x: 1.0, y: 1.0, w: f64::from(SIDE) - 2.0, h: f64::from(SIDE) - 2.0 };
    let new = |what: &str| Sheet::labelled((SIDE, SIDE), &format!("{}: {what}", scene.title));
    let (mut whole, mut enlarged) = (new("from above"), new(ENLARGED));
    overview(&mut whole, scene, place);
    let words = detail(&mut enlarged, scene, place);
    FigureParts {
        title: scene.title.clone(),
        subtitle: scene.subtitle.clone(),
        panels: vec![(String::new(), whole), (enlarged_words(scene).to_owned(), enlarged)],
        legend: swatches(legend(scene, &words)),
        layout: Layout::LargeColumns,
    }
}

/// The whole scene.
fn overview(sheet: &mut Sheet, scene: &BevScene, place: Rect) {
    let whole = Viewport::around(scene, place);
    panel(sheet, scene, &whole, &OVERVIEW_PEN);
    let dashed = Paint { dash: 6.0, ..Paint::line(INK, 2.0) };
    sheet.clipped(place, |sheet| sheet.rect(whole.rect_of(&enlarged(scene, place)), dashed));
}

/// Its densest region, and the classes whose words stand in it.
fn detail(sheet: &mut Sheet, scene: &BevScene, place: Rect) -> Vec<Class> {
    panel(sheet, scene, &enlarged(scene, place), &DETAIL_PEN)
}

fn enlarged(scene: &BevScene, panel: Rect) -> Viewport {
    let half_m = DETAIL_HALF_M.min(Viewport::around(scene, panel).half_m);
    let centre = scene.focus.as_ref().map_or_else(|| busiest_spot(scene, DETAIL_HALF_M), |focus| focus.at);
    Viewport { centre, half_m, panel }
}

fn enlarged_words(scene: &BevScene) -> &str {
    scene.focus.as_ref().map_or(ENLARGED, |focus| &focus.words)
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
        let fused = scene.fused.iter().map(|mark| (mark.bev.x, mark.bev.y));
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

    /// The smallest upright rectangle around a box, on the panel.
    fn bounds(&self, bev: &BevBox) -> Rect {
        let corners = bev.corners().map(|corner| self.px(corner));
        let (mut low, mut high) = (corners[0], corners[0]);
        for (x, y) in corners {
            low = (low.0.min(x), low.1.min(y));
            high = (high.0.max(x), high.1.max(y));
        }
        Rect { x: low.0, y: low.1, w: high.0 - low.0, h: high.1 - low.1 }
    }

    pub(super) fn shows(&self, x: f64, y: f64, margin_m: f64) -> bool {
        (x - self.centre.0).abs() <= self.half_m + margin_m
            && (y - self.centre.1).abs() <= self.half_height_m() + margin_m
    }
}

/// The covered object with most covered and fused objects around it, m; without truth the fused one.
pub(super) fn busiest_spot(scene: &BevScene, half_m: f64) -> (f64, f64) {
    let fused = || scene.fused.iter().map(|mark| &mark.bev);
    let covered = || scene.truth.iter().filter(|truth| truth.is_covered).map(|truth| &truth.bev);
    let crowd = |centre: &BevBox| {
        let spot = Viewport { centre: (centre.x, centre.y), half_m: 0.8 * half_m, panel: DETAIL };
        covered().chain(fused()).filter(|bev| spot.shows(bev.x, bev.y, 0.0)).count()
    };
    let busiest = covered().max_by_key(|bev| crowd(bev)).or_else(|| fused().max_by_key(|bev| crowd(bev)));
    busiest.map_or((0.0, 0.0), |bev| (bev.x, bev.y))
}

/// The style of a panel: line widths in px.
pub(super) struct Pen {
    pub(super) grid_m: f64,
    pub(super) thin: f64,
    pub(super) thick: f64,
    /// Whether each fused object has the word of its class, where there is room.
    pub(super) has_words: bool,
    /// Whether the insides of boxes have the tint of their class.
    pub(super) has_tints: bool,
}

/// Draws what a viewport shows. Returns the classes whose words it wrote.
pub(super) fn panel(sheet: &mut Sheet, scene: &BevScene, view: &Viewport, pen: &Pen) -> Vec<Class> {
    panel_in(sheet, scene, (view, FUSED), pen)
}

/// The same with another colour of the fused objects.
pub(super) fn panel_in(
    sheet: &mut Sheet,
    scene: &BevScene,
    (view, fused): (&Viewport, Colour),
    pen: &Pen,
) -> Vec<Class> {
    let mut words = Vec::new();
    sheet.clipped(view.panel, |sheet| {
        sheet.rect(view.panel, Paint::fill(BAND));
        grid(sheet, view, pen.grid_m);
        scene.roads.iter().for_each(|line| road(sheet, view, line));
        boxes(sheet, scene, (view, fused), pen);
        for [from, to] in scene.motions.iter().filter(|[from, _]| view.shows(from.0, from.1, 0.0)) {
            arrow(sheet, [view.px(*from), view.px(*to)], (fused, pen.thin));
        }
        let bar = scale_bar(sheet, view);
        words = labels(sheet, scene, (view, bar), pen);
        hovers(sheet, scene, view);
    });
    sheet.rect(view.panel, Paint::line(MUTED, 1.5));
    words
}

/// Truth below detections below fused objects.
fn boxes(sheet: &mut Sheet, scene: &BevScene, (view, fused): (&Viewport, Colour), pen: &Pen) {
    let tinted = |sheet: &mut Sheet, bev: &BevBox, class: Class| {
        if pen.has_tints && view.shows(bev.x, bev.y, bev.circumradius()) {
            sheet.shade(&bev.corners().map(|corner| view.px(corner)), tint(class.group()), TINT_OPACITY);
        }
    };
    for truth in &scene.truth {
        let line = Paint::line(TRUTH, pen.thick);
        let paint = match (truth.is_covered, pen.has_tints) {
            (true, true) => line,
            (true, false) => Paint { fill: Some(TRUTH_FILL), ..line },
            (false, _) => Paint { dash: 3.5, ..Paint::line(TRUTH, pen.thin) },
        };
        if truth.is_covered {
            tinted(sheet, &truth.bev, truth.class);
        }
        bev_box(sheet, view, &truth.bev, paint);
    }
    scene.fused.iter().for_each(|mark| tinted(sheet, &mark.bev, mark.class));
    for (agent, colour) in scene.agents.iter().zip(AGENTS.iter().cycle()) {
        agent.detections.iter().for_each(|bev| bev_box(sheet, view, bev, Paint::line(colour, pen.thin)));
    }
    scene.fused.iter().for_each(|mark| bev_box(sheet, view, &mark.bev, Paint::line(fused, pen.thick)));
}

/// Agents with their names, and words of classes. Returns the classes whose words it wrote.
fn labels(sheet: &mut Sheet, scene: &BevScene, (view, bar): (&Viewport, Rect), pen: &Pen) -> Vec<Class> {
    let detections = scene.agents.iter().flat_map(|agent| &agent.detections);
    let boxes = scene.truth.iter().map(|one| &one.bev).chain(detections);
    let boxes = boxes.chain(scene.fused.iter().map(|mark| &mark.bev)).map(|bev| view.bounds(bev)).collect();
    let mut labels = Labels { boxes, taken: vec![bar], panel: view.panel };
    let mut names = Vec::new();
    for (agent, colour) in scene.agents.iter().zip(AGENTS.iter().cycle()) {
        if let Some(pose) = agent.pose.filter(|pose| view.shows(pose.x, pose.y, 0.0)) {
            let (x, y) = view.px((pose.x, pose.y));
            // The mark of a roadside unit has no front.
            let yaw = if agent.marked_as() == SensorKind::Vehicle { pose.yaw } else { 0.0 };
            marker(sheet, (agent.marked_as(), colour), &Place { at: (x, y), yaw, scale: 1.0 });
            let around = Rect { x: x - 14.0, y: y - 14.0, w: 28.0, h: 28.0 };
            labels.taken.push(around);
            names.push(Label { around, text: agent.id.as_str(), set: font(22.0, true) });
        }
    }
    // Once all marks are there, so that no name lies over another agent's mark.
    for name in &names {
        labels.write_anyhow(sheet, name);
    }
    let shown = scene.fused.iter().filter(|mark| pen.has_words && view.shows(mark.bev.x, mark.bev.y, 0.0));
    let mut written = Vec::new();
    for mark in shown {
        let around = view.bounds(&mark.bev);
        if labels.write(sheet, &Label { around, text: word(mark.class), set: font(19.0, true) }) {
            written.push(mark.class);
        }
    }
    written.sort_unstable();
    written.dedup();
    written
}

/// What is known of each fused object, while the pointer is there.
fn hovers(sheet: &mut Sheet, scene: &BevScene, view: &Viewport) {
    for mark in scene.fused.iter().filter(|mark| !mark.words.is_empty()) {
        if view.shows(mark.bev.x, mark.bev.y, 0.0) {
            let half = 0.5 * mark.bev.w.min(mark.bev.d) * view.px_per_m();
            sheet.hover(view.px((mark.bev.x, mark.bev.y)), half.clamp(5.0, 30.0), mark.words.clone());
        }
    }
}

/// An area, or a line on the ground in its true width; markings are wide enough to be seen.
fn road(sheet: &mut Sheet, view: &Viewport, road: &Road) {
    if road.kind == RoadKind::Area {
        let border: Vec<_> = road.points.iter().map(|point| view.px(*point)).collect();
        sheet.path(&border, true, Paint::fill(ROAD));
        return;
    }
    let (colour, least_px) = if road.kind == RoadKind::Surface { (ROAD, 1.0) } else { (PAPER, 2.2) };
    let width = (road.width_m * view.px_per_m()).max(least_px);
    for pair in road.points.windows(2) {
        sheet.line(&[view.px(pair[0]), view.px(pair[1])], (colour, width));
    }
}

fn grid(sheet: &mut Sheet, view: &Viewport, mut step_m: f64) {
    // An agent that is far away by mistake must not make the picture enormous.
    while 2.0 * view.half_m > MOST_LINES * step_m {
        step_m *= 10.0;
    }
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

/// The longest of 1, 2, 5, 10 … m that is at most a quarter of the panel. Returns what it covers.
fn scale_bar(sheet: &mut Sheet, view: &Viewport) -> Rect {
    let lengths = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0];
    let length_m = lengths.into_iter().rfind(|length| *length <= view.half_m / 2.0).unwrap_or(1.0);
    let (x, y) = (view.panel.x + 18.0, view.panel.y + view.panel.h - 18.0);
    let end = x + length_m * view.px_per_m();
    for line in [[(x, y), (end, y)], [(x, y - 6.0), (x, y + 6.0)], [(end, y - 6.0), (end, y + 6.0)]] {
        sheet.line(&line, (INK, 3.0));
    }
    let middle = Type { anchor: Anchor::Middle, ..font(20.0, false) };
    sheet.text((f64::midpoint(x, end), y - 11.0), &format!("{length_m} m"), middle);
    Rect { x: x - 4.0, y: y - 30.0, w: end - x + 8.0, h: 40.0 }
}

/// What each kind of box is, and how many there are; classes that occur; the words that were written.
fn legend(scene: &BevScene, words: &[Class]) -> Vec<(Key, String)> {
    let n_covered = scene.truth.iter().filter(|truth| truth.is_covered).count();
    let n_others = scene.truth.len() - n_covered;
    let mut rows = Vec::new();
    if !scene.truth.is_empty() {
        rows.push((TRUE_BOX, format!("truth: {n_covered} objects, in view for 1 s or more")));
    }
    if n_others > 0 {
        let dashed = Paint { dash: 3.5, ..Paint::line(TRUTH, 2.0) };
        rows.push((Key::Box(dashed), format!("truth not (yet) in view: {n_others} objects")));
    }
    for (agent, colour) in scene.agents.iter().zip(AGENTS.iter().cycle()) {
        let when = agent.offset.map_or_else(String::new, captured);
        let kind = agent.kind.map_or_else(String::new, |kind| format!(" ({})", kind.name()));
        let (id, n) = (agent.id, agent.detections.len());
        rows.push((Key::Agent(agent.marked_as(), colour), format!("{id}{kind}: {n} detections{when}")));
    }
    rows.push((Key::Box(Paint::line(FUSED, 3.6)), format!("fused: {} objects", scene.fused.len())));
    if !scene.motions.is_empty() {
        rows.push((Key::Arrow(FUSED), "its motion in 1 s".to_owned()));
    }
    let occurs = |group: &ClassGroup| {
        let covered = scene.truth.iter().filter(|truth| truth.is_covered).map(|truth| truth.class);
        covered.chain(scene.fused.iter().map(|mark| mark.class)).any(|class| class.group() == *group)
    };
    let groups = GROUPS.into_iter().filter(occurs);
    rows.extend(groups.map(|group| (Key::Tint(tint(group)), group_name(group).to_owned())));
    // A word that is a part of its class's name says enough.
    let short = words.iter().filter(|class| !class.name().contains(word(**class)));
    rows.extend(short.map(|class| (Key::None, format!("{}: {class}", word(*class)))));
    rows
}

/// When a frame was captured, from the time of the picture.
fn captured(offset: Span) -> String {
    let ms = offset.as_millis_f64();
    let distance = format!("{:.0} ms", ms.abs());
    match distance.as_str() {
        "0 ms" => ", at this moment".to_owned(),
        _ if ms < 0.0 => format!(", {distance} earlier"),
        _ => format!(", {distance} later"),
    }
}

#[cfg(test)]
mod tests;
