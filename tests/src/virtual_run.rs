//! A run in virtual time: the same agents, wire bytes and engine as live, without processes and without
//! waiting. The network is a queue ordered by arrival; the same scenario and seed give the same bits.

use crate::run_log::{ReceivedDetections, RunLog};
use crate::traffic::{Arrival, Listening, Traffic};
use v2x_agent::scenario::Scenario;
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::WireError;
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::schedule::PublishMode;

/// What a virtual run is told.
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
    /// When the hub publishes.
    pub publish: PublishMode,
}

impl VirtualRun<'_> {
    /// Runs the scenario through an engine. What a consumer next to the hub would have received is the log.
    pub fn run(&self, engine: &mut Engine) -> Result<RunLog, WireError> {
        let Self { scenario, seed, start, duration, publish } = *self;
        let traffic = Traffic::new(scenario, seed, (start, duration), scenario.agents.len())?;
        let mut log = RunLog { descriptions: traffic.descriptions.clone(), ..RunLog::default() };
        let listening = Listening { publish, start, until: None, listens_to: |_: &_| true };
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
    use v2x_fusion_hub::config::EngineConfig;

    const GOLDEN_FINGERPRINT: u64 = 12_563_783_394_357_586_774;

    const ON_UPDATE: PublishMode =
        PublishMode::OnUpdate { tick: Span::from_millis(100), min_interval: Span::from_millis(2) };

    fn run(seed: u64) -> RunLog {
        run_publishing(seed, ON_UPDATE)
    }

    fn run_publishing(seed: u64, publish: PublishMode) -> RunLog {
        let text = include_str!("../../deploy/scenarios/crossing.toml");
        let scenario = Scenario::from_toml(text).unwrap();
        let start = Timestamp::EPOCH + Span::from_millis(1_000_000_000);
        let mut engine = Engine::new(EngineConfig::new(HubId::new("hub").unwrap(), 1));
        let duration = Span::from_millis(2000);
        let run = VirtualRun { scenario: &scenario, seed, start, duration, publish };
        run.run(&mut engine).unwrap()
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
        // As this test's failure prints it. It changes with world, noise, link, wire and engine, and with nothing
        // else: not with the machine, its C library, the compiler's options or the number of cores.
        assert_eq!(fingerprint(&run(1)), GOLDEN_FINGERPRINT);
    }

    #[test]
    fn a_fixed_rate_is_kept_whatever_arrives() {
        let interval = Span::from_millis(50);
        let log = run_publishing(1, PublishMode::Fixed { interval });
        let stamps: Vec<_> = log.fused.iter().map(|received| received.frame.fused_at).collect();
        assert!(stamps.len() > 30);
        assert!(stamps.windows(2).all(|pair| pair[1] - pair[0] == interval));
    }

    #[test]
    fn a_late_link_brings_frames_out_of_sequence() {
        let log = run(1);
        let health = &log.fused.last().unwrap().frame.agents;
        assert!(health.iter().any(|agent| agent.out_of_sequence > 0), "{health:?}");
    }
}
