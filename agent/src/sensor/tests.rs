use super::*;
use crate::random::StandardNormal;
use crate::scenario::Scenario;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use v2x_common::id::AgentId;

const CROSSING: &str = include_str!("../../../deploy/scenarios/crossing.toml");
const START: Timestamp = Timestamp::from_nanos(1_700_000_000_000_000_000);
const BOOT: Boot = Boot { seed: 1, epoch: 9, start: START };
const N_FRAMES: u64 = 1200;

fn sensor_of(text: &str, id: &str, boot: Boot) -> Sensor {
    let scenario = Scenario::from_toml(text).unwrap();
    let world = Arc::new(scenario.world(boot.seed));
    let index = scenario.agent_index(&AgentId::new(id).unwrap()).unwrap();
    scenario.agents[index].sensor(world, boot).unwrap()
}

fn sensor(id: &str) -> Sensor {
    sensor_of(CROSSING, id, BOOT)
}

fn truth(agent: &Sensor, sequence: u64) -> BTreeMap<ObjectId, TrueObject> {
    let mut objects = Vec::new();
    agent.world().objects_at(agent.capture_time(sequence) - START, &mut objects);
    objects.into_iter().map(|object| (object.id, object)).collect()
}

/// The detections of a frame with their identities.
fn named(observation: &Observation) -> impl Iterator<Item = (Option<ObjectId>, &Detection)> {
    observation.identities.objects.iter().copied().zip(&observation.frame.detections)
}

#[test]
fn every_frame_is_valid_and_has_an_identity_for_each_detection() {
    for id in ["ego", "rsu"] {
        let sensor = sensor(id);
        for sequence in 0..N_FRAMES {
            let Observation { frame, identities } = sensor.observe(sequence);
            assert_eq!(frame.validate(), Ok(()));
            assert_eq!((identities.epoch, identities.sequence), (frame.id.epoch, frame.id.sequence));
            assert_eq!(identities.objects.len(), frame.detections.len());
        }
        assert!(sensor.description().validate().is_ok());
    }
}

#[test]
fn capture_times_follow_phase_and_rate_and_are_found_again() {
    let rsu = sensor("rsu");
    assert_eq!(rsu.capture_time(0), START + Span::from_millis(50));
    assert_eq!(rsu.capture_time(3), START + Span::from_millis(350));
    assert_eq!(rsu.sequence_at_or_after(START + Span::from_millis(350)), 3);
    assert_eq!(rsu.sequence_at_or_after(START + Span::from_nanos(350_000_001)), 4);
    assert_eq!(rsu.sequence_at_or_after(START - Span::from_millis(5000)), 0);
    assert_eq!(rsu.observe(3).frame.captured_at, rsu.capture_time(3));
}

#[test]
fn the_share_of_detected_objects_is_the_detection_probability_and_none_is_outside_of_the_view() {
    let rsu = sensor("rsu");
    let pose = rsu.world().agent_pose(1, Span::ZERO).unwrap();
    let (mut n_visible, mut n_detected) = (0, 0);
    for sequence in 0..N_FRAMES {
        let objects = truth(&rsu, sequence);
        let visible = |o: &TrueObject| rsu.config().field_of_view.contains(&pose, o.bev.x, o.bev.y);
        n_visible += objects.values().filter(|o| visible(o)).count();
        let observation = rsu.observe(sequence);
        for id in observation.identities.objects.iter().flatten() {
            assert!(visible(&objects[id]));
            n_detected += 1;
        }
    }
    let share = f64::from(n_detected) / n_visible as f64;
    // Some 30 000 draws: three standard errors are 0.004.
    assert!((share - 0.95).abs() < 0.004, "{share}");
}

