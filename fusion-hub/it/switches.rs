//! What the engine uses beside the reports themselves can be switched off.

use crate::world::{agent, at, config, description, detection, frame};
use v2x_common::class::Class;
use v2x_common::detection::Detection;
use v2x_common::fused::FusedObject;
use v2x_common::sensor::SizeNoiseLaw;
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::engine::EngineConfig;

/// The one object after a second of reports at 10 Hz.
fn told(config: EngineConfig, size_noise: Option<SizeNoiseLaw>, class: Class) -> FusedObject {
    let mut engine = Engine::new(config);
    let ego = agent("ego");
    let mut sensor = description(1e-6);
    sensor.size_noise = size_noise;
    engine.handle_description(ego, sensor).expect("a valid description");
    for (sequence, ms) in (0..).zip((0..1000).step_by(100)) {
        let error = if sequence % 2 == 0 { 0.2 } else { -0.1 };
        let seen = Detection { class, ..detection(0, at(ms), (error, error)) };
        engine.handle_frame(&frame(ego, sequence, ms, vec![seen]), at(ms));
    }
    let told = engine.fused(at(950)).objects[0].clone();
    FusedObject { class: Class::Unknown, class_probabilities: Vec::new(), ..told }
}

const LAW: SizeNoiseLaw = SizeNoiseLaw { sigma: 0.2, lower: 0.1 };

#[test]
fn without_class_priors_a_pedestrian_is_told_as_a_car_would_be() {
    let blind = config().with_tracking(|tracking| {
        tracking.tracker.class_motion = false;
        tracking.class_size_priors = false;
    });
    assert_eq!(told(blind, None, Class::Adult), told(blind, None, Class::Car));
    assert_ne!(told(config(), None, Class::Adult).velocity, told(config(), None, Class::Car).velocity);
}

#[test]
fn without_size_priors_a_size_is_what_was_reported_and_motion_is_still_the_classs() {
    let own_sizes = config().with_tracking(|tracking| tracking.class_size_priors = false);
    let (car, adult) = (told(own_sizes, None, Class::Car), told(own_sizes, None, Class::Adult));
    assert_eq!((car.bev.w, car.bev.d), (adult.bev.w, adult.bev.d));
    assert_ne!(car.velocity, adult.velocity);
    let with_priors = told(config(), None, Class::Adult);
    assert!(with_priors.bev.d < adult.bev.d, "4.5 m is long for a pedestrian: {with_priors:?}");
}

#[test]
fn without_debiasing_a_declared_law_of_sizes_changes_nothing() {
    let plain = EngineConfig { debias_sizes: false, ..config() };
    assert_eq!(told(plain, Some(LAW), Class::Car), told(plain, None, Class::Car));
    assert_ne!(told(config(), Some(LAW), Class::Car), told(config(), None, Class::Car));
}
