//! A compared method: one of the hub's, a user's in-process method, or the recorded output of a user's method.

use crate::data::fused_box::FusedBox;
use crate::data::observation::AgentReport;
use crate::drive::keyframes::engine_run::{EngineRun, KeyframeOutput, Refused};
use crate::drive::keyframes::method::{Method, Recipe};
use crate::drive::keyframes::outputs::RecordedOutput;
use crate::drive::keyframes::setting::{SceneTrial, Setting};
use crate::drive::keyframes::setup::Setup;
use serde::{Serialize, Serializer};
use std::fmt;
use std::sync::Arc;
use v2x_common::detection::Detection;
use v2x_common::time::Span;
use v2x_fusion_hub::fusion::FusionMethod;

/// Makes a user's method for one scene.
pub(crate) type Factory = dyn Fn() -> Box<dyn FusionMethod> + Send + Sync;

/// A row of the tables.
#[derive(Clone)]
pub enum Contender {
    /// A method of the tables.
    Method(Method),
    /// A user's method.
    Own {
        /// Its name in tables.
        key: String,
        /// Its inputs apart from boxes and classes, in words.
        inputs: String,
        /// Makes it for one scene.
        factory: Arc<Factory>,
    },
    /// The output of a user's method for exported detections.
    Recorded(Arc<RecordedOutput>),
}

impl fmt::Debug for Contender {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Contender").field(&self.key()).finish()
    }
}

impl PartialEq for Contender {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}

impl Serialize for Contender {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.key())
    }
}

impl Contender {
    /// A user's method; `inputs` are its inputs apart from boxes and classes, in words.
    pub fn own(
        key: impl Into<String>,
        inputs: impl Into<String>,
        factory: impl Fn() -> Box<dyn FusionMethod> + Send + Sync + 'static,
    ) -> Self {
        Self::Own { key: key.into(), inputs: inputs.into(), factory: Arc::new(factory) }
    }

    /// Its name in tables.
    pub fn key(&self) -> &str {
        match self {
            Self::Method(method) => method.key(),
            Self::Own { key, .. } => key,
            Self::Recorded(output) => output.name(),
        }
    }

    /// Its inputs apart from boxes and classes, in words.
    pub fn inputs(&self) -> String {
        match self {
            Self::Method(method) => method.inputs(),
            Self::Own { inputs, .. } => inputs.clone(),
            Self::Recorded(output) => output.inputs().to_owned(),
        }
    }

    /// Whether it can run under this setting. A recorded output is for the detections of one setting only.
    pub fn has_output_for(&self, setting: &Setting) -> bool {
        match self {
            Self::Recorded(output) => output.is_for(setting),
            _ => true,
        }
    }

    /// Whether its boxes have covariances.
    pub fn claims_accuracy(&self) -> bool {
        match self {
            Self::Recorded(output) => output.claims_accuracy(),
            _ => true,
        }
    }

    /// The method of the tables, if it is one.
    pub const fn method(&self) -> Option<Method> {
        match self {
            Self::Method(method) => Some(*method),
            _ => None,
        }
    }

    /// Makes it for one scene.
    pub fn begin(&self, trial_of_scene: &SceneTrial<'_>) -> Fuser {
        let SceneTrial { noise, conditions, .. } = *trial_of_scene;
        let run = |setup: Setup| Box::new(EngineRun::new(setup, noise.levels(), conditions));
        match self {
            Self::Method(method) => {
                let Recipe { setup, before } = method.recipe(noise);
                match before {
                    Some(before) => Fuser::Filtered(run(before), run(setup)),
                    None => Fuser::Engine(run(setup)),
                }
            }
            Self::Own { factory, .. } => {
                let run = EngineRun::with_fusion(Setup::ours(), noise.levels(), conditions, factory());
                Fuser::Engine(Box::new(run))
            }
            Self::Recorded(output) => Fuser::Recorded(output.of(trial_of_scene)),
        }
    }
}

/// A contender in one scene.
#[derive(Debug)]
pub enum Fuser {
    /// An engine.
    Engine(Box<EngineRun>),
    /// Two engines: the second takes the first one's fused objects as an agent's report.
    Filtered(Box<EngineRun>, Box<EngineRun>),
    /// A recorded output, by keyframe.
    Recorded(std::vec::IntoIter<Vec<FusedBox>>),
}

impl Fuser {
    /// Takes in a keyframe of this number and time. Returns the keyframes that are published then: this one, or with a lag
    /// earlier ones.
    pub fn fuse(
        &mut self,
        reports: &[AgentReport; 2],
        (frame, at): (usize, Span),
    ) -> Result<Vec<KeyframeOutput>, Refused> {
        match self {
            Self::Engine(run) => run.fuse(reports, at),
            Self::Filtered(first, second) => {
                let fused = first.fuse(reports, at)?;
                let boxes = fused.iter().flat_map(|output| &output.boxes);
                second.fuse(&[as_report(boxes, reports)], at)
            }
            Self::Recorded(output) => {
                Ok(vec![KeyframeOutput { frame, boxes: output.next().unwrap_or_default() }])
            }
        }
    }

    /// At the end of a scene: the keyframes that are not published yet.
    pub fn finish(&mut self) -> Vec<KeyframeOutput> {
        match self {
            Self::Engine(run) | Self::Filtered(_, run) => run.finish(),
            Self::Recorded(_) => Vec::new(),
        }
    }
}

/// A fused list as a report of agent 1.
fn as_report<'a>(
    fused: impl Iterator<Item = &'a FusedBox> + Clone,
    reports: &[AgentReport; 2],
) -> AgentReport {
    let detection = |one: &FusedBox| Detection {
        class: one.class,
        score: one.existence,
        bev: one.bev,
        covariance: one.covariance,
        velocity: None,
        heading: v2x_common::detection::HeadingKind::Known,
        source_track: None,
    };
    AgentReport {
        pose: reports[0].pose,
        detections: fused.clone().map(detection).collect(),
        identities: fused.map(|one| one.object).collect(),
    }
}
