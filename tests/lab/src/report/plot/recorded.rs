//! Recorded traffic from above: the way of each object, its first and its last place.

use crate::report::palette::{AGENTS, BAND, FAINT, INK, MUTED, PAPER, TRUTH};
use crate::report::plot::sheet::{Anchor, Paint, Rect, Sheet, Type};
use v2x_agent::trajectories::{RecordedObject, Traffic};
use v2x_agent::world::{Road, RoadKind};
use v2x_common::class::{Class, ClassGroup};

const WIDTH: u32 = 1300;
const HEIGHT: u32 = 1000;
const MAP: Rect = Rect { x: 20.0, y: 90.0, w: 890.0, h: 890.0 };
const LEGEND_X: f64 = 940.0;
/// Objects that have their id written beside them: those that go the longest way.
const LABELLED: usize = 24;
/// Places nearer than this to each other are one on the picture, px.
const STEP_PX: f64 = 1.5;

/// A picture of recorded traffic, as an SVG document. Labels of the axes are in the file's coordinates.
pub fn recorded_svg(traffic: &Traffic, roads: &[Road], title: &str) -> String {
    let mut sheet = Sheet::new(WIDTH, HEIGHT);
    sheet.text((MAP.x, 42.0), title, font(28.0, true));
    let subtitle = format!(
        "{} objects, {} rows, {:.1} s; square: first place, arrow head: last place",
        traffic.objects.len(),
        traffic.n_rows,
        traffic.length.as_secs_f64()
    );
    sheet.text((MAP.x, 73.0), &subtitle, font(18.0, false));
    let view = View::around(traffic);
    sheet.clipped(MAP, |sheet| {
        sheet.rect(MAP, Paint::fill(BAND));
        roads.iter().for_each(|line| road(sheet, &view, line));
        grid(sheet, &view);
        let mut objects: Vec<_> = traffic.objects.iter().map(|object| (way_m(object), object)).collect();
        objects.sort_by(|a, b| b.0.total_cmp(&a.0));
        objects.iter().rev().for_each(|(_, object)| way(sheet, &view, object));
        for (_, object) in objects.iter().take(LABELLED) {
            label(sheet, &view, object);
        }
    });
    axes(&mut sheet, &view, traffic.origin);
    sheet.rect(MAP, Paint::line(MUTED, 1.5));
    legend(&mut sheet, traffic);
    sheet.svg()
}

/// The part of the map that is shown.
struct View {
    left: f64,
    top: f64,
    px_per_m: f64,
}

impl View {
    fn around(traffic: &Traffic) -> Self {
        let [west, south, east, north] = traffic.extent();
        let side_m = ((east - west).max(north - south) * 1.08).max(20.0);
        let (x, y) = (f64::midpoint(west, east), f64::midpoint(south, north));
        Self { left: x - side_m / 2.0, top: y + side_m / 2.0, px_per_m: MAP.w / side_m }
    }

    fn px(&self, x: f64, y: f64) -> (f64, f64) {
        (MAP.x + (x - self.left) * self.px_per_m, MAP.y + (self.top - y) * self.px_per_m)
    }

    /// A round distance of grid lines: some eight of them, m.
    fn step_m(&self) -> f64 {
        let side_m = MAP.w / self.px_per_m;
        let steps = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1e3, 2e3, 5e3, 1e4, 1e5];
        steps.into_iter().find(|step| side_m / step <= 9.0).unwrap_or(1e6)
    }

    /// Places of the grid lines from left to right, and from bottom to top, m.
    fn lines(&self) -> [Vec<f64>; 2] {
        let (step_m, side_m) = (self.step_m(), MAP.w / self.px_per_m);
        [self.left, self.top - side_m].map(|low| {
            let first = libm::ceil(low / step_m) * step_m;
            let line = |k: i32| first + f64::from(k) * step_m;
            (0..10).map(line).take_while(|at| *at <= low + side_m).collect()
        })
    }
}

/// The length of an object's way, m.
fn way_m(object: &RecordedObject) -> f64 {
    let step =
        |pair: &[v2x_agent::trajectories::Sample]| pair[0].pose.distance_to(pair[1].pose.x, pair[1].pose.y);
    object.trajectory.samples().windows(2).map(step).sum()
}

const fn colour(class: Class) -> &'static str {
    match class.group() {
        ClassGroup::FourWheeled => TRUTH,
        ClassGroup::TwoWheeled => AGENTS[1],
        ClassGroup::Pedestrian => AGENTS[0],
        ClassGroup::Immobile => AGENTS[4],
        ClassGroup::Unknown => MUTED,
    }
}

