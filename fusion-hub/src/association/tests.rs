use super::assignment::{Assigner, Candidate};
use super::gate::Separation;
use super::gate::distance2;
use super::*;
use crate::values::overlap::Footprint;
use crate::values::{Measurement, PredictedMeasurement};
use proptest::prelude::*;
use v2x_common::class::Class;
use v2x_common::covariance::Covariance2;
use v2x_common::geometry::BevBox;

const COSTS: [AssociationCost; 4] =
    [AssociationCost::Csba, AssociationCost::Likelihood, AssociationCost::Iou, AssociationCost::Euclidean];

fn measurement(extent: f64) -> impl Strategy<Value = Measurement> {
    let class = prop::sample::select(vec![Class::Car, Class::Adult, Class::Unknown]);
    // One in twenty is of another order of magnitude: far away, or very uncertain.
    let position = prop_oneof![
        19 => [0.0..extent, 0.0..extent],
        1 => [-1e7..1e7f64, -1e7..1e7f64],
    ];
    let sigma = prop_oneof![19 => 0.2..1.5f64, 1 => 1.5..1e4f64];
    (class, position, sigma, -0.9..0.9f64, [1.0..3.0f64, 1.0..6.0f64], -3.0..3.0f64).prop_map(
        |(class, position, sigma, rho, size, yaw)| Measurement {
            class,
            position,
            r: Covariance2 { xx: sigma * sigma, xy: 0.7 * rho * sigma * sigma, yy: 0.49 * sigma * sigma },
            size,
            relative_variance: [0.04, 0.04],
            yaw,
            yaw_variance: 0.02,
            size_law: [None; 2],
            heading: v2x_common::detection::HeadingKind::Known,
            velocity: None,
            is_track: false,
            since_last_s: f64::INFINITY,
        },
    )
}

fn expected(z: &Measurement) -> PredictedMeasurement {
    PredictedMeasurement {
        class: z.class,
        position: z.position,
        position_covariance: z.r,
        gate_covariance: z.r,
        size: z.size,
        size_variance: [0.04 * z.size[0] * z.size[0], 0.04 * z.size[1] * z.size[1]],
        yaw: z.yaw,
        yaw_variance: z.yaw_variance,
        report_probability: 0.5,
        by_positions: None,
    }
}

/// The cost of a pair by the definition, `None` where it is no candidate.
fn cost(z: &Measurement, track: &PredictedMeasurement, config: &AssociationConfig) -> Option<f64> {
    let outline = |[x, y]: [f64; 2], [w, d]: [f64; 2], yaw| Footprint::of(&BevBox { x, y, w, d, yaw });
    let iou = outline(track.position, track.size, track.yaw).iou(&outline(z.position, z.size, z.yaw));
    let distance2 = distance2(z.position, track.position);
    // Of what is uncertain by more than 6 m, and of a track by more than 12 m, only so much counts.
    let limited = |p: &Covariance2, most: f64| p.scaled((most / p.xx.max(p.yy)).min(1.0));
    let near = Measurement { r: limited(&z.r, 36.0), ..*z };
    let limited =
        PredictedMeasurement { position_covariance: limited(&track.gate_covariance, 144.0), ..*track };
    let within_gate = Separation::of(&near, &limited).is_within(config.gate);
    let (is_near, cost) = match config.cost {
        AssociationCost::Csba => (within_gate, csba::pair_cost(z, track, &csba::CsbaWeights::PUBLISHED)),
        AssociationCost::Likelihood => (within_gate, likelihood::pair_cost(z, track, config)),
        AssociationCost::Iou => (iou > 0.0, 1.0 - iou),
        AssociationCost::Euclidean => (distance2 <= 9.0, libm::sqrt(distance2)),
    };
    (is_near && (config.classes == ClassRule::Ignored || z.class.is_compatible_with(track.class)))
        .then_some(cost)
}

fn cost_alone(cost: AssociationCost) -> f64 {
    match cost {
        AssociationCost::Csba | AssociationCost::Iou => 1.0,
        AssociationCost::Likelihood => likelihood::COST_ALONE,
        AssociationCost::Euclidean => 3.0,
    }
}

