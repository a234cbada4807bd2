//! What an agent declares of its accuracy may change.

use super::traffic::{Observer, Traffic, VEHICLE, rings};
use crate::world::{agent, description};
use v2x_common::sensor::{Accuracy, SensorDescription};
use v2x_fusion_hub::registration::{Bias, Registration};

const BIAS: Bias = Bias { dx_m: 0.3, dy_m: -0.4, yaw_rad: 0.0, clock_s: 0.0 };

fn traffic() -> Traffic {
    let observers = vec![Observer::unit(), Observer::vehicle("car", BIAS)];
    Traffic::new(Registration::Correct, rings(1), observers, 1)
}

fn declare(traffic: &mut Traffic, position_m: f64) {
    let accuracy = Accuracy { position_m, ..VEHICLE };
    let described = SensorDescription { accuracy, ..description(1e-7) };
    traffic.engine.handle_description(agent("car"), described).expect("a valid description");
}

fn corrected_m(traffic: &Traffic) -> f64 {
    let applied = traffic.registration_of("car").applied;
    libm::hypot(applied.dx_m, applied.dy_m)
}

#[test]
fn an_agent_whose_declared_accuracy_varies_is_corrected_as_one_whose_does_not() {
    let (mut steady, mut varying) = (traffic(), traffic());
    for second in 0..20 {
        declare(&mut steady, 0.5);
        declare(&mut varying, if second % 2 == 0 { 0.5 } else { 0.51 });
        steady.run(1);
        varying.run(1);
    }
    let (steady, varying) = (corrected_m(&steady), corrected_m(&varying));
    assert!(steady > 0.4, "{steady} m of 0.5 m");
    assert!((varying - steady).abs() < 0.02, "{varying} m against {steady} m");
}

#[test]
fn an_agent_that_declares_less_is_corrected_by_no_more_from_then_on() {
    let mut traffic = traffic();
    traffic.run(20);
    assert!(corrected_m(&traffic) > 0.4);
    declare(&mut traffic, 0.2);
    assert!(corrected_m(&traffic) <= 0.2 + 1e-12, "at once");
    traffic.run(10);
    assert!(corrected_m(&traffic) <= 0.2 + 1e-12, "and later");
    declare(&mut traffic, 0.0);
    traffic.run(5);
    assert_eq!(corrected_m(&traffic), 0.0, "it declares no error of its position");
}
