//! What is typed, and what it means.

use super::*;
use crate::baselines::Rule;
use crate::fusion::{Hypotheses, PRESETS, WindowConfig};
use crate::registration::Registration;

fn settings(text: &str) -> Result<HubSettings, SettingsError> {
    HubSettings::from_table(text.parse().expect("valid TOML"))
}

fn tracking(text: &str) -> TrackingConfig {
    match settings(text).unwrap().engine.fusion {
        Fusion::Tracking(tracking) => tracking,
        Fusion::Window(_) => panic!("{text} is no tracking"),
    }
}

#[test]
fn an_empty_table_is_the_default() {
    assert_eq!(settings(""), Ok(HubSettings::default()));
    assert_eq!(settings("").unwrap().engine, EngineConfig::new(HubId::new("hub").unwrap(), 0));
}

#[test]
fn typed_values_take_effect() {
    let settings = settings(
        "delta_max_ms = 700\nlag_ms = 250\npublish = { mode = \"fixed\", rate_hz = 20 }\n\
         [agents.cam]\nsigma_position_m = 1.5\n",
    )
    .unwrap();
    assert_eq!(settings.engine.delta_max, Span::from_millis(700));
    assert_eq!(settings.engine.fusion.lag(), Span::from_millis(250));
    assert_eq!(settings.publish, PublishMode::Fixed { interval: Span::from_millis(50) });
    let cam = AgentId::new("cam").unwrap();
    assert_eq!(settings.of_agent(&cam).report_defaults.sigma_position_m, 1.5);
    assert_eq!(settings.of_agent(&AgentId::new("x").unwrap()).report_defaults.sigma_position_m, 0.5);
}

#[test]
fn contributors_and_tiles_are_as_set() {
    let contributors = |text: &str| settings(text).unwrap().engine.contributors;
    assert_eq!(contributors(""), ContributorLimit::All);
    assert_eq!(contributors("contributors = \"all\""), ContributorLimit::All);
    assert_eq!(contributors("contributors = \"none\""), ContributorLimit::Newest(0));
    assert_eq!(contributors("contributors = 4"), ContributorLimit::Newest(4));
    let tiles = |text: &str| settings(text).unwrap().tiles;
    assert_eq!(tiles(""), None);
    let munich = tiles("tiles = { latitude_deg = 48.137, longitude_deg = 11.575 }").unwrap();
    assert_eq!(munich.zoom.get(), 16);
    let place = munich.plane.geodetic(0.0, 0.0);
    assert!((place.latitude_deg - 48.137).abs() < 1e-9 && (place.longitude_deg - 11.575).abs() < 1e-9);
}

#[test]
fn every_preset_is_a_method_of_the_hub() {
    for preset in PRESETS {
        let engine = settings(&format!("method = \"{}\"", preset.key)).unwrap().engine;
        assert_eq!(engine, HubSettings::default().engine.with_preset(preset), "{}", preset.key);
    }
}

#[test]
fn the_number_of_association_particles_is_as_set() {
    let count = |text: &str| tracking(text).tracker.hypotheses.count();
    assert_eq!([count(""), count("association_particles = 8")], [1, 8]);
    assert_eq!(tracking("association_particles = 0").tracker.hypotheses, Hypotheses::ONE);
}

#[test]
fn the_papers_methods_use_no_extension_unless_it_is_set() {
    let extras = |text: &str| {
        let tracking = tracking(text);
        [tracking.resolve_duplicates, tracking.tracker.reassociate]
    };
    assert_eq!([extras(""), extras("resolve_duplicates = false")], [[true, true], [false, true]]);
    for method in ["unikf-paper", "unikf-literal"] {
        let method = format!("method = \"{method}\"");
        assert_eq!(extras(&method), [false, false]);
        assert_eq!(extras(&format!("{method}\nreconsider = true")), [false, true]);
    }
}

#[test]
fn late_data_sets_the_policy_for_late_frames_and_for_newer_data() {
    let late = |text: &str| (settings(text).unwrap().engine.late_frames, tracking(text).tracker.rollback);
    assert_eq!(late(""), (LateFrames::Fuse, Rollback::Replay));
    assert_eq!(late("method = \"unikf-literal\""), (LateFrames::Fuse, Rollback::Only));
    assert_eq!(late("late_data = \"rollback-only\""), (LateFrames::Fuse, Rollback::Only));
    assert_eq!(late("late_data = \"drop\""), (LateFrames::Drop, Rollback::Replay));
    assert_eq!(late("late_data = \"ignore-delay\""), (LateFrames::IgnoreDelay, Rollback::Replay));
}

#[test]
fn epsilon_s_applies_to_the_filter_of_the_paper_only() {
    let synchronous = |text: &str| tracking(text).tracker.synchronous;
    assert_eq!(synchronous("synchronous_ms = 20"), Span::ZERO);
    assert_eq!(synchronous("synchronous_ms = 20\nmethod = \"unikf-paper\""), Span::from_millis(20));
}

