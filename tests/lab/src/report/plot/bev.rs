//! A bird's-eye view of one time, in the paper's colours: truth blue, first agent red, second green, fused magenta.
//!
//! On the left the whole scene, on the right its densest region enlarged, and the legend.

use crate::report::palette::{AGENTS, BAND, FAINT, INK, MUTED, OURS as FUSED, PAPER, TRUTH, TRUTH_FILL};
use crate::report::plot::scene::{BevScene, SceneAgent};
use crate::report::plot::svg::{Font, Rect, Style, Svg};
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

/// The picture as a self-contained SVG document.
pub(crate) fn bev_svg(scene: &BevScene) -> String {
    bev_svg_named(scene, "bev")
}

/// The same with this prefix of all ids, for a page with several.
pub(crate) fn bev_svg_named(scene: &BevScene, id: &str) -> String {
    let mut svg = Svg::new(WIDTH, HEIGHT);
    svg.text((WHOLE.x, 42.0), &scene.title, font(30.0, true));
    svg.text((WHOLE.x, 73.0), &scene.subtitle, font(20.0, false));
    let whole = Viewport::around(scene, WHOLE);
    let detail =
        Viewport { centre: busiest_spot(scene), half_m: DETAIL_HALF_M.min(whole.half_m), panel: DETAIL };
    panel(
        &mut svg,
        scene,
        &whole,
        &Pen { id: &format!("{id}-whole"), grid_m: 10.0, thin: 1.4, thick: 2.2, has_letters: false },
    );
    svg.rect(whole.rect_of(&detail), Style { dashes: "7 5", ..Style::line(INK, 2.0) });
    panel(
        &mut svg,
        scene,
        &detail,
        &Pen { id: &format!("{id}-detail"), grid_m: 2.0, thin: 2.2, thick: 3.4, has_letters: true },
    );
    svg.text((DETAIL.x + 14.0, DETAIL.y + 28.0), "the dashed square, enlarged", font(18.0, false));
    legend(&mut svg, scene);
    svg.finish()
}

/// A square of the map on a panel of the sheet.
#[derive(Clone, Copy, Debug)]
struct Viewport {
    centre: (f64, f64),
    half_m: f64,
    panel: Rect,
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

    fn px_per_m(&self) -> f64 {
        self.panel.w / (2.0 * self.half_m)
    }

    fn px(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let scale = self.px_per_m();
        let (left, top) = (self.centre.0 - self.half_m, self.centre.1 + self.half_m);
        (self.panel.x + (x - left) * scale, self.panel.y + (top - y) * scale)
    }

    /// Another viewport's square on this panel.
    fn rect_of(&self, other: &Self) -> Rect {
        let (x, y) = self.px((other.centre.0 - other.half_m, other.centre.1 + other.half_m));
        let side = 2.0 * other.half_m * self.px_per_m();
        Rect { x, y, w: side, h: side }
    }

    fn shows(&self, x: f64, y: f64, margin_m: f64) -> bool {
        let reach = self.half_m + margin_m;
        (x - self.centre.0).abs() <= reach && (y - self.centre.1).abs() <= reach
    }
}

/// The point with most covered objects and boxes around it, m.
fn busiest_spot(scene: &BevScene) -> (f64, f64) {
    let boxes = || scene.agents.iter().flat_map(|agent| &agent.detections).chain(&scene.fused);
    let covered = || scene.truth.iter().filter(|truth| truth.is_covered).map(|truth| &truth.bev);
    let crowd = |centre: &BevBox| {
        let spot = Viewport { centre: (centre.x, centre.y), half_m: 0.8 * DETAIL_HALF_M, panel: DETAIL };
        covered().chain(boxes()).filter(|bev| spot.shows(bev.x, bev.y, 0.0)).count()
    };
    covered().max_by_key(|bev| crowd(bev)).map_or((0.0, 0.0), |bev| (bev.x, bev.y))
}

/// The style of a panel: line widths in px.
struct Pen<'a> {
    id: &'a str,
    grid_m: f64,
    thin: f64,
    thick: f64,
    /// Whether each fused object has the letter of its class.
    has_letters: bool,
}

