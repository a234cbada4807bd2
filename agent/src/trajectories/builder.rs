//! Rows become objects.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use v2x_common::class::Class;
use v2x_common::geometry::{Pose, wrap_angle};
use v2x_common::time::Span;
use v2x_common::unmapped_names::USUAL_CLASSES;

use super::error::TrafficError;
use super::headings;
use super::options::ReadOptions;
use super::paces::Paces;
use super::remarks::{self, Place, Survey};
use super::sizes::Sizes;
use super::traffic::{Format, RecordedObject, Remarks, Traffic};
use super::trajectory::{Sample, Trajectory};
use super::units::Units;

/// Columns that look like directions, and leave open from where and in which unit they count.
const DIRECTIONS: [&str; 8] =
    ["heading", "direction", "dir", "orientation", "course", "bearing", "theta", "angle"];

/// Rows of a recording that are kept, 40 bytes each; one with more is refused.
pub const MAX_ROWS: usize = 10_000_000;
/// Coordinates farther from (0, 0) are moved where no origin is given.
const FAR_M: f64 = 1e5;
/// An origin is a multiple of this, m.
const ORIGIN_STEP_M: f64 = 100.0;
/// Unknown class names that are named.
const NAMED: usize = 8;

/// One row of a recording.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row<'a> {
    pub(super) line: u64,
    pub(super) t_s: f64,
    pub(super) id: &'a str,
    pub(super) kind: Kind<'a>,
    pub(super) at: At,
    /// Width and depth, m.
    pub(super) size: (Option<f64>, Option<f64>),
}

/// What a row says of the object's class.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind<'a> {
    /// A name.
    Name(&'a str),
    /// A type of SUMO, and the class of types that nobody knows.
    Sumo(&'a str, Class),
}

/// Where an object is.
#[derive(Clone, Copy, Debug)]
pub(super) struct At {
    pub(super) x: f64,
    pub(super) y: f64,
    /// Counter-clockwise from east, any number of turns; not a number where it is unknown.
    pub(super) yaw: f64,
    /// Whether this is the middle of its front, not of all of it.
    pub(super) is_front: bool,
}

/// An object under construction.
struct Draft {
    name: String,
    class: Class,
    /// Sums of the sizes, and how many there were, of w and d.
    sizes: [(f64, u32); 2],
    /// By vehicle type.
    stated: [Option<f64>; 2],
    rows: Vec<Kept>,
}

#[derive(Clone, Copy)]
struct Kept {
    t: Span,
    line: u64,
    pose: Pose,
}

/// Rows so far.
pub(super) struct Builder<'a> {
    options: &'a ReadOptions,
    drafts: Vec<Draft>,
    /// By id; never iterated.
    index: HashMap<String, usize>,
    n_rows: usize,
    n_outside: u64,
    is_sorted: bool,
    last: Span,
    /// The file's first time: times are kept since it.
    base_s: Option<f64>,
    /// Whether that was given, and is not of the first row.
    is_base_given: bool,
    /// An earlier time than the first row's, where a part of the file is read: the part counts from the earliest.
    earlier_s: Option<f64>,
    unknown: BTreeMap<String, Class>,
    /// Such names that were met before they were in the list: more than it has, where it is full.
    n_unknown: usize,
    sizes: Sizes,
    pub(super) remarks: Remarks,
    pub(super) scene: Option<String>,
    /// Borders of areas in the file's coordinates, m.
    pub(super) areas: Vec<Vec<(f64, f64)>>,
}

impl<'a> Builder<'a> {
    pub(super) fn new(options: &'a ReadOptions) -> Self {
        Self {
            options,
            drafts: Vec::new(),
            index: HashMap::new(),
            n_rows: 0,
            n_outside: 0,
            is_sorted: true,
            last: Span::ZERO,
            base_s: options.earliest_s,
            is_base_given: options.earliest_s.is_some(),
            earlier_s: None,
            unknown: BTreeMap::new(),
            n_unknown: 0,
            sizes: Sizes::default(),
            remarks: Remarks::default(),
            scene: None,
            areas: Vec::new(),
        }
    }

    /// Times to keep count from this time of the file, not from its first row.
    pub(super) fn since(base_s: f64, options: &'a ReadOptions) -> Self {
        Self { base_s: Some(base_s), is_base_given: true, ..Self::new(options) }
    }

