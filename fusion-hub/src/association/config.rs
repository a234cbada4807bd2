//! How detections and tracks are associated.

use crate::values::ClassLaw;
use serde::{Deserialize, Serialize};

/// Beyond this distance of centres, m, [`AssociationCost::Euclidean`] makes no pair (paper, section IV).
pub const EUCLIDEAN_REACH_M: f64 = 3.0;

/// What makes a pair likely.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AssociationCost {
    /// Combined scores of centre, dimension and orientation, as in the paper.
    #[default]
    Csba,
    /// The negative log-likelihood.
    Likelihood,
    /// One minus the overlap of the boxes (paper, Fig. 4); the gate is that they overlap.
    Iou,
    /// The distance of the centres (paper, Fig. 4); the gate is [`EUCLIDEAN_REACH_M`].
    Euclidean,
}

/// What classes say of a pair.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClassRule {
    /// Nothing.
    Ignored,
    /// Only equal classes, or an unknown one, make a pair.
    #[default]
    Exact,
    /// Classes that differ cost by how seldom detectors confuse them, and make no pair where that is seldom and sizes differ, too;
    /// with a cost other than the likelihood as [`Self::Exact`].
    Evidence,
}

/// How pairs are made.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AssociationConfig {
    /// What makes a pair likely.
    pub cost: AssociationCost,
    /// The largest squared Mahalanobis distance of positions (χ² with 2 degrees of freedom) of a pair; of no
    /// effect on the costs that have a gate of their own.
    pub gate: f64,
    /// Whether reported headings may be turned by half a turn or a quarter, or be worthless; without, they err by a normal
    /// distribution.
    pub turned_headings: bool,
    /// What classes say of a pair.
    pub classes: ClassRule,
    /// How the classes of a frame's agent err; of effect with [`ClassRule::Evidence`].
    pub class_law: ClassLaw,
}

impl Default for AssociationConfig {
    /// The gate is that of deploy/docs/methods.md: 0.9997 of true pairs are within it.
    fn default() -> Self {
        Self {
            cost: AssociationCost::default(),
            gate: 16.2,
            turned_headings: false,
            classes: ClassRule::Exact,
            class_law: ClassLaw::UNKNOWN,
        }
    }
}