fn panel(svg: &mut Svg, scene: &BevScene, view: &Viewport, pen: &Pen<'_>) {
    svg.begin_clip(pen.id, view.panel);
    svg.rect(view.panel, Style { fill: BAND, ..Style::line("none", 0.0) });
    scene.roads.iter().for_each(|line| road(svg, view, line));
    grid(svg, view, pen.grid_m);
    for truth in &scene.truth {
        let style = if truth.is_covered {
            Style { fill: TRUTH_FILL, ..Style::line(TRUTH, pen.thick) }
        } else {
            Style { dashes: "4 3", opacity: 0.5, ..Style::line(TRUTH, pen.thin) }
        };
        bev_box(svg, view, &truth.bev, style);
    }
    for (agent, colour) in scene.agents.iter().zip(AGENTS.iter().cycle()) {
        agent.detections.iter().for_each(|bev| bev_box(svg, view, bev, Style::line(colour, pen.thin)));
    }
    scene.fused.iter().for_each(|bev| bev_box(svg, view, bev, Style::line(FUSED, pen.thick)));
    scene.motions.iter().for_each(|motion| arrow(svg, view, *motion, pen));
    let mut labels = Labels { taken: Vec::new(), panel: view.panel };
    for (agent, colour) in scene.agents.iter().zip(AGENTS.iter().cycle()) {
        if let Some(pose) = agent.pose.filter(|pose| view.shows(pose.x, pose.y, 0.0)) {
            marker(svg, view, agent, &pose, colour);
            labels.write(svg, view.px((pose.x, pose.y)), agent.id.as_str(), 19.0);
        }
    }
    for (at, letter) in scene.letters.iter().filter(|_| pen.has_letters) {
        if view.shows(at.0, at.1, 0.0) {
            labels.write(svg, view.px(*at), letter, 15.0);
        }
    }
    scale_bar(svg, view);
    svg.end_clip();
    svg.rect(view.panel, Style::line(MUTED, 1.5));
}

/// An area, or a line on the ground in its true width, thin ones at least a hair.
fn road(svg: &mut Svg, view: &Viewport, road: &Road) {
    if road.kind == RoadKind::Area {
        let border: Vec<_> = road.points.iter().map(|point| view.px(*point)).collect();
        svg.path(&border, true, Style { fill: FAINT, ..Style::line("none", 0.0) });
        return;
    }
    let colour = if road.kind == RoadKind::Surface { FAINT } else { PAPER };
    let width = (road.width_m * view.px_per_m()).max(1.0);
    for pair in road.points.windows(2) {
        svg.line([view.px(pair[0]), view.px(pair[1])], Style::line(colour, width));
    }
}

fn grid(svg: &mut Svg, view: &Viewport, step_m: f64) {
    let style = Style { opacity: 0.6, ..Style::line(FAINT, 1.0) };
    let first = |low: f64| libm::ceil(low / step_m) * step_m;
    let Rect { x: left, y: top, w, h } = view.panel;
    let mut offset = first(view.centre.0 - view.half_m);
    while offset <= view.centre.0 + view.half_m {
        let (x, _) = view.px((offset, 0.0));
        svg.line([(x, top), (x, top + h)], style);
        offset += step_m;
    }
    let mut offset = first(view.centre.1 - view.half_m);
    while offset <= view.centre.1 + view.half_m {
        let (_, y) = view.px((0.0, offset));
        svg.line([(left, y), (left + w, y)], style);
        offset += step_m;
    }
}

/// The box, with a tick over its front edge.
fn bev_box(svg: &mut Svg, view: &Viewport, bev: &BevBox, style: Style<'_>) {
    if !view.shows(bev.x, bev.y, bev.circumradius()) {
        return;
    }
    let corners = bev.corners().map(|corner| view.px(corner));
    let tick = [bev.d / 4.0, bev.d / 2.0 + 0.4].map(|ahead| view.px(bev.pose().offset(ahead, 0.0)));
    svg.outline(&corners, Some(tick), style);
}

/// A vehicle is an arrow head in the direction of its heading, a roadside unit is a diamond.
fn marker(svg: &mut Svg, view: &Viewport, agent: &SceneAgent, pose: &Pose, colour: &str) {
    let (x, y) = view.px((pose.x, pose.y));
    let (sin, cos) = libm::sincos(pose.yaw);
    let shape: &[(f64, f64)] = match agent.kind {
        SensorKind::Vehicle => &[(16.0, 0.0), (-11.0, 10.0), (-5.0, 0.0), (-11.0, -10.0)],
        SensorKind::RoadsideUnit => &[(13.0, 0.0), (0.0, 13.0), (-13.0, 0.0), (0.0, -13.0)],
    };
    let turned = |&(ahead, left): &(f64, f64)| (x + ahead * cos - left * sin, y - ahead * sin - left * cos);
    let points: Vec<_> = shape.iter().map(turned).collect();
    svg.outline(&points, None, Style { fill: colour, ..Style::line(INK, 2.0) });
}

