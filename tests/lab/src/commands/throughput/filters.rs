//! Processor time of one predict and update: our filter, a textbook filter, and the replay after a late measurement.

use crate::commands::cpu_time::thread_cpu_time;
use crate::commands::throughput::textbook::{Dense, Structured};
use std::hint::black_box;
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::geometry::BevBox;
use v2x_common::id::{AgentId, FrameId, TrackId};
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::filter::size_priors::SizePriors;
use v2x_fusion_hub::filter::{Filter, MotionParams};
use v2x_fusion_hub::track::{Evidence, FrameStore, Rollback, SensedFrame, Track, TrackContext};
use v2x_fusion_hub::values::{AgentNames, Measurement, SensingDefaults, SensorModel};

/// Time between two reports of one object by ten agents at 10 Hz.
const STEP: Span = Span::from_millis(10);
const ROUNDS: usize = 5;
const REPLAY_ROUNDS: usize = 100;
const STEPS: u32 = 400;
const TRACKS: usize = 100;
/// Number of measurements that are newer than the late one.
const NEWER: usize = 25;

/// CPU time of one predict and update, ns.
#[derive(Clone, Copy, Debug)]
pub(super) struct FilterCosts {
    pub(super) ours_ns: f64,
    pub(super) textbook_ns: f64,
    pub(super) structured_ns: f64,
}

/// CPU time per step, the least of several rounds, since disturbances only add time. Consecutive steps are of
/// different tracks, as in a frame.
fn least_ns_per_step<T: Clone>(start: &T, mut step_of: impl FnMut(&mut T, u32)) -> f64 {
    let mut least_ns = f64::INFINITY;
    for _ in 0..ROUNDS {
        let mut tracks = vec![start.clone(); TRACKS];
        let begun = thread_cpu_time();
        for step in 0..STEPS {
            tracks.iter_mut().for_each(|track| step_of(track, step));
        }
        let spent = (thread_cpu_time() - begun).as_secs_f64() * 1e9;
        black_box(&tracks);
        least_ns = least_ns.min(spent / (f64::from(STEPS) * TRACKS as f64));
    }
    least_ns
}

fn detection(step: u32) -> Detection {
    let wobble = f64::from(step % 17) / 17.0 - 0.5;
    let size = [1.8, 4.5];
    let sigma_size = [0.18 * size[0], 0.18 * size[1]];
    Detection {
        class: Class::Car,
        score: 0.9,
        bev: BevBox {
            x: 10.0 * f64::from(step) * STEP.as_secs_f64() + 0.3 * wobble,
            y: -0.4 * wobble,
            w: size[0] * (1.0 + 0.1 * wobble),
            d: size[1] * (1.0 - 0.1 * wobble),
            yaw: 0.05 * wobble,
        },
        covariance: BoxCovariance {
            position: Covariance2 { xx: 0.09, xy: 0.02, yy: 0.16 },
            ww: sigma_size[0] * sigma_size[0],
            dd: sigma_size[1] * sigma_size[1],
            yaw: 0.01,
        },
        velocity: None,
        heading: v2x_common::detection::HeadingKind::Known,
        source_track: None,
    }
}

fn measurement(step: u32) -> Measurement {
    SensorModel::undescribed(&SensingDefaults::default()).measurement(&detection(step))
}

/// Measures the three filters on the same reports.
pub(super) fn filter_costs<F: Filter>() -> FilterCosts {
    let reports: Vec<_> = (0..1000).map(measurement).collect();
    let motion = MotionParams::of(Class::Car);
    let initial = F::initial(Timestamp::EPOCH, &reports[0]);
    let belief = Dense::of(&initial.estimate(Class::Car, &SizePriors::default().of_track(None)));
    let of_step = |step: u32| black_box(&reports[step as usize % reports.len()]);
    let dt_s = STEP.as_secs_f64();
    let ours_ns = least_ns_per_step(&initial, |state, step| {
        state.predict(state.at() + STEP, Class::Car);
        state.update(of_step(step));
    });
    let textbook_ns = least_ns_per_step(&belief, |dense, step| {
        dense.predict(dt_s, &motion);
        black_box(dense.update(of_step(step)));
    });
    let structured_ns = least_ns_per_step(&Structured::of(&belief), |structured, step| {
        structured.predict(dt_s, &motion);
        black_box(structured.update(of_step(step)));
    });
    FilterCosts { ours_ns, textbook_ns, structured_ns }
}

/// CPU time to insert a late report before 25 newer ones of its track and to apply these again, ns.
pub(super) fn late_replay_ns<F: Filter>() -> anyhow::Result<f64> {
    let mut agents = AgentNames::default();
    let name = AgentId::new("agent")?;
    let slot = agents.slot_for(name);
    let sensing = SensorModel::undescribed(&SensingDefaults::default());
    let mut frames = FrameStore::default();
    let mut detection_of = |step: u32, sequence: u64| {
        let captured_at = Timestamp::EPOCH + Span::from_nanos(i64::from(step) * STEP.as_nanos());
        let frame = DetectionFrame {
            id: FrameId { agent: name, epoch: 1, sequence },
            captured_at,
            sensor_pose: None,
            sensor_revision: 0,
            map_frame: None,
            detections: vec![detection(step)],
        };
        let model = sensing.model();
        let sensed =
            SensedFrame { frame: &frame, agent: slot, sensor: &sensing, model: &model, coverage: None };
        Evidence::detection(captured_at, frames.insert(&sensed), 0)
    };
    let n_in_time = u32::try_from(2 * NEWER)?;
    let in_time: Vec<_> = (0..n_in_time).map(|step| detection_of(step, u64::from(step))).collect();
    // It has the time of the report before it but a higher order, so the number of newer reports is exact.
    let late = detection_of(n_in_time - u32::try_from(NEWER)? - 1, 1 << 40);
    let context = TrackContext {
        frames: &frames,
        agents: &agents,
        synchronous: Span::ZERO,
        rollback: Rollback::Replay,
        keeps_folded: false,
        class_motion: true,
        exclusion: true,
    };
    let mut track: Track<F> = Track::new(TrackId(1), in_time[0], None, &context);
    in_time[1..].iter().for_each(|item| track.insert(*item, None, &context));
    // So many tracks fit into the caches, as the tracks of a hub do.
    let n_copies = 64;
    let mut least_ns = f64::INFINITY;
    for _ in 0..REPLAY_ROUNDS {
        let mut tracks = vec![track.clone(); n_copies as usize];
        let begun = thread_cpu_time();
        for track in &mut tracks {
            track.insert(late, None, &context);
            track.replay(&context);
        }
        let spent = (thread_cpu_time() - begun).as_secs_f64() * 1e9 / f64::from(n_copies);
        black_box(&tracks);
        least_ns = least_ns.min(spent);
    }
    Ok(least_ns)
}
