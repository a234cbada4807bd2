//! Gives a hub with other settings what a recorded one was given.

use crate::data::hub_inputs::HubInputs;
use crate::data::run_log::ReceivedFused;
use v2x_common::time::Timestamp;
use v2x_common::wire::{self, WireError};
use v2x_fusion_hub::engine::{Engine, Schedule};
use v2x_fusion_hub::hub::{Core, Handled, HubSettings, encode_list};

/// The lists of a hub with these settings, as a consumer beside it would have received them.
pub(crate) fn rerun(given: &HubInputs, settings: HubSettings) -> Result<Vec<ReceivedFused>, WireError> {
    let Some(first) = given.inputs.first() else { return Ok(Vec::new()) };
    let schedule = Schedule::new(settings.publish, first.at);
    let core = Core::new(settings, Engine::new);
    let mut hub = Hub { core, schedule, lists: Vec::new(), buffer: Vec::new() };
    for input in &given.inputs {
        while hub.schedule.is_due(input.at) {
            hub.publish(hub.schedule.next_deadline().min(input.at))?;
        }
        if input.is_description {
            // A refused one was refused then, too.
            let _ = hub.core.handle_description(input.agent, &input.body());
        } else if let Handled::Accepted { .. } = hub.core.handle_frame(input.agent, input.at, &input.body()) {
            hub.schedule.note_update();
        }
        if hub.schedule.is_due(input.at) {
            hub.publish(input.at)?;
        }
    }
    Ok(hub.lists)
}

struct Hub {
    core: Core,
    schedule: Schedule,
    lists: Vec<ReceivedFused>,
    buffer: Vec<u8>,
}

impl Hub {
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
    use v2x_common::id::{AgentId, NetworkId};
    use v2x_common::keys::Keys;
    use v2x_common::recording::Entry;
    use v2x_common::time::Span;
    use v2x_common::wire::ENCODING_JSON;
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
        rerun(&given, settings).unwrap()
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
    fn lists_come_by_the_settings_own_schedule() {
        let lists = rerun_with("ours");
        assert!(lists.len() >= 50 && lists.is_sorted_by(|a, b| a.received_at < b.received_at));
        assert!(lists.iter().all(|list| list.received_at == list.frame.fused_at));
    }
}
