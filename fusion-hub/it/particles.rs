//! Several hypotheses of which report is of which track: their benefit, and that they are repeatable.

use crate::world::{agent, at, description, engine_of_particles, frame};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::f64::consts::PI;
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::fused::FusedObject;
use v2x_common::geometry::BevBox;
use v2x_common::id::TrackId;
use v2x_fusion_hub::engine::Engine;

/// A walker at a constant velocity: position (m) and velocity (m/s).
#[derive(Clone, Copy)]
pub(crate) struct Walker {
    pub(crate) start: [f64; 2],
    pub(crate) velocity: [f64; 2],
}

impl Walker {
    pub(crate) fn at(&self, t_s: f64) -> [f64; 2] {
        [0, 1].map(|axis| self.start[axis] + self.velocity[axis] * t_s)
    }
}

pub(crate) const SIGMA_M: f64 = 1.5;
const SIGMA_YAW_RAD: f64 = 1.2;
pub(crate) const INTERVAL_MS: i64 = 250;

fn normal(random: &mut ChaCha8Rng) -> f64 {
    let mut uniform = || (f64::from(random.next_u32()) + 0.5) / 4_294_967_296.0;
    libm::sqrt(-2.0 * libm::log(uniform())) * libm::cos(2.0 * PI * uniform())
}

pub(crate) fn detection(walker: &Walker, t_s: f64, random: &mut ChaCha8Rng) -> Detection {
    let [x, y] = walker.at(t_s);
    let [vx, vy] = walker.velocity;
    let yaw = libm::atan2(vy, vx) + SIGMA_YAW_RAD * normal(random);
    Detection {
        class: Class::Adult,
        score: 1.0,
        bev: BevBox {
            x: x + SIGMA_M * normal(random),
            y: y + SIGMA_M * normal(random),
            w: 0.7,
            d: 0.7,
            yaw: v2x_common::geometry::wrap_angle(yaw),
        },
        covariance: BoxCovariance {
            position: Covariance2::isotropic(SIGMA_M),
            ww: 0.1,
            dd: 0.1,
            yaw: SIGMA_YAW_RAD * SIGMA_YAW_RAD,
        },
        velocity: None,
        heading: v2x_common::detection::HeadingKind::Known,
        source_track: None,
    }
}

/// Frames of two agents in turn that detect walkers.
pub(crate) fn frames(walkers: &[Walker], n: i64, seed: u64) -> Vec<DetectionFrame> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let frame_of = |sequence: i64| {
        let ms = sequence * INTERVAL_MS;
        #[expect(clippy::cast_precision_loss, reason = "test input")]
        let t_s = ms as f64 * 1e-3;
        let detections = walkers.iter().map(|walker| detection(walker, t_s, &mut random)).collect();
        let name = agent(["ego", "rsu"][usize::from(sequence % 2 == 1)]);
        frame(name, u64::try_from(sequence).expect("test input"), ms, detections)
    };
    (0..n).map(frame_of).collect()
}

pub(crate) fn engine(n_particles: u32) -> Engine {
    let mut engine = engine_of_particles(n_particles);
    for name in ["ego", "rsu"] {
        engine.handle_description(agent(name), description(1e-6)).expect("a valid description");
    }
    engine
}

/// The objects after each frame.
fn published(engine: &mut Engine, frames: &[DetectionFrame]) -> Vec<Vec<FusedObject>> {
    let mut publish = |frame: &DetectionFrame| {
        engine.handle_frame(frame, frame.captured_at);
        engine.fused(frame.captured_at).objects.clone()
    };
    frames.iter().map(&mut publish).collect()
}

fn nearest(objects: &[FusedObject], [x, y]: [f64; 2]) -> Option<(TrackId, f64)> {
    let distance = |object: &FusedObject| libm::hypot(object.bev.x - x, object.bev.y - y);
    let nearest = objects.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    Some((nearest.track, distance(nearest)))
}

pub(crate) fn crowd() -> Vec<Walker> {
    let lane = |k: u32| {
        let (across, along) = (f64::from(k % 4), f64::from(k / 4));
        let speed = if k.is_multiple_of(2) { 1.4 } else { -1.4 };
        Walker { start: [3.0 * along - 5.0 * speed, 1.2 * across], velocity: [speed, 0.0] }
    };
    (0..12).map(lane).collect()
}

