//! Worlds that people bring in formats of their own: nuScenes' tables, CommonRoad, the laboratory's tables.

use crate::support::{folder, run, up_with};
use anyhow::{Context, ensure};
use serde_json::{Value, json};
use std::path::Path;
use v2x_common::wire;

/// A scenario that commonroad-io 2024.2 wrote (white space was removed): a car, a bus, a person, and a parked car.
const COMMONROAD: &str = include_str!("data/commonroad.xml");

fn names(text: &str, expected: &[&str]) -> anyhow::Result<()> {
    let missing: Vec<_> = expected.iter().filter(|part| !text.contains(**part)).collect();
    ensure!(missing.is_empty(), "{missing:?} is not in {text}");
    Ok(())
}

fn token(kind: &str, number: usize) -> String {
    format!("{kind}{number:04}")
}

fn at(x: f64, y: f64) -> Value {
    json!({"translation": [x, y, 0.0], "rotation": [1.0, 0.0, 0.0, 0.0]})
}

/// Adds the fields of the second record to the first one.
fn with(mut record: Value, more: &Value) -> Value {
    if let (Some(record), Some(more)) = (record.as_object_mut(), more.as_object()) {
        record.extend(more.clone());
    }
    record
}

/// Writes the tables of two scenes of nuScenes. In each of them the vehicle with the sensors follows a car for 10 s past a
/// parked truck.
fn write_nuscenes(folder: &Path) -> anyhow::Result<()> {
    const N: usize = 21;
    std::fs::create_dir_all(folder)?;
    let (mut samples, mut data, mut poses, mut boxes) = (vec![], vec![], vec![], vec![]);
    for number in 0..2 * N {
        #[expect(clippy::cast_precision_loss, reason = "a small number")]
        let x = 4.0 * (number % N) as f64 + 600.0;
        let sample = token("k", number);
        let scene = token("s", number / N);
        samples.push(json!({"token": sample, "scene_token": scene, "timestamp": 1_500_000_000_000_000_u64 + 500_000 * number as u64}));
        data.push(
            json!({"token": token("d", number), "sample_token": sample, "calibrated_sensor_token": "q",
                         "ego_pose_token": token("p", number), "is_key_frame": true}),
        );
        poses.push(with(json!({"token": token("p", number)}), &at(x, 1600.0)));
        let boxed = |instance: &str, size: [f64; 3], at: &Value| {
            let token = format!("{sample}-{instance}");
            with(
                json!({"token": token, "sample_token": sample, "instance_token": instance, "size": size}),
                at,
            )
        };
        boxes.push(boxed("ahead", [1.9, 4.6, 1.6], &at(x + 20.0, 1600.0)));
        boxes.push(boxed("parked", [2.5, 8.0, 3.0], &at(640.0, 1604.0)));
    }
    for (table, records) in [
        (
            "category",
            json!([{"token": "c1", "name": "vehicle.car"}, {"token": "c2", "name": "vehicle.truck"}]),
        ),
        (
            "instance",
            json!([{"token": "ahead", "category_token": "c1"}, {"token": "parked", "category_token": "c2"}]),
        ),
        (
            "scene",
            json!([{"token": "s0000", "name": "scene-0061"}, {"token": "s0001", "name": "scene-0103"}]),
        ),
        ("sensor", json!([{"token": "r", "channel": "LIDAR_TOP"}])),
        ("calibrated_sensor", json!([{"token": "q", "sensor_token": "r"}])),
        ("sample", samples.into()),
        ("sample_data", data.into()),
        ("ego_pose", poses.into()),
        ("sample_annotation", boxes.into()),
    ] {
        std::fs::write(folder.join(table).with_extension("json"), records.to_string())?;
    }
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scene_of_nuscenes_is_the_world_of_a_live_network() -> anyhow::Result<()> {
    let folder = folder("world-nuscenes")?;
    write_nuscenes(&folder.join("nuscenes/v1.0-tiny"))?;
    // The folder of the version is found.
    let ending = run(&folder, &["world", "nuscenes", "--scene", "scene-0103"]).await?;
    assert_eq!(ending.code, Some(0), "{ending:#?}");
    names(
        &ending.stdout,
        &["nuscenes: nuScenes tables, scene scene-0103, 63 rows, 3 objects", "vehicle.truck", "ego"],
    )?;
    let wrong = run(&folder, &["world", "nuscenes", "--scene", "scene-9"]).await?;
    assert_eq!(wrong.code, Some(1), "{wrong:#?}");
    names(&wrong.stderr, &["has no scene \"scene-9\"; it has scene-0061, scene-0103"])?;
    let init = ["scenario", "init", "--world", "nuscenes", "--scene", "scene-0103", "mine.toml"];
    let ending = run(&folder, &init).await?;
    assert_eq!(ending.code, Some(0), "{ending:#?}");
    let text = std::fs::read_to_string(folder.join("mine.toml"))?;
    names(&text, &["file = \"nuscenes\"", "scene = \"scene-0103\"", "ride = \"ego\""])?;
    let (_up, endpoint) = up_with(&folder, "mine.toml", "world-nuscenes").await?;
    let args = ["watch", "--json", "--count", "40", "--network", "world-nuscenes", "--connect", &endpoint];
    let ending = run(&folder, &args).await?;
    let last = ending.stdout.lines().last().context("no frame")?;
    let frame = wire::json::decode_fused(last.as_bytes())?;
    let is_parked = frame.objects.iter().any(|object| object.bev.pose().distance_to(640.0, 1604.0) < 1.5);
    assert!(is_parked, "{frame:#?}");
    // The run's folder is complete without the data set.
    std::fs::remove_dir_all(folder.join("nuscenes"))?;
    let scenario = v2x_agent::Scenario::load(folder.join("run/scenario.toml"))?;
    assert_eq!(scenario.files[0].path, folder.join("run/world-file"));
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_folder_without_tables_is_refused_with_what_is_missing() -> anyhow::Result<()> {
    let folder = folder("world-no-tables")?;
    std::fs::create_dir(folder.join("empty"))?;
    write_nuscenes(&folder.join("broken"))?;
    std::fs::remove_file(folder.join("broken/ego_pose.json"))?;
    write_nuscenes(&folder.join("two/one"))?;
    write_nuscenes(&folder.join("two/other"))?;
    for (name, expected) in [
        ("empty", "no scene.json is in it, or in a folder of it"),
        ("broken", "cannot read table ego_pose: broken/ego_pose.json: No such file"),
        ("two", "several folders of it have one: name one of one, other"),
    ] {
        let ending = run(&folder, &["world", name]).await?;
        assert_eq!(ending.code, Some(1), "{ending:#?}");
        names(&ending.stderr, &[expected])?;
    }
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_commonroad_scenario_is_drawn_with_its_lanes_and_simulated() -> anyhow::Result<()> {
    let folder = folder("world-commonroad")?;
    std::fs::write(folder.join("straight.xml"), COMMONROAD)?;
    let ending = run(&folder, &["world", "straight.xml"]).await?;
    assert_eq!(ending.code, Some(0), "{ending:#?}");
    let expected = [
        "straight.xml: CommonRoad scenario, 160 rows, 4 objects",
        "vehicle.bus.rigid",
        "human.pedestrian.adult",
    ];
    names(&ending.stdout, &expected)?;
    assert!(!ending.stdout.contains("looks wrong"), "{}", ending.stdout);
    names(&ending.stdout, &["planning problem 100 begins at (-48, 0)"])?;
    let svg = std::fs::read_to_string(folder.join("straight.world.svg"))?;
    names(&svg, &["Z\" stroke=\"none\" stroke-width=\"0\" fill=\"#d2d5da\""])?;
    let ending = run(&folder, &["scenario", "init", "--world", "straight.xml"]).await?;
    assert_eq!(ending.code, Some(0), "{ending:#?}");
    let scenario = v2x_agent::Scenario::load(folder.join("straight.toml"))?;
    assert_eq!(scenario.world.roads().len(), 1, "the lane");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn the_laboratorys_tables_of_scenes_and_of_truth_are_worlds() -> anyhow::Result<()> {
    let folder = folder("world-lab-tables")?;
    // As `lab fuse --truth` reads it, and as `lab tables` and `lab export` read scenes.
    let truth = "t,object_id,class,x,y,vx,vy,w,d,yaw\n10,7,vehicle.car,0,0,10,0,1.8,4.5,0\n11,7,vehicle.car,10,0,10,0,1.8,4.5,0\n";
    let scenes = "scene,frame,t_s,object_id,class,x,y,width,length,yaw,ego_x,ego_y,ego_yaw\n\
                  a,0,0,x7,vehicle.car,1,2,1.8,4.5,0,10,20,0.5\na,1,0.5,x7,vehicle.car,4,2,1.8,4.5,0,11,20,0.5\n";
    std::fs::write(folder.join("truth.csv"), truth)?;
    std::fs::write(folder.join("scenes.csv"), scenes)?;
    for (file, expected) in [
        ("truth.csv", "truth.csv: CSV, 2 rows, 1 objects"),
        ("scenes.csv", "CSV of the laboratory, scene a, 4 rows, 2 objects"),
    ] {
        let ending = run(&folder, &["world", file]).await?;
        assert_eq!(ending.code, Some(0), "{ending:#?}");
        names(&ending.stdout, &[expected])?;
    }
    Ok(())
}
