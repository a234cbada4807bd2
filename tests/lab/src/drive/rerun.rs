//! Gives a hub with other settings what a recorded one was given.

use crate::data::hub_inputs::{HubInput, HubInputs};
use crate::data::run_log::ReceivedFused;
use crate::drive::found::{Found, FoundOverTime};
use std::collections::BTreeMap;
use v2x_common::detection::DetectionFrame;
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::{self, WireError};
use v2x_fusion_hub::engine::{AgentStatistics, Engine, Schedule};
use v2x_fusion_hub::fusion::Innovations;
use v2x_fusion_hub::hub::{Core, Handled, HubSettings, encode_list};

/// What a hub made of what a recorded one was given.
#[derive(Debug, Default)]
pub(crate) struct Rerun {
    /// Its lists, as a consumer beside it would have received them.
    pub lists: Vec<ReceivedFused>,
    /// The innovations of each accepted frame that had some, in the order of arrival.
    pub innovations: Vec<FrameInnovations>,
    /// What it counted of each agent, by name.
    pub agents: Vec<(AgentId, AgentStatistics)>,
    /// What it found wrong with them.
    pub found: Vec<Found>,
}

/// The innovations of one frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FrameInnovations {
    /// Whose frame.
    pub agent: AgentId,
    /// When it arrived.
    pub at: Timestamp,
    /// Their sum and number.
    pub innovations: Innovations,
}

/// For longer no empty lists are made one after the other.
const LONGEST_SILENCE: Span = Span::from_millis(60_000);

/// Runs a hub with these settings on what a recorded one was given.
pub(crate) fn rerun(given: &HubInputs, settings: HubSettings) -> Result<Rerun, WireError> {
    let Some(first) = given.inputs.first() else { return Ok(Rerun::default()) };
    let publish = settings.publish;
    let schedule = Schedule::new(publish, first.at);
    let core = Core::new(settings, Engine::new);
    let mut hub = Hub { core, schedule, lists: Vec::new(), innovations: Vec::new(), buffer: Vec::new() };
    let mut found = FoundOverTime::new(first.at);
    for input in &given.inputs {
        while hub.schedule.is_due(input.at) {
            let at = hub.schedule.next_deadline().min(input.at);
            hub.publish(at)?;
            // A log may have gaps of years, in which nothing is there.
            let is_empty = hub.lists.last().is_some_and(|list| list.frame.objects.is_empty());
            if is_empty && input.at - at > LONGEST_SILENCE {
                hub.schedule = Schedule::new(publish, input.at);
            }
        }
        if input.is_description {
            // A refused one was refused then, too.
            let _ = hub.core.handle_description(input.agent, &input.body());
        } else {
            hub.take(input);
        }
        if hub.schedule.is_due(input.at) {
            hub.publish(input.at)?;
        }
        found.diagnose_until(&mut hub.core, input.at);
    }
    let end = given.inputs.last().map_or(first.at, |last| last.at);
    let found = found.end(&mut hub.core, end);
    let agents = hub.core.engine().agents().iter();
    let mut agents: Vec<_> = agents.map(|(agent, record)| (*agent, record.statistics.clone())).collect();
    agents.sort_by_key(|(agent, _)| *agent);
    Ok(Rerun { lists: hub.lists, innovations: hub.innovations, agents, found })
}

/// A frame that arrived longer before or after a time shows nothing of it.
const NEAR: Span = Span::from_millis(1000);

/// The frame of each agent that was captured nearest to a time, as a hub with these settings understands it.
pub(crate) fn frames_near(
    given: &HubInputs,
    settings: HubSettings,
    at: Timestamp,
) -> BTreeMap<AgentId, DetectionFrame> {
    let core = Core::new(settings, Engine::new);
    let mut nearest: BTreeMap<AgentId, DetectionFrame> = BTreeMap::new();
    let near = given.inputs.iter().filter(|input| !input.is_description && (input.at - at).abs() <= NEAR);
    for input in near {
        let Ok(frame) = core.understood(input.agent, &input.body()) else { continue };
        let distance = |frame: &DetectionFrame| (frame.captured_at - at).abs();
        if nearest.get(&input.agent).is_none_or(|before| distance(&frame) < distance(before)) {
            nearest.insert(input.agent, frame);
        }
    }
    nearest
}

struct Hub {
    core: Core,
    schedule: Schedule,
    lists: Vec<ReceivedFused>,
    innovations: Vec<FrameInnovations>,
    buffer: Vec<u8>,
}

impl Hub {
    fn take(&mut self, input: &HubInput) {
        let before = self.innovations_of(&input.agent);
        if let Handled::Accepted { .. } = self.core.handle_frame(input.agent, input.at, &input.body()) {
            self.schedule.note_update();
        }
        let after = self.innovations_of(&input.agent);
        let innovations =
            Innovations { nis_sum: after.nis_sum - before.nis_sum, count: after.count - before.count };
        if innovations.count > 0 {
            self.innovations.push(FrameInnovations { agent: input.agent, at: input.at, innovations });
        }
    }

    /// All that an agent had until now.
    fn innovations_of(&self, agent: &AgentId) -> Innovations {
        let record = self.core.engine().agents().record(agent);
        record.map_or_else(Innovations::default, |record| record.statistics.innovations)
    }

