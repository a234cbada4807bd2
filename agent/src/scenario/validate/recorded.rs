//! Recorded traffic as the world of a scenario.

use std::collections::BTreeMap;
use std::path::Path;

use v2x_common::class::Class;

use super::field::Field;
use super::roads;
use super::setting::Setting;
use crate::scenario::config::ScenarioFile;
use crate::scenario::error::ScenarioError;
use crate::scenario::files::{Files, maker_in_words};
use crate::scenario::toml_file::{TomlOrigin, TomlWorld};
use crate::trajectories::{ReadOptions, VehicleType};
use crate::world::{Course, RecordedWorld, WorldConfig, traffic_roads};

pub(super) fn recorded(field: &Field<'_>, file: &TomlWorld, files: &Files) -> Result<Setting, ScenarioError> {
    let Some(name) = &file.file else {
        let expected = "the path of recorded traffic: CSV with columns t, id, class, x, y, XML of SUMO or CommonRoad, or \
                        the folder of nuScenes' tables";
        return Err(field.child("file").error("missing", expected));
    };
    let path = existing(field, files, ("file", name))?;
    let mut named = vec![ScenarioFile { key: "file", path: path.clone() }];
    let mut vehicle_types = BTreeMap::<String, VehicleType>::new();
    if let Some(name) = &file.vtypes {
        let path = existing(field, files, ("vtypes", name))?;
        vehicle_types = Files::vehicle_types(&path)?;
        named.push(ScenarioFile { key: "vtypes", path });
    }
    let traffic = files.traffic(path, options(field, file, vehicle_types)?)?;
    let mut roads = traffic_roads(&traffic);
    roads.extend(roads::roads(field, &file.road, traffic.origin)?);
    let course = if file.repeats.unwrap_or(true) { Course::Repeats } else { Course::Ends };
    let config = WorldConfig::Recorded(RecordedWorld { traffic, course, roads });
    Ok(Setting { config, files: named, sumo: None })
}

/// The path of a file that is there.
fn existing(
    field: &Field<'_>,
    files: &Files,
    (key, name): (&'static str, &str),
) -> Result<std::path::PathBuf, ScenarioError> {
    let path = files.path(name);
    if path.is_file() || key == "file" && path.is_dir() {
        return Ok(path);
    }
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    let folder = folder.map_or_else(String::new, |folder| format!(" in {}", folder.display()));
    let expected = format!(
        "a file{folder}; the CSV and XML files and folders of tables there: {}{}",
        files.others(&path),
        maker_in_words(&path)
    );
    Err(field.child(key).error(format_args!("{name:?}"), expected))
}

fn options(
    field: &Field<'_>,
    file: &TomlWorld,
    vehicle_types: BTreeMap<String, VehicleType>,
) -> Result<ReadOptions, ScenarioError> {
    let second = |name, value: Option<f64>| {
        value
            .map(|value| {
                field.number(name, value, value.abs() <= 1e9, "seconds since the file's earliest time")
            })
            .transpose()
    };
    let (from_s, to_s) = (second("from_s", file.from_s)?, second("to_s", file.to_s)?);
    if let (Some(from_s), Some(to_s)) = (from_s, to_s) {
        field.number("to_s", to_s, to_s > from_s, "more than from_s")?;
    }
    let gap = |gap_s: f64| {
        field.number("max_gap_s", gap_s, gap_s > 0.0 && gap_s <= 3600.0, "more than 0, at most 3600")
    };
    let origin = file.origin.as_ref().map(|TomlOrigin { x, y }| {
        let field = field.child("origin");
        let limit = "-1e8 to 1e8";
        Ok((field.number("x", *x, x.abs() <= 1e8, limit)?, field.number("y", *y, y.abs() <= 1e8, limit)?))
    });
    Ok(ReadOptions {
        from_s,
        to_s,
        earliest_s: None,
        origin: origin.transpose()?,
        scene: file.scene.clone(),
        max_gap_s: file.max_gap_s.map(gap).transpose()?,
        classes: classes(&field.child("classes"), &file.classes)?,
        vehicle_types,
    })
}

fn classes(
    field: &Field<'_>,
    file: &BTreeMap<String, String>,
) -> Result<BTreeMap<String, Class>, ScenarioError> {
    let class = |(name, class): (&String, &String)| {
        let known = Class::from_name(class);
        let known = known.ok_or_else(|| {
            let names: Vec<_> = Class::ALL.iter().map(|class| class.name()).collect();
            field.child(name).error(format_args!("{class:?}"), format_args!("a class: {}", names.join(", ")))
        });
        Ok((name.clone(), known?))
    };
    file.iter().map(class).collect()
}
