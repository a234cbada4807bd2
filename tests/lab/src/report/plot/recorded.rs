//! Recorded traffic from above: the way of each object, its first and its last place.

use crate::report::palette::{AGENTS, BAND, Colour, FAINT, INK, MUTED, OURS, PAPER, ROAD, TRUTH};
use crate::report::plot::labels::{Label, Labels};
use crate::report::plot::sheet::{Anchor, Paint, Rect, Sheet, Type};
use v2x_agent::trajectories::{RecordedObject, Traffic};
use v2x_agent::world::{Road, RoadKind};
use v2x_common::class::{Class, ClassGroup};

const WIDTH: u32 = 1300;
/// Left, top and width of the map.
const MAP: (f64, f64, f64) = (20.0, 90.0, 890.0);
/// The map is as high as the traffic makes it, but no flatter than this share of its width, and no higher than it is wide.
const FLATTEST: f64 = 0.4;
const LEGEND_X: f64 = 940.0;
const LEGEND_PITCH: f64 = 30.0;
/// Objects that have their id written beside them, where there is room: those that go the longest way.
const LABELLED: usize = 60;
/// Places nearer than this to each other are one on the picture, px.
const STEP_PX: f64 = 1.5;
/// A name that is farther from its mark has a line to it, px.
const FAR_PX: f64 = 12.0;
/// Labels keep this far from ways, px.
const CLEAR_PX: f64 = 3.0;

/// A picture of recorded traffic, as an SVG document. Labels of the axes are in the file's coordinates.
pub fn recorded_svg(traffic: &Traffic, roads: &[Road], title: &str) -> String {
    let view = View::around(traffic);
    let map = view.map;
    let classes = classes_of(traffic);
    let legend_end = map.y + LEGEND_PITCH * (classes.len() as f64 + 0.5);
    let mut sheet = Sheet::labelled((WIDTH, (map.y + map.h).max(legend_end) as u32 + 20), title);
    sheet.text((map.x, 42.0), title, font(28.0, true));
    let subtitle = format!(
        "{} objects, {} rows, {:.1} s; square: first place, arrow head: last place",
        traffic.objects.len(),
        traffic.n_rows,
        traffic.length.as_secs_f64()
    );
    sheet.text((map.x, 73.0), &subtitle, font(18.0, false));
    sheet.clipped(map, |sheet| {
        sheet.rect(map, Paint::fill(BAND));
        roads.iter().for_each(|line| road(sheet, &view, line));
        grid(sheet, &view);
        let mut ways: Vec<_> = traffic.objects.iter().filter_map(|object| Way::of(object, &view)).collect();
        ways.sort_by(|a, b| b.way_m.total_cmp(&a.way_m));
        ways.iter().rev().for_each(|way| way.draw(sheet));
        let figures = axes(sheet, &view, traffic.origin);
        label(sheet, &view, (&ways, figures));
    });
    sheet.rect(map, Paint::line(MUTED, 1.5));
    legend(&mut sheet, &classes);
    sheet.svg()
}

/// The part of the map that is shown.
struct View {
    map: Rect,
    left: f64,
    top: f64,
    px_per_m: f64,
}

impl View {
    fn around(traffic: &Traffic) -> Self {
        let [west, south, east, north] = traffic.extent();
        let (wide_m, high_m) = (east - west, north - south);
        let side_m = (wide_m.max(high_m) * 1.08).max(20.0);
        let share = (1.08 * high_m / side_m + 0.06).clamp(FLATTEST, 1.0);
        let (left, top, w) = MAP;
        let map = Rect { x: left, y: top, w, h: (w * share).round() };
        let (x, y) = (f64::midpoint(west, east), f64::midpoint(south, north));
        Self { map, left: x - side_m / 2.0, top: y + share * side_m / 2.0, px_per_m: w / side_m }
    }

    fn px(&self, x: f64, y: f64) -> (f64, f64) {
        (self.map.x + (x - self.left) * self.px_per_m, self.map.y + (self.top - y) * self.px_per_m)
    }

    /// A round distance of grid lines: some eight of them, m.
    fn step_m(&self) -> f64 {
        let side_m = self.map.w / self.px_per_m;
        let steps = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1e3, 2e3, 5e3, 1e4, 1e5];
        steps.into_iter().find(|step| side_m / step <= 9.0).unwrap_or(1e6)
    }

    /// Places of the grid lines from left to right, and from bottom to top, m.
    fn lines(&self) -> [Vec<f64>; 2] {
        let step_m = self.step_m();
        let [wide_m, high_m] = [self.map.w, self.map.h].map(|px| px / self.px_per_m);
        [(self.left, wide_m), (self.top - high_m, high_m)].map(|(low, length_m)| {
            let first = libm::ceil(low / step_m) * step_m;
            let line = |k: i32| first + f64::from(k) * step_m;
            (0..10).map(line).take_while(|at| *at <= low + length_m).collect()
        })
    }
}