#[test]
fn clutter_has_its_rate_and_lies_in_the_view() {
    for id in ["ego", "rsu"] {
        let sensor = sensor(id);
        let index = usize::from(id == "rsu");
        let mut n_clutter = 0;
        let mut n_in_inner_half = 0;
        for sequence in 0..4 * N_FRAMES {
            let observation = sensor.observe(sequence);
            let pose = sensor.world().agent_pose(index, sensor.capture_time(sequence) - START).unwrap();
            for (_, clutter) in named(&observation).filter(|(object, _)| object.is_none()) {
                let range_m = pose.distance_to(clutter.bev.x, clutter.bev.y);
                assert!((sensor.config().field_of_view.range_min_m..=60.0).contains(&range_m), "{range_m}");
                n_clutter += 1;
                n_in_inner_half += u32::from(range_m < 60.0 * std::f64::consts::FRAC_1_SQRT_2);
            }
        }
        // About 2400 clutters: three standard errors of the rate are 0.03, of the share 0.03.
        let rate = f64::from(n_clutter) / (4 * N_FRAMES) as f64;
        assert!((rate - 0.5).abs() < 0.03, "{rate}");
        let share = f64::from(n_in_inner_half) / f64::from(n_clutter);
        assert!((share - 0.5).abs() < 0.03, "{share} of the clutter in half of the area");
    }
}

#[test]
fn detections_err_by_what_they_report() {
    let rsu = sensor("rsu");
    let (mut n, mut squares) = (0.0, [0.0; 3]);
    for sequence in 0..N_FRAMES {
        let objects = truth(&rsu, sequence);
        let observation = rsu.observe(sequence);
        for (id, detection) in named(&observation) {
            let Some(object) = id.map(|id| objects[&id]) else { continue };
            assert_eq!(object.class, detection.class);
            let (ex, ey) = (detection.bev.x - object.bev.x, detection.bev.y - object.bev.y);
            let e_yaw = wrap_angle(detection.bev.yaw - object.bev.yaw);
            squares[0] += ex * ex / detection.covariance.position.xx;
            squares[1] += ey * ey / detection.covariance.position.yy;
            squares[2] += e_yaw * e_yaw / detection.covariance.yaw;
            n += 1.0;
        }
    }
    for normalized in squares.map(|sum| sum / n) {
        // Standard error 0.008; σ from the measured range instead of the true one adds little.
        assert!((normalized - 1.0).abs() < 0.03, "{normalized}");
    }
}

#[test]
fn a_vehicle_reports_itself_once_per_frame_with_the_declared_accuracy() {
    let ego = sensor("ego");
    let own = ego.world().agent_object(0).unwrap();
    let body = ego.description().body.unwrap();
    let (mut position, mut yaw) = (0.0, 0.0);
    for sequence in 0..N_FRAMES {
        let observation = ego.observe(sequence);
        let reports: Vec<&Detection> =
            named(&observation).filter(|(id, _)| *id == Some(own)).map(|(_, detection)| detection).collect();
        let [report] = reports[..] else { panic!("{} reports of itself", reports.len()) };
        assert_eq!((report.class, report.bev.w, report.bev.d), (body.class, body.w, body.d));
        assert_eq!(Some(report.bev.pose()), observation.frame.sensor_pose);
        let truth = truth(&ego, sequence)[&own].bev;
        position += (report.bev.x - truth.x) * (report.bev.x - truth.x);
        yaw += wrap_angle(report.bev.yaw - truth.yaw) * wrap_angle(report.bev.yaw - truth.yaw);
    }
    let n = N_FRAMES as f64;
    // Standard error of a σ from 1200 draws: 2 %.
    assert!((libm::sqrt(position / n) / 0.3 - 1.0).abs() < 0.07, "{}", libm::sqrt(position / n));
    assert!(
        (libm::sqrt(yaw / n).to_degrees() / 0.5 - 1.0).abs() < 0.07,
        "{}",
        libm::sqrt(yaw / n).to_degrees()
    );
}

#[test]
fn the_roadside_unit_sees_the_ego() {
    let (ego, rsu) = (sensor("ego"), sensor("rsu"));
    let own = ego.world().agent_object(0);
    assert!((0..100).any(|sequence| rsu.observe(sequence).identities.objects.contains(&own)));
    assert_eq!(rsu.description().body, None);
}

