//! The kinematic filter against filterpy.

use super::{assert_close, covariance};
use v2x_common::covariance::Velocity;
use v2x_fusion_hub::filter::Kinematic;

#[derive(serde::Deserialize)]
struct Case {
    accel_psd: f64,
    sigma_velocity: f64,
    z0: [f64; 2],
    r0: [f64; 3],
    steps: Vec<Step>,
}

#[derive(serde::Deserialize)]
struct Step {
    dt: f64,
    velocity: bool,
    z: [f64; 2],
    r: [f64; 3],
    mean: [f64; 4],
    covariance: [f64; 10],
}

#[test]
fn every_step_equals_filterpys() {
    let cases: Vec<Case> = serde_json::from_str(include_str!("kalman.json")).unwrap();
    for case in &cases {
        let mut state = Kinematic::initial(case.z0, covariance(case.r0), case.sigma_velocity, None);
        for step in &case.steps {
            let r = covariance(step.r);
            state.predict(step.dt, case.accel_psd);
            if step.velocity {
                state.update_velocity(&Velocity { x: step.z[0], y: step.z[1], covariance: r });
            } else {
                state.update_position(step.z, &r);
            }
            let [x, y] = state.position;
            let [vx, vy] = state.velocity;
            assert_close(&[x, y, vx, vy], &step.mean, 1e-9);
            assert_close(&state.covariance(), &step.covariance, 1e-9);
        }
    }
}
