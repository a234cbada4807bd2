//! A late report before 25 newer ones of its track: inserted in its place, with a replay of all later ones.

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::geometry::BevBox;
use v2x_common::id::{AgentId, FrameId, TrackId};
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::filter::{Filter, ImmState, State};
use v2x_fusion_hub::track::{Evidence, FrameStore};
use v2x_fusion_hub::track::{Rollback, SensedFrame, Track, TrackContext};
use v2x_fusion_hub::values::AgentNames;
use v2x_fusion_hub::values::{SensingDefaults, SensorModel};

/// Time between two reports, as ten agents at 10 Hz give them.
const STEP: Span = Span::from_millis(10);
const IN_TIME: u32 = 50;
const NEWER: u32 = 25;

fn frame(agent: AgentId, step: u32, sequence: u64) -> DetectionFrame {
    let bev = BevBox { x: 0.1 * f64::from(step), y: 0.0, w: 1.8, d: 4.5, yaw: 0.0 };
    let covariance = BoxCovariance { position: Covariance2::isotropic(0.3), ww: 0.1, dd: 0.6, yaw: 0.01 };
    DetectionFrame {
        id: FrameId { agent, epoch: 1, sequence },
        captured_at: Timestamp::EPOCH + Span::from_nanos(i64::from(step) * STEP.as_nanos()),
        sensor_pose: None,
        sensor_revision: 0,
        map_frame: None,
        detections: vec![Detection {
            class: Class::Car,
            score: 0.9,
            bev,
            covariance,
            velocity: None,
            heading: v2x_common::detection::HeadingKind::Known,
            source_track: None,
        }],
    }
}

fn late_report<F: Filter>(criterion: &mut Criterion, filter: &str) {
    let mut agents = AgentNames::default();
    let name = AgentId::new("agent").expect("a legal name");
    let slot = agents.slot_for(name);
    let sensing = SensorModel::undescribed(&SensingDefaults::default());
    let mut frames = FrameStore::default();
    let mut evidence = |step: u32, sequence: u64| {
        let frame = frame(name, step, sequence);
        let model = sensing.model();
        let sensed =
            SensedFrame { frame: &frame, agent: slot, sensor: &sensing, model: &model, coverage: None };
        Evidence::detection(frame.captured_at, frames.insert(&sensed), 0)
    };
    let in_time: Vec<_> = (0..IN_TIME).map(|step| evidence(step, u64::from(step))).collect();
    // At the very time of the one before it, but later in order: exactly so many are newer.
    let late = evidence(IN_TIME - NEWER - 1, 1 << 40);
    let records = TrackContext {
        frames: &frames,
        agents: &agents,
        synchronous: Span::ZERO,
        rollback: Rollback::Replay,
        keeps_folded: false,
        class_motion: true,
        exclusion: true,
    };
    let mut track: Track<F> = Track::new(TrackId(1), in_time[0], None, &records);
    in_time[1..].iter().for_each(|evidence| track.insert(*evidence, None, &records));
    criterion.bench_function(&format!("replay/{filter}, 25 newer"), |bencher| {
        bencher.iter_batched_ref(
            || track.clone(),
            |track| {
                track.insert(late, None, &records);
                track.replay(&records);
            },
            // As many tracks as stay in the caches, where a hub's are.
            BatchSize::NumIterations(64),
        );
    });
}

fn replay(criterion: &mut Criterion) {
    late_report::<State>(criterion, "cv");
    late_report::<ImmState>(criterion, "imm");
}

criterion_group!(benches, replay);
criterion_main!(benches);
