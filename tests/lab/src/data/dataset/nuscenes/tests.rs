//! Small tables, and errors in them.

use super::*;
use serde_json::{Value, json};
use std::path::PathBuf;
use v2x_agent::truth::ObjectId;
use v2x_common::class::Class;
use v2x_common::time::Span;

/// A folder of tables, removed at the end.
struct Tables(PathBuf);

impl Drop for Tables {
    fn drop(&mut self) {
        // At worst a temporary folder is left.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

impl Tables {
    /// Two scenes: a car and a person over two keyframes, and another car once.
    fn new(name: &str) -> Self {
        let root = std::env::temp_dir().join(format!("v2x-nuscenes-{}-{name}", std::process::id()));
        let tables = Self(root);
        std::fs::create_dir_all(tables.0.join("v1.0-tiny")).unwrap();
        let sample = |token: &str, scene: &str, us: i64| json!({"token": token, "scene_token": scene, "timestamp": us});
        let data = |sample: &str, sensor: &str, pose: &str, key: bool| {
            json!({"token": format!("d-{pose}"), "sample_token": sample, "calibrated_sensor_token": sensor,
                   "ego_pose_token": pose, "is_key_frame": key})
        };
        let at = |token: &str, x: f64| json!({"token": token, "translation": [x, 5.0, 0.0], "rotation": [0.0, 0.0, 0.0, 1.0]});
        let boxed = |token: &str, sample: &str, instance: &str, x: f64| {
            json!({"token": token, "sample_token": sample, "instance_token": instance, "translation": [x, 2.0, 1.0],
                   "size": [1.8, 4.5, 1.6], "rotation": [1.0, 0.0, 0.0, 0.0]})
        };
        tables.write("category", &json!([{"token": "c1", "name": "vehicle.car"}, {"token": "c2", "name": "human.pedestrian.adult"}]));
        tables.write("instance", &json!([{"token": "i1", "category_token": "c1"}, {"token": "i2", "category_token": "c2"}, {"token": "i3", "category_token": "c1"}]));
        tables.write(
            "scene",
            &json!([{"token": "s1", "name": "scene-0003"}, {"token": "s2", "name": "scene-0004"}]),
        );
        tables.write(
            "sample",
            &json!([sample("k2", "s1", 1_500_000), sample("k1", "s1", 1_000_000), sample("k3", "s2", 7)]),
        );
        tables.write(
            "sensor",
            &json!([{"token": "r1", "channel": "LIDAR_TOP"}, {"token": "r2", "channel": "CAM_FRONT"}]),
        );
        tables.write(
            "calibrated_sensor",
            &json!([{"token": "q1", "sensor_token": "r1"}, {"token": "q2", "sensor_token": "r2"}]),
        );
        tables.write(
            "sample_data",
            &json!([
                data("k1", "q1", "p1", true),
                data("k1", "q2", "p9", true),
                data("k1", "q1", "p8", false),
                data("k2", "q1", "p2", true),
                data("k3", "q1", "p3", true)
            ]),
        );
        tables.write(
            "ego_pose",
            &json!([at("p1", 1.0), at("p2", 2.0), at("p3", 3.0), at("p8", 8.0), at("p9", 9.0)]),
        );
        tables.write(
            "sample_annotation",
            &json!([
                boxed("a1", "k1", "i1", 10.0),
                boxed("a2", "k2", "i1", 12.0),
                boxed("a3", "k1", "i2", 20.0),
                boxed("a4", "k3", "i3", 30.0)
            ]),
        );
        tables
    }

    fn path(&self, table: &str) -> PathBuf {
        self.0.join("v1.0-tiny").join(format!("{table}.json"))
    }

    fn write(&self, table: &str, records: &Value) {
        std::fs::write(self.path(table), serde_json::to_string_pretty(records).unwrap()).unwrap();
    }

    /// Changes one field of one record.
    fn spoil(&self, table: &str, record: usize, field: &str, value: Value) {
        let text = std::fs::read_to_string(self.path(table)).unwrap();
        let mut records: Value = serde_json::from_str(&text).unwrap();
        records[record][field] = value;
        self.write(table, &records);
    }

    fn load(&self, split: &Split) -> Result<Vec<Scene>, NuscenesError> {
        load(&self.0, "v1.0-tiny", split)
    }

    /// The whole chain of causes.
    fn error(&self) -> String {
        format!("{:#}", anyhow::Error::from(self.load(&Split::All).unwrap_err()))
    }
}

#[test]
fn tables_become_scenes() {
    let tables = Tables::new("good");
    let scenes = tables.load(&Split::All).unwrap();
    assert_eq!(scenes.len(), 2);
    let [first, second] = &scenes[0].keyframes[..] else { panic!("two keyframes") };
    assert_eq!((first.at, second.at), (Span::ZERO, Span::from_millis(500)), "sorted by time");
    assert_eq!((first.ego.x, second.ego.x), (1.0, 2.0), "the lidar's key frames");
    assert!((first.ego.yaw - std::f64::consts::PI).abs() < 1e-12);
    assert_eq!((first.objects.len(), second.objects.len()), (2, 1));
    let car = first.objects[0];
    assert_eq!((car.class, car.bev.x, car.bev.w, car.bev.d), (Class::Car, 10.0, 1.8, 4.5));
    assert_eq!(second.objects[0].id, car.id);
    assert_eq!(first.objects[1].class, Class::Adult);
    assert!(scenes[0].is_moving(car.id) && !scenes[0].is_moving(ObjectId(1)));
}

#[test]
fn splits_choose_scenes() {
    let tables = Tables::new("splits");
    let names =
        |split: Split| tables.load(&split).map(|scenes| scenes.into_iter().map(|scene| scene.name).collect());
    assert_eq!(names(Split::Val).unwrap(), ["scene-0003".to_owned()] as [String; 1]);
    let named: Vec<String> = names("scene-0004".parse().unwrap()).unwrap();
    assert_eq!(named, ["scene-0004"]);
    let nothing: Result<Vec<String>, _> = names(Split::Named(vec!["scene-9".to_owned()]));
    assert!(matches!(nothing, Err(NuscenesError::NoScenes { .. })));
}

#[test]
fn errors_name_table_record_and_field() {
    for (table, record, field, value, message) in [
        (
            "category",
            1,
            "name",
            json!("ufo"),
            "table category, record c2, field name: \"ufo\", expected one of",
        ),
        (
            "instance",
            0,
            "category_token",
            json!("c9"),
            "table instance, record i1, field category_token: \"c9\"",
        ),
        ("sample", 0, "timestamp", Value::Null, "table sample, record k2, field timestamp: null"),
        ("sample_data", 0, "is_key_frame", json!(1), "table sample_data, record d-p1, field is_key_frame: 1"),
        ("ego_pose", 1, "rotation", json!([1.0]), "table ego_pose, record p2, field rotation: [1.0]"),
        (
            "sample_annotation",
            3,
            "size",
            json!([0.0, 1, 1]),
            "table sample_annotation, record a4, field size: [0.0,1,1]",
        ),
        (
            "sample_annotation",
            1,
            "instance_token",
            json!("i9"),
            "table sample_annotation, record a2, field instance_token",
        ),
        (
            "sample_data",
            3,
            "ego_pose_token",
            json!("p0"),
            "table sample_data, record d-p2, field ego_pose_token: \"p0\", expected a token of table ego_pose",
        ),
        (
            "sample_data",
            3,
            "is_key_frame",
            json!(false),
            "table sample, record k2, field token: no key frame",
        ),
    ] {
        let tables = Tables::new(&format!("{table}-{field}"));
        tables.spoil(table, record, field, value);
        let error = tables.error();
        assert!(error.starts_with(message), "{error}");
    }
}

#[test]
fn missing_and_broken_tables_are_named() {
    let tables = Tables::new("missing");
    std::fs::remove_file(tables.path("ego_pose")).unwrap();
    assert!(tables.error().starts_with("cannot read table ego_pose"), "{}", tables.error());
    let tables = Tables::new("broken");
    std::fs::write(tables.path("sample"), "[{\"token\": \"k1\", ").unwrap();
    let error = tables.error();
    assert!(error.starts_with("table sample, record 0") && error.contains("line 1"), "{error}");
}