    /// Takes a row, if it is within the window.
    pub(super) fn add(&mut self, row: &Row<'_>) -> Result<(), TrafficError> {
        let base_s = *self.base_s.get_or_insert(row.t_s);
        let since_s = row.t_s - base_s;
        let ReadOptions { from_s, to_s, .. } = self.options;
        let is_part = !self.is_base_given && (from_s.is_some() || to_s.is_some());
        if is_part && row.t_s < self.earlier_s.unwrap_or(base_s) {
            self.earlier_s = Some(row.t_s);
        }
        // What is kept and what not was decided by a wrong time: only the earliest one is still looked for.
        if self.earlier_s.is_some() {
            return Ok(());
        }
        if from_s.is_some_and(|from_s| since_s < from_s) || to_s.is_some_and(|to_s| since_s > to_s) {
            self.n_outside += 1;
            return Ok(());
        }
        if self.n_rows == MAX_ROWS {
            return Err(TrafficError::TooManyRows { line: row.line, limit: MAX_ROWS });
        }
        self.n_rows += 1;
        let t = Span::from_secs_f64(since_s);
        self.is_sorted &= t >= self.last;
        self.last = t;
        let draft = self.draft(row);
        for (sum, size) in draft.sizes.iter_mut().zip([row.size.0, row.size.1]) {
            if let Some(size) = size {
                *sum = (sum.0 + size, sum.1 + 1);
            }
        }
        let mut pose = Pose { x: row.at.x, y: row.at.y, yaw: row.at.yaw };
        if row.at.is_front {
            (pose.x, pose.y) = pose.offset(-draft.size()[1] / 2.0, 0.0);
        }
        draft.rows.push(Kept { t, line: row.line, pose });
        let class = draft.class;
        self.sizes.note((row.line, row.id), class, row.size);
        Ok(())
    }

    /// The steps of these that can be within the window, where time is 0 in step 0.
    #[expect(clippy::cast_possible_truncation, reason = "the cast saturates, and the numbers were whole")]
    pub(super) fn steps_within(&self, (first, last): (i64, i64), step_s: f64) -> (i64, i64) {
        let ReadOptions { from_s, to_s, .. } = self.options;
        let from = from_s.map_or(first, |from_s| libm::floor(from_s / step_s) as i64);
        let to = to_s.map_or(last, |to_s| libm::ceil(to_s / step_s) as i64);
        (first.max(from), last.min(to))
    }

    fn draft(&mut self, row: &Row<'_>) -> &mut Draft {
        let index = match self.index.get(row.id) {
            Some(index) => *index,
            None => {
                let (class, stated) = self.class(row.kind);
                let draft =
                    Draft { name: row.id.to_owned(), class, sizes: [(0.0, 0); 2], stated, rows: Vec::new() };
                self.index.insert(row.id.to_owned(), self.drafts.len());
                self.drafts.push(draft);
                self.drafts.len() - 1
            }
        };
        &mut self.drafts[index]
    }

    /// The class of a name, and sizes that its vehicle type states.
    fn class(&mut self, kind: Kind<'_>) -> (Class, [Option<f64>; 2]) {
        let (name, fallback) = match kind {
            Kind::Name(name) => (name, Class::Unknown),
            Kind::Sumo(name, fallback) => (name, fallback),
        };
        let vtype = self.options.vehicle_types.get(name).copied().unwrap_or_default();
        let known = self.options.classes.get(name).copied().or(vtype.class);
        let known = known.or_else(|| Class::from_name(name)).or_else(|| of_data_set(name));
        let class = known.unwrap_or_else(|| {
            if !self.unknown.contains_key(name) {
                self.n_unknown += 1;
                if self.unknown.len() < NAMED {
                    self.unknown.insert(name.to_owned(), fallback);
                }
            }
            fallback
        });
        (class, [vtype.width_m, vtype.length_m])
    }

    /// Notes columns that are not used.
    pub(super) fn ignored(&mut self, columns: &[String]) {
        if !columns.is_empty() {
            let direction = columns
                .iter()
                .find(|name| DIRECTIONS.iter().any(|one| name.trim().eq_ignore_ascii_case(one)));
            let hint = direction.map_or_else(String::new, |name| {
                format!(
                    ". For {name} to be read, name it yaw (radians) or yaw_deg (degrees), counter-clockwise from east, or \
                     heading_deg (degrees, clockwise from north)"
                )
            });
            self.remarks.notes.push(format!("columns that are not used: {}{hint}", columns.join(", ")));
        }
    }

