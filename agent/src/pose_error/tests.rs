use super::*;

const HERE: Pose = Pose { x: 10.0, y: -4.0, yaw: 3.0 };

fn agent() -> AgentId {
    AgentId::new("ego").unwrap()
}

fn error(correlation_s: f64) -> PoseError {
    PoseError { position_m: 0.2, yaw_rad: 0.01, correlation_s, bias: Pose::default() }
}

/// The random part in units of its σ, frame by frame at 10 Hz.
fn standardized(error: &PoseError, sequence: u64) -> [f64; 3] {
    let estimate = error.estimate(&HERE, &FrameKey { seed: 4, agent: &agent(), sequence }, 10.0);
    [
        (estimate.x - HERE.x) / error.position_m,
        (estimate.y - HERE.y) / error.position_m,
        wrap_angle(estimate.yaw - HERE.yaw) / error.yaw_rad,
    ]
}

const N: u64 = 40_000;

/// The random part of every frame, and as many more as the longest lag that is asked for.
fn course(error: &PoseError) -> Vec<[f64; 3]> {
    (0..N + 30).map(|sequence| standardized(error, sequence)).collect()
}

/// Mean of the products of each axis with itself `lag` frames later.
fn autocovariance(course: &[[f64; 3]], lag: usize) -> [f64; 3] {
    let pairs = || course.iter().zip(&course[lag..]).take(40_000);
    [0, 1, 2].map(|axis| pairs().map(|(now, later)| now[axis] * later[axis]).sum::<f64>() / N as f64)
}

#[test]
fn without_correlation_the_errors_of_frames_are_independent_and_have_the_declared_sigma() {
    let course = course(&error(0.0));
    // Standard errors from 40 000 draws: 0.007 of the variance, 0.005 of the covariance.
    for variance in autocovariance(&course, 0) {
        assert!((variance - 1.0).abs() < 0.028, "{variance}");
    }
    for covariance in autocovariance(&course, 1) {
        assert!(covariance.abs() < 0.02, "{covariance}");
    }
}

#[test]
fn the_correlation_falls_by_a_factor_e_in_the_correlation_time() {
    // τ is 5 frames: 40 000 frames are worth some 8000 independent ones of a product, standard error 0.016.
    let course = course(&error(0.5));
    for (lag, expected) in [(0, 1.0), (1, 0.8187), (5, 0.3679), (10, 0.1353), (30, 0.0025)] {
        for covariance in autocovariance(&course, lag) {
            assert!((covariance - expected).abs() < 0.06, "{covariance} at lag {lag}");
        }
    }
}

/// Every frame is a sum of weighted independent draws; the weights give its covariances without sampling.
fn covariance(process: &GaussMarkov<3>, n: u64, m: u64) -> f64 {
    // One draw after another is 1 and all others are 0: what comes out are the weights.
    (0..=process.knot_spacing() * 2)
        .map(|one| {
            let draw = |frame| [f64::from(u8::from(frame == one)); 3];
            process.at(n, &draw)[0] * process.at(m, &draw)[0]
        })
        .sum()
}

#[test]
fn every_frame_has_variance_1_and_the_exact_exponential_correlation_also_across_knots() {
    let process = GaussMarkov::<3> { correlation_frames: 7.0 };
    assert_eq!(process.knot_spacing(), 128);
    for n in [0, 1, 63, 64, 100, 127, 128, 129, 200] {
        let variance = covariance(&process, n, n);
        assert!((variance - 1.0).abs() < 1e-11, "{variance} at {n}");
        for m in [0, 5, 60, 65, 99, 126, 128, 130, 190] {
            let expected = libm::exp(-(f64::from(u32::try_from(n.abs_diff(m)).unwrap())) / 7.0);
            let found = covariance(&process, n, m);
            assert!((found - expected).abs() < 1e-6, "{found} between {n} and {m}, expected {expected}");
        }
    }
}

#[test]
fn any_frame_can_be_computed_without_those_before_it() {
    let error = error(3600.0);
    for sequence in [0, 1, 1_000_003, u64::MAX / 2 + 1, u64::MAX] {
        let [x, y, yaw] = standardized(&error, sequence);
        assert!(x.abs() < 7.0 && y.abs() < 7.0 && yaw.abs() < 7.0, "{x} {y} {yaw}");
        assert_eq!(standardized(&error, sequence), [x, y, yaw]);
    }
    // An hour's error moves in a second by σ √(2/3600): five of those.
    let (before, after) = (standardized(&error, 1_000_000), standardized(&error, 1_000_010));
    assert!((before[0] - after[0]).abs() < 0.12, "{before:?} {after:?}");
}

#[test]
fn errors_of_seeds_agents_and_axes_are_independent() {
    let other = AgentId::new("rsu").unwrap();
    let estimate =
        |seed, agent: &AgentId| error(5.0).estimate(&HERE, &FrameKey { seed, agent, sequence: 17 }, 10.0);
    let ours = estimate(1, &agent());
    assert!(ours.x.to_bits() != estimate(2, &agent()).x.to_bits());
    assert!(ours.x.to_bits() != estimate(1, &other).x.to_bits());
    let [x, y, _] = standardized(&error(5.0), 17);
    assert!((x - y).abs() > 1e-9);
}

#[test]
fn a_bias_is_added_in_the_map_frame() {
    let bias = Pose { x: 0.3, y: -0.4, yaw: 0.5 };
    let agent = agent();
    let key = FrameKey { seed: 1, agent: &agent, sequence: 3 };
    let estimate = PoseError { bias, ..PoseError::default() }.estimate(&HERE, &key, 10.0);
    assert!((estimate.x - 10.3).abs() < 1e-12 && (estimate.y + 4.4).abs() < 1e-12);
    assert!((estimate.yaw - wrap_angle(3.5)).abs() < 1e-12);
}

#[test]
fn boxes_keep_their_range_and_bearing_from_the_estimated_pose() {
    let pose = EstimatedPose { truth: HERE, estimate: Pose { x: 10.5, y: -4.5, yaw: -3.1 } };
    let measured = BevBox { x: 40.0, y: 36.0, w: 1.8, d: 4.5, yaw: 1.0 };
    let placed = pose.place(&measured);
    let range = |pose: &Pose, bev: &BevBox| pose.distance_to(bev.x, bev.y);
    assert!((range(&pose.estimate, &placed) - range(&pose.truth, &measured)).abs() < 1e-12);
    let bearing = |pose: &Pose, bev: &BevBox| pose.bearing_to(bev.x, bev.y);
    assert!((bearing(&pose.estimate, &placed) - bearing(&pose.truth, &measured)).abs() < 1e-12);
    let turned = wrap_angle(placed.yaw - measured.yaw);
    assert!((turned - wrap_angle(-3.1 - 3.0)).abs() < 1e-12);
    assert_eq!((placed.w, placed.d), (1.8, 4.5));
}