#[test]
fn the_order_of_detections_is_independent_of_their_identities() {
    let rsu = sensor("rsu");
    let (mut n_clutter_last, mut n_with_clutter, mut rank_correlation) = (0, 0.0, 0.0);
    for sequence in 0..N_FRAMES {
        let ids = rsu.observe(sequence).identities.objects;
        let mean_index = (ids.len() as f64 - 1.0) / 2.0;
        let known: Vec<_> =
            (0..).zip(&ids).filter_map(|(index, id)| id.map(|id| (f64::from(index), id))).collect();
        let mut sorted: Vec<ObjectId> = known.iter().map(|(_, id)| *id).collect();
        sorted.sort_unstable();
        for (index, id) in &known {
            let rank = sorted.binary_search(id).unwrap() as f64;
            rank_correlation += (index - mean_index) * (rank - mean_index) / (mean_index * mean_index);
        }
        let n_clutters = ids.len() - known.len();
        n_with_clutter += n_clutters as f64 / ids.len() as f64;
        n_clutter_last += u32::from(ids.last() == Some(&None));
    }
    // Sums of some 35 000 terms of variance about 1/9: four standard errors.
    assert!(rank_correlation.abs() < 4.0 * 62.0, "{rank_correlation}");
    // About 20 expected.
    assert!((f64::from(n_clutter_last) - n_with_clutter).abs() < 18.0, "{n_clutter_last} {n_with_clutter}");
}

#[test]
fn the_same_inputs_give_the_same_bits_whatever_the_epoch() {
    let (first, second) = (sensor("ego"), sensor_of(CROSSING, "ego", Boot { epoch: 77, ..BOOT }));
    let later = sensor_of(CROSSING, "ego", Boot { start: START + Span::from_millis(9), ..BOOT });
    let other_seed = sensor_of(CROSSING, "ego", Boot { seed: 2, ..BOOT });
    for sequence in [0, 1, 500, 1_000_000] {
        let expected = first.observe(sequence).frame.detections;
        assert_eq!(expected, second.observe(sequence).frame.detections);
        assert_eq!(expected, later.observe(sequence).frame.detections);
        assert_ne!(expected, other_seed.observe(sequence).frame.detections);
    }
}

#[test]
fn one_more_agent_does_not_change_detections_of_other_objects() {
    let car = "[[agents]]\nid = \"x\"\nkind = \"vehicle\"\npose = { x = 12, y = -20 }\n[hub]";
    let (before, after) = (sensor("rsu"), sensor_of(&CROSSING.replace("[hub]", car), "rsu", BOOT));
    let new = after.world().agent_object(2);
    let sorted = |observation: &Observation| {
        let mut xs: Vec<(Option<ObjectId>, u64)> =
            named(observation).filter(|(id, _)| *id != new).map(|(id, d)| (id, d.bev.x.to_bits())).collect();
        xs.sort_unstable();
        xs
    };
    for sequence in 0..50 {
        assert_eq!(sorted(&before.observe(sequence)), sorted(&after.observe(sequence)));
    }
}

#[test]
fn a_sector_detects_objects_ahead_only() {
    let narrow = CROSSING.replace("{ range_max_m = 60 }", "{ range_max_m = 60, width_deg = 90 }");
    let rsu = sensor_of(&narrow, "rsu", BOOT);
    let pose = rsu.world().agent_pose(1, Span::ZERO).unwrap();
    let quarter = rsu.config().field_of_view.area_m2() / (PI * 3600.0);
    assert!((quarter - 0.25).abs() < 1e-12);
    for sequence in 0..200 {
        let (objects, observation) = (truth(&rsu, sequence), rsu.observe(sequence));
        for (id, detection) in named(&observation) {
            let bev = id.map_or(detection.bev, |id| objects[&id].bev);
            assert!(pose.bearing_to(bev.x, bev.y).abs() <= PI / 4.0 + 1e-9);
        }
    }
}

/// The crossing with these lines in the table of one agent.
fn sensor_with(id: &str, lines: &str) -> Sensor {
    sensor_of(&CROSSING.replace(&format!("id = \"{id}\""), &format!("id = \"{id}\"\n{lines}")), id, BOOT)
}

#[test]
fn a_clock_error_changes_time_stamps_and_nothing_else() {
    let (right, wrong) = (sensor("rsu"), sensor_with("rsu", "clock = { offset_ms = 50, drift_ppm = 100 }"));
    for sequence in [0, 1, 600] {
        assert_eq!(right.capture_time(sequence), wrong.capture_time(sequence));
        let (expected, mut found) = (right.observe(sequence), wrong.observe(sequence));
        let ahead = found.frame.captured_at - wrong.capture_time(sequence);
        let drifted = Span::from_nanos((wrong.capture_time(sequence) - START).as_nanos() / 10_000);
        assert_eq!(ahead, Span::from_millis(50) + drifted);
        found.frame.captured_at = expected.frame.captured_at;
        assert_eq!(expected, found);
    }
}