/// The length of an object's way, m.
fn way_m(object: &RecordedObject) -> f64 {
    let step =
        |pair: &[v2x_agent::trajectories::Sample]| pair[0].pose.distance_to(pair[1].pose.x, pair[1].pose.y);
    object.trajectory.samples().windows(2).map(step).sum()
}

/// Colours of the figures of agents and methods, of which none is here; no two of them look alike to anybody.
const fn colour(class: Class) -> Colour {
    match class {
        Class::Car => TRUTH,
        Class::Truck | Class::Trailer | Class::ConstructionVehicle => AGENTS[4],
        Class::BendyBus | Class::RigidBus => AGENTS[2],
        Class::Ambulance | Class::PoliceCar => OURS,
        Class::Motorcycle => AGENTS[3],
        _ => match class.group() {
            ClassGroup::FourWheeled => TRUTH,
            ClassGroup::TwoWheeled => AGENTS[1],
            ClassGroup::Pedestrian => AGENTS[0],
            ClassGroup::Immobile => AGENTS[6],
            ClassGroup::Unknown => AGENTS[5],
        },
    }
}

/// The way of an object on the map.
struct Way<'a> {
    object: &'a RecordedObject,
    way_m: f64,
    points: Vec<(f64, f64)>,
    first: (f64, f64),
    last: (f64, f64),
    yaw: f64,
}

impl<'a> Way<'a> {
    fn of(object: &'a RecordedObject, view: &View) -> Option<Self> {
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
        let (first, last) = (samples.first()?, samples.last()?);
        Some(Self {
            object,
            way_m: way_m(object),
            points,
            first: view.px(first.pose.x, first.pose.y),
            last: view.px(last.pose.x, last.pose.y),
            yaw: last.pose.yaw,
        })
    }

    fn draw(&self, sheet: &mut Sheet) {
        let colour = colour(self.object.class);
        if self.points.len() > 1 {
            sheet.path(&self.points, false, Paint { opacity: 0.75, ..Paint::line(colour, 2.2) });
        }
        let (x, y) = self.first;
        let dot = [(-3.5, -3.5), (3.5, -3.5), (3.5, 3.5), (-3.5, 3.5)].map(|(dx, dy)| (x + dx, y + dy));
        sheet.path(&dot, true, Paint { fill: Some(colour), ..Paint::line(PAPER, 1.0) });
        let (x, y) = self.last;
        let (sin, cos) = libm::sincos(self.yaw);
        let turned = |(ahead, left): (f64, f64)| (x + ahead * cos - left * sin, y - ahead * sin - left * cos);
        let head = [(9.0, 0.0), (-6.0, 5.5), (-6.0, -5.5)].map(turned);
        sheet.path(&head, true, Paint { fill: Some(colour), ..Paint::line(PAPER, 1.0) });
        let name = format!("{}: {}, {:.0} m", self.object.name, self.object.class.name(), self.way_m);
        sheet.hover(self.last, 9.0, name.clone());
        sheet.hover(self.first, 6.0, name);
    }

    /// What a label may not lie over: small squares along the way, and its ends.
    fn obstacles(&self) -> impl Iterator<Item = Rect> {
        let square =
            |(x, y): (f64, f64), half: f64| Rect { x: x - half, y: y - half, w: 2.0 * half, h: 2.0 * half };
        let between = |pair: &[(f64, f64)]| {
            let [(x, y), (to_x, to_y)] = [pair[0], pair[1]];
            let n = (libm::hypot(to_x - x, to_y - y) / CLEAR_PX).ceil().clamp(1.0, 1e4) as u32;
            (0..n).map(move |k| {
                let share = f64::from(k) / f64::from(n);
                (x + share * (to_x - x), y + share * (to_y - y))
            })
        };
        let along = self.points.windows(2).flat_map(between).map(move |at| square(at, CLEAR_PX));
        along.chain([square(self.first, 5.0), square(self.last, 10.0)])
    }
}

