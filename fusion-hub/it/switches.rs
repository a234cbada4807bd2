//! Prior knowledge of the engine can be switched off.

use crate::world::{agent, at, config, description, detection, frame};
use v2x_common::class::Class;
use v2x_common::detection::Detection;
use v2x_common::fused::FusedObject;
use v2x_common::sensor::SizeNoiseLaw;
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::engine::EngineConfig;

/// The one object after a second of reports at 10 Hz.
fn published(config: EngineConfig, size_noise: Option<SizeNoiseLaw>, class: Class) -> FusedObject {
    let mut engine = Engine::new(config);
    let ego = agent("ego");
    let mut sensor = description(1e-6);
    sensor.size_noise = size_noise;
    engine.handle_description(ego, sensor).expect("a valid description");
    for (sequence, ms) in (0..).zip((0..1000).step_by(100)) {
        let error = if sequence % 2 == 0 { 0.2 } else { -0.1 };
        let detection_of_class = Detection { class, ..detection(0, at(ms), (error, error)) };
        engine.handle_frame(&frame(ego, sequence, ms, vec![detection_of_class]), at(ms));
    }
    let object = engine.fused(at(950)).objects[0].clone();
    FusedObject { class: Class::Unknown, class_probabilities: Vec::new(), ..object }
}

const LAW: SizeNoiseLaw = SizeNoiseLaw { sigma: 0.2, lower: 0.1 };

#[test]
fn without_class_priors_a_pedestrian_is_estimated_as_a_car() {
    let blind = config().with_tracking(|tracking| {
        tracking.tracker.class_motion = false;
        tracking.class_size_priors = false;
    });
    assert_eq!(published(blind, None, Class::Adult), published(blind, None, Class::Car));
    assert_ne!(
        published(config(), None, Class::Adult).velocity,
        published(config(), None, Class::Car).velocity
    );
}

#[test]
fn without_size_priors_sizes_are_as_reported_and_motion_depends_on_the_class() {
    let own_sizes = config().with_tracking(|tracking| tracking.class_size_priors = false);
    let (car, adult) = (published(own_sizes, None, Class::Car), published(own_sizes, None, Class::Adult));
    assert_eq!((car.bev.w, car.bev.d), (adult.bev.w, adult.bev.d));
    assert_ne!(car.velocity, adult.velocity);
    let with_priors = published(config(), None, Class::Adult);
    assert!(with_priors.bev.d < adult.bev.d, "4.5 m is long for a pedestrian: {with_priors:?}");
}

#[test]
fn without_debiasing_a_declared_law_of_sizes_changes_nothing() {
    let plain = EngineConfig { debias_sizes: false, ..config() };
    assert_eq!(published(plain, Some(LAW), Class::Car), published(plain, None, Class::Car));
    assert_ne!(published(config(), Some(LAW), Class::Car), published(config(), None, Class::Car));
}
