//! The page of a log, as `lab report` writes one of a recording.

use crate::commands::report_of_recording::{Given, page};
use crate::data::detection_log::Arrival;
use crate::data::hub_inputs::{HubInput, HubInputs};
use crate::drive::found::Found;
use crate::drive::replay::Declared;
use crate::score::offline::TruthScore;
use anyhow::Context;
use std::collections::BTreeMap;
use std::path::Path;
use v2x_common::conventions::Conventions;
use v2x_common::id::AgentId;
use v2x_common::sensor::SensorDescription;
use v2x_common::time::Timestamp;
use v2x_common::wire;
use v2x_fusion_hub::diagnosis::Finding;
use v2x_fusion_hub::hub::HubSettings;

/// What is known of a log beside its frames.
pub(super) struct Seen<'a> {
    /// All that is printed.
    pub(super) findings: &'a [Finding],
    pub(super) truth: Option<&'a TruthScore>,
}

/// The frames of a log, in our own conventions, as a hub would be given them.
#[derive(Debug)]
pub(super) struct Collected {
    declared: Declared,
    inputs: Vec<HubInput>,
    descriptions: BTreeMap<AgentId, SensorDescription>,
    span: Option<(Timestamp, Timestamp)>,
}

impl Collected {
    /// Of sensors of which so much is declared.
    pub(super) const fn new(declared: Declared) -> Self {
        Self { declared, inputs: Vec::new(), descriptions: BTreeMap::new(), span: None }
    }

    /// Takes in a frame.
    pub(super) fn note(&mut self, Arrival { received_at: at, frame, .. }: &Arrival) {
        let sensor = frame.id.agent;
        let (first, _) = *self.span.get_or_insert((*at, *at));
        self.span = Some((first, *at));
        if !self.descriptions.contains_key(&sensor)
            && let Some(description) = self.declared.description_of(&sensor)
        {
            self.descriptions.insert(sensor, description);
            let json = wire::json::encode_sensor(&description).ok();
            self.inputs.extend(json.map(|json| HubInput::description(*at, sensor, json)));
        }
        // What is impossible was left out of the frame when it was read.
        let json = wire::json::encode_detections(frame).ok();
        self.inputs.extend(json.map(|json| HubInput::frame(*at, sensor, json)));
    }

    /// Writes the page.
    ///
    /// # Errors
    /// Where the log shows nothing, or the file cannot be written.
    pub(super) fn write(
        self,
        (out, name): (&Path, &str),
        mut settings: HubSettings,
        Seen { findings, truth }: &Seen<'_>,
    ) -> anyhow::Result<()> {
        // The frames have been converted.
        settings.agents.values_mut().for_each(|agent| agent.conventions = Conventions::default());
        let (first, last) = self.span.unwrap_or((Timestamp::EPOCH, Timestamp::EPOCH));
        let html = page(&Given {
            name,
            inputs: HubInputs { settings: None, inputs: self.inputs },
            settings,
            descriptions: self.descriptions,
            found: findings.iter().map(|one| Found { finding: one.clone(), first, last }).collect(),
            score: truth.map(TruthScore::lines).unwrap_or_default(),
        })?;
        std::fs::write(out, html).with_context(|| format!("writing {}", out.display()))
    }
}