/// Names beside first places, none over a way, a mark, another name or a figure of an axis. One without room is left out.
fn label(sheet: &mut Sheet, view: &View, (ways, figures): (&[Way<'_>], Vec<Rect>)) {
    let boxes = ways.iter().flat_map(Way::obstacles).collect();
    let mut labels = Labels { boxes, taken: figures, panel: view.map };
    for way in ways.iter().take(LABELLED) {
        let (x, y) = way.first;
        let around = Rect { x: x - 4.0, y: y - 4.0, w: 8.0, h: 8.0 };
        let set = Type { colour: colour(way.object.class), ..font(14.0, true) };
        let is_written = labels.write(sheet, &Label { around, text: &way.object.name, set });
        let Some(place) = labels.taken.last().filter(|_| is_written) else { continue };
        let nearest = (x.clamp(place.x, place.x + place.w), y.clamp(place.y, place.y + place.h));
        if libm::hypot(nearest.0 - x, nearest.1 - y) > FAR_PX {
            sheet.path(&[(x, y), nearest], false, Paint { opacity: 0.6, ..Paint::line(set.colour, 0.9) });
        }
    }
}

fn road(sheet: &mut Sheet, view: &View, road: &Road) {
    let points: Vec<_> = road.points.iter().map(|(x, y)| view.px(*x, *y)).collect();
    match road.kind {
        RoadKind::Area => sheet.path(&points, true, Paint::fill(ROAD)),
        RoadKind::Surface => sheet.path(&points, false, Paint::line(ROAD, road.width_m * view.px_per_m)),
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
        sheet.path(&[(px, view.map.y), (px, view.map.y + view.map.h)], false, paint);
    }
    for y in rows {
        let (_, py) = view.px(0.0, y);
        sheet.path(&[(view.map.x, py), (view.map.x + view.map.w, py)], false, paint);
    }
}

/// Coordinates at the borders, in the file's coordinates. Returns what they cover.
fn axes(sheet: &mut Sheet, view: &View, origin: (f64, f64)) -> Vec<Rect> {
    let [columns, rows] = view.lines();
    let map = view.map;
    let small = Type { colour: MUTED, ..font(13.0, false) };
    let columns = columns.into_iter().map(|x| ((view.px(x, 0.0).0 + 3.0, map.y + map.h - 6.0), x + origin.0));
    // The corner has the number of the first column.
    let is_above = |y: &f64| view.px(0.0, *y).1 < map.y + map.h - 24.0;
    let rows =
        rows.into_iter().filter(is_above).map(|y| ((map.x + 4.0, view.px(0.0, y).1 - 3.0), y + origin.1));
    let mut covered = Vec::new();
    for (at, value) in columns.chain(rows) {
        let text = format!("{value}");
        sheet.text(at, &text, small);
        covered.push(Rect { x: at.0, y: at.1 - 12.0, w: 8.5 * text.len() as f64, h: 15.0 });
    }
    covered
}

/// The classes that occur, and how many objects each has.
fn classes_of(traffic: &Traffic) -> Vec<(Class, usize)> {
    let count = |class: Class| traffic.objects.iter().filter(|object| object.class == class).count();
    Class::ALL.into_iter().map(|class| (class, count(class))).filter(|(_, n)| *n > 0).collect()
}

fn legend(sheet: &mut Sheet, classes: &[(Class, usize)]) {
    for (index, (class, n)) in classes.iter().enumerate() {
        let y = MAP.1 + 24.0 + LEGEND_PITCH * index as f64;
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
            assert_eq!(filled, 3, "its first and its last place, and its name");
        }
    }

    #[test]
    fn names_of_objects_that_begin_at_one_place_do_not_overlap() {
        let row = |k: u32, t: u32| format!("{t},vehicle-{k},car,{},{}\n", 40 * t, k / 3);
        let rows: String = (0..9).flat_map(|k| [0, 1].map(|t| row(k, t))).collect();
        let traffic = read(format!("t,id,class,x,y\n{rows}").as_bytes(), &ReadOptions::default()).unwrap();
        let svg = recorded_svg(&traffic, &[], "crowd");
        let place = |line: &str| {
            let of = |name: &str| {
                line.split(&format!(" {name}=\"")).nth(1)?.split('"').next()?.parse::<f64>().ok()
            };
            Some((of("x")?, of("y")?))
        };
        let names = svg.lines().filter(|line| line.contains(">vehicle-"));
        let names: Vec<_> = names.filter_map(place).collect();
        assert!(names.len() >= 3, "{svg}");
        for (k, (x, y)) in names.iter().enumerate() {
            let is_apart =
                |(other_x, other_y): &(f64, f64)| (x - other_x).abs() > 70.0 || (y - other_y).abs() > 14.0;
            assert!(names[..k].iter().all(is_apart), "{names:?}");
        }
    }
}