    /// All objects.
    pub(super) fn finish(mut self, format: Format) -> Result<Traffic, TrafficError> {
        if let Some(earliest_s) = self.earlier_s {
            return Err(TrafficError::EarlierRow { earliest_s });
        }
        if self.n_rows == 0 {
            return Err(TrafficError::Empty(self.outside()));
        }
        let base_s = self.base_s.unwrap_or(0.0);
        self.drafts.iter_mut().try_for_each(|draft| draft.sort(base_s))?;
        let (first, last) = self.times();
        let length = last - first;
        if length == Span::ZERO {
            return Err(TrafficError::OneTime);
        }
        let step = self.usual_step();
        if !(0.1..=7.0 * 86_400.0).contains(&length.as_secs_f64()) {
            return Err(TrafficError::Length { length, step });
        }
        let max_gap_s = self.options.max_gap_s.unwrap_or_else(|| (3.0 * step.as_secs_f64()).max(2.0));
        let max_gap = Span::from_secs_f64(max_gap_s);
        let origin = self.options.origin.unwrap_or_else(|| self.far_origin());
        let mut survey = Survey::default();
        for draft in &self.drafts {
            let places = draft.rows.iter().map(|row| Place { t: row.t, pose: &row.pose, line: row.line });
            survey.add((draft.class, &draft.name), places, max_gap);
        }
        let places = self.drafts.iter().map(|draft| draft.rows.iter().map(|row| (row.t, &row.pose)));
        let units = Units::of(places, step).warnings();
        // What has another unit of time has no speed.
        let mut paces = Paces::default();
        for draft in self.drafts.iter().filter(|_| units.is_empty() && format != Format::SumoFcd) {
            paces.add(draft.class.group(), draft.rows.iter().map(|row| (row.t, &row.pose)), max_gap);
        }
        self.note(origin);
        self.areas.iter_mut().flatten().for_each(|(x, y)| (*x, *y) = (*x - origin.0, *y - origin.1));
        let objects = std::mem::take(&mut self.drafts).into_iter();
        let objects: Vec<_> = objects.map(|draft| draft.object(first, origin, max_gap)).collect();
        self.remarks.warnings.extend(units);
        self.remarks.warnings.extend(paces.warnings(step));
        self.remarks.warnings.extend(self.sizes.warnings(objects.len()));
        self.remarks.warnings.extend(remarks::warnings(&survey, format));
        Ok(Traffic {
            format,
            n_rows: self.n_rows,
            first_s: base_s + first.as_secs_f64(),
            length,
            step,
            max_gap,
            origin,
            scene: self.scene,
            areas: self.areas,
            remarks: self.remarks,
            objects,
        })
    }

    /// How many rows the part of the file leaves out, in words.
    fn outside(&self) -> String {
        match self.n_outside {
            0 => String::new(),
            n => {
                format!(
                    " between from_s and to_s ({n} are outside; times count from the file's earliest one)"
                )
            }
        }
    }

    /// The first and the last time.
    fn times(&self) -> (Span, Span) {
        let times = self.drafts.iter().flat_map(|draft| &draft.rows).map(|row| row.t);
        times.fold((Span::from_nanos(i64::MAX), Span::from_nanos(i64::MIN)), |(first, last), t| {
            (first.min(t), last.max(t))
        })
    }

    /// The median time between two rows of an object, of a bounded number of them.
    fn usual_step(&self) -> Span {
        let pairs = self.drafts.iter().flat_map(|draft| draft.rows.windows(2).take(100));
        let mut steps: Vec<_> = pairs.take(100_000).map(|pair| pair[1].t - pair[0].t).collect();
        steps.sort_unstable();
        steps.get(steps.len() / 2).copied().unwrap_or(Span::ZERO)
    }

    /// A round place in the middle of coordinates that are far from (0, 0); else (0, 0).
    fn far_origin(&self) -> (f64, f64) {
        let places = || self.drafts.iter().flat_map(|draft| &draft.rows).map(|row| row.pose);
        let middle = |axis: fn(&Pose) -> f64| {
            let (low, high) = places()
                .fold((f64::MAX, f64::MIN), |(low, high), at| (low.min(axis(&at)), high.max(axis(&at))));
            f64::midpoint(low, high)
        };
        let (x, y) = (middle(|pose| pose.x), middle(|pose| pose.y));
        if x.abs() <= FAR_M && y.abs() <= FAR_M {
            return (0.0, 0.0);
        }
        let round = |value: f64| ORIGIN_STEP_M * libm::round(value / ORIGIN_STEP_M);
        (round(x), round(y))
    }

