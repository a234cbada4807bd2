//! The wire codec: time per detection and per fused object.
//!
//! `cargo bench -p v2x-common --no-default-features --bench codec`

use criterion::{Criterion, Throughput};
use std::hint::black_box;
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2, Velocity};
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::fused::{AgentHealth, FusedFrame, FusedObject, KINEMATIC_INDEX};
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::id::{AgentId, FrameId, HubId, MeasurementId, TrackId};
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::{detections, fused};

/// Different frames, taken in turn: of one alone a processor learns every branch by heart, and more than
/// these do not stay in its caches.
const N_FRAMES: usize = 8;
const N_PER_FRAME: usize = 100;
const N_AGENTS: usize = 10;
const NOW: Timestamp = Timestamp::from_nanos(1_789_998_400_123_456_789);

/// Numbers that look random: a linear congruential generator (Knuth's MMIX constants).
struct Numbers(u64);

impl Numbers {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        f64::from(u32::try_from(self.0 >> 32).expect("32 bits are left")) / f64::from(u32::MAX)
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    fn bev(&mut self, around: Pose) -> BevBox {
        BevBox {
            x: around.x + self.between(-60.0, 60.0),
            y: around.y + self.between(-60.0, 60.0),
            w: self.between(1.6, 2.5),
            d: self.between(3.8, 12.0),
            yaw: self.between(-3.1, 3.1),
        }
    }

    fn covariance(&mut self) -> Covariance2 {
        let (x, y, rho) = (self.between(0.05, 1.0), self.between(0.05, 1.0), self.between(-0.9, 0.9));
        Covariance2 { xx: x * x, xy: rho * x * y, yy: y * y }
    }

    /// Position and velocity depend on each other as after some updates of a filter.
    fn kinematic_covariance(&mut self) -> [f64; 10] {
        let sigma = [(); 4].map(|()| self.between(0.05, 1.0));
        KINEMATIC_INDEX.map(|(row, column)| {
            let rho = match column - row {
                0 => 1.0,
                2 => self.between(0.3, 0.7),
                _ => self.between(-0.1, 0.1),
            };
            rho * sigma[row] * sigma[column]
        })
    }
}

fn agent(i: usize) -> AgentId {
    AgentId::new(&format!("vehicle-{i:02}")).expect("a legal name")
}

fn detection(numbers: &mut Numbers, around: Pose, has_velocity: bool) -> Detection {
    let position = numbers.covariance();
    let BevBox { x, y, .. } = numbers.bev(Pose::default());
    Detection {
        class: Class::Car,
        score: numbers.unit(),
        bev: numbers.bev(around),
        covariance: BoxCovariance { position, ww: 0.03 + 0.1 * numbers.unit(), dd: 0.2, yaw: 0.01 },
        velocity: has_velocity.then(|| Velocity { x: x / 3.0, y: y / 3.0, covariance: numbers.covariance() }),
        heading: v2x_common::detection::HeadingKind::Known,
        source_track: None,
    }
}

fn detection_frame(seed: usize, has_velocity: bool) -> DetectionFrame {
    let pose = Pose { x: 500_000.123, y: 5_400_000.456, yaw: 1.2 };
    let numbers = &mut Numbers(seed as u64);
    DetectionFrame {
        id: FrameId { agent: agent(1), epoch: 1_789_998_400_123_456, sequence: 360_000 },
        captured_at: NOW,
        sensor_pose: Some(pose),
        sensor_revision: 1,
        map_frame: None,
        detections: (0..N_PER_FRAME).map(|_| detection(numbers, pose, has_velocity)).collect(),
    }
}

