//! A frame into the engine, with and without association particles: 50 walkers, 100 m² each, detected by ten agents
//! at 10 Hz with errors of 0.3 m and of 1 m. The last number of a name is how many particles there are.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::f64::consts::PI;
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::id::{AgentId, FrameId, HubId};
use v2x_common::sensor::{Accuracy, FieldOfView, SensorDescription, SensorKind};
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::engine::EngineConfig;
use v2x_fusion_hub::fusion::{Hypotheses, ParticleCount};

const N_OBJECTS: u32 = 50;
const N_AGENTS: u32 = 10;
const N_FRAMES: u32 = 500;
const INTERVAL_MS: u32 = 10;
const SIDE_M: f64 = 70.7;
const SIGMA_YAW_RAD: f64 = 0.2;

struct Chance(ChaCha8Rng);

impl Chance {
    fn uniform(&mut self) -> f64 {
        (f64::from(self.0.next_u32()) + 0.5) / 4_294_967_296.0
    }

    fn normal(&mut self) -> f64 {
        libm::sqrt(-2.0 * libm::log(self.uniform())) * libm::cos(2.0 * PI * self.uniform())
    }
}

fn agents() -> Vec<AgentId> {
    (0..N_AGENTS).map(|k| AgentId::new(&format!("agent-{k}")).expect("a legal name")).collect()
}

fn frames(sigma_m: f64) -> Vec<DetectionFrame> {
    let mut chance = Chance(ChaCha8Rng::seed_from_u64(1));
    let walkers: Vec<[f64; 3]> = (0..N_OBJECTS)
        .map(|_| [SIDE_M * chance.uniform(), SIDE_M * chance.uniform(), 2.0 * PI * (chance.uniform() - 0.5)])
        .collect();
    let agents = agents();
    let frame_at = |step: u32| {
        let walked = 1.4e-3 * f64::from(INTERVAL_MS * step);
        let detections = walkers.iter().map(|[x, y, yaw]| {
            let measured_yaw = v2x_common::geometry::wrap_angle(yaw + SIGMA_YAW_RAD * chance.normal());
            let [x, y] = [x + walked * libm::cos(*yaw), y + walked * libm::sin(*yaw)]
                .map(|at| at + sigma_m * chance.normal());
            Detection {
                class: Class::Adult,
                score: 1.0,
                bev: BevBox { x, y, w: 0.7, d: 0.7, yaw: measured_yaw },
                covariance: BoxCovariance {
                    position: Covariance2::isotropic(sigma_m),
                    ww: 0.05,
                    dd: 0.05,
                    yaw: SIGMA_YAW_RAD * SIGMA_YAW_RAD,
                },
                velocity: None,
                heading: v2x_common::detection::HeadingKind::Known,
                source_track: None,
            }
        });
        DetectionFrame {
            id: FrameId { agent: agents[(step % N_AGENTS) as usize], epoch: 1, sequence: u64::from(step) },
            captured_at: Timestamp::EPOCH + Span::from_millis(1_000_000 + i64::from(INTERVAL_MS * step)),
            sensor_pose: Some(Pose { x: SIDE_M / 2.0, y: SIDE_M / 2.0, yaw: 0.0 }),
            sensor_revision: 1,
            map_frame: None,
            detections: detections.collect(),
        }
    };
    (0..N_FRAMES).map(frame_at).collect()
}

fn engine(n_particles: u32) -> Engine {
    let hypotheses = ParticleCount::new(n_particles).map_or(Hypotheses::ONE, Hypotheses::Particles);
    let config = EngineConfig::new(HubId::new("hub").expect("a legal name"), 1)
        .with_tracking(|tracking| tracking.tracker.hypotheses = hypotheses);
    let mut engine = Engine::new(config);
    for agent in agents() {
        let description = SensorDescription {
            revision: 1,
            kind: SensorKind::RoadsideUnit,
            field_of_view: FieldOfView::omnidirectional(0.0, 200.0),
            detection_probability: 0.95,
            clutter_per_m2: 1e-6,
            size_noise: None,
            body: None,
            accuracy: Accuracy { position_m: 0.02, yaw_rad: 1e-3, clock_s: 1e-6 },
            rate_hz: 10.0,
        };
        engine.handle_description(agent, description).expect("a valid description");
    }
    engine
}

fn particles(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("frame of 50, 100 m² each");
    group.throughput(Throughput::Elements(u64::from(N_FRAMES))).sample_size(10);
    for sigma_m in [0.3, 1.0] {
        let frames = frames(sigma_m);
        for n_particles in [0, 8, 24] {
            let id = BenchmarkId::new(format!("error {sigma_m} m"), n_particles);
            group.bench_function(id, |bencher| {
                bencher.iter(|| {
                    let mut engine = engine(n_particles);
                    for frame in &frames {
                        engine.handle_frame(frame, frame.captured_at);
                    }
                    engine.counts().tracks
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, particles);
criterion_main!(benches);