    fn publish(&mut self, now: Timestamp) -> Result<(), WireError> {
        self.schedule.take_due(now);
        encode_list(self.core.fused(now), &mut self.buffer)?;
        self.lists.push(ReceivedFused { received_at: now, frame: wire::fused::decode(&self.buffer)? });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::hub_inputs::hub_inputs;
    use v2x_common::id::NetworkId;
    use v2x_common::keys::Keys;
    use v2x_common::recording::Entry;
    use v2x_common::wire::ENCODING_JSON;
    use v2x_fusion_hub::diagnosis::Code;
    use v2x_fusion_hub::fusion::preset;

    fn at(ms: i64) -> Timestamp {
        Timestamp::EPOCH + Span::from_millis(1_000_000 + ms)
    }

    /// A car at 10 m/s, every 100 ms, 50 ms on its way.
    fn entries() -> Vec<Entry> {
        let agent = AgentId::new("ego").unwrap();
        let key = Keys::new(NetworkId::new("demo").unwrap()).detections(&agent);
        let frame = |k: i64| Entry {
            received_at: at(100 * k + 50),
            key: key.clone(),
            encoding: ENCODING_JSON.into(),
            payload: format!(
                r#"{{"captured_at":{},"detections":[{{"class":"car","x":{k},"y":2}}]}}"#,
                at(100 * k).as_micros()
            )
            .into_bytes(),
        };
        (0..50).map(frame).collect()
    }

    fn rerun_with(method: &str) -> Vec<ReceivedFused> {
        let given = hub_inputs(entries().into_iter().map(Ok)).unwrap();
        let mut settings = HubSettings::default();
        settings.engine = settings.engine.with_preset(preset(method).unwrap());
        rerun(&given, settings).unwrap().lists
    }

    #[test]
    fn another_method_gets_what_the_recorded_hub_got() {
        let (ours, window) = (rerun_with("ours"), rerun_with("nms"));
        let last = |lists: &[ReceivedFused]| {
            let frame = &lists.last().unwrap().frame;
            assert_eq!((frame.objects.len(), frame.agents[0].accepted), (1, 50));
            frame.objects[0].bev.x
        };
        // Ours predicts to the time of the list, 50 ms after the capture at 49 m; a single-frame rule does not.
        assert!((last(&ours) - 49.5).abs() < 0.2, "{}", last(&ours));
        assert!((last(&window) - 49.0).abs() < 1e-3, "{}", last(&window));
    }

    #[test]
    fn every_frame_after_the_first_of_an_object_has_its_innovation() {
        let given = hub_inputs(entries().into_iter().map(Ok)).unwrap();
        let Rerun { innovations, agents, .. } = rerun(&given, HubSettings::default()).unwrap();
        assert!(innovations.iter().all(|frame| frame.innovations.count == 1) && innovations.len() >= 45);
        assert!(innovations.is_sorted_by(|a, b| a.at < b.at));
        let sum: f64 = innovations.iter().map(|frame| frame.innovations.nis_sum).sum();
        let [(_, statistics)] = &agents[..] else { panic!("{agents:?}") };
        assert!((statistics.innovations.nis_sum - sum).abs() < 1e-9 && statistics.accepted == 50);
    }

    #[test]
    fn what_is_wrong_with_an_agent_is_found_in_its_recording() {
        let given = hub_inputs(entries().into_iter().map(Ok)).unwrap();
        let Rerun { found, .. } = rerun(&given, HubSettings::default()).unwrap();
        let missing = found.iter().find(|found| found.finding.code == Code::SigmaMissing).unwrap();
        assert!(missing.first >= at(1000) && missing.last <= at(5000) && missing.first < missing.last);
    }

    #[test]
    fn the_nearest_frame_is_shown_as_the_hub_understands_it() {
        let given = hub_inputs(entries().into_iter().map(Ok)).unwrap();
        let offset = "[agents.ego]\ntime_offset_ms = 20".parse().unwrap();
        let frames = frames_near(&given, HubSettings::from_table(offset).unwrap(), at(2050));
        let frame = &frames[&AgentId::new("ego").unwrap()];
        assert_eq!((frame.captured_at, frame.detections[0].bev.x), (at(2020), 20.0));
        assert!(frames_near(&given, HubSettings::default(), at(9000)).is_empty());
    }

    #[test]
    fn years_without_frames_cost_no_lists() {
        let mut given = hub_inputs(entries().into_iter().map(Ok)).unwrap();
        let mut last = given.inputs.last().unwrap().clone();
        last.at += Span::from_millis(1_000_000_000_000);
        given.inputs.push(last);
        let lists = rerun(&given, HubSettings::default()).unwrap().lists;
        assert!(lists.len() < 1000, "{}", lists.len());
    }

    #[test]
    fn lists_come_by_the_settings_own_schedule() {
        let lists = rerun_with("ours");
        assert!(lists.len() >= 50 && lists.is_sorted_by(|a, b| a.received_at < b.received_at));
        assert!(lists.iter().all(|list| list.received_at == list.frame.fused_at));
    }
}