/// The least total cost over every assignment.
fn brute_force(
    measurements: &[Measurement],
    tracks: &mut Vec<PredictedMeasurement>,
    config: &AssociationConfig,
) -> f64 {
    let Some((z, rest)) = measurements.split_first() else { return 0.0 };
    let mut best = cost_alone(config.cost) + brute_force(rest, tracks, config);
    for place in 0..tracks.len() {
        if let Some(pair) = cost(z, &tracks[place], config) {
            let track = tracks.remove(place);
            best = best.min(pair + brute_force(rest, tracks, config));
            tracks.insert(place, track);
        }
    }
    best
}

/// The cost of what was found, which must be an assignment of candidates.
fn total(
    measurements: &[Measurement],
    tracks: &[PredictedMeasurement],
    associator: &Associator,
    config: &AssociationConfig,
) -> f64 {
    let mut taken = vec![false; tracks.len()];
    assert_eq!(associator.track_of().len(), measurements.len());
    let costs = measurements.iter().zip(associator.track_of()).map(|(z, found)| {
        let Some(track) = found else { return cost_alone(config.cost) };
        let track = *track as usize;
        assert!(!std::mem::replace(&mut taken[track], true), "a track has one measurement");
        cost(z, &tracks[track], config).expect("only candidates are assigned")
    });
    costs.sum()
}

/// The least total cost, by one problem of all pairs with measurements as rows.
fn one_for_all(
    measurements: &[Measurement],
    tracks: &[PredictedMeasurement],
    config: &AssociationConfig,
) -> f64 {
    let mut candidates = Vec::new();
    for (row, z) in (0..).zip(measurements) {
        candidates.extend(
            (0..)
                .zip(tracks)
                .filter_map(|(col, track)| cost(z, track, config).map(|cost| Candidate { row, col, cost })),
        );
    }
    let alone = cost_alone(config.cost);
    let mut assigner = Assigner::default();
    let found = assigner.solve(measurements.len(), tracks.len(), &candidates, alone);
    let costs = measurements.iter().zip(found).map(|(z, found)| {
        found.map_or(alone, |track| cost(z, &tracks[track as usize], config).expect("a candidate"))
    });
    costs.sum()
}

fn config() -> impl Strategy<Value = AssociationConfig> {
    (prop::sample::select(COSTS.to_vec()), any::<bool>()).prop_map(|(cost, is_exact)| AssociationConfig {
        cost,
        classes: if is_exact { ClassRule::Exact } else { ClassRule::Ignored },
        ..Default::default()
    })
}

proptest! {
    #[test]
    fn the_association_is_the_optimum_over_all_assignments_within_the_gate(
        measurements in prop::collection::vec(measurement(8.0), 0..5),
        tracks in prop::collection::vec(measurement(8.0), 0..5),
        config in config(),
    ) {
        let mut tracks: Vec<_> = tracks.iter().map(expected).collect();
        let mut associator = Associator::default();
        associator.associate(&measurements, &tracks, &config);
        let total = total(&measurements, &tracks, &associator, &config);
        let best = brute_force(&measurements, &mut tracks, &config);
        prop_assert!((total - best).abs() < 1e-9, "{total} {best}");
    }

    #[test]
    fn the_candidates_are_all_pairs_within_the_gate_in_order_and_all_are_weighed(
        frames in prop::collection::vec(
            (prop::collection::vec(measurement(60.0), 0..80), prop::collection::vec(measurement(60.0), 0..80)),
            1..3),
        config in config(),
    ) {
        let mut associator = Associator::default();
        for (measurements, tracks) in frames {
            let tracks: Vec<_> = tracks.iter().map(expected).collect();
            associator.associate(&measurements, &tracks, &config);
            let mut all = Vec::new();
            for (i, track) in (0u32..).zip(&tracks) {
                let start = all.len();
                all.extend((0u32..).zip(&measurements).filter_map(|(j, z)| {
                    cost(z, track, &config).map(|_| (i, j))
                }));
                let of_track: Vec<_> = all[start..].iter().map(|pair| pair.1).collect();
                prop_assert_eq!(associator.candidates_of(i as usize), of_track);
            }
            prop_assert_eq!(associator.candidates().collect::<Vec<_>>(), all);
            prop_assert!((total(&measurements, &tracks, &associator, &config)
                - one_for_all(&measurements, &tracks, &config)).abs() < 1e-9);
        }
    }
}

