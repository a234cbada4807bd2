//! Small tables in memory.

use super::*;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{self, BufRead, Cursor};

/// Two scenes: a car that drives and a person that stands over three keyframes; another car once.
pub(crate) fn tables() -> BTreeMap<String, Value> {
    let table = |name: &str, records: Value| (name.to_owned(), records);
    let sample =
        |token: &str, scene: &str, us: i64| json!({"token": token, "scene_token": scene, "timestamp": us});
    let data = |sample: &str, pose: &str| {
        json!({"token": format!("d-{pose}"), "sample_token": sample, "calibrated_sensor_token": "q1",
               "ego_pose_token": pose, "is_key_frame": true})
    };
    let ego = |token: &str, x: f64| json!({"token": token, "translation": [x, 5.0, 0.0], "rotation": [0.0, 0.0, 0.0, 1.0]});
    let boxed = |token: &str, sample: &str, instance: &str, x: f64| {
        json!({"token": token, "sample_token": sample, "instance_token": instance, "translation": [x, 2.0, 1.0],
               "size": [1.8, 4.5, 1.6], "rotation": [1.0, 0.0, 0.0, 0.0]})
    };
    BTreeMap::from([
        table(
            "category",
            json!([{"token": "c1", "name": "vehicle.car"}, {"token": "c2", "name": "human.pedestrian.adult"},
                   {"token": "c3", "name": "flat.driveable_surface"}]),
        ),
        table(
            "instance",
            json!([{"token": "i1", "category_token": "c1"}, {"token": "i2", "category_token": "c2"},
                   {"token": "i3", "category_token": "c1"}]),
        ),
        table("scene", json!([{"token": "s1", "name": "scene-0003"}, {"token": "s2", "name": "scene-0004"}])),
        table(
            "sample",
            json!([
                sample("k2", "s1", 1_500_000),
                sample("k1", "s1", 1_000_000),
                sample("k3", "s1", 2_000_000),
                sample("m1", "s2", 7),
                sample("m2", "s2", 500_007)
            ]),
        ),
        table("sensor", json!([{"token": "r1", "channel": "LIDAR_TOP"}])),
        table("calibrated_sensor", json!([{"token": "q1", "sensor_token": "r1"}])),
        table(
            "sample_data",
            json!([data("k1", "p1"), data("k2", "p2"), data("k3", "p3"), data("m1", "p4"), data("m2", "p4")]),
        ),
        table("ego_pose", json!([ego("p1", 30.0), ego("p2", 25.0), ego("p3", 20.0), ego("p4", 3.0)])),
        table(
            "sample_annotation",
            json!([
                boxed("a1", "k1", "i1", 10.0),
                boxed("a2", "k2", "i1", 12.0),
                boxed("a3", "k3", "i1", 14.0),
                boxed("a4", "k1", "i2", 20.0),
                boxed("a5", "k3", "i2", 20.0),
                boxed("a6", "m1", "i3", 30.0)
            ]),
        ),
    ])
}

/// Opens such tables.
pub(crate) fn open(tables: &BTreeMap<String, Value>) -> impl Fn(&str) -> io::Result<Box<dyn BufRead>> {
    let texts: BTreeMap<_, _> =
        tables.iter().map(|(name, records)| (name.clone(), records.to_string())).collect();
    move |table| {
        let text = texts.get(table).ok_or(io::ErrorKind::NotFound)?;
        Ok(Box::new(Cursor::new(text.clone().into_bytes())))
    }
}

fn all(tables: &BTreeMap<String, Value>) -> Result<Vec<AnnotatedScene>, TableError> {
    scenes(&open(tables), &|_| true)
}

#[test]
fn a_scene_has_its_keyframes_in_order_of_time() {
    let tables = tables();
    assert_eq!(scene_names(&open(&tables)).unwrap(), ["scene-0003", "scene-0004"]);
    let scenes = all(&tables).unwrap();
    assert_eq!(scenes[0].instances, ["i1", "i2"]);
    let micros: Vec<_> = scenes[0].keyframes.iter().map(|keyframe| keyframe.at.as_micros()).collect();
    assert_eq!(micros, [1_000_000, 1_500_000, 2_000_000]);
}

#[test]
fn a_category_of_segmentation_is_wrong_only_where_an_object_is_of_it() {
    let mut tables = tables();
    assert!(all(&tables).is_ok());
    tables.get_mut("instance").unwrap()[0]["category_token"] = json!("c3");
    let message = all(&tables).unwrap_err().to_string();
    assert!(
        message.starts_with("table category, record c3, field name: \"flat.driveable_surface\""),
        "{message}"
    );
}

#[test]
fn two_keyframes_of_a_scene_at_one_time_are_refused() {
    let mut tables = tables();
    tables.get_mut("sample").unwrap()[2]["timestamp"] = json!(1_500_000);
    let message = all(&tables).unwrap_err().to_string();
    assert!(
        message.starts_with("table sample, record k3, field timestamp: 1500000, expected a time"),
        "{message}"
    );
}

#[test]
fn a_place_beyond_the_earth_and_a_quaternion_that_is_no_rotation_are_refused() {
    for (field, value) in [("translation", json!([1e9, 0.0, 0.0])), ("rotation", json!([0.0, 0.0, 0.0, 0.0]))]
    {
        let mut tables = tables();
        tables.get_mut("sample_annotation").unwrap()[0][field] = value;
        let message = all(&tables).unwrap_err().to_string();
        assert!(message.contains(&format!("field {field}: ")), "{message}");
    }
}
