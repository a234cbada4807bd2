//! What a method made of the detections.

use crate::data::exported::{DetectionId, identity};
use crate::data::fused_box::FusedBox;
use crate::data::observation::AgentReport;
use crate::data::scene::Scene;
use crate::score::keyframes::by_position::assign_objects;
use v2x_common::class::Class;
use v2x_common::covariance::BoxCovariance;
use v2x_common::geometry::BevBox;
use v2x_common::id::TrackId;
use v2x_fusion_hub::association::assignment::Assigner;

/// A box of a method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutputBox {
    /// Position and size (m), heading (rad).
    pub bev: BevBox,
    /// Its class.
    pub class: Class,
    /// Existence probability, 0 to 1.
    pub existence: f64,
    /// Its covariance, where the method states one.
    pub covariance: Option<BoxCovariance>,
    /// Of agents 1 and 2, the newest detection that it was made of: keyframe, and place in the agent's report.
    pub detections: [Option<(usize, usize)>; 2],
}

/// How the true object of a box is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Provenance {
    /// By the detections that it names: that of agent 1 of this keyframe, else of agent 2, else the newest one.
    Detections,
    /// By position, within the class. Not where agents miss objects or report clutter.
    Position,
}

/// The output of a method for every keyframe of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct MethodOutput {
    /// How the true objects are found.
    pub provenance: Provenance,
    /// The boxes, by keyframe.
    pub by_keyframe: Vec<Vec<OutputBox>>,
}

/// The output is not of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OutputError {
    /// Another number of keyframes.
    #[error("output for {found} keyframes, the scene has {expected}")]
    Keyframes {
        /// How many there are.
        found: usize,
        /// How many the scene has.
        expected: usize,
    },
    /// A detection that no agent reported.
    #[error(
        "box {index} of keyframe {frame} names detection {detection} of agent {} in keyframe {of}, which there is not", .agent + 1
    )]
    Detection {
        /// The keyframe.
        frame: usize,
        /// The box.
        index: usize,
        /// Place of the agent.
        agent: usize,
        /// The keyframe of the detection.
        of: usize,
        /// Its place in the report.
        detection: usize,
    },
    /// Boxes cannot be matched by position under these conditions.
    #[error(
        "with missed detections and clutter, boxes are matched by the detections that they name (det_ids) only"
    )]
    ByPosition,
}

impl MethodOutput {
    /// The boxes with their true objects.
    pub(super) fn scored(
        &self,
        scene: &Scene,
        reports: &[[AgentReport; 2]],
    ) -> Result<Vec<Vec<FusedBox>>, OutputError> {
        let (found, expected) = (self.by_keyframe.len(), scene.keyframes.len());
        if found != expected {
            return Err(OutputError::Keyframes { found, expected });
        }
        let mut assigner = Assigner::default();
        let scored = |(frame, boxes): (usize, &Vec<OutputBox>)| {
            let scored = |(index, one): (usize, &OutputBox)| one.scored((frame, index), reports);
            let mut boxes = boxes.iter().enumerate().map(scored).collect::<Result<Vec<_>, _>>()?;
            if self.provenance == Provenance::Position {
                assign_objects(&mut boxes, &scene.keyframes[frame], &mut assigner);
            }
            Ok(boxes)
        };
        self.by_keyframe.iter().enumerate().map(scored).collect()
    }
}

impl OutputBox {
    fn scored(
        &self,
        (frame, index): (usize, usize),
        reports: &[[AgentReport; 2]],
    ) -> Result<FusedBox, OutputError> {
        let named = self.detections.iter().enumerate().filter_map(|(agent, one)| {
            let (frame, index) = (*one)?;
            Some(DetectionId { agent, frame, index })
        });
        let object = identity(named, frame, reports).map_err(|id| OutputError::Detection {
            frame,
            index,
            agent: id.agent,
            of: id.frame,
            detection: id.index,
        })?;
        Ok(FusedBox {
            bev: self.bev,
            class: self.class,
            existence: self.existence,
            velocity: None,
            covariance: self.covariance.unwrap_or_default(),
            track: TrackId(index as u64),
            object,
        })
    }
}
