//! The paper's protocol for methods in other languages: noisy detections of scenes, and the scores of what a method makes of
//! them. It is what `lab export`, `lab score` and `lab tables` do, without files between.

mod output;
mod study;

use crate::data::dataset::Source;

pub use crate::data::conditions::Conditions;
pub use crate::data::dataset::DatasetError;
pub use crate::data::noise::{NoisePair, Shape};
pub use crate::data::observation::AgentReport;
pub use crate::data::scene::{Keyframe, Scene, TrueBox};
pub use crate::drive::keyframes::contender::Contender;
pub use crate::drive::keyframes::method::Method;
pub use crate::drive::keyframes::outputs::RecordedOutput;
pub use crate::score::keyframes::counting::{Counting, Subset};
pub use crate::score::keyframes::experiments::RunError;
pub use crate::score::keyframes::metrics::{Metrics, Value};
pub use output::{MethodOutput, OutputBox, OutputError, Provenance};
pub use study::{Score, Study};

/// The scenes of `lab --dataset SOURCE`; `version` and `split` are those of nuScenes.
///
/// # Errors
/// Names the file, the line and the column, or says which sources there are.
pub fn scenes(source: &str, version: &str, split: &str) -> Result<Vec<Scene>, DatasetError> {
    let source: Source = source.parse()?;
    match split.parse() {
        Ok(split) => source.load(version, &split),
        Err(never) => match never {},
    }
}

/// The scenes of `lab --quick`: at most twelve, spread over all.
pub fn quick(scenes: Vec<Scene>) -> Vec<Scene> {
    crate::data::scene::spread(scenes, crate::data::scene::QUICK_SCENES)
}
