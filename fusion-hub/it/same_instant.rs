//! Frames of one instant, one much less accurate than the other: their order changes no result.

use crate::particles::{INTERVAL_MS, SIGMA_M, Walker, crowd, detection, engine};
use crate::world::{agent, at, description, frame};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use v2x_common::covariance::Covariance2;
use v2x_common::fused::FusedObject;
use v2x_common::id::FrameId;
use v2x_common::time::Span;

/// Walkers at short distances, detected by an accurate and a less accurate agent at the same instants;
/// `is_inaccurate_first` says whose frame arrives first. Returns the objects published after each instant, and the
/// number of tracks.
fn of_two_kinds(seed: u64, n_particles: u32, is_inaccurate_first: bool) -> (Vec<Vec<FusedObject>>, usize) {
    let walkers: Vec<Walker> = (0..6)
        .map(|k| f64::from(k) - 2.5)
        .map(|place| Walker { start: [-6.0, 1.6 * place], velocity: [1.4, -0.4 * place] })
        .collect();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut engine = engine(n_particles);
    let mut published = Vec::new();
    for sequence in 0..30u32 {
        let t_s = f64::from(sequence) * 0.25;
        let mut frame_of = |name: &str, sigma_m: f64| {
            let detections = walkers.iter().map(|walker| {
                let mut one = detection(walker, t_s, &mut random);
                let [x, y] = walker.at(t_s);
                one.bev.x = x + (one.bev.x - x) * sigma_m / SIGMA_M;
                one.bev.y = y + (one.bev.y - y) * sigma_m / SIGMA_M;
                one.covariance.position = Covariance2::isotropic(sigma_m);
                one
            });
            frame(agent(name), u64::from(sequence), i64::from(sequence) * INTERVAL_MS, detections.collect())
        };
        let mut frames = vec![frame_of("ego", 0.5), frame_of("rsu", 1.5)];
        // Ids come from the accurate one.
        frames.truncate(if sequence < 3 { 1 } else { 2 });
        if is_inaccurate_first {
            frames.reverse();
        }
        let now = frames[0].captured_at;
        for frame in &frames {
            engine.handle_frame(frame, now);
            // At any rate of publishing.
            engine.fused(now);
        }
        published.push(engine.fused(now).objects.clone());
    }
    (published, engine.counts().tracks)
}

#[test]
fn a_less_accurate_frame_weights_particles_once_in_either_order() {
    let mut made_a_difference = false;
    for seed in 0..20 {
        let [first, last] = [true, false].map(|is_first| of_two_kinds(seed, 8, is_first));
        assert!(first == last, "seed {seed}");
        made_a_difference |= last != of_two_kinds(seed, 0, false);
    }
    assert!(made_a_difference, "too easy");
}

#[test]
fn a_track_initiated_by_a_less_accurate_frame_keeps_its_id_and_has_the_same_covariance_as_in_the_other_order()
{
    let walkers = [0.0, 60.0].map(|y| Walker { start: [20.0, y], velocity: [1.4, 0.0] });
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut frame_of = |name: &str, sigma_m: f64| {
        let mut detections: Vec<_> =
            walkers.iter().map(|walker| detection(walker, 0.0, &mut random)).collect();
        detections.iter_mut().for_each(|one| one.covariance.position = Covariance2::isotropic(sigma_m));
        frame(agent(name), 0, 0, detections)
    };
    let (accurate, inaccurate) = (frame_of("ego", 0.5), frame_of("rsu", 1.5));
    for n_particles in [0, 8] {
        let [first, last] = [[&inaccurate, &accurate], [&accurate, &inaccurate]].map(|order| {
            let mut engine = engine(n_particles);
            let mut names = order.iter().map(|frame| {
                engine.handle_frame(frame, at(0));
                engine.fused(at(0)).objects.iter().map(|object| object.track).collect::<Vec<_>>()
            });
            let (before, after) = (names.next(), names.next());
            assert_eq!(before, after);
            assert_eq!(after.map(|names| names.len()), Some(2));
            drop(names);
            engine.fused(at(0)).objects.clone()
        });
        assert!(first == last, "{first:?} {last:?}");
    }
}

#[test]
fn late_frames_of_one_instant_lose_no_object_in_any_order() {
    for seed in 0..6 {
        let mut frames = Vec::new();
        for (name, every) in [("ego", 1), ("rsu", 1), ("van", 2)] {
            let factor = if name == "ego" { 0.3 } else { 1.0 };
            for (sequence, mut frame) in
                (0..).zip(crate::particles::frames(&crowd(), 60, seed).into_iter().step_by(every))
            {
                frame.id = FrameId { agent: agent(name), sequence, ..frame.id };
                frame
                    .detections
                    .iter_mut()
                    .for_each(|one| one.covariance.position = Covariance2::isotropic(SIGMA_M * factor));
                frames.push(frame);
            }
        }
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut arrivals: Vec<_> = frames
            .into_iter()
            .map(|frame| {
                let delay = if random.next_u32() % 2 == 0 { 0 } else { i64::from(random.next_u32() % 480) };
                (frame.captured_at + Span::from_millis(delay), frame)
            })
            .collect();
        arrivals.sort_by_key(|(arrival, frame)| (*arrival, frame.id));
        let mut engine = engine(8);
        engine.handle_description(agent("van"), description(1e-6)).expect("a valid description");
        for (arrival, frame) in &arrivals {
            engine.handle_frame(frame, *arrival);
            if random.next_u32() % 3 == 0 {
                engine.fused(*arrival);
            }
        }
        let n = engine.fused(at(59 * INTERVAL_MS)).objects.len();
        assert!((9..=15).contains(&n), "{n} of 12 in seed {seed}");
    }
}
