//! A [`FusionMethod`] in the place of the engine's own tracks.

use super::FusionMethod;
use crate::agents::{AgentSlot, Agents};
use crate::inbox::AgentRecord;
use crate::registration::{Shared, Source};
use crate::sensing::{Sensing, SensingDefaults};
use crate::tracker::{Counts, Innovations};
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::FusedObject;
use v2x_common::time::{Span, Timestamp};

/// What the engine asks of tracks, answered by somebody else's method.
#[derive(Debug)]
pub(crate) struct Plugged {
    method: Box<dyn FusionMethod>,
    undescribed: Sensing,
    n_told: usize,
}

impl Plugged {
    pub(crate) fn new(method: Box<dyn FusionMethod>, defaults: &SensingDefaults) -> Self {
        Self { method, undescribed: Sensing::undescribed(defaults), n_told: 0 }
    }

    pub(crate) fn handle(
        &mut self,
        frame: &DetectionFrame,
        (_, record, _): (AgentSlot, &AgentRecord, Option<Source>),
        _: &Agents,
    ) -> Innovations {
        let sensing = if record.description.is_some() { &record.sensing } else { &self.undescribed };
        self.method.handle_frame(frame, sensing);
        Innovations::default()
    }

    pub(crate) fn tell(&mut self, objects: &mut Vec<FusedObject>, now: Timestamp, _: &Agents) {
        objects.clear();
        self.method.tell(now, objects);
        self.n_told = objects.len();
    }

    /// It has no lag of the engine's making: whoever wants one looks back itself.
    pub(crate) fn tell_as_of(&mut self, objects: &mut Vec<FusedObject>, at: Timestamp, agents: &Agents) {
        self.tell(objects, at, agents);
    }

    // Its memory is its own business.
    #[expect(clippy::unused_self, reason = "as the tracker has it")]
    pub(crate) fn settle(&mut self, _: Timestamp, _: (Timestamp, Span), _: &Agents) {}

    #[expect(clippy::unused_self, reason = "as the tracker has it")]
    pub(crate) fn is_full_for(&self, _: usize) -> bool {
        false
    }

    #[expect(clippy::unused_self, reason = "as the tracker has it")]
    pub(crate) fn first_quarter(&self) -> Option<Timestamp> {
        None
    }

    #[expect(clippy::unused_self, reason = "as the tracker has it")]
    pub(crate) fn n_measurements_of(&self, _: AgentSlot) -> usize {
        0
    }

    #[expect(clippy::unused_self, reason = "as the tracker has it")]
    pub(crate) fn shared(&self) -> &[Shared] {
        &[]
    }

    pub(crate) fn n_tracks(&self) -> usize {
        self.n_told
    }

    #[expect(clippy::unused_self, reason = "as the tracker has it")]
    pub(crate) fn counts(&self) -> Counts {
        Counts::default()
    }
}
