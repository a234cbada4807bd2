//! Recorded traffic in numbers.

use serde::Serialize;
use std::fmt::Write;
use v2x_agent::trajectories::{RecordedObject, Traffic};
use v2x_common::class::Class;

/// Recorded traffic in numbers.
#[derive(Debug, Serialize)]
pub(super) struct Summary {
    file: String,
    format: &'static str,
    rows: usize,
    scene: Option<String>,
    /// In the file, s.
    first_s: f64,
    duration_s: f64,
    /// Usual time between two rows of an object, s.
    step_s: f64,
    max_gap_s: f64,
    /// What is subtracted from the file's coordinates, m.
    origin: (f64, f64),
    /// West, south, east, north in the file's coordinates, m.
    extent: [f64; 4],
    classes: Vec<OfClass>,
    objects: Vec<OfObject>,
    notes: Vec<String>,
    warnings: Vec<String>,
}

#[derive(Debug, Serialize)]
struct OfClass {
    class: &'static str,
    objects: usize,
    w: f64,
    d: f64,
    mean_speed_mps: f64,
    max_speed_mps: f64,
}

#[derive(Debug, Serialize)]
struct OfObject {
    id: String,
    class: &'static str,
    /// Since time 0, s.
    from_s: f64,
    to_s: f64,
    way_m: f64,
    max_speed_mps: f64,
    rows: usize,
}

impl Summary {
    pub(super) fn of(traffic: &Traffic, file: &str) -> Self {
        let mut objects: Vec<_> = traffic.objects.iter().map(OfObject::of).collect();
        objects.sort_by(|a, b| b.way_m.total_cmp(&a.way_m));
        let [west, south, east, north] = traffic.extent();
        let (x, y) = traffic.origin;
        Self {
            file: file.to_owned(),
            format: traffic.format.name(),
            rows: traffic.n_rows,
            scene: traffic.scene.clone(),
            first_s: traffic.first_s,
            duration_s: traffic.length.as_secs_f64(),
            step_s: traffic.step.as_secs_f64(),
            max_gap_s: traffic.max_gap.as_secs_f64(),
            origin: traffic.origin,
            extent: [west + x, south + y, east + x, north + y],
            classes: Class::ALL.iter().filter_map(|class| OfClass::of(*class, traffic, &objects)).collect(),
            objects,
            notes: traffic.remarks.notes.clone(),
            warnings: traffic.remarks.warnings.clone(),
        }
    }

    /// As lines to read, with so many objects.
    pub(super) fn text(&self, n_objects: usize) -> String {
        let mut text = self.head();
        let _ = writeln!(text, "\nclass                        objects  size w × d, m   mean m/s   max m/s");
        for OfClass { class, objects, w, d, mean_speed_mps, max_speed_mps } in &self.classes {
            let size = format!("{w:.2} × {d:.2}");
            let _ = writeln!(
                text,
                "{class:28} {objects:7}  {size:>13} {mean_speed_mps:10.1} {max_speed_mps:9.1}"
            );
        }
        let width =
            self.objects.iter().take(n_objects).map(|one| one.id.chars().count()).max().unwrap_or(0).max(6);
        let _ = writeln!(
            text,
            "\n{:width$}  class                          from s      to s     way m   max m/s   rows",
            "object"
        );
        for OfObject { id, class, from_s, to_s, way_m, max_speed_mps, rows } in
            self.objects.iter().take(n_objects)
        {
            let _ = writeln!(
                text,
                "{id:width$}  {class:28} {from_s:8.1}  {to_s:8.1}  {way_m:8.1} {max_speed_mps:9.1} {rows:6}"
            );
        }
        let rest = self.objects.len().saturating_sub(n_objects);
        if rest > 0 {
            let _ = writeln!(text, "… and {rest} that go less far (--all lists them)");
        }
        for note in &self.notes {
            let _ = writeln!(text, "\nnote: {note}");
        }
        for warning in &self.warnings {
            let _ = writeln!(text, "\nlooks wrong: {warning}");
        }
        text
    }

    fn head(&self) -> String {
        let Self { file, format, rows, first_s, duration_s, step_s, max_gap_s, extent, .. } = self;
        let [west, south, east, north] = extent;
        let scene = self.scene.as_ref().map_or_else(String::new, |scene| format!(", scene {scene}"));
        let rate_hz = if *step_s > 0.0 { 1.0 / step_s } else { 0.0 };
        let (n, end_s) = (self.objects.len(), first_s + duration_s);
        format!(
            "{file}: {format}{scene}, {rows} rows, {n} objects\n\
             time    {duration_s:.1} s, from {first_s} to {end_s} s in the file; a row each {step_s:.3} s ({rate_hz:.1} Hz)\n\
             gaps    an object without a row for more than {max_gap_s} s is absent\n\
             extent  x {west:.1} to {east:.1} m, y {south:.1} to {north:.1} m in the file\n"
        )
    }
}

impl OfObject {
    fn of(object: &RecordedObject) -> Self {
        let samples = object.trajectory.samples();
        let seconds =
            |sample: Option<&v2x_agent::trajectories::Sample>| sample.map_or(0.0, |s| s.t.as_secs_f64());
        let (mut way_m, mut max_speed_mps) = (0.0, 0.0_f64);
        for pair in samples.windows(2) {
            let step_m = pair[0].pose.distance_to(pair[1].pose.x, pair[1].pose.y);
            way_m += step_m;
            max_speed_mps = max_speed_mps.max(step_m / (pair[1].t - pair[0].t).as_secs_f64());
        }
        Self {
            id: object.name.clone(),
            class: object.class.name(),
            from_s: seconds(samples.first()),
            to_s: seconds(samples.last()),
            way_m,
            max_speed_mps,
            rows: samples.len(),
        }
    }
}

impl OfClass {
    /// Means over the objects of a class; `None` where there are none.
    #[expect(clippy::cast_precision_loss, reason = "a number of objects")]
    fn of(class: Class, traffic: &Traffic, objects: &[OfObject]) -> Option<Self> {
        let n = traffic.objects.iter().filter(|object| object.class == class).count();
        let mean = |value: fn(&RecordedObject) -> f64| {
            traffic.objects.iter().filter(|object| object.class == class).map(value).sum::<f64>() / n as f64
        };
        let own = || objects.iter().filter(|object| object.class == class.name());
        let (way_m, time_s) =
            own().fold((0.0, 0.0), |(way, time), one| (way + one.way_m, time + one.to_s - one.from_s));
        (n > 0).then(|| Self {
            class: class.name(),
            objects: n,
            w: mean(|object| object.w),
            d: mean(|object| object.d),
            mean_speed_mps: if time_s > 0.0 { way_m / time_s } else { 0.0 },
            max_speed_mps: own().map(|object| object.max_speed_mps).fold(0.0, f64::max),
        })
    }
}
