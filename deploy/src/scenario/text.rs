//! A scenario of recorded traffic, as commented TOML.

use crate::recorded;
use std::collections::BTreeMap;
use std::fmt::Write;
use v2x_agent::trajectories::{ReadOptions, RecordedObject, Traffic};
use v2x_common::class::ClassGroup;

/// Side of the squares in which rows are counted, m.
const CELL_M: f64 = 20.0;

/// The paths of the files, as the scenario has them.
pub(super) struct Files<'a> {
    pub(super) traffic: &'a str,
    /// With SUMO's vehicle types.
    pub(super) vtypes: Option<&'a str>,
}

/// A scenario with a vehicle that rides on an object of the recording, and a roadside unit where most of it happens.
pub(super) fn scenario(traffic: &Traffic, options: &ReadOptions, files: &Files<'_>) -> String {
    let file = files.traffic;
    let mut text = format!(
        "# Recorded traffic as a live world, written by  v2x scenario init. Every key: deploy/docs/configuration.md\n\
         # Coordinates here are those of the recorded file: m, x east, y north.\n\n\
         name = {}\n\n\
         [world]\n\
         kind = \"trajectories\"\n\
         # Relative to this file. {} objects in {:.1} s;  v2x world {file}  draws it.\n\
         file = {}\n",
        quoted(&name_of(file)),
        traffic.objects.len(),
        traffic.length.as_secs_f64(),
        quoted(file),
    );
    if let Some(vtypes) = files.vtypes {
        let _ = writeln!(text, "# Sizes and classes of SUMO's vehicle types.\nvtypes = {}", quoted(vtypes));
    }
    text += &keys(traffic, options);
    text += "\n# Roads for the pictures, by their middle and width, or as areas; nothing drives by them:\n\
             # [[world.road]]\n\
             # width_m = 7.0\n\
             # line = [[-100, 0], [100, 0]]\n\
             # [[world.road]]\n\
             # polygon = [[-8, -8], [8, -8], [8, 8], [-8, 8]]\n";
    if let Some(object) = best_to_ride(traffic) {
        text += &rider(object);
    }
    text += &units(traffic);
    text + "\n# Settings of the hub; keys that are left out have their defaults.\n[hub]\n"
}

/// A scenario whose world SUMO drives by this configuration; its traffic is that of the first minutes.
pub(super) fn live(traffic: &Traffic, config: &str) -> String {
    let mut text = format!(
        "# SUMO as the live world of a network, written by  v2x scenario init. Every key: deploy/docs/configuration.md\n\
         # Coordinates are those of SUMO's network: m, x east, y north.\n\n\
         name = {}\n\n\
         [world]\n\
         kind = \"sumo\"\n\
         # Relative to this file. Its network is drawn, too.\n\
         file = {}\n\
         # SUMO's time at which the world begins, s; until then it runs as fast as it can:\n\
         # begin_s = 60\n",
        quoted(&name_of(config)),
        quoted(config),
    );
    if let Some(object) = best_to_ride(traffic) {
        text += &rider(object);
    }
    text += &units(traffic);
    text + "\n# Settings of the hub; keys that are left out have their defaults.\n[hub]\n"
}

fn keys(traffic: &Traffic, options: &ReadOptions) -> String {
    let mut text = String::new();
    let key = |name: &str, value: Option<f64>, other: &str| match value {
        Some(value) => format!("{name} = {value:?}\n"),
        None => format!("# {name} = {other}\n"),
    };
    text += "# A part of it, s since the file's first row:\n";
    text += &key("from_s", options.from_s, "0");
    text += &key("to_s", options.to_s, &format!("{}", traffic.length.as_secs_f64()));
    if let Some(scene) = &traffic.scene {
        let _ = writeln!(text, "scene = {}", quoted(scene));
    }
    let _ =
        writeln!(text, "# After its end it begins again; with false the world is empty then.\nloop = true");
    let gap_s = traffic.max_gap.as_secs_f64();
    let _ = writeln!(text, "# An object without a row for longer is absent, s.\n# max_gap_s = {gap_s}");
    if traffic.origin != (0.0, 0.0) {
        let (x, y) = traffic.origin;
        let _ = writeln!(
            text,
            "# The place that is (0, 0) in the network's map.\norigin = {{ x = {x:?}, y = {y:?} }}"
        );
    }
    text += "# Classes of names that are not known:\n# classes = { my_type = \"truck\" }\n";
    text
}