fn way(sheet: &mut Sheet, view: &View, object: &RecordedObject) {
    let samples = object.trajectory.samples();
    let mut points: Vec<(f64, f64)> = Vec::new();
    for sample in samples {
        let point = view.px(sample.pose.x, sample.pose.y);
        let is_far =
            points.last().is_none_or(|last| libm::hypot(point.0 - last.0, point.1 - last.1) >= STEP_PX);
        if is_far {
            points.push(point);
        }
    }
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return };
    let colour = colour(object.class);
    if points.len() > 1 {
        sheet.path(&points, false, Paint { opacity: 0.65, ..Paint::line(colour, 2.0) });
    }
    let (x, y) = view.px(first.pose.x, first.pose.y);
    let dot = [(-3.5, -3.5), (3.5, -3.5), (3.5, 3.5), (-3.5, 3.5)].map(|(dx, dy)| (x + dx, y + dy));
    sheet.path(&dot, true, Paint { fill: Some(colour), ..Paint::line(PAPER, 1.0) });
    let (x, y) = view.px(last.pose.x, last.pose.y);
    let (sin, cos) = libm::sincos(last.pose.yaw);
    let turned = |(ahead, left): (f64, f64)| (x + ahead * cos - left * sin, y - ahead * sin - left * cos);
    let head = [(9.0, 0.0), (-6.0, 5.5), (-6.0, -5.5)].map(turned);
    sheet.path(&head, true, Paint { fill: Some(colour), ..Paint::line(INK, 1.0) });
}

fn label(sheet: &mut Sheet, view: &View, object: &RecordedObject) {
    if let Some(first) = object.trajectory.samples().first() {
        let (x, y) = view.px(first.pose.x, first.pose.y);
        sheet.text((x + 7.0, y - 5.0), &object.name, font(14.0, true));
    }
}

fn road(sheet: &mut Sheet, view: &View, road: &Road) {
    let points: Vec<_> = road.points.iter().map(|(x, y)| view.px(*x, *y)).collect();
    match road.kind {
        RoadKind::Area => sheet.path(&points, true, Paint::fill(FAINT)),
        RoadKind::Surface => sheet.path(&points, false, Paint::line(FAINT, road.width_m * view.px_per_m)),
        RoadKind::Marking | RoadKind::StopLine => {
            sheet.path(&points, false, Paint::line(PAPER, (road.width_m * view.px_per_m).max(1.0)));
        }
    }
}

fn grid(sheet: &mut Sheet, view: &View) {
    let paint = Paint { opacity: 0.6, ..Paint::line(FAINT, 1.0) };
    let [columns, rows] = view.lines();
    for x in columns {
        let (px, _) = view.px(x, 0.0);
        sheet.path(&[(px, MAP.y), (px, MAP.y + MAP.h)], false, paint);
    }
    for y in rows {
        let (_, py) = view.px(0.0, y);
        sheet.path(&[(MAP.x, py), (MAP.x + MAP.w, py)], false, paint);
    }
}

/// Coordinates at the borders, in the file's coordinates.
fn axes(sheet: &mut Sheet, view: &View, origin: (f64, f64)) {
    let [columns, rows] = view.lines();
    let small = Type { colour: MUTED, ..font(13.0, false) };
    for x in columns {
        sheet.text((view.px(x, 0.0).0 + 3.0, MAP.y + MAP.h - 6.0), &format!("{}", x + origin.0), small);
    }
    for y in rows {
        sheet.text((MAP.x + 4.0, view.px(0.0, y).1 - 3.0), &format!("{}", y + origin.1), small);
    }
}

#[expect(clippy::cast_precision_loss, reason = "a count of classes")]
fn legend(sheet: &mut Sheet, traffic: &Traffic) {
    let mut rows: Vec<(Class, usize)> = Vec::new();
    for class in Class::ALL {
        let n = traffic.objects.iter().filter(|object| object.class == class).count();
        if n > 0 {
            rows.push((class, n));
        }
    }
    for (index, (class, n)) in rows.iter().enumerate() {
        let y = MAP.y + 24.0 + 30.0 * index as f64;
        sheet.line(&[(LEGEND_X, y - 6.0), (LEGEND_X + 34.0, y - 6.0)], (colour(*class), 4.0));
        sheet.text((LEGEND_X + 44.0, y), &format!("{n} × {}", class.name()), font(17.0, false));
    }
}

const fn font(size: f64, bold: bool) -> Type {
    Type { size, colour: INK, bold, anchor: Anchor::Start }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_agent::trajectories::{ReadOptions, read};

    #[test]
    fn every_object_has_a_way_a_first_and_a_last_place_in_the_colour_of_its_group() {
        let text = "t,id,class,x,y\n0,a<b,car,500000,0\n1,a<b,car,500010,0\n0,p,adult,500000,5\n1,p,adult,500000,6\n";
        let traffic = read(text.as_bytes(), &ReadOptions::default()).unwrap();
        let road =
            Road { kind: RoadKind::Area, width_m: 0.0, points: vec![(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)] };
        let svg = recorded_svg(&traffic, &[road], "mine & yours");
        for expected in ["mine &amp; yours", "a&lt;b", "1 × vehicle.car", TRUTH, AGENTS[0], ">500000<"] {
            assert!(svg.contains(expected), "{expected} is not in {svg}");
        }
        for colour in [TRUTH, AGENTS[0]] {
            let filled = svg.matches(&format!("fill=\"{colour}\"")).count();
            assert_eq!(filled, 2, "its first and its last place");
        }
    }
}