/// Where the object will be in a second.
fn arrow(svg: &mut Svg, view: &Viewport, [from, to]: [(f64, f64); 2], pen: &Pen<'_>) {
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
    let style = Style::line(FUSED, pen.thin);
    svg.line([tail, tip], style);
    for side in [-1.0, 1.0] {
        let barb = |axis: fn((f64, f64)) -> f64| axis(tip) - 8.0 * axis(ahead) + side * 4.0 * axis(left);
        svg.line([tip, (barb(|point| point.0), barb(|point| point.1))], style);
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
    fn write(&mut self, svg: &mut Svg, (x, y): (f64, f64), label: &str, size: f64) {
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
            svg.text((place.x, place.y + 0.8 * h), label, font(size, true));
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
fn scale_bar(svg: &mut Svg, view: &Viewport) {
    let lengths = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0];
    let length_m = lengths.into_iter().rfind(|length| *length <= view.half_m / 2.0).unwrap_or(1.0);
    let (x, y) = (view.panel.x + 18.0, view.panel.y + view.panel.h - 18.0);
    let end = x + length_m * view.px_per_m();
    let style = Style::line(INK, 3.0);
    svg.line([(x, y), (end, y)], style);
    svg.line([(x, y - 6.0), (x, y + 6.0)], style);
    svg.line([(end, y - 6.0), (end, y + 6.0)], style);
    svg.text(
        (f64::midpoint(x, end), y - 11.0),
        &format!("{length_m} m"),
        Font { anchor: "middle", ..font(18.0, false) },
    );
}

fn legend(svg: &mut Svg, scene: &BevScene) {
    let n_covered = scene.truth.iter().filter(|truth| truth.is_covered).count();
    let n_others = scene.truth.len() - n_covered;
    let solid = Style { fill: TRUTH_FILL, ..Style::line(TRUTH, 3.0) };
    let dashed = Style { dashes: "4 3", opacity: 0.5, ..Style::line(TRUTH, 2.0) };
    let mut rows = vec![(solid, format!("truth: {n_covered} objects in view for 1 s"))];
    if n_others > 0 {
        rows.push((dashed, format!("truth not (yet) in view: {n_others} objects")));
    }
    for (agent, colour) in scene.agents.iter().zip(AGENTS.iter().cycle()) {
        let when =
            agent.offset.map_or_else(String::new, |offset| format!(" at {:+.0} ms", offset.as_millis_f64()));
        let (id, kind, n) = (agent.id, agent.kind.name(), agent.detections.len());
        rows.push((Style::line(colour, 2.6), format!("{id} ({kind}): {n} detections{when}")));
    }
    rows.push((Style::line(FUSED, 3.6), format!("fused: {} objects", scene.fused.len())));
    let nothing = Style::line("none", 0.0);
    if !scene.motions.is_empty() {
        rows.push((nothing, "arrow: the way of one second".to_owned()));
    }
    if !scene.letters.is_empty() {
        rows.push((nothing, "letter: class, as C car, P pedestrian, T truck".to_owned()));
    }
    legend_rows(svg, &rows);
}

#[expect(clippy::cast_precision_loss, reason = "counts of rows and letters")]
fn legend_rows(svg: &mut Svg, rows: &[(Style<'_>, String)]) {
    let pitch = (LEGEND.h / rows.len() as f64).min(40.0);
    // Letters of these fonts are on average at most 0.6 em wide: long names get a smaller font.
    let longest = rows.iter().map(|(_, text)| text.chars().count()).max().unwrap_or(1);
    let size = (pitch * 0.55).min(21.0).min((LEGEND.w - 64.0) / (0.6 * longest as f64));
    let mut middle = LEGEND.y + pitch / 2.0;
    for (style, text) in rows {
        svg.rect(Rect { x: LEGEND.x + 4.0, y: middle - pitch * 0.28, w: 44.0, h: pitch * 0.56 }, *style);
        svg.text((LEGEND.x + 64.0, middle + size * 0.35), text, font(size, false));
        middle += pitch;
    }
}

const fn font(size: f64, bold: bool) -> Font {
    Font { size, colour: INK, bold, anchor: "start" }
}

#[cfg(test)]
mod tests;
