use super::*;
use crate::sending::Fate;
use crate::sensor::{Boot, Sensor};
use crate::truth::ObjectId;
use crate::world::{RoadKind, World};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use v2x_common::class::Class;
use v2x_common::time::{Span, Timestamp};

const SCENARIO: &str = r#"
name = "recorded"
[world]
kind = "trajectories"
file = "traffic.csv"
[[agents]]
id = "ego"
kind = "vehicle"
ride = "veh1"
[[agents]]
id = "rsu"
kind = "roadside-unit"
pose = { x = 5, y = 5 }
"#;

const TRAFFIC: &str = "t,id,class,x,y,yaw,w,d\n\
    100,veh1,truck,0,0,0,2.5,8\n101,veh1,truck,10,0,0,2.5,8\n102,veh1,truck,20,0,0,2.5,8\n\
    100,veh2,car,0,4,0,1.8,4\n102,veh2,car,0,4,0,1.8,4\n104,veh2,car,0,4,0,1.8,4\n";

/// A folder with the traffic, of one test's own.
fn folder(test: &str, traffic: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("v2x-recorded-{test}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("traffic.csv"), traffic).unwrap();
    folder
}

fn read(test: &str, text: &str) -> Result<Scenario, ScenarioError> {
    let folder = folder(test, TRAFFIC);
    let scenario = Scenario::from_toml_with(text, &Files::in_folder(&folder));
    std::fs::remove_dir_all(folder).unwrap();
    scenario
}

fn refusal(from: &str, to: &str) -> String {
    assert!(SCENARIO.contains(from), "{from}");
    let name: String = to.chars().filter(char::is_ascii_alphanumeric).take(40).collect();
    read(&name, &SCENARIO.replacen(from, to, 1)).unwrap_err().to_string()
}

const START: Timestamp = Timestamp::from_nanos(1_000_000_000_000);

fn sensor(scenario: &Scenario, agent: usize) -> Sensor {
    let world = Arc::new(scenario.world(1));
    scenario.agents[agent].sensor(world, Boot { seed: 1, epoch: 1, start: START }).unwrap()
}

fn ids(world: &World, seconds: f64) -> Vec<u32> {
    let mut objects = Vec::new();
    world.objects_at(Span::from_secs_f64(seconds), &mut objects);
    objects.iter().map(|object| object.id.0).collect()
}

#[test]
fn the_world_is_the_recording_from_time_zero_and_repeats_itself_by_default() {
    let scenario = read("repeats", SCENARIO).unwrap();
    assert_eq!(scenario.loop_length, Span::from_millis(4000));
    let world = scenario.world(1);
    assert_eq!((ids(&world, 0.0), ids(&world, 1.5), ids(&world, 3.0)), (vec![1, 2], vec![1, 2], vec![2]));
    assert_eq!(ids(&world, 4.0 + 1.5), [1, 2]);
    let once =
        read("once", &SCENARIO.replace("traffic.csv\"", "traffic.csv\"\nloop = false")).unwrap().world(1);
    assert_eq!((ids(&once, 4.0), ids(&once, 5.5), ids(&once, -1.0)), (vec![2], vec![], vec![]));
}

#[test]
fn an_agent_that_rides_is_its_object_and_does_not_detect_itself() {
    let scenario = read("rides", SCENARIO).unwrap();
    let ego = sensor(&scenario, 0);
    assert_eq!(ego.own_object(), Some(ObjectId(1)));
    let body = ego.description().body.unwrap();
    assert_eq!((body.class, body.w, body.d), (Class::Truck, 2.5, 8.0));
    let truth = ego.world().agent_pose(0, Span::from_millis(500)).unwrap();
    assert_eq!((truth.x, truth.y), (5.0, 0.0));
    let seen: Vec<_> =
        (0..20).flat_map(|sequence| ego.observe(sequence).identities.objects).flatten().collect();
    // Itself once in each frame, by its report.
    assert_eq!(seen.iter().filter(|id| **id == ObjectId(1)).count(), 20);
    assert!(seen.contains(&ObjectId(2)));
    let mut objects = Vec::new();
    ego.objects_at_capture(3, &mut objects);
    assert_eq!(objects.len(), 2, "its body is not there twice");
}

#[test]
fn an_agent_whose_object_is_absent_sends_nothing() {
    let scenario = read("absent", SCENARIO).unwrap();
    let ego = sensor(&scenario, 0);
    assert!(ego.is_present(20) && !ego.is_present(21) && !ego.is_present(39) && ego.is_present(40));
    let absent = ego.observe(30).frame;
    assert_eq!((absent.sensor_pose, absent.detections.len()), (None, 0));
    let boot = Boot { seed: 1, epoch: 1, start: START };
    let mut sender = scenario.agents[0].sender(Arc::new(scenario.world(1)), boot).unwrap();
    assert_eq!(sender.send(30), Fate::Withheld);
    assert!(matches!(sender.send(41), Fate::Arrives { .. }));
}

#[test]
fn an_agent_follows_waypoints_turns_at_them_and_stands_before_and_after() {
    let way = "waypoints = [[1, 0, 0], [2, 10, 0], [3, 10, 10]]";
    let scenario = read("waypoints", &SCENARIO.replace("ride = \"veh1\"", way)).unwrap();
    let world = scenario.world(1);
    let at = |seconds: f64| world.agent_pose(0, Span::from_secs_f64(seconds)).unwrap();
    let is_near = |seconds: f64, (x, y, yaw_deg): (f64, f64, f64)| {
        let pose = at(seconds);
        let is_near = pose.distance_to(x, y) < 1e-6 && (pose.yaw.to_degrees() - yaw_deg).abs() < 1e-6;
        assert!(is_near, "{pose:?} at {seconds} s is not {x}, {y}, {yaw_deg}");
    };
    is_near(0.0, (0.0, 0.0, 0.0));
    is_near(1.5, (5.0, 0.0, 0.0));
    is_near(2.5, (10.0, 5.0, 90.0));
    is_near(3.9, (10.0, 10.0, 90.0));
    let turning = at(2.0);
    assert!(
        (turning.yaw.to_degrees() - 45.0).abs() < 1e-6 && turning.distance_to(10.0, 0.0) < 2.0,
        "{turning:?}"
    );
    let crossing = "name = \"c\"\n[world]\nkind = \"crossing\"\n[[agents]]\nid = \"a\"\nkind = \"vehicle\"\n";
    assert!(Scenario::from_toml(&format!("{crossing}{way}\n")).is_ok(), "in every world");
}

#[test]
fn coordinates_of_the_scenario_are_those_of_the_file() {
    let folder = folder("origin", "t,id,class,x,y\n0,veh1,car,691600,5334700\n4,veh1,car,691640,5334700\n");
    let text = SCENARIO.replace("pose = { x = 5, y = 5 }", "pose = { x = 691605, y = 5334705 }");
    let text = format!(
        "{text}[[world.road]]\npolygon = [[691600, 5334700], [691610, 5334700], [691610, 5334710]]\n"
    );
    let scenario = Scenario::from_toml_with(&text, &Files::in_folder(&folder)).unwrap();
    std::fs::remove_dir_all(folder).unwrap();
    let pose = scenario.world(1).agent_pose(1, Span::ZERO).unwrap();
    assert_eq!((pose.x, pose.y), (5.0, 5.0));
    let roads = scenario.world.roads();
    assert_eq!((roads[0].kind, roads[0].points[1]), (RoadKind::Area, (10.0, 0.0)));
}

#[test]
fn areas_lie_below_lines_and_markings_above() {
    let roads = "[[world.road]]\nkind = \"marking\"\nline = [[0, 0], [1, 0]]\n[[world.road]]\nline = [[0, 0], [1, 0]]\n\
                 [[world.road]]\npolygon = [[0, 0], [1, 0], [1, 1]]\n";
    let roads = read("roads", &format!("{SCENARIO}{roads}")).unwrap().world.roads();
    let found: Vec<_> = roads.iter().map(|road| (road.kind, road.width_m)).collect();
    assert_eq!(found, [(RoadKind::Area, 0.0), (RoadKind::Surface, 3.5), (RoadKind::Marking, 0.15)]);
}

#[test]
fn every_mistake_names_its_line_and_what_exists() {
    let file = "file = \"traffic.csv\"";
    let ride = "ride = \"veh1\"";
    let cases: &[(&str, &str, &[&str])] = &[
        (
            "\"trajectories\"",
            "\"csv\"",
            &["line 4, column 8", "`csv`", "`crossing`, `highway`, `trajectories`"],
        ),
        (file, "", &["line 3, column 1: world.file is missing", "columns t, id, class, x, y"]),
        (file, "file = \"other.csv\"", &["line 5, column 8: world.file is \"other.csv\"", "traffic.csv"]),
        (
            file,
            "file = \"traffic.csv\"\ntraffic = 0.5",
            &["line 6", "world.traffic is 0.5, expected no such field with recorded"],
        ),
        (
            file,
            "file = \"traffic.csv\"\nfrom_s = 3\nto_s = 2",
            &["line 7", "world.to_s is 2, expected more than from_s"],
        ),
        (file, "file = \"traffic.csv\"\nmax_gap_s = 0", &["line 6", "world.max_gap_s is 0"]),
        (
            file,
            "file = \"traffic.csv\"\nclasses = { a = \"cart\" }",
            &["line 6", "world.classes.a is \"cart\"", "vehicle.car"],
        ),
        (file, "file = \"traffic.csv\"\nscene = \"s\"", &["traffic.csv: has no scene \"s\"; it has none"]),
        (
            "[world]",
            "loop_s = 120\n[world]",
            &["line 3", "loop_s is 120, expected none: recorded traffic is as long"],
        ),
        (ride, "ride = \"veh9\"", &["line 9, column 8: agents[0].ride is \"veh9\"", "veh1, veh2"]),
        (ride, "route = \"block-ne\"", &["agents[0].route is \"block-ne\"", "use ride, pose or waypoints"]),
        (ride, "", &["agents[0] is without pose, ride and waypoints, expected one of them"]),
        (ride, "ride = \"veh1\"\npose = { x = 1, y = 1 }", &["agents[0] is with both pose and ride"]),
        (ride, "waypoints = [[0, 1, 1]]", &["agents[0].waypoints is 1 points, expected two or more"]),
        (
            ride,
            "waypoints = [[0, 1, 1], [0, 2, 2]]",
            &["line 9", "[0.0, 2.0, 2.0], expected [t_s, x, y] with t_s rising from 0 to at most 4"],
        ),
        (
            "pose = { x = 5, y = 5 }",
            "ride = \"veh1\"",
            &["agents[1].ride is given, expected none: only vehicles drive"],
        ),
        (
            "[[agents]]",
            "[[world.road]]\nline = [[0, 0]]\n[[agents]]",
            &["line 7", "world.road[0].line is 1 points"],
        ),
        (
            "[[agents]]",
            "[[world.road]]\nwidth_m = 1\n[[agents]]",
            &["world.road[0] is without line and polygon"],
        ),
    ];
    for (from, to, expected) in cases {
        let message = refusal(from, to);
        for part in *expected {
            assert!(message.contains(part), "{part:?} is not in {message}");
        }
    }
    let crossing = "name = \"c\"\n[world]\nkind = \"crossing\"\nfile = \"a.csv\"\nagents = []\n";
    let message = Scenario::from_toml(crossing).unwrap_err().to_string();
    assert!(message.contains("agents"), "{message}");
}

#[test]
fn a_mistake_in_the_traffic_names_its_file_line_and_column() {
    let folder = folder("bad-traffic", &TRAFFIC.replace("101,veh1,truck,10", "101,veh1,truck,ten"));
    std::fs::write(folder.join("mine.toml"), SCENARIO).unwrap();
    let message = Scenario::load(folder.join("mine.toml")).unwrap_err().to_string();
    std::fs::remove_dir_all(&folder).unwrap();
    let expected =
        format!("{}: line 3, column x: \"ten\", expected a coordinate", folder.join("traffic.csv").display());
    assert!(message.contains(&expected), "{message}");
}

#[test]
fn the_shipped_example_is_valid() {
    let path: PathBuf =
        [env!("CARGO_MANIFEST_DIR"), "../deploy/examples/recorded/junction.toml"].iter().collect();
    let scenario = Scenario::load(&path).unwrap();
    let recorded = scenario.world.recorded().unwrap();
    assert_eq!((recorded.traffic.objects.len(), scenario.agents.len()), (12, 3));
    assert_eq!(recorded.traffic.remarks.warnings, [""; 0]);
    assert_eq!(scenario.files[0].path, path.parent().unwrap_or(Path::new("")).join("junction.csv"));
}
