//! Recorded traffic: `v2x world`, `v2x scenario init`, and a network in a world of it.

use crate::support::{folder, run, up_with};
use anyhow::{Context, ensure};
use std::path::Path;
use v2x_common::class::Class;
use v2x_common::wire;

const JUNCTION: &str = include_str!("../examples/recorded/junction.csv");

fn names(text: &str, expected: &[&str]) -> anyhow::Result<()> {
    let missing: Vec<_> = expected.iter().filter(|part| !text.contains(**part)).collect();
    ensure!(missing.is_empty(), "{missing:?} is not in {text}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_file_is_summed_up_and_drawn() -> anyhow::Result<()> {
    let folder = folder("world-summary")?;
    std::fs::write(folder.join("junction.csv"), JUNCTION)?;
    let ending = run(&folder, &["world", "junction.csv"]).await?;
    assert_eq!(ending.code, Some(0), "{ending:#?}");
    let expected =
        ["junction.csv: CSV, 1184 rows, 12 objects", "40.0 s, from 0 to 40 s", "vehicle.bus.rigid", "veh5"];
    names(&ending.stdout, &expected)?;
    assert!(!ending.stdout.contains("looks wrong"), "{}", ending.stdout);
    let svg = std::fs::read_to_string(folder.join("junction.world.svg"))?;
    names(&svg, &["<svg", "veh5", "7 × vehicle.car", "</svg>"])?;
    let json =
        run(&folder, &["world", "junction.csv", "--json", "--from", "10", "--svg", "part.svg"]).await?;
    let summary: serde_json::Value = serde_json::from_str(&json.stdout)?;
    assert_eq!((&summary["first_s"], &summary["duration_s"]), (&10.0.into(), &30.0.into()));
    assert!(folder.join("part.svg").exists());
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn what_looks_wrong_is_said_with_what_to_change_and_what_cannot_be_read_is_refused()
-> anyhow::Result<()> {
    let folder = folder("world-mistakes")?;
    // Headings in degrees.
    let in_degrees = |line: &str| {
        let mut cells: Vec<_> = line.split(',').map(str::to_owned).collect();
        if let Ok(yaw) = cells[5].parse::<f64>() {
            cells[5] = yaw.to_degrees().to_string();
        }
        cells.join(",") + "\n"
    };
    std::fs::write(folder.join("degrees.csv"), JUNCTION.lines().map(in_degrees).collect::<String>())?;
    let ending = run(&folder, &["world", "degrees.csv"]).await?;
    assert_eq!(ending.code, Some(0), "{ending:#?}");
    names(&ending.stdout, &["looks wrong", "degrees: name the column yaw_deg"])?;
    std::fs::write(folder.join("make.py"), "write('fcd.xml')")?;
    std::fs::write(folder.join("bad.csv"), JUNCTION.replacen("veh1,car,-100.00", "veh1,car,west", 1))?;
    for (args, expected) in [
        (["world", "bad.csv"].as_slice(), ["bad.csv", "column x: \"west\""]),
        (&["world", "none.csv"], ["reading none.csv", "No such file"]),
        (&["world", "fcd.xml"], ["reading fcd.xml", "it is written by  python3 ./make.py"]),
        (&["world", "crossing"], ["crossing is a shipped scenario", "`v2x up crossing --web`"]),
        (&["scenario", "init", "--world", "bad.csv"], ["bad.csv", "column x: \"west\""]),
    ] {
        let ending = run(&folder, args).await?;
        assert_eq!(ending.code, Some(1), "{ending:#?}");
        names(&ending.stderr, &expected)?;
    }
    assert!(!folder.join("bad.toml").exists());
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scenario_is_written_once_and_is_valid() -> anyhow::Result<()> {
    let folder = folder("scenario-init")?;
    let ending = run(&folder, &["scenario", "init"]).await?;
    assert_eq!(ending.code, Some(0), "{ending:#?}");
    assert_eq!(
        std::fs::read_to_string(folder.join("scenario.toml"))?,
        include_str!("../scenarios/crossing.toml")
    );
    let again = run(&folder, &["scenario", "init"]).await?;
    assert_eq!(again.code, Some(1), "{again:#?}");
    names(&again.stderr, &["scenario.toml exists", "--force"])?;
    assert_eq!(run(&folder, &["scenario", "init", "--force"]).await?.code, Some(0));
    // Coordinates of a survey, in a folder of its own.
    std::fs::create_dir(folder.join("data"))?;
    let far = "t;id;class;x;y\n0;a b;car;691600,5;5334700\n30;a b;car;691840,5;5334700\n";
    std::fs::write(folder.join("data/far.csv"), far)?;
    let far = run(&folder, &["scenario", "init", "--world", "data/far.csv"]).await?;
    assert_eq!(far.code, Some(0), "{far:#?}");
    let text = std::fs::read_to_string(folder.join("far.toml"))?;
    names(&text, &["file = \"data/far.csv\"", "ride = \"a b\"", "origin = { x = 6917", "pose = { x = 691"])
}

#[tokio::test(flavor = "multi_thread")]
async fn a_written_scenario_begins_when_the_agents_vehicle_comes_and_names_files_from_its_own_folder()
-> anyhow::Result<()> {
    let folder = folder("scenario-ride")?;
    // The second vehicle is there longer, from 5 to 55 s of 90 s.
    let mut rows = "t,id,class,x,y\n".to_owned();
    for t in 0..=90 {
        rows += &format!("{t},parked,car,0,20\n");
        if t <= 8 {
            rows += &format!("{t},short,car,{},0\n", 8 * t);
        }
        if (5..=55).contains(&t) {
            rows += &format!("{t},long,car,{},5\n", 8 * t);
        }
    }
    std::fs::write(folder.join("traffic.csv"), rows)?;
    std::fs::create_dir(folder.join("mine"))?;
    let ending = run(&folder, &["scenario", "init", "--world", "traffic.csv", "mine/own.toml"]).await?;
    assert_eq!(ending.code, Some(0), "{ending:#?}");
    let text = std::fs::read_to_string(folder.join("mine/own.toml"))?;
    names(
        &text,
        &[
            "file = \"../traffic.csv\"",
            "from_s = 5.0",
            "to_s = 55.0",
            "ride = \"long\"",
            "It is there from 0.0 to 50.0 s of the world",
        ],
    )?;
    let scenario = v2x_agent::Scenario::load(folder.join("mine/own.toml"))?;
    let world = scenario.world(1);
    for seconds in [0, 25, 49] {
        let t = v2x_common::time::Span::from_millis(1000 * seconds);
        assert!(world.agent_pose(0, t).is_some(), "the vehicle is not there after {seconds} s");
    }
    // What the user chooses stays.
    let args = ["scenario", "init", "--world", "traffic.csv", "--from", "2", "chosen.toml"];
    assert_eq!(run(&folder, &args).await?.code, Some(0));
    names(
        &std::fs::read_to_string(folder.join("chosen.toml"))?,
        &["from_s = 2.0", "# to_s = 90", "It is there from 3.0 to 53.0 s of the world"],
    )
}

#[tokio::test(flavor = "multi_thread")]
async fn a_mistake_in_a_scenario_names_it_once() -> anyhow::Result<()> {
    let folder = folder("scenario-once")?;
    std::fs::write(folder.join("bad.toml"), "name = \"bad\"\nloop_s = 7\n")?;
    let ending = run(&folder, &["up", "bad.toml"]).await?;
    assert_eq!(ending.code, Some(1), "{ending:#?}");
    assert_eq!(ending.stderr.matches("scenario bad.toml").count(), 1, "{}", ending.stderr);
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_written_scenario_is_the_world_of_a_live_network() -> anyhow::Result<()> {
    let folder = folder("world-up")?;
    std::fs::write(folder.join("junction.csv"), JUNCTION)?;
    let ending = run(&folder, &["scenario", "init", "--world", "junction.csv"]).await?;
    assert_eq!(ending.code, Some(0), "{ending:#?}");
    let (_up, endpoint) = up_with(&folder, "junction.toml", "world-up").await?;
    let args = ["watch", "--json", "--count", "40", "--network", "world-up", "--connect", &endpoint];
    let ending = run(&folder, &args).await?;
    let last = ending.stdout.lines().last().context("no frame")?;
    let frame = wire::json::decode_fused(last.as_bytes())?;
    // It stands there all the time.
    let van = frame.objects.iter().find(|object| object.bev.pose().distance_to(42.0, -5.4) < 1.0);
    let parked = frame.objects.iter().find(|object| object.bev.pose().distance_to(-30.0, 5.2) < 1.0);
    assert!(van.or(parked).is_some_and(|object| object.class.group() == Class::Car.group()), "{frame:#?}");
    // The run's folder is complete without the file.
    assert_eq!(std::fs::read_to_string(folder.join("run/world-file.csv"))?, JUNCTION);
    let scenario = v2x_agent::Scenario::load(folder.join("run/scenario.toml"))?;
    assert!(scenario.files.iter().all(|file| file.path == Path::new(&folder).join("run/world-file.csv")));
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_run_in_recorded_traffic_is_scored_against_it() -> anyhow::Result<()> {
    let folder = folder("world-demo")?;
    let scenario = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/recorded/junction.toml");
    let ending =
        run(&folder, &["demo", "--scenario", scenario, "--duration", "12s", "--out", "run", "--json"])
            .await?;
    let summary: serde_json::Value =
        serde_json::from_str(&ending.stdout).with_context(|| format!("{ending:#?}"))?;
    let ate_m = summary["fused"]["ate_m"].as_f64().with_context(|| summary.to_string())?;
    assert!(ate_m < 1.0, "{ate_m} m from the truth of the recording: {summary}");
    names(&std::fs::read_to_string(folder.join("run/bev.svg"))?, &["patrol", "rsu"])
}

#[tokio::test(flavor = "multi_thread")]
async fn an_option_of_a_file_is_refused_where_no_file_is_read() -> anyhow::Result<()> {
    let folder = folder("world-options")?;
    let cases: [(&[&str], &str); 2] = [
        (&["world", "some.toml", "--from", "10"], "--from is for a file of recorded traffic"),
        (
            &["scenario", "init", "--vtypes", "demand.rou.xml"],
            "--vtypes is for recorded traffic: give its file by --world",
        ),
    ];
    for (args, expected) in cases {
        let ending = run(&folder, args).await?;
        assert_eq!(ending.code, Some(1), "{ending:#?}");
        names(&ending.stderr, &[expected])?;
    }
    assert!(!folder.join("scenario.toml").exists());
    Ok(())
}