fn rider(object: &RecordedObject) -> String {
    let samples = object.trajectory.samples();
    let seconds =
        |sample: Option<&v2x_agent::trajectories::Sample>| sample.map_or(0.0, |s| s.t.as_secs_f64());
    format!(
        "\n# A vehicle agent on an object of the recording, by its id: it sees the others, and reports itself.\n\
         [[agents]]\n\
         id = \"ego\"\n\
         kind = \"vehicle\"\n\
         # It is there from {:.1} to {:.1} s; before and after it the agent sends nothing.\n\
         ride = {}\n\
         # Or a way of its own, as [t_s, x, y]:\n\
         # waypoints = [[0, -50, -2], [10, 50, -2]]\n\
         rate_hz = 10\n\
         noise = \"N1\"\n\
         field_of_view = {{ range_max_m = 60 }}\n\
         accuracy = {{ position_m = 0.3, yaw_deg = 0.5 }}\n\
         # From capture to arrival: 80 ± 30 ms, and one frame of a hundred is lost. Or a name: v2x links\n\
         link = {{ delay_ms = 80, jitter_ms = 30, loss = 0.01 }}\n",
        seconds(samples.first()),
        seconds(samples.last()),
        quoted(&object.name),
    )
}

/// A roadside unit where most rows are, and another one where no vehicle can carry the first agent.
fn units(traffic: &Traffic) -> String {
    let n = if best_to_ride(traffic).is_some() { 1 } else { 2 };
    let mut text =
        "\n# A roadside unit where most of the recording happens: move it to where you would place one.\n"
            .to_owned();
    for (number, (x, y)) in busiest(traffic, n).into_iter().enumerate() {
        let id = if number == 0 { "rsu".to_owned() } else { format!("rsu-{}", number + 1) };
        let (x, y) = (x + traffic.origin.0, y + traffic.origin.1);
        let _ = write!(
            text,
            "[[agents]]\nid = \"{id}\"\nkind = \"roadside-unit\"\n\
             pose = {{ x = {x:.1}, y = {y:.1}, yaw_deg = 0 }}\n\
             phase_ms = 50\nnoise = \"N1\"\nfield_of_view = {{ range_max_m = 60 }}\n\
             link = {{ delay_ms = 80, jitter_ms = 30, loss = 0.01 }}\n"
        );
    }
    text
}

/// The vehicle that goes the longest way for the longest time.
fn best_to_ride(traffic: &Traffic) -> Option<&RecordedObject> {
    let way_m = |object: &RecordedObject| {
        let samples = object.trajectory.samples().windows(2);
        samples.map(|pair| pair[0].pose.distance_to(pair[1].pose.x, pair[1].pose.y)).sum::<f64>()
    };
    let time_s = |object: &RecordedObject| {
        let samples = object.trajectory.samples();
        samples.last().zip(samples.first()).map_or(0.0, |(last, first)| (last.t - first.t).as_secs_f64())
    };
    let vehicles = traffic.objects.iter().filter(|object| object.class.group() == ClassGroup::FourWheeled);
    let ways = vehicles.map(|object| (way_m(object), object)).filter(|(way_m, _)| *way_m > 10.0);
    ways.max_by(|a, b| (a.0 * time_s(a.1)).total_cmp(&(b.0 * time_s(b.1)))).map(|(_, object)| object)
}

/// Middles of the squares with most rows.
fn busiest(traffic: &Traffic, n: usize) -> Vec<(f64, f64)> {
    #[expect(clippy::cast_possible_truncation, reason = "coordinates are below 1e8 m")]
    let cell = |value: f64| libm::floor(value / CELL_M) as i64;
    let mut rows = BTreeMap::<(i64, i64), usize>::new();
    for sample in traffic.objects.iter().flat_map(|object| object.trajectory.samples()) {
        *rows.entry((cell(sample.pose.x), cell(sample.pose.y))).or_default() += 1;
    }
    let mut cells: Vec<_> = rows.into_iter().collect();
    cells.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
    #[expect(clippy::cast_precision_loss, reason = "cells of a map")]
    let middle = |cell: i64| (cell as f64 + 0.5) * CELL_M;
    cells.into_iter().take(n).map(|((x, y), _)| (middle(x), middle(y))).collect()
}

fn name_of(file: &str) -> String {
    recorded::stem(std::path::Path::new(file)).unwrap_or_else(|| "recorded".to_owned())
}

/// JSON writes a text with the same escapes as TOML.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}
