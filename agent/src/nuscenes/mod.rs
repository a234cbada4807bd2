//! Annotated scenes from nuScenes' own tables: `scene.json`, `sample.json` and so on, as its devkit reads them.
//!
//! The caller opens the tables. The large ones are read record by record; only the records of the wanted scenes stay in
//! memory. Times, poses of the ego vehicle and boxes are the recorded ones; a keyframe's ego pose is that of its lidar sweep,
//! in the middle of the rear axle (<https://www.nuscenes.org/nuscenes#data-format>).

mod assemble;
mod scene;
mod table;
#[cfg(test)]
pub(crate) mod tests;

pub use scene::{AnnotatedFrame, AnnotatedScene, Annotation};
pub use table::{OpenTable, TableError};

use assemble::Assembly;

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