fn fused_object(numbers: &mut Numbers, i: usize, agents: &[AgentHealth]) -> FusedObject {
    let car = |probability| (Class::Car, probability);
    let classes = if i.is_multiple_of(10) { vec![car(0.8), (Class::Truck, 0.2)] } else { vec![car(1.0)] };
    let contributor = |(index, health): (usize, &AgentHealth)| MeasurementId {
        frame: FrameId { agent: health.agent, epoch: health.epoch, sequence: 360_000 + index as u64 },
        index: u16::try_from((i + 7 * index) % 200).expect("below 200"),
    };
    FusedObject {
        track: TrackId::new(0xdead_beef, u32::try_from(i).expect("few objects")),
        class: Class::Car,
        class_probabilities: classes,
        class_conflict: 0.0,
        bev: numbers.bev(Pose { x: 500_000.0, y: 5_400_000.0, yaw: 0.0 }),
        velocity: (numbers.between(-20.0, 20.0), numbers.between(-20.0, 20.0)),
        kinematic_covariance: numbers.kinematic_covariance(),
        ww: 0.01 + 0.1 * numbers.unit(),
        dd: 0.02 + 0.1 * numbers.unit(),
        yaw_variance: 0.001 + 0.01 * numbers.unit(),
        heading: v2x_common::detection::HeadingKind::Known,
        existence: numbers.between(0.5, 1.0),
        age: Span::from_secs_f64(numbers.between(0.0, 100.0)),
        last_measured_at: NOW - Span::from_secs_f64(numbers.between(0.01, 0.2)),
        contributors: agents.iter().enumerate().map(contributor).collect(),
    }
}

fn fused_frame(seed: usize) -> FusedFrame {
    let numbers = &mut Numbers(seed as u64);
    let health = |i| AgentHealth {
        agent: agent(i),
        epoch: 1_789_998_400_123_456 + i as u64,
        newest_captured_at: NOW - Span::from_millis(50),
        accepted: 360_000,
        refused: 3,
        out_of_sequence: 1000,
    };
    let agents: Vec<_> = (0..N_AGENTS).map(health).collect();
    FusedFrame {
        hub: HubId::new("hub-1").expect("a legal name"),
        lineage: 0xdead_beef,
        sequence: 1_234_567,
        fused_at: NOW,
        map_frame: None,
        objects: (0..N_PER_FRAME).map(|i| fused_object(numbers, i, &agents)).collect(),
        agents,
        includes: Vec::new(),
    }
}

fn bytes_of<T>(encode: impl Fn(&T, &mut Vec<u8>), frames: &[T]) -> Vec<Vec<u8>> {
    let encoded = |frame| {
        let mut bytes = Vec::new();
        encode(frame, &mut bytes);
        bytes
    };
    frames.iter().map(encoded).collect()
}

/// Encodes or decodes the inputs in turn.
fn measure<T>(
    criterion: &mut Criterion,
    (group, name): (&str, &str),
    inputs: &[T],
    mut code: impl FnMut(&T),
) {
    let mut group = criterion.benchmark_group(group);
    group.throughput(Throughput::Elements(N_PER_FRAME as u64));
    let mut turns = inputs.iter().cycle();
    group.bench_function(name, |bencher| {
        bencher.iter(|| code(turns.next().expect("an endless iterator")));
    });
    group.finish();
}

fn detections(criterion: &mut Criterion) {
    let encode = |frame: &DetectionFrame, bytes: &mut Vec<u8>| {
        detections::encode(black_box(frame), bytes).expect("a valid frame");
    };
    for (group, has_velocity) in [("detections", false), ("detections with velocity", true)] {
        let frames: Vec<_> = (0..N_FRAMES).map(|seed| detection_frame(seed, has_velocity)).collect();
        let payloads = bytes_of(encode, &frames);
        let mut buffer = Vec::new();
        measure(criterion, (group, "encode"), &frames, |frame| {
            buffer.clear();
            encode(frame, black_box(&mut buffer));
        });
        measure(criterion, (group, "decode"), &payloads, |bytes| {
            black_box(detections::decode(black_box(bytes)).expect("a valid payload"));
        });
        let mut frame = DetectionFrame::empty(frames[0].id, NOW);
        measure(criterion, (group, "decode_into"), &payloads, |bytes| {
            detections::decode_into(black_box(bytes), black_box(&mut frame)).expect("a valid payload");
        });
    }
}

fn fused(criterion: &mut Criterion) {
    let encode = |frame: &FusedFrame, bytes: &mut Vec<u8>| {
        fused::encode(black_box(frame), bytes).expect("a valid frame");
    };
    let frames: Vec<_> = (0..N_FRAMES).map(fused_frame).collect();
    let payloads = bytes_of(encode, &frames);
    let mut buffer = Vec::new();
    measure(criterion, ("fused", "encode"), &frames, |frame| {
        buffer.clear();
        encode(frame, black_box(&mut buffer));
    });
    measure(criterion, ("fused", "decode"), &payloads, |bytes| {
        black_box(fused::decode(black_box(bytes)).expect("a valid payload"));
    });
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    detections(&mut criterion);
    fused(&mut criterion);
    criterion.final_summary();
}