#[test]
fn a_pose_error_moves_a_frame_as_a_whole() {
    let line = "pose_error = { position_m = 0.5, yaw_deg = 2, correlation_s = 5, bias_x_m = 1 }";
    let (right, wrong) = (sensor_with("ego", "pose_error = {}"), sensor_with("ego", line));
    let own = right.own_object();
    for sequence in [0, 7, 400] {
        let (right, wrong) = (right.observe(sequence), wrong.observe(sequence));
        let (true_pose, estimated) = (right.frame.sensor_pose.unwrap(), wrong.frame.sensor_pose.unwrap());
        assert!(true_pose.distance_to(estimated.x, estimated.y) > 0.01);
        assert_eq!(right.identities, wrong.identities);
        for ((object, right), (_, wrong)) in named(&right).zip(named(&wrong)) {
            if *object.as_ref().unwrap_or(&ObjectId(0)) == own.unwrap() {
                assert_eq!((right.bev.pose(), wrong.bev.pose()), (true_pose, estimated));
                continue;
            }
            let relative_to = |pose: &Pose, bev: &BevBox| {
                (
                    pose.distance_to(bev.x, bev.y),
                    pose.bearing_to(bev.x, bev.y),
                    wrap_angle(bev.yaw - pose.yaw),
                )
            };
            let (expected, found) =
                (relative_to(&true_pose, &right.bev), relative_to(&estimated, &wrong.bev));
            assert!((expected.0 - found.0).abs() < 1e-9, "range {expected:?} {found:?}");
            assert!(wrap_angle(expected.1 - found.1).abs() < 1e-9, "bearing {expected:?} {found:?}");
            assert!(wrap_angle(expected.2 - found.2).abs() < 1e-9, "heading {expected:?} {found:?}");
            assert!((right.covariance.position.xx / wrong.covariance.position.xx - 1.0).abs() < 1e-9);
        }
    }
}

#[test]
fn a_surveyed_pose_is_exact_unless_a_pose_error_is_configured() {
    let pose = sensor("rsu").world().agent_pose(1, Span::ZERO).unwrap();
    assert_eq!(sensor("rsu").observe(5).frame.sensor_pose, Some(pose));
    let biased = sensor_with("rsu", "pose_error = { bias_x_m = 0.25, bias_y_m = -0.5 }");
    let estimated = biased.observe(5).frame.sensor_pose.unwrap();
    assert_eq!((estimated.x, estimated.y), (pose.x + 0.25, pose.y - 0.5));
}

#[test]
fn a_random_capture_phase_is_determined_by_the_seed_and_lies_within_one_period() {
    let text = CROSSING.replace("phase_ms = 50", "phase_ms = \"random\"");
    let phase = |seed| sensor_of(&text, "rsu", Boot { seed, ..BOOT }).capture_time(0) - START;
    assert!((0..50).all(|seed| (Span::ZERO..Span::from_millis(100)).contains(&phase(seed))));
    assert!((0..50).any(|seed| phase(seed) > Span::from_millis(70)));
    assert_eq!(phase(3), phase(3));
    let rsu = sensor_of(&text, "rsu", BOOT);
    assert_eq!(rsu.sequence_at_or_after(rsu.capture_time(4)), 4);
}

#[test]
fn the_description_contains_the_declared_accuracy() {
    let accuracy = |agent: &Sensor| agent.description().accuracy;
    let (ego, rsu) = (accuracy(&sensor("ego")), accuracy(&sensor("rsu")));
    assert_eq!((ego.position_m, ego.clock_s), (0.3, 0.05));
    assert_eq!((rsu.position_m, rsu.clock_s), (0.02, 1e-6));
}

/// Errors of the detections of a run in x, in units of their σ.
fn normalized_errors(sensor: &Sensor) -> Vec<f64> {
    let mut errors = Vec::new();
    for sequence in 0..N_FRAMES {
        let (objects, observation) = (truth(sensor, sequence), sensor.observe(sequence));
        assert_eq!(observation.frame.validate(), Ok(()));
        for (id, detection) in named(&observation) {
            let Some(object) = id.map(|id| objects[&id]) else { continue };
            let sigma = libm::sqrt(detection.covariance.position.xx);
            errors.push((detection.bev.x - object.bev.x) / sigma);
        }
    }
    errors
}

