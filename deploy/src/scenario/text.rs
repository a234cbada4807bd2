//! A scenario of recorded traffic, as commented TOML.

use super::ride::{self, Stay};
use crate::{recorded, sumo_home};
use std::collections::BTreeMap;
use std::fmt::Write;
use v2x_agent::trajectories::{ReadOptions, Traffic};

/// Side of the squares in which rows are counted, m.
const CELL_M: f64 = 20.0;
/// A world ends when the agent's vehicle leaves where that is there for so long, s, or for such a share of the recording.
const LONG_STAY_S: f64 = 20.0;
const LONG_STAY_SHARE: f64 = 0.5;

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
    let stay = ride::best(traffic);
    let part = Part::of(traffic, options, stay.as_ref());
    text += &keys(traffic, &part);
    text += "\n# Roads for the pictures, by their middle and width, or as areas; nothing drives by them:\n\
             # [[world.road]]\n\
             # width_m = 7.0\n\
             # line = [[-100, 0], [100, 0]]\n\
             # [[world.road]]\n\
             # polygon = [[-8, -8], [8, -8], [8, 8], [-8, 8]]\n";
    if let Some(stay) = stay {
        let [from_s, to_s] = [stay.from, stay.to].map(|t| t.as_secs_f64() - part.skipped_s);
        let when =
            format!("It is there from {from_s:.1} to {to_s:.1} s of the world; else the agent is idle.");
        text += &rider(&stay, &when);
    }
    text += &units(traffic, stay.is_some());
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
         file = {}\n",
        quoted(&name_of(config)),
        quoted(config),
    );
    if let Some(words) = sumo_home::long_step(traffic.step.as_secs_f64()) {
        let _ = writeln!(text, "# {words}.");
    }
    text += "# SUMO's time at which the world begins, s; until then it runs as fast as it can.\n";
    let stay = ride::best(traffic);
    match stay.filter(|stay| stay.from.as_secs_f64() > 0.0) {
        // What SUMO writes of a time is there one step later for those who ask.
        Some(stay) => {
            let begin_s = libm::ceil(traffic.first_s + (stay.from + traffic.step).as_secs_f64());
            let _ = writeln!(text, "# The agent's vehicle is there then:\nbegin_s = {begin_s}");
        }
        None => text += "# begin_s = 60\n",
    }
    if let Some(stay) = stay {
        let [from_s, to_s] = [stay.from, stay.to].map(|t| traffic.first_s + t.as_secs_f64());
        let until = if stay.to >= traffic.length {
            format!("at least {to_s:.0} s, up to where SUMO was looked at")
        } else {
            format!("{to_s:.0} s")
        };
        let when =
            format!("It is there from {from_s:.0} to {until}, of SUMO's time; else the agent is idle.");
        text += &rider(&stay, &when);
    }
    text += &units(traffic, stay.is_some());
    text + "\n# Settings of the hub; keys that are left out have their defaults.\n[hub]\n"
}

/// The part of a recording that becomes the world, s since the file's earliest time.
struct Part {
    from_s: Option<f64>,
    to_s: Option<f64>,
    /// The last time of the recording.
    end_s: f64,
    /// What was read and is left out before it, s.
    skipped_s: f64,
    /// It is that in which the agent's vehicle is there.
    is_of_vehicle: bool,
}

impl Part {
    /// What the user has chosen, or the part in which a vehicle is there.
    fn of(traffic: &Traffic, options: &ReadOptions, stay: Option<&Stay<'_>>) -> Self {
        let length_s = traffic.length.as_secs_f64();
        let end_s = options.from_s.unwrap_or(0.0) + length_s;
        let chosen =
            Self { from_s: options.from_s, to_s: options.to_s, end_s, skipped_s: 0.0, is_of_vehicle: false };
        let Some(stay) = stay.filter(|_| options.from_s.is_none() && options.to_s.is_none()) else {
            return chosen;
        };
        let is_long = stay.seconds() >= LONG_STAY_S.min(LONG_STAY_SHARE * length_s);
        let from_s = milliseconds(stay.from.as_secs_f64());
        let from_s = (from_s > 0.0).then_some(from_s);
        let to_s = (is_long && stay.to < traffic.length).then(|| milliseconds(stay.to.as_secs_f64()));
        Self {
            from_s,
            to_s,
            skipped_s: from_s.unwrap_or(0.0),
            is_of_vehicle: from_s.or(to_s).is_some(),
            ..chosen
        }
    }
}

/// Whole milliseconds, never later.
fn milliseconds(seconds: f64) -> f64 {
    libm::floor(1e3 * seconds + 1e-6) / 1e3
}

fn keys(traffic: &Traffic, part: &Part) -> String {
    let mut text = String::new();
    let key = |name: &str, value: Option<f64>, other: &str| match value {
        Some(value) => format!("{name} = {value:?}\n"),
        None => format!("# {name} = {other}\n"),
    };
    text += match part.is_of_vehicle {
        true => {
            "# The part in which the first agent's vehicle is there, s since the file's earliest time; without these keys all of\n# it is the world:\n"
        }
        false => "# A part of it, s since the file's earliest time:\n",
    };
    text += &key("from_s", part.from_s, "0");
    text += &key("to_s", part.to_s, &format!("{}", part.end_s));
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

/// A vehicle agent; `when` says when its vehicle is there.
fn rider(stay: &Stay<'_>, when: &str) -> String {
    format!(
        "\n# A vehicle agent on an object of the world, by its id: it sees the others, and reports itself.\n\
         [[agents]]\n\
         id = \"ego\"\n\
         kind = \"vehicle\"\n\
         # {when}\n\
         ride = {}\n\
         # Or a way of its own, as [t_s, x, y]:\n\
         # waypoints = [[0, -50, -2], [10, 50, -2]]\n\
         rate_hz = 10\n\
         noise = \"N1\"\n\
         field_of_view = {{ range_max_m = 60 }}\n\
         accuracy = {{ position_m = 0.3, yaw_deg = 0.5 }}\n\
         # From capture to arrival: 80 ± 30 ms, and one frame of a hundred is lost. Or a name: v2x links\n\
         link = {{ delay_ms = 80, jitter_ms = 30, loss = 0.01 }}\n",
        quoted(&stay.object.name),
    )
}

/// A roadside unit where most rows are, and another one where no vehicle can carry the first agent.
fn units(traffic: &Traffic, has_rider: bool) -> String {
    let n = if has_rider { 1 } else { 2 };
    let mut text =
        "\n# A roadside unit where most happens: move it to where you would place one.\n".to_owned();
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
