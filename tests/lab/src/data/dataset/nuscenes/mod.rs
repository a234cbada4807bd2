//! Scenes from nuScenes' own tables: `ROOT/VERSION/scene.json` and so on, as its devkit reads them.
//!
//! The large tables are read record by record. Only the records of the chosen scenes stay in memory. Times, ego poses and
//! boxes are the recorded ones; a keyframe's ego pose is that of its lidar sweep.

mod assemble;
mod error;
mod split;
mod table;
#[cfg(test)]
mod tests;

pub(crate) use error::NuscenesError;
pub(crate) use split::Split;

use crate::data::scene::Scene;
use assemble::Assembly;
use std::path::Path;

/// Reads the scenes of a split.
pub(crate) fn load(root: &Path, version: &str, split: &Split) -> Result<Vec<Scene>, NuscenesError> {
    let folder = root.join(version);
    let mut assembly = Assembly::default();
    assembly.read_classes(&folder)?;
    assembly.read_scenes(&folder, split)?;
    assembly.read_samples(&folder)?;
    assembly.read_ego_poses(&folder)?;
    assembly.read_boxes(&folder)?;
    let scenes = assembly.finish()?;
    if scenes.is_empty() {
        return Err(NuscenesError::NoScenes { folder, split: split.clone() });
    }
    Ok(scenes)
}
