//! An engine that is saved and restored goes on with the same bits.

use crate::world::{agent, at, description, frame};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame, HeadingKind};
use v2x_common::fused::FusedFrame;
use v2x_common::geometry::BevBox;
use v2x_common::id::HubId;
use v2x_common::time::Span;
use v2x_fusion_hub::engine::{Engine, EngineConfig};
use v2x_fusion_hub::fusion::{Hypotheses, MotionModel, PRESETS, ParticleCount};
use v2x_fusion_hub::values::{Saved, StateError};

/// What the hub is given: a description or a frame, or it is asked for its lists.
enum Call {
    Describe(&'static str),
    Frame(DetectionFrame),
    Lists,
}

struct Traffic {
    rng: ChaCha8Rng,
}

impl Traffic {
    fn unit(&mut self) -> f64 {
        f64::from(self.rng.next_u32()) / f64::from(u32::MAX)
    }

    fn error(&mut self, scale: f64) -> f64 {
        (self.unit() + self.unit() + self.unit() - 1.5) * 2.0 * scale
    }

    /// Cars, cyclists and walkers close to each other; headings that turn round, classes that differ, misses.
    fn detections(&mut self, ms: i64, agent: usize) -> Vec<Detection> {
        let mut detections = Vec::new();
        #[expect(clippy::cast_precision_loss, reason = "a test's seconds")]
        let t = ms as f64 * 1e-3;
        for object in 0..12 {
            if self.unit() < 0.15 {
                continue;
            }
            let lane = f64::from(object % 6);
            let confused = self.unit() < 0.1;
            let class = [Class::Car, Class::Bicycle, Class::Adult][object as usize % 3];
            let class = if confused { Class::Truck } else { class };
            let speed = f64::from(object % 4) * 3.0;
            let turned = if self.unit() < 0.2 { std::f64::consts::PI } else { 0.0 };
            let offset = if agent == 2 { 1.0 } else { 0.0 };
            let (w, d) = class.typical_size();
            let bev = BevBox {
                x: speed * t + lane * 4.0 + offset + self.error(0.3),
                y: lane * 5.0 + self.error(0.3),
                w: w * (1.0 + self.error(0.05)),
                d: d * (1.0 + self.error(0.05)),
                yaw: v2x_common::geometry::wrap_angle(turned + self.error(0.05)),
            };
            detections.push(Detection {
                class,
                score: 0.3 + 0.7 * self.unit(),
                bev,
                covariance: BoxCovariance {
                    position: Covariance2::isotropic(0.3),
                    ww: 0.05,
                    dd: 0.2,
                    yaw: 0.01,
                },
                velocity: None,
                heading: if object == 5 { HeadingKind::Axis } else { HeadingKind::Known },
                source_track: None,
            });
        }
        if self.unit() < 0.3 {
            let mut broken = detections[0];
            broken.bev.w = -1.0;
            detections.insert(0, broken);
        }
        detections
    }
}

/// Six seconds of four agents at 10 Hz, each frame late by up to 0.4 s; and when each call comes, ms.
fn calls() -> Vec<(i64, Call)> {
    let mut traffic = Traffic { rng: ChaCha8Rng::seed_from_u64(3) };
    let mut calls =
        vec![(0, Call::Describe("ego")), (0, Call::Describe("rsu")), (500, Call::Describe("van"))];
    for sequence in 0..60_u32 {
        for (number, name) in ["ego", "rsu", "van", "bare"].into_iter().enumerate() {
            let captured = i64::from(sequence) * 100 + 7 * number as i64;
            #[expect(clippy::cast_possible_truncation, reason = "below 400")]
            let late = (traffic.unit() * 400.0) as i64;
            let detections = traffic.detections(captured, number);
            calls.push((
                captured + late,
                Call::Frame(frame(agent(name), sequence.into(), captured, detections)),
            ));
        }
    }
    calls.extend((0..65).map(|tick| (tick * 100 + 3, Call::Lists)));
    calls.sort_by_key(|(at, _)| *at);
    calls
}

fn run(engine: &mut Engine, calls: &[(i64, Call)]) -> Vec<FusedFrame> {
    let mut lists = Vec::new();
    for (ms, call) in calls {
        match call {
            Call::Describe(name) => {
                engine.handle_description(agent(name), description(1e-4)).expect("a valid description");
            }
            Call::Frame(frame) => drop(engine.handle_frame(frame, at(*ms))),
            Call::Lists => {
                lists.push(engine.fused(at(*ms)).clone());
                lists.extend(engine.lagged(at(*ms)).cloned());
            }
        }
    }
    lists
}

/// Every preset; constant velocity; particles; a lag, and a second list.
fn configs() -> Vec<EngineConfig> {
    let plain = EngineConfig::new(HubId::new("hub").expect("test input"), 7);
    let mut configs: Vec<_> = PRESETS.iter().map(|preset| plain.with_preset(preset)).collect();
    configs.push(plain.with_tracking(|tracking| tracking.motion = MotionModel::Cv));
    let particles = Hypotheses::Particles(ParticleCount::new(8).expect("a legal number"));
    configs.push(plain.with_tracking(|tracking| tracking.tracker.hypotheses = particles));
    let lagged = Hypotheses::Single { lag: Span::ZERO, second_lag: Some(Span::from_millis(500)) };
    configs.push(plain.with_tracking(|tracking| tracking.tracker.hypotheses = lagged));
    let lag = Hypotheses::with_lag(Span::from_millis(300));
    configs.push(plain.with_tracking(|tracking| tracking.tracker.hypotheses = lag));
    configs
}

fn saved(engine: &Engine) -> Vec<u8> {
    let mut bytes = Vec::new();
    engine.save(&mut bytes).expect("a method of ours");
    bytes
}

#[test]
fn an_engine_restored_at_any_moment_publishes_the_same_bits_as_the_one_that_was_saved() {
    let calls = calls();
    for (number, config) in configs().into_iter().enumerate() {
        for middle in if number == 0 { vec![0, calls.len() / 3] } else { vec![calls.len() / 2 + 1] } {
            let (before, after) = calls.split_at(middle);
            let mut engine = Engine::new(config);
            run(&mut engine, before);
            let mut restored = Engine::restored(config, &saved(&engine)).expect("saved by this build");
            let (went_on, again) = (run(&mut engine, after), run(&mut restored, after));
            assert!(!went_on.is_empty() && went_on.iter().any(|list| !list.objects.is_empty()));
            for (one, other) in went_on.iter().zip(&again) {
                assert_eq!(one, other, "{:?}, restored at call {middle}", config.fusion);
            }
            assert_eq!(went_on.len(), again.len());
        }
    }
}

#[test]
fn a_broken_state_is_an_error() {
    let mut engine = Engine::new(configs()[0]);
    run(&mut engine, &calls()[..200]);
    let bytes = saved(&engine);
    assert!(Engine::restored(configs()[0], &bytes).is_ok());
    for length in [0, 1, bytes.len() / 2, bytes.len() - 1] {
        assert!(Engine::restored(configs()[0], &bytes[..length]).is_err(), "cut at {length}");
    }
    let longer = [bytes.as_slice(), &[0]].concat();
    assert_eq!(Engine::restored(configs()[0], &longer).err(), Some(StateError::LeftOver(1)));
}