    fn note(&mut self, origin: (f64, f64)) {
        let notes = &mut self.remarks.notes;
        if origin != (0.0, 0.0) {
            let (x, y) = origin;
            notes.push(format!(
                "the map's (0, 0) is at ({x}, {y}) of the file; poses, waypoints and roads of the scenario stay in the \
                 file's coordinates"
            ));
        }
        if !self.is_sorted {
            notes.push("the rows were not in order of time, and were sorted".to_owned());
        }
        for class in Class::ALL {
            let names = self.unknown.iter().filter(|(_, taken_as)| **taken_as == class);
            let names: Vec<_> = names.map(|(name, _)| format!("{name:?}")).collect();
            if names.is_empty() {
                continue;
            }
            let (are, each) = if names.len() == 1 { (" is", "it") } else { ("s are", "each") };
            self.remarks.warnings.push(format!(
                "class name{are} not known and taken as {}: {}{}; say what {each} is by  classes = {{ {} }}{}, with one of \
                 {USUAL_CLASSES}",
                class.name(),
                names.join(", "),
                if self.n_unknown > self.unknown.len() { ", …" } else { "" },
                names.iter().map(|name| format!("{name} = \"CLASS\"")).collect::<Vec<_>>().join(", "),
                if class == Class::Unknown { "" } else { ", or by SUMO's  vtypes = \"demand.rou.xml\"" }
            ));
        }
    }
}

impl Draft {
    /// Width and depth, m: the mean of what the rows say, else by its vehicle type, else typical of its class.
    fn size(&self) -> [f64; 2] {
        let typical = self.class.typical_size();
        let mut sizes = [typical.0, typical.1];
        for (index, size) in sizes.iter_mut().enumerate() {
            let (sum, n) = self.sizes[index];
            *size = if n > 0 { sum / f64::from(n) } else { self.stated[index].unwrap_or(*size) };
        }
        sizes
    }

    /// In order of time; an error where two rows have one.
    fn sort(&mut self, base_s: f64) -> Result<(), TrafficError> {
        self.rows.sort_by_key(|row| row.t);
        let twice = self.rows.windows(2).find(|pair| pair[0].t == pair[1].t);
        twice.map_or(Ok(()), |pair| {
            Err(TrafficError::Duplicate {
                id: self.name.clone(),
                t_s: base_s + pair[0].t.as_secs_f64(),
                first: pair[0].line,
                second: pair[1].line,
            })
        })
    }

    fn object(self, first: Span, origin: (f64, f64), max_gap: Span) -> RecordedObject {
        let [w, d] = self.size();
        let mut poses: Vec<_> = self.rows.iter().map(|row| row.pose).collect();
        headings::fill(&mut poses);
        let sample = |(row, pose): (&Kept, Pose)| Sample {
            t: row.t - first,
            pose: Pose { x: pose.x - origin.0, y: pose.y - origin.1, yaw: wrap_angle(pose.yaw) },
        };
        let samples = self.rows.iter().zip(poses).map(sample).collect();
        RecordedObject {
            name: self.name,
            class: self.class,
            w,
            d,
            trajectory: Arc::new(Trajectory::new(samples, max_gap)),
        }
    }
}

/// Names of data sets and of SUMO that are no class by themselves.
fn of_data_set(name: &str) -> Option<Class> {
    let folded = name.trim().to_ascii_lowercase();
    Some(match folded.as_str() {
        // CommonRoad's.
        "taxi" | "parkedvehicle" => Class::Car,
        "priorityvehicle" => Class::Ambulance,
        "train" => Class::BendyBus,
        // INTERACTION does not distinguish them.
        "pedestrian/bicycle" => Class::Adult,
        "default_vehtype" | "passenger" | "private" | "evehicle" | "hov" | "custom1" | "custom2" => {
            Class::Car
        }
        "default_pedtype" => Class::Adult,
        "default_biketype" => Class::Bicycle,
        "default_taxitype" => Class::Car,
        "coach" => Class::RigidBus,
        "delivery" => Class::Truck,
        "emergency" => Class::Ambulance,
        "authority" | "army" | "vip" => Class::Car,
        "rail_urban" | "rail" | "rail_electric" | "rail_fast" | "subway" | "cable_car" => Class::BendyBus,
        _ => return None,
    })
}
