use super::*;
use crate::clock::ClockError;
use crate::link::Delay;
use crate::noise::NoiseLevel;
use crate::pose_error::PoseError;
use crate::sending::{SendRule, Transmit};
use crate::timing::Phase;
use crate::world::{CrossingConfig, Route, Station, WorldConfig};
use v2x_common::geometry::Pose;
use v2x_common::sensor::{Accuracy, SensorKind};
use v2x_common::time::Span;

const MINIMAL: &str = r#"
name = "small"
[world]
kind = "crossing"
[[agents]]
id = "a"
kind = "vehicle"
route = "block-ne"
[[agents]]
id = "b"
kind = "roadside-unit"
pose = { x = 1, y = 2, yaw_deg = 270 }
"#;

fn shipped(name: &str) -> std::path::PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "../deploy/scenarios", name].iter().collect()
}

/// The message for a minimal scenario with one text replaced.
fn refusal(from: &str, to: &str) -> String {
    assert!(MINIMAL.contains(from), "{from}");
    Scenario::from_toml(&MINIMAL.replacen(from, to, 1)).unwrap_err().to_string()
}

#[test]
fn every_shipped_scenario_is_valid() {
    for (name, n_agents) in [("crossing", 2), ("ten-agents", 10), ("highway", 4)] {
        let scenario = Scenario::load(shipped(&format!("{name}.toml"))).unwrap();
        assert_eq!((scenario.name.as_str(), scenario.agents.len()), (name, n_agents));
    }
}

#[test]
fn the_agents_of_the_default_scenario_have_the_same_sensor_and_link() {
    let scenario = Scenario::load(shipped("crossing.toml")).unwrap();
    let [ego, rsu] = &scenario.agents[..] else { panic!("two agents") };
    assert_eq!((ego.id().as_str(), ego.sensor.kind), ("ego", SensorKind::Vehicle));
    assert_eq!((rsu.id().as_str(), rsu.sensor.kind), ("rsu", SensorKind::RoadsideUnit));
    assert_eq!(ego.sensor.noise, NoiseLevel::N1.model());
    assert_eq!(
        (ego.sensor.noise, &ego.sending.link, ego.sensor.rate),
        (rsu.sensor.noise, &rsu.sending.link, rsu.sensor.rate)
    );
    assert_eq!((ego.sensor.detection_probability, ego.sensor.clutter_per_frame), (0.95, 0.5));
    assert_eq!((rsu.sensor.detection_probability, rsu.sensor.clutter_per_frame), (0.95, 0.5));
    let at = |ms| Phase::Fixed(Span::from_millis(ms));
    assert_eq!((ego.sensor.phase, rsu.sensor.phase), (at(0), at(50)));
}

#[test]
fn missing_fields_have_their_defaults() {
    let scenario = Scenario::from_toml(MINIMAL).unwrap();
    assert_eq!((scenario.loop_length, scenario.seed), (Span::from_millis(120_000), 1));
    assert_eq!(scenario.world, WorldConfig::Crossing(CrossingConfig::default()));
    let [car, unit] = &scenario.agents[..] else { panic!("two agents") };
    assert_eq!(car.station, Station::Driving(Route::Block(0)));
    assert_eq!((car.sensor.field_of_view.range_min_m, unit.sensor.field_of_view.range_min_m), (2.5, 0.0));
    for (agent, declared) in [(car, [0.5, 0.5, 50.0]), (unit, [0.02, 0.02, 0.001])] {
        let Accuracy { position_m, yaw_rad, clock_s } = agent.sensor.accuracy;
        let found = [position_m, yaw_rad.to_degrees(), 1e3 * clock_s];
        assert!(found.iter().zip(declared).all(|(f, d)| (f / d - 1.0).abs() < 1e-12), "{found:?}");
        assert_eq!((agent.sensor.clock, agent.sensor.pose_error), (ClockError::default(), None));
        assert_eq!((agent.sending.transmit, agent.sending.rule), (Transmit::Immediately, SendRule::Periodic));
        assert_eq!(
            (&agent.sending.sensing, agent.sensor.phase),
            (&Delay::constant(0.0), Phase::Fixed(Span::ZERO))
        );
    }
    let Station::Fixed(Pose { x, y, yaw }) = unit.station else { panic!("it stands") };
    assert_eq!((x, y), (1.0, 2.0));
    assert!((yaw + std::f64::consts::FRAC_PI_2).abs() < 1e-12, "{yaw} is wrapped");
}

