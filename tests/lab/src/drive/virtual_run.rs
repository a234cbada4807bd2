//! A run in virtual time: the same agents, wire bytes and engine as live, without processes and without waiting. The
//! network is a queue ordered by arrival. The same scenario and seed give the same bits.

use crate::data::run_log::{ReceivedDetections, RunLog};
use crate::drive::traffic::{Arrival, Listening, Traffic};
use v2x_agent::scenario::Scenario;
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::WireError;
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::hub::HubSettings;

/// The settings of a virtual run.
#[derive(Clone, Copy, Debug)]
pub struct VirtualRun<'a> {
    /// The scenario.
    pub scenario: &'a Scenario,
    /// Seed of the world and of all noise.
    pub seed: u64,
    /// When scenario time is 0.
    pub start: Timestamp,
    /// How long the agents capture.
    pub duration: Span,
    /// The hub's: whom it listens to, how it reads frames, and when it publishes.
    pub settings: &'a HubSettings,
}

impl VirtualRun<'_> {
    /// Runs the scenario through an engine. The log is what a consumer next to the hub would have received.
    pub fn run(&self, engine: Engine) -> Result<RunLog, WireError> {
        let Self { scenario, seed, start, duration, settings } = *self;
        let traffic = Traffic::new(scenario, seed, (start, duration), scenario.agents.len())?;
        let mut log = RunLog { descriptions: traffic.descriptions.clone(), ..RunLog::default() };
        let listening = Listening { settings, start, until: None };
        traffic.feed(engine, listening, |received| log.fused.push(received))?;
        let received = |Arrival { received_at, frame, identities, .. }| ReceivedDetections {
            received_at,
            frame,
            identities,
        };
        log.detections = traffic.arrivals.into_iter().map(received).collect();
        Ok(log)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::id::HubId;
    use v2x_common::wire;
    use v2x_fusion_hub::engine::{EngineConfig, PublishMode};

    const GOLDEN_FINGERPRINT: u64 = 13_130_132_253_042_421_595;

    const ON_UPDATE: PublishMode =
        PublishMode::OnUpdate { tick: Span::from_millis(100), min_interval: Span::from_millis(2) };

    fn run(seed: u64) -> RunLog {
        run_publishing(seed, ON_UPDATE)
    }

    const CROSSING: &str = include_str!("../../../../deploy/scenarios/crossing.toml");

    fn run_publishing(seed: u64, publish: PublishMode) -> RunLog {
        run_of(CROSSING, (seed, publish), Span::from_millis(2000))
    }

    /// The crossing with these lines in the roadside unit's table.
    fn run_with_unit(lines: &str, duration: Span) -> RunLog {
        let unit = "kind = \"roadside-unit\"\n";
        run_of(&CROSSING.replace(unit, &format!("{unit}{lines}\n")), (1, ON_UPDATE), duration)
    }

    fn run_of(text: &str, (seed, publish): (u64, PublishMode), duration: Span) -> RunLog {
        let settings = HubSettings { publish, ..HubSettings::default() };
        run_with(text, (seed, &settings), duration)
    }

    fn run_with(text: &str, (seed, settings): (u64, &HubSettings), duration: Span) -> RunLog {
        let scenario = Scenario::from_toml(text).unwrap();
        let start = Timestamp::EPOCH + Span::from_millis(1_000_000_000);
        let engine = Engine::new(EngineConfig::new(HubId::new("hub").unwrap(), 1));
        let run = VirtualRun { scenario: &scenario, seed, start, duration, settings };
        run.run(engine).unwrap()
    }

    #[test]
    fn the_same_seed_gives_the_same_bits_and_another_seed_does_not() {
        assert_eq!(run(1), run(1));
        assert_ne!(run(1), run(2));
    }

    /// FNV-1a over every fused frame as it goes over the wire.
    fn fingerprint(log: &RunLog) -> u64 {
        let mut bytes = Vec::new();
        for received in &log.fused {
            wire::fused::encode(&received.frame, &mut bytes).unwrap();
        }
        bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
            (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
        })
    }

    #[test]
    fn the_same_run_has_the_same_bits_on_every_machine() {
        // As the failure of this test prints it. It changes only with world, noise, link, wire and engine, not with the
        // machine, its C library, the compiler's options or the number of cores.
        assert_eq!(fingerprint(&run(1)), GOLDEN_FINGERPRINT);
    }

    #[test]
    fn a_wrong_clock_shifts_the_stamps_of_its_agent_and_no_arrival() {
        let duration = Span::from_millis(2000);
        let right = run_with_unit("", duration);
        let mut wrong = run_with_unit("clock = { offset_ms = 50 }", duration);
        let unit = |received: &ReceivedDetections| received.frame.id.agent.as_str() == "rsu";
        assert!(wrong.detections.iter().any(unit));
        for received in wrong.detections.iter_mut().filter(|received| unit(received)) {
            received.frame.captured_at = received.frame.captured_at - Span::from_millis(50);
        }
        assert_eq!(right.detections, wrong.detections);
        assert_ne!(right.fused, wrong.fused);
    }

    #[test]
    fn a_hub_keeps_its_objects_where_agents_send_a_fraction_by_etsis_rules() {
        let link = "link = { delay_ms = 80, jitter_ms = 30, loss = 0.01 }\n";
        let by_rule = CROSSING.replace(link, &format!("{link}send = \"etsi\"\n"));
        let sent_and_published = |text| {
            let log = run_of(text, (1, ON_UPDATE), Span::from_millis(10_000));
            let sent: usize = log.detections.iter().map(|received| received.frame.detections.len()).sum();
            // Mean over the second half, when objects have been found.
            let half = log.fused.len() / 2;
            let published: usize =
                log.fused[half..].iter().map(|received| received.frame.objects.len()).sum();
            (sent as f64, published as f64 / (log.fused.len() - half) as f64)
        };
        let (all, by_rule) = (sent_and_published(CROSSING), sent_and_published(&by_rule));
        assert!(by_rule.0 < 0.3 * all.0, "{} of {} detections", by_rule.0, all.0);
        // About thirty objects. A new one is published later where its second detection is sent a second later.
        assert!((by_rule.1 - all.1).abs() < 3.0, "{} objects instead of {}", by_rule.1, all.1);
    }

    #[test]
    fn a_fixed_publishing_rate_does_not_depend_on_arrivals() {
        let interval = Span::from_millis(50);
        let log = run_publishing(1, PublishMode::Fixed { interval });
        let stamps: Vec<_> = log.fused.iter().map(|received| received.frame.fused_at).collect();
        assert!(stamps.len() > 30);
        assert!(stamps.windows(2).all(|pair| pair[1] - pair[0] == interval));
    }

    #[test]
    fn the_hubs_settings_of_agents_hold_as_live() {
        let settings = |text: &str| HubSettings::from_table(text.parse().unwrap()).unwrap();
        let objects_and_agents = |text: &str| {
            let log = run_with(CROSSING, (1, &settings(text)), Span::from_millis(2000));
            let last = log.fused.last().unwrap().frame.clone();
            let objects: Vec<_> = log.fused.iter().map(|list| list.frame.objects.clone()).collect();
            (objects, last.agents.iter().map(|one| (one.accepted, one.refused)).collect::<Vec<_>>())
        };
        let all = objects_and_agents("");
        let alone = objects_and_agents("only_agents = [\"rsu\"]");
        assert!(all.1.iter().all(|(accepted, refused)| *accepted > 0 && *refused == 0), "{:?}", all.1);
        // Frames of who is left out are counted as a hub counts them.
        let left_out = alone.1.iter().filter(|(accepted, refused)| *accepted == 0 && *refused > 0).count();
        assert!(left_out == 1 && alone.1.len() == 2, "{:?}", alone.1);
        let shifted = objects_and_agents("[agents.rsu]\ntime_offset_ms = 40");
        assert!(shifted.0 != all.0, "a time offset changes nothing");
    }

    #[test]
    fn a_late_link_brings_frames_out_of_sequence() {
        let log = run(1);
        let health = &log.fused.last().unwrap().frame.agents;
        assert!(health.iter().any(|agent| agent.out_of_sequence > 0), "{health:?}");
    }
}
