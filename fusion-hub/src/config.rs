//! The engine's settings.

use crate::association::AssociationCost;
use crate::sensing::SensingDefaults;
use v2x_common::id::{HubId, MapFrame};
use v2x_common::time::Span;

/// What an engine is told once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EngineConfig {
    /// Its name in fused frames.
    pub hub: HubId,
    /// New at every start, so that track ids never come back.
    pub lineage: u32,
    /// The coordinate frame of all positions; frames that name another one are refused. Where it is `None`, the
    /// first one that an accepted frame names holds.
    pub map_frame: Option<MapFrame>,
    /// Δmax: frames older, or further in the future, are refused.
    pub delta_max: Span,
    /// How long an object is published without being measured.
    pub coast: Span,
    /// What makes a pair of detection and track likely.
    pub association: AssociationCost,
    /// χ² gate on the squared Mahalanobis distance of positions (2 degrees of freedom).
    pub gate: f64,
    /// Probability of existence from which on an object is published.
    pub publish_existence: f64,
    /// What is assumed where agents say nothing.
    pub sensing: SensingDefaults,
}

impl EngineConfig {
    /// The defaults, for a hub of this name: Δmax of the paper (500 ms), the gate of METHODS.md 7
    /// (16.2: 0.9997 of true pairs).
    pub fn new(hub: HubId, lineage: u32) -> Self {
        Self {
            hub,
            lineage,
            map_frame: None,
            delta_max: Span::from_millis(500),
            coast: Span::from_millis(1500),
            association: AssociationCost::default(),
            gate: 16.2,
            publish_existence: 0.5,
            sensing: SensingDefaults::default(),
        }
    }
}