#[test]
fn rules_without_memory_take_their_own_settings() {
    let text = "method = \"nms\"\noverlap = 0.3\nwindow_ms = 40\nmain_agent = \"ego\"";
    let expected = WindowConfig {
        rule: Rule::Nms { overlap: 0.3 },
        window: Span::from_millis(40),
        main_agent: Some(AgentId::new("ego").unwrap()),
    };
    assert_eq!(settings(text).unwrap().engine.fusion, Fusion::Window(expected));
}

#[test]
fn a_hub_can_be_limited_to_listed_agents() {
    let listens = |text: &str, agent: &str| settings(text).unwrap().listens_to(&AgentId::new(agent).unwrap());
    assert!(listens("", "ego") && listens("only_agents = [\"ego\"]", "ego"));
    assert!(!listens("only_agents = [\"ego\"]", "rsu"));
}

#[test]
fn prior_knowledge_can_be_switched_off() {
    let priors = |text: &str| (tracking(text).tracker.class_motion, tracking(text).class_size_priors);
    assert_eq!(priors("class_priors = false"), (false, false));
    assert_eq!(priors("class_size_priors = false"), (true, false));
    assert!(!settings("debias_sizes = false").unwrap().engine.debias_sizes);
}

#[test]
fn registration_is_the_methods_default_unless_it_is_set() {
    let registration = |text: &str| settings(text).unwrap().engine.fusion.registration();
    assert_eq!(registration(""), Registration::Correct);
    assert_eq!(registration("registration = \"estimate\""), Registration::Estimate);
    assert_eq!(registration("method = \"unikf-paper\""), Registration::Off);
    let both = "method = \"unikf-paper\"\nregistration = \"correct\"";
    assert_eq!(registration(both), Registration::Correct);
}

#[test]
fn the_listed_keys_are_the_fields_of_the_table() {
    let error = serde_json::from_str::<HubTable>(r#"{"?": 0}"#).unwrap_err().to_string();
    let fields: Vec<&str> = error.split('`').skip(3).step_by(2).collect();
    assert_eq!(fields, HubTable::KEYS);
}

#[test]
fn errors_name_the_field_and_the_value() {
    let cases = [
        ("delta_max = 5", "delta_max"),
        ("delta_max_ms = -5", "delta_max_ms is -5"),
        ("gate = nan", "gate is NaN"),
        ("method = \"wbfs\"", "unknown method `wbfs`, expected one of `ours`"),
        ("window_ms = -1", "window_ms is -1"),
        ("lag_ms = -1", "lag_ms is -1, expected 0 to 10000"),
        ("lag_ms = 10001", "lag_ms is 10001"),
        ("lag_ms = 500\nmethod = \"nms\"", "lag_ms and hub.lagged are for methods with memory"),
        ("lagged = { lag_ms = 0 }", "lagged.lag_ms is 0, expected 1 to 10000"),
        ("lagged = { rate_hz = 0 }", "lagged.rate_hz is 0, expected 0.1 to 100"),
        ("lagged = { lag = 1 }", "unknown field `lag`"),
        ("lagged = {}\nmethod = \"nms\"", "methods with memory"),
        ("lagged = {}\nassociation_particles = 8", "association_particles = 0, not 8"),
        ("lag_ms = 500\nassociation_particles = 8", "hub.association_particles = 0, not 8"),
        ("association_particles = 1", "association_particles is 1, expected 0, or 2 to 64"),
        ("association_particles = 65", "association_particles is 65"),
        ("association_particles = -8", "-8"),
        ("publish = { mode = \"sometimes\" }", "sometimes"),
        ("publish = { mode = \"fixed\", rate_hz = 0 }", "publish.rate_hz is 0"),
        ("registration = \"on\"", "unknown variant `on`, expected one of `off`"),
        ("agents.\"a/b\" = {}", "a/b"),
        ("contributors = \"some\"", "string \"some\", expected \"all\", \"none\" or a number from 0 to 1024"),
        ("contributors = \"some\"", "contributors"),
        ("contributors = 1025", "1025"),
        ("contributors = -1", "-1"),
        ("contributors = 1.5", "1.5"),
        ("tiles = {}", "latitude_deg"),
        (
            "tiles = { latitude_deg = 90, longitude_deg = 0 }",
            "tiles.latitude_deg is 90, expected -85.05 to 85.05",
        ),
        ("tiles = { latitude_deg = 0, longitude_deg = 181 }", "tiles.longitude_deg is 181"),
        ("tiles = { latitude_deg = 0, longitude_deg = 0, zoom = 27 }", "tiles.zoom is 27, expected 1 to 26"),
        ("tiles = { latitude_deg = 0, longitude_deg = 0, zoom = 0 }", "tiles.zoom is 0"),
        (
            "tiles = { latitude = 0, longitude_deg = 0 }",
            "unknown field `latitude` (did you mean `latitude_deg`?)",
        ),
        (
            "only_agent = [\"ego\"]",
            "unknown field `only_agent` (did you mean `only_agents`?), expected one of `id`",
        ),
    ];
    for (text, named) in cases {
        let message = settings(text).unwrap_err().to_string();
        assert!(message.contains(named), "{message:?} should name {named:?}");
    }
}