#[test]
fn the_same_frames_give_the_same_bits() {
    let frames = frames(&crowd(), 60, 7);
    let (first, second) = (published(&mut engine(8), &frames), published(&mut engine(8), &frames));
    assert!(first == second);
    assert!(first != published(&mut engine(0), &frames), "particles made a difference");
}

#[test]
fn every_object_is_published_once() {
    for seed in 0..10 {
        let objects = published(&mut engine(16), &frames(&crowd(), 60, seed));
        for objects in &objects[10..] {
            let mut ids: Vec<_> = objects.iter().map(|object| object.track).collect();
            ids.dedup();
            assert_eq!(ids.len(), objects.len(), "one object for each name");
            let mut newest: Vec<_> = objects.iter().flat_map(|object| object.contributors.last()).collect();
            newest.sort_unstable();
            newest.dedup();
            assert_eq!(newest.len(), objects.len(), "one object for each report");
            assert!((10..=14).contains(&objects.len()), "{} of 12 in seed {seed}", objects.len());
        }
    }
}

#[test]
fn late_frames_update_every_particle() {
    let mut frames = frames(&crowd(), 60, 3);
    let times: Vec<_> = frames.iter().map(|frame| frame.captured_at).collect();
    for pair in frames.chunks_mut(2) {
        pair.swap(0, 1);
    }
    let mut engine = engine(8);
    for (frame, now) in frames.iter().zip(times) {
        engine.handle_frame(frame, now.max(frame.captured_at));
        engine.fused(now.max(frame.captured_at));
    }
    let objects = &engine.fused(at(59 * INTERVAL_MS)).objects;
    assert!((10..=14).contains(&objects.len()), "{} of 12", objects.len());
}

/// Two walkers whose paths cross at a small angle: how often ids are swapped at the end, and the mean
/// distance of the nearest object, m.
fn crossing(n_particles: u32) -> (u32, f64) {
    let walkers = [
        Walker { start: [-8.0, -3.0], velocity: [1.5, 0.6] },
        Walker { start: [-8.0, 3.0], velocity: [1.5, -0.6] },
    ];
    let (mut swaps, mut error_m, mut count) = (0, 0.0, 0.0);
    for seed in 0..200 {
        let objects = published(&mut engine(n_particles), &frames(&walkers, 40, seed));
        let names = |place: usize, t_s: f64| {
            walkers.map(|walker| nearest(&objects[place], walker.at(t_s)).map(|(track, _)| track))
        };
        let [begin, end] = [names(10, 2.5), names(39, 9.75)];
        swaps += u32::from(begin[0] == end[1] && begin[1] == end[0]);
        for (objects, t_s) in objects[12..].iter().zip(12..) {
            let t_s = f64::from(t_s) * 0.25;
            for walker in &walkers {
                let Some((_, distance)) = nearest(objects, walker.at(t_s)) else { continue };
                error_m += distance;
                count += 1.0;
            }
        }
    }
    (swaps, error_m / count)
}

#[test]
fn particles_halve_the_id_swaps_of_crossing_walkers_at_high_noise() {
    let (plain, particles) = (crossing(0), crossing(16));
    // Of 200, with fixed seeds: 37 against 12 when this was written; 0.89 m against 0.80 m.
    assert!(plain.0 >= 20, "too easy: {plain:?}");
    assert!(2 * particles.0 <= plain.0, "{particles:?} swaps and error, {plain:?} without");
    assert!(particles.1 < plain.1, "{particles:?} swaps and error, {plain:?} without");
}

#[test]
fn without_competing_pairs_particles_change_no_bit() {
    let far = [0.0, 60.0].map(|y| Walker { start: [-5.0, y], velocity: [1.4, 0.0] });
    let frames = frames(&far, 40, 1);
    assert!(published(&mut engine(0), &frames) == published(&mut engine(64), &frames));
    let mut defaults = engine_of_particles(0);
    assert_eq!(published(&mut defaults, &frames).len(), 40);
}
