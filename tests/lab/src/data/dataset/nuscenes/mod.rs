//! Scenes from nuScenes' own tables: `ROOT/VERSION/scene.json` and so on, which `v2x_agent::nuscenes` reads.
//!
//! Agent 1 of a keyframe is at the ego pose of its lidar sweep.

mod error;
mod split;
#[cfg(test)]
mod tests;

pub(crate) use error::NuscenesError;
pub(crate) use split::Split;

use crate::data::scene::{Keyframe, Scene, TrueBox};
use std::path::Path;
use v2x_agent::nuscenes::{AnnotatedScene, Annotation, scenes};
use v2x_agent::scenario::table_in;
use v2x_agent::truth::ObjectId;
use v2x_common::time::Timestamp;

/// Reads the scenes of a split.
pub(crate) fn load(root: &Path, version: &str, split: &Split) -> Result<Vec<Scene>, NuscenesError> {
    let folder = root.join(version);
    let scenes = scenes(&|table| table_in(&folder, table), &|name| split.has(name))?;
    if scenes.is_empty() {
        return Err(NuscenesError::NoScenes { folder, split: split.clone() });
    }
    Ok(scenes.into_iter().map(scene).collect())
}

fn scene(AnnotatedScene { name, keyframes, .. }: AnnotatedScene) -> Scene {
    let start = keyframes.first().map_or(Timestamp::EPOCH, |keyframe| keyframe.at);
    let object = |Annotation { instance, class, bev }| TrueBox { id: ObjectId(instance), class, bev };
    let keyframes = keyframes.into_iter().map(|keyframe| Keyframe {
        at: keyframe.at - start,
        ego: keyframe.ego,
        objects: keyframe.boxes.into_iter().map(object).collect(),
    });
    Scene::new(name, keyframes.collect())
}
