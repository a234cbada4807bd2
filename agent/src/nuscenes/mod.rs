//! Annotated scenes from nuScenes' own tables: `scene.json`, `sample.json` and so on, as its devkit reads them.
//!
//! The caller opens the tables. The large ones are read record by record; only the records of the wanted scenes stay in
//! memory. Times, poses of the ego vehicle and boxes are the recorded ones; a keyframe's ego pose is that of its lidar sweep,
//! in the middle of the rear axle (<https://www.nuscenes.org/nuscenes#data-format>).

mod assemble;
mod table;
#[cfg(test)]
pub(crate) mod tests;

pub use table::TableError;

use assemble::Assembly;
use std::io::{self, BufRead};
use v2x_common::class::Class;
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::time::Timestamp;

/// The tables that are read.
pub const TABLES: [&str; 9] = [
    "category",
    "instance",
    "scene",
    "sample",
    "sensor",
    "calibrated_sensor",
    "sample_data",
    "ego_pose",
    "sample_annotation",
];

/// Opens a table by its name.
pub type OpenTable<'a> = dyn Fn(&str) -> io::Result<Box<dyn BufRead>> + 'a;

/// One scene.
#[derive(Clone, Debug, PartialEq)]
pub struct AnnotatedScene {
    /// Such as `scene-0103`.
    pub name: String,
    /// Tokens of the annotated objects, in order of appearance in the tables.
    pub instances: Vec<String>,
    /// In order of time.
    pub keyframes: Vec<AnnotatedFrame>,
}

/// One keyframe.
#[derive(Clone, Debug, PartialEq)]
pub struct AnnotatedFrame {
    /// When it was captured.
    pub at: Timestamp,
    /// The middle of the ego vehicle's rear axle, in the map of the scene's city, m, and its heading, rad.
    pub ego: Pose,
    /// The annotated objects.
    pub boxes: Vec<Annotation>,
}

/// One object in one keyframe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Annotation {
    /// Its place in the scene's `instances`.
    pub instance: u32,
    /// Its class.
    pub class: Class,
    /// Position and size, m; heading, rad.
    pub bev: BevBox,
}

/// The names of all scenes, in the table's order.
pub fn scene_names(open: &OpenTable<'_>) -> Result<Vec<String>, TableError> {
    let mut names = Vec::new();
    table::each(open, "scene", |record| {
        names.push(record.text("name")?.to_owned());
        Ok(())
    })?;
    Ok(names)
}

/// Reads the scenes whose names are wanted, in the table's order; those without a sample are left out.
pub fn scenes(
    open: &OpenTable<'_>,
    is_wanted: &dyn Fn(&str) -> bool,
) -> Result<Vec<AnnotatedScene>, TableError> {
    let mut assembly = Assembly::default();
    assembly.read_classes(open)?;
    assembly.read_scenes(open, is_wanted)?;
    assembly.read_samples(open)?;
    assembly.read_ego_poses(open)?;
    assembly.read_boxes(open)?;
    assembly.finish()
}