#[test]
fn a_track_of_low_existence_loses_its_report_only_to_a_competing_track() {
    let config = AssociationConfig { cost: AssociationCost::Likelihood, ..Default::default() };
    let z = Measurement {
        class: Class::Car,
        position: [0.0, 0.0],
        r: Covariance2::isotropic(0.5),
        size: [1.8, 4.5],
        relative_variance: [0.04; 2],
        yaw: 0.0,
        yaw_variance: 0.02,
        size_law: [None; 2],
        heading: v2x_common::detection::HeadingKind::Known,
        velocity: None,
        is_track: false,
        since_last_s: f64::INFINITY,
    };
    let track = |x: f64, existence: f64| PredictedMeasurement {
        position: [x, 0.0],
        report_probability: existence,
        ..expected(&z)
    };
    let mut associator = Associator::default();
    let (unlikely, likely) = (track(0.1, 0.001), track(0.9, 0.99));
    associator.associate(&[z], &[unlikely, likely], &config);
    assert_eq!(associator.track_of(), [Some(1)]);
    associator.associate(&[z], &[unlikely], &config);
    assert_eq!(associator.track_of(), [Some(0)]);
    associator.associate(&[z], &[track(0.1, 0.99), likely], &config);
    assert_eq!(associator.track_of(), [Some(0)]);
}

#[test]
fn names_of_costs_are_in_kebab_case() {
    for (cost, name) in COSTS.iter().zip(["csba", "likelihood", "iou", "euclidean"]) {
        assert_eq!(serde_json::from_str::<AssociationCost>(&format!("\"{name}\"")).unwrap(), *cost);
    }
}

fn car_at(position: [f64; 2]) -> Measurement {
    Measurement {
        class: Class::Car,
        position,
        r: Covariance2 { xx: 0.3, xy: 0.1, yy: 0.2 },
        size: [1.8, 4.5],
        relative_variance: [0.04; 2],
        yaw: 0.0,
        yaw_variance: 0.02,
        size_law: [None; 2],
        heading: v2x_common::detection::HeadingKind::Known,
        velocity: None,
        is_track: false,
        since_last_s: f64::INFINITY,
    }
}

#[test]
fn a_separation_is_the_mahalanobis_distance_by_both_covariances() {
    let (z, there) = (car_at([3.5, -1.0]), car_at([1.0, 2.0]));
    let p = Covariance2 { xx: 0.5, xy: -0.2, yy: 0.9 };
    let track = PredictedMeasurement { position_covariance: p, ..expected(&there) };
    let s = nalgebra::Matrix2::new(0.8, -0.1, -0.1, 1.1);
    let off = nalgebra::Vector2::new(2.5, -3.0);
    let expected2 = (off.transpose() * s.try_inverse().unwrap() * off)[0];
    let separation = Separation::of(&z, &track);
    assert!((separation.mahalanobis2() - expected2).abs() < 1e-12);
    assert!((separation.determinant - s.determinant()).abs() < 1e-12);
    assert!((distance2(z.position, track.position) - 15.25).abs() < 1e-12);
}

#[test]
fn a_measurement_of_hardly_any_certainty_is_a_candidate_for_what_is_about_it_and_not_for_all() {
    let vague = Measurement { r: Covariance2::isotropic(60.0), ..car_at([0.0, 0.0]) };
    let tracks: Vec<_> = (0..20).map(|k| expected(&car_at([10.0 * f64::from(k), 0.0]))).collect();
    let mut associator = Associator::default();
    associator.find_candidates(&[vague], &tracks, &AssociationConfig::default());
    let near: Vec<_> = (0..20).filter(|k| !associator.candidates_of(*k).is_empty()).collect();
    assert_eq!(near, [0, 1, 2], "four deviations of 6 m");
}