#[test]
fn the_table_of_the_hub_is_not_interpreted() {
    let text = format!("{MINIMAL}\n[hub]\nanything = [1, 2]\n");
    assert!(Scenario::from_toml(&text).unwrap().hub.contains_key("anything"));
}

#[test]
fn own_noise_numbers_are_read_in_their_units() {
    let table = r#"id = "a"
noise = { position_m = 0.3, position_per_m = 0.02, yaw_deg = 90, yaw_deg_per_m = 0.1, size = 0.3 }"#;
    let noise = Scenario::from_toml(&MINIMAL.replace(r#"id = "a""#, table)).unwrap().agents[0].sensor.noise;
    assert_eq!((noise.position_m, noise.position_per_m), (0.3, 0.02));
    assert!((noise.yaw_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    assert_eq!((noise.size.sigma, noise.size.lower), (0.3, 0.1));
}

/// The agent `b` of the minimal scenario with these lines.
fn with(lines: &str) -> AgentConfig {
    let text = MINIMAL.replace(r#"id = "b""#, &format!("id = \"b\"\n{lines}"));
    Scenario::from_toml(&text).unwrap().agents.remove(1)
}

#[test]
fn clocks_poses_and_times_are_read_in_their_units() {
    let agent = with(
        "clock = { offset_ms = -50, drift_ppm = 10 }
pose_error = { position_m = 0.2, yaw_deg = 90, correlation_s = 5, bias_x_m = 0.3, bias_y_m = -0.4, bias_yaw_deg = 180 }
accuracy = { position_m = 1, clock_ms = 2 }
sensing_ms = 60.5
phase_ms = \"random\"
transmit = { period_ms = 100, phase_ms = 30 }
send = \"etsi\"",
    );
    assert_eq!(agent.sensor.clock, ClockError { offset: Span::from_millis(-50), drift_ppm: 10.0 });
    let error = agent.sensor.pose_error.unwrap();
    assert_eq!((error.position_m, error.correlation_s, error.bias.x, error.bias.y), (0.2, 5.0, 0.3, -0.4));
    assert!((error.yaw_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    assert!((error.bias.yaw - std::f64::consts::PI).abs() < 1e-12);
    assert_eq!((agent.sensor.accuracy.position_m, agent.sensor.accuracy.clock_s), (1.0, 0.002));
    assert_eq!((agent.sending.sensing, agent.sensor.phase), (Delay::constant(0.0605), Phase::Random));
    let phase = Phase::Fixed(Span::from_millis(30));
    assert_eq!(agent.sending.transmit, Transmit::Slotted { period: Span::from_millis(100), phase });
    assert_eq!(agent.sending.rule, SendRule::Etsi);
}

#[test]
fn a_sensors_delay_has_the_names_that_links_have() {
    let agent = with("sensing_ms = \"custom:delay=60ms,jitter=10ms\"");
    assert_eq!(agent.sending.sensing, Delay::Normal { mean_s: 0.06, sigma_s: 0.01 });
}

#[test]
fn the_older_name_of_the_declared_accuracy_is_still_read() {
    assert_eq!(with("self_report = { yaw_deg = 2 }"), with("accuracy = { yaw_deg = 2 }"));
}

#[test]
fn v2xvits_noisy_link_brings_its_pose_noise_unless_the_agent_has_its_own() {
    let published = with("link = \"v2xvit-noisy\"").sensor.pose_error.unwrap();
    assert_eq!((published.position_m, published.correlation_s, published.bias), (0.2, 0.0, Pose::default()));
    assert!((published.yaw_rad.to_degrees() - 0.2).abs() < 1e-12);
    let own = with("link = \"v2xvit-noisy\"\npose_error = {}");
    assert_eq!(own.sensor.pose_error, Some(PoseError::default()));
    assert_eq!(with("link = \"lte-uu\"").sensor.pose_error, None);
}

#[test]
fn a_missing_file_is_named() {
    let message = Scenario::load("/nowhere/x.toml").unwrap_err().to_string();
    assert!(message.contains("/nowhere/x.toml") && message.contains("cannot read"), "{message}");
}

#[test]
fn unknown_fields_and_wrong_types_are_named_with_their_line() {
    let cases = [
        ("[world]", "[world]\ntraffik = 1", ["line 4", "traffik"]),
        (r#"id = "b""#, "id = \"b\"\nrate = 10", ["line 11", "rate"]),
        (r#"kind = "crossing""#, r#"kind = "village""#, ["line 4", "village"]),
        (r#"id = "b""#, "id = \"b\"\nnoise = \"N4\"", ["line 11", "N4"]),
        (r#"id = "b""#, "id = \"b\"\nnoise = { position_m = 1, foo = 2 }", ["line 11", "foo"]),
        (r#"id = "b""#, "id = \"b\"\nlink = { delay_ms = \"long\" }", ["line 11", "long"]),
        (r#"id = "b""#, "id = \"b\"\nlink = \"custom:loss=7\"", ["line 11", "loss is \"7\""]),
        (r#"id = "b""#, "id = \"b\"\nphase_ms = \"often\"", ["line 11", "often"]),
        (
            r#"id = "b""#,
            "id = \"b\"\nsensing_ms = \"pc5\"",
            ["line 11", "sensing is \"pc5\", expected a delay alone"],
        ),
        (r#"id = "b""#, "id = \"b\"\ntransmit = \"later\"", ["line 11", "later"]),
        (r#"id = "b""#, "id = \"b\"\nsend = \"always\"", ["line 11", "always"]),
        (r#"id = "b""#, "id = \"b\"\nclock = { skew = 1 }", ["line 11", "skew"]),
        (r#"id = "b""#, "id = \"b\"\naccuracy = {}\nself_report = {}", ["duplicate", "accuracy"]),
        (r#"kind = "roadside-unit""#, "", ["line 9", "kind"]),
        ("x = 1", "x = 1, z = 4", ["line 12", "z"]),
        ("name =", "name", ["line 2", "="]),
    ];
    for (from, to, expected) in cases {
        let message = refusal(from, to);
        for part in expected {
            assert!(message.contains(part), "{part:?} is not in {message}");
        }
    }
}

#[test]
fn invalid_values_are_named_by_field_and_value() {
    let id_b = r#"id = "b""#;
    let cases = [
        (id_b, "id = \"b\"\nrate_hz = 0", "agents[1].rate_hz is 0, expected 0.1 to 1000"),
        (id_b, "id = \"b\"\nrate_hz = nan", "agents[1].rate_hz is NaN"),
        (id_b, "id = \"a\"", "agents[1].id is \"a\", expected an id that no other agent has"),
        (id_b, "id = \"a b\"", "agents[1].id is \"a b\""),
        (id_b, "id = \"b\"\nphase_ms = -1", "agents[1].phase_ms is -1"),
        (id_b, "id = \"b\"\ndetection_probability = 1.2", "agents[1].detection_probability is 1.2"),
        (id_b, "id = \"b\"\nclutter_per_frame = -1", "agents[1].clutter_per_frame is -1"),
        (id_b, "id = \"b\"\nlink = { loss = 2 }", "agents[1].link.loss is 2"),
        (id_b, "id = \"b\"\nlink = { loss = 0.9, burst = 3 }", "agents[1].link.burst is 3"),
        (id_b, "id = \"b\"\nlink = { jitter_ms = -2 }", "agents[1].link.jitter_ms is -2"),
        (id_b, "id = \"b\"\nfield_of_view = { range_max_m = 0 }", "agents[1].field_of_view.range_max_m is 0"),
        (id_b, "id = \"b\"\nfield_of_view = { width_deg = 400 }", "agents[1].field_of_view.width_deg is 400"),
        (
            id_b,
            "id = \"b\"\naccuracy = { position_m = 0 }",
            "agents[1].accuracy.position_m is 0, expected 0.001",
        ),
        (id_b, "id = \"b\"\naccuracy = { clock_ms = -1 }", "agents[1].accuracy.clock_ms is -1"),
        (
            id_b,
            "id = \"b\"\nclock = { offset_ms = 1e6 }",
            "agents[1].clock.offset_ms is 1000000, expected -60000",
        ),
        (id_b, "id = \"b\"\nclock = { drift_ppm = 2000 }", "agents[1].clock.drift_ppm is 2000"),
        (
            id_b,
            "id = \"b\"\npose_error = { yaw_deg = -1 }",
            "agents[1].pose_error.yaw_deg is -1, expected 0 to 180",
        ),
        (
            id_b,
            "id = \"b\"\npose_error = { bias_x_m = 200 }",
            "agents[1].pose_error.bias_x_m is 200, expected -100",
        ),
        (
            id_b,
            "id = \"b\"\npose_error = { correlation_s = nan }",
            "agents[1].pose_error.correlation_s is NaN",
        ),
        (id_b, "id = \"b\"\nsensing_ms = -5", "agents[1].sensing_ms is -5, expected 0 to 10000"),
        (
            id_b,
            "id = \"b\"\ntransmit = { period_ms = 0 }",
            "agents[1].transmit.period_ms is 0, expected 1 to",
        ),
        (
            id_b,
            "id = \"b\"\ntransmit = { period_ms = 10, phase_ms = -1 }",
            "agents[1].transmit.phase_ms is -1, expected 0 to 60000 or \"random\"",
        ),
        (id_b, "id = \"b\"\nroute = \"block-ne\"", "agents[1] is with both pose and route"),
        ("block-ne", "main-street", "agents[0].route is \"main-street\", expected block-ne"),
        ("block-ne", "service-south", "agents[0].route is \"service-south\", expected block-ne"),
        ("route = \"block-ne\"", "", "agents[0] is without pose and route"),
        ("x = 1,", "x = inf,", "agents[1].pose.x is inf"),
        ("[world]", "loop_s = 5\n[world]", "loop_s is 5, expected 100 to 3600"),
        ("[world]", "map_frame = \"a/b\"\n[world]", "map_frame is \"a/b\""),
        ("[world]", "[world]\ntraffic = 2", "world.traffic is 2, expected 0 to 1"),
        ("[world]", "[world]\nparked = 1000", "world.parked is 1000, expected at most 120"),
        ("[world]", "[world]\nlanes = 2", "world.lanes is 2, expected no such field in a crossing"),
        ("[world]", "[world]\ntrafic = 1", "unknown field `trafic` (did you mean `traffic`?)"),
    ];
    for (from, to, expected) in cases {
        let message = refusal(from, to);
        assert!(message.contains(expected), "{expected:?} is not in {message}");
    }
}

#[test]
fn noise_that_the_wire_could_not_carry_is_refused() {
    let with = |numbers: &str| refusal(r#"id = "b""#, &format!("id = \"b\"\nnoise = {{ {numbers} }}"));
    let zero = with("position_m = 0, position_per_m = 0, yaw_deg = 1, yaw_deg_per_m = 0, size = 0.1");
    assert!(zero.contains("agents[1].noise.position_m is 0"), "{zero}");
    let huge = with("position_m = 1, position_per_m = 0.5, yaw_deg = 1, yaw_deg_per_m = 0, size = 0.1");
    assert!(huge.contains("agents[1].noise is 31 m"), "{huge}");
    let lower = with(
        "position_m = 1, position_per_m = 0, yaw_deg = 1, yaw_deg_per_m = 0, size = 0.1, size_lower = 1",
    );
    assert!(lower.contains("agents[1].noise.size_lower is 1"), "{lower}");
}

#[test]
fn a_route_has_a_limited_number_of_agents() {
    let another = |id| format!("[[agents]]\nid = \"{id}\"\nkind = \"vehicle\"\nroute = \"block-ne\"\n");
    let two = format!("{MINIMAL}{}", another("c"));
    assert!(Scenario::from_toml(&two).is_ok());
    let message = Scenario::from_toml(&format!("{two}{}", another("d"))).unwrap_err().to_string();
    assert!(message.contains("agents[3].route") && message.contains("at most 2 agents"), "{message}");
}