#[test]
fn a_law_of_rand_distr_is_the_law_of_the_errors() {
    let share_beyond_4_sigma =
        |errors: &[f64]| errors.iter().filter(|error| error.abs() > 4.0).count() as f64 / errors.len() as f64;
    // Student's t with 3 degrees of freedom exceeds 4 with a probability of 2.8 %; a normal law of 0.006 %.
    let student = sensor("rsu").with_position_noise(rand_distr::StudentT::new(3.0).unwrap());
    let share = share_beyond_4_sigma(&normalized_errors(&student));
    // Standard error 0.1 %; σ is computed from the measured range, which makes large errors a little smaller.
    assert!((0.015..0.035).contains(&share), "{share}");
    assert!(share_beyond_4_sigma(&normalized_errors(&sensor("rsu"))) < 0.001);
}

#[test]
fn the_built_in_law_given_by_hand_gives_the_same_bits() {
    let (default, by_hand) = (sensor("ego"), sensor("ego"));
    let by_hand = by_hand.with_position_noise(StandardNormal).with_heading_noise(StandardNormal);
    for sequence in 0..50 {
        assert_eq!(default.observe(sequence), by_hand.observe(sequence));
    }
}

#[test]
fn a_measurement_that_is_not_finite_counts_as_missed() {
    struct Nothing;
    impl Distribution<f64> for Nothing {
        fn sample<R: rand::Rng + ?Sized>(&self, _: &mut R) -> f64 {
            f64::NAN
        }
    }
    let sensors = [
        sensor("rsu").with_position_noise(Nothing),
        sensor("rsu").with_heading_noise(Nothing),
        sensor("rsu").with_size_noise(Nothing),
    ];
    for sensor in sensors {
        let observation = sensor.observe(3);
        assert_eq!(observation.frame.validate(), Ok(()));
        assert!(observation.identities.objects.iter().all(Option::is_none), "only clutter is left");
    }
}

#[test]
fn a_sensor_of_an_unknown_agent_or_with_a_number_beyond_its_limits_is_an_error() {
    let known = sensor("rsu");
    let with = |change: fn(&mut SensorConfig)| {
        let mut config = known.config().clone();
        change(&mut config);
        Sensor::new(config, known.world().clone(), BOOT).map(drop)
    };
    let unknown = AgentId::new("unknown").unwrap();
    assert_eq!(
        with(|config| config.agent = AgentId::new("unknown").unwrap()),
        Err(SensorError::NoSuchAgent(unknown))
    );
    let error = with(|config| config.clutter_per_frame = f64::NAN).unwrap_err().to_string();
    assert!(error.contains("clutter_per_frame is NaN, expected 0 to 100"), "{error}");
}

#[test]
fn a_profile_turns_headings_and_scores_true_objects_above_false_ones() {
    let text = CROSSING.replace("id = \"rsu\"", "id = \"rsu\"\nprofile = \"lidar\"");
    let sensor = sensor_of(&text, "rsu", BOOT);
    let (mut turned, mut n, mut scores, mut false_scores) = (0, 0, Vec::new(), Vec::new());
    for sequence in 0..N_FRAMES {
        let observation = sensor.observe(sequence);
        assert_eq!(observation.frame.validate(), Ok(()));
        let objects = truth(&sensor, sequence);
        for (id, detection) in named(&observation) {
            match id {
                Some(id) => {
                    n += 1;
                    turned += u32::from(wrap_angle(detection.bev.yaw - objects[&id].bev.yaw).abs() > 2.0);
                    scores.push(detection.score);
                }
                None => false_scores.push(detection.score),
            }
        }
    }
    let share = f64::from(turned) / f64::from(n);
    assert!((0.05..0.25).contains(&share), "{share}");
    let mean = |scores: &[f64]| scores.iter().sum::<f64>() / scores.len() as f64;
    assert!(mean(&scores) > mean(&false_scores) + 0.1, "{} {}", mean(&scores), mean(&false_scores));
}