#[test]
fn the_likelihood_cost_is_minus_two_ln_of_the_density_with_capped_cues() {
    let track = expected(&car_at([0.0, 0.0]));
    let z = Measurement { position: [0.5, 0.2], size: [2.0, 5.0], yaw: 0.1, ..car_at([0.0, 0.0]) };
    let separation = Separation::of(&z, &track);
    let position = separation.mahalanobis2() + libm::log(separation.determinant);
    // The heading's variance is 0.02 rad² on either side.
    let (heading, sizes) = (0.1 * 0.1 / 0.04, csba::dimension_distance2(&z, &track));
    assert!(
        (likelihood::pair_cost(&z, &track, &AssociationConfig::default()) - (position + heading + sizes))
            .abs()
            < 1e-12
    );
    let unlike = Measurement { size: [9.0, 0.5], yaw: 3.0, ..z };
    assert!(
        (likelihood::pair_cost(&unlike, &track, &AssociationConfig::default()) - (position + 12.0 + 12.0))
            .abs()
            < 1e-12
    );
}

#[test]
fn a_pair_without_competitor_costs_no_more_by_a_low_report_probability_and_less_by_a_high_one() {
    let config = AssociationConfig { cost: AssociationCost::Likelihood, ..Default::default() };
    let here = car_at([0.0, 0.0]);
    let track = |report_probability| PredictedMeasurement { report_probability, ..expected(&here) };
    let mut associator = Associator::default();
    let mut found = |z: Measurement, track| {
        associator.associate(&[z], &[track], &config);
        associator.track_of()[0]
    };
    // Within the limit alone, beyond it with what a low probability costs.
    let turned = Measurement { position: [1.5, 0.0], yaw: 3.0, ..here };
    let cost = likelihood::pair_cost(&turned, &track(0.5), &AssociationConfig::default());
    assert!(cost < likelihood::COST_ALONE && cost + 12.0 > likelihood::COST_ALONE, "{cost}");
    assert_eq!(found(turned, track(0.001)), Some(0));
    // Beyond the limit alone, within it by a high probability.
    let unlike = Measurement { position: [1.9, 0.0], size: [9.0, 0.5], ..turned };
    let cost = likelihood::pair_cost(&unlike, &track(0.5), &AssociationConfig::default());
    assert!(cost > likelihood::COST_ALONE && cost < likelihood::COST_ALONE + 9.0, "{cost}");
    assert_eq!((found(unlike, track(0.5)), found(unlike, track(0.99))), (None, Some(0)));
}

#[test]
fn boxes_that_overlap_at_their_far_ends_are_candidates() {
    let config =
        AssociationConfig { cost: AssociationCost::Iou, classes: ClassRule::Ignored, ..Default::default() };
    let mut associator = Associator::default();
    // Long and narrow ones end to end, and square ones corner to corner.
    for (size, yaw, apart) in [([0.2, 12.0], 0.0, 11.9), ([4.0, 4.0], std::f64::consts::FRAC_PI_4, 5.6)] {
        let z = Measurement { size, yaw, ..car_at([apart, 0.0]) };
        let track = expected(&Measurement { size, yaw, ..car_at([0.0, 0.0]) });
        associator.find_candidates(&[z], &[track], &config);
        assert_eq!(associator.candidates_of(0), [0], "{size:?}");
    }
}

#[test]
fn the_rivals_of_a_measurement_are_the_tracks_whose_gate_it_is_in() {
    let config = AssociationConfig { cost: AssociationCost::Likelihood, ..Default::default() };
    let [near, between, far] = [0.0, 2.5, 90.0].map(|x| car_at([x, 0.0]));
    let tracks = [0.0, 2.0, 5.0, 200.0].map(|x| expected(&car_at([x, 0.0])));
    let mut associator = Associator::default();
    associator.find_candidates(&[near, between, far], &tracks, &config);
    assert_eq!(associator.n_expected(), 4);
    let reached =
        |place: u32| (0..4).filter(|track| associator.candidates_of(*track).contains(&place)).count();
    let rivals = [0, 1, 2].map(|place| associator.rivals(place));
    assert_eq!(rivals.map(|rivals| rivals as usize), [0, 1, 2].map(reached));
    assert!(rivals[0] > 1 && rivals[2] == 0, "{rivals:?}");
}
