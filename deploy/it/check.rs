//! `v2x check` and `v2x status`: what is wrong is said in sentences, with an exit code.

use crate::support::{Ending, V2x, folder, run, up, up_with};
use anyhow::{Context, anyhow};
use serde_json::Value;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;
use tokio::task::JoinHandle;
use v2x_common::clock;
use v2x_common::net::session::{self, SessionOptions};

/// Publishes JSON frames at 10 Hz under a key, until it is dropped.
pub(crate) struct Detector(JoinHandle<()>);

impl Detector {
    pub(crate) async fn start(endpoint: &str, key: &str, json: fn(i64) -> String) -> anyhow::Result<Self> {
        let options = SessionOptions { connect: vec![endpoint.to_owned()], ..SessionOptions::default() };
        let session = session::open(session::client_config(&options)?).await?;
        let publisher =
            session.declare_publisher(key.to_owned()).await.map_err(|error| anyhow!("{error}"))?;
        Ok(Self(tokio::spawn(async move {
            let mut tick = tokio::time::interval(Duration::from_millis(100));
            let _session = session;
            loop {
                tick.tick().await;
                if publisher.put(json(clock::now().as_micros())).await.is_err() {
                    return;
                }
            }
        })))
    }
}

impl Drop for Detector {
    fn drop(&mut self) {
        self.0.abort();
    }
}

/// Two parked cars, with headings in degrees.
fn degrees(now_us: i64) -> String {
    let car = |x: i32, yaw: i32| {
        format!(r#"{{"class": "car", "x": {x}, "y": 300, "yaw": {yaw}, "w": 1.8, "d": 4.5}}"#)
    };
    format!(r#"{{"captured_at": {now_us}, "detections": [{}, {}]}}"#, car(300, 90), car(330, 270))
}

fn findings(ending: &Ending) -> anyhow::Result<Vec<(String, Option<String>)>> {
    let report: Value = serde_json::from_str(&ending.stdout).with_context(|| format!("{ending:#?}"))?;
    let findings = report["findings"].as_array().context("findings")?;
    let text = |one: &Value| one.as_str().map(str::to_owned);
    Ok(findings.iter().map(|one| (text(&one["code"]).unwrap_or_default(), text(&one["agent"]))).collect())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_sound_network_is_healthy_and_a_wrong_detector_and_a_wrong_key_are_named() -> anyhow::Result<()> {
    let folder = folder("check")?;
    let (_up, endpoint) = up(&folder, "check").await?;
    let check = ["check", "--network", "check", "--connect", &endpoint];
    let sound = run(&folder, &[&check[..], &["--json"]].concat()).await?;
    let faults: Value = serde_json::from_str(&sound.stdout)?;
    assert_eq!((sound.code, &faults["verdict"]), (Some(0), &"healthy".into()), "{sound:#?}");

    let _wrong = Detector::start(&endpoint, "v2x/check/agent/cam1/detections", degrees).await?;
    let _astray = Detector::start(&endpoint, "v2x/chekc/agent/cam2/detections", degrees).await?;
    let _foreign = Detector::start(&endpoint, "cameras/north", degrees).await?;
    let _misspelt = Detector::start(&endpoint, "v2x/check/agent/cam3/detection", degrees).await?;
    // The hub judges ten seconds at a time.
    let has_begun = |found: &[(String, Option<String>)]| found.iter().any(|(code, _)| code == "degrees");
    let found = loop {
        let ending = run(&folder, &[&check[..], &["--json", "--duration", "4"]].concat()).await?;
        let found = findings(&ending)?;
        assert_eq!(ending.code, Some(1), "{ending:#?}");
        if has_begun(&found) {
            break found;
        }
    };
    for (code, agent) in [("degrees", Some("cam1")), ("wrong-network", None), ("wrong-key", None)] {
        assert!(found.contains(&(code.to_owned(), agent.map(str::to_owned))), "{code} is not in {found:?}");
    }

    let brief = run(&folder, &["status", "--check", "--network", "check", "--connect", &endpoint]).await?;
    assert_eq!(brief.code, Some(1), "{brief:#?}");
    assert!(brief.stdout.contains("degraded") && brief.stdout.contains("FAULT  cam1"), "{brief:#?}");
    let table = run(&folder, &["status", "--network", "check", "--connect", &endpoint]).await?;
    assert_eq!(table.code, Some(0), "{table:#?}");
    // It holds no liveliness token, and is alive by its traffic.
    let row = table.stdout.lines().find(|line| line.starts_with("cam1 ")).context("a row of cam1")?;
    assert!(row.contains(" yes "), "{row}");
    assert!(table.stdout.lines().all(|line| line.chars().count() <= 80), "{}", table.stdout);
    // What is misspelt within its own network the hub notices itself.
    let status = run(&folder, &["status", "--json", "--network", "check", "--connect", &endpoint]).await?;
    let status: Value = serde_json::from_str(&status.stdout)?;
    let says: Vec<_> = status["findings"]
        .as_array()
        .context("findings")?
        .iter()
        .map(|one| one["says"].to_string())
        .collect();
    let stray: Vec<_> = says.iter().filter(|says| says.contains("which nobody reads")).collect();
    assert!(stray.len() == 1 && stray[0].contains("`v2x/check/agent/cam3/detection`"), "{says:#?}");
    let log = std::fs::read_to_string(folder.join("run/logs/hub.log"))?;
    let warned: Vec<_> = log.lines().filter(|line| line.contains("are degrees")).collect();
    assert_eq!(warned.len(), 1, "one warning when it begins: {warned:#?}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn without_a_hub_the_check_stands_in_for_one() -> anyhow::Result<()> {
    let folder = folder("check-alone")?;
    let args =
        ["check", "--network", "check-alone", "--listen", "tcp/127.0.0.1:0", "--json", "--duration", "0.3"];
    let nobody = run(&folder, &args).await?;
    assert_eq!(nobody.code, Some(3), "nobody was heard: {nobody:#?}");
    let none = ["check", "--connect", "tcp/127.0.0.1:1", "--wait", "0.3"];
    let refused = run(&folder, &none).await?;
    assert_eq!(refused.code, Some(1), "{refused:#?}");
    assert!(refused.stderr.contains("v2x check --listen"), "{refused:#?}");
    let port = std::net::TcpListener::bind("127.0.0.1:0")?.local_addr()?.port();
    let endpoint = format!("tcp/127.0.0.1:{port}");
    let args = ["check", "--network", "check-alone", "--listen", &endpoint, "--json", "--duration", "6"];
    let check = V2x::start(&folder, &args)?;
    let detector = async {
        loop {
            if let Ok(detector) =
                Detector::start(&endpoint, "v2x/check-alone/agent/cam1/detections", degrees).await
            {
                return detector;
            }
        }
    };
    let _detector = tokio::time::timeout(crate::support::TIMEOUT, detector).await.context("it listens")?;
    let ending = check.end().await?;
    assert_eq!(ending.code, Some(1), "{ending:#?}");
    assert!(findings(&ending)?.contains(&("degrees".to_owned(), Some("cam1".to_owned()))), "{ending:#?}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn an_agent_whose_vehicle_is_not_in_the_world_is_idle_and_that_is_no_fault() -> anyhow::Result<()> {
    let folder = folder("check-idle")?;
    // Its vehicle comes after five minutes.
    let rows =
        "t,id,class,x,y\n0,parked,car,10,5\n600,parked,car,10,5\n300,veh 7,car,0,0\n600,veh 7,car,90,0\n";
    std::fs::write(folder.join("traffic.csv"), rows)?;
    let scenario = r#"
        name = "idle"
        [world]
        kind = "trajectories"
        file = "traffic.csv"
        loop = false
        max_gap_s = 600
        [[agents]]
        id = "ego"
        kind = "vehicle"
        ride = "veh 7"
        [[agents]]
        id = "rsu"
        kind = "roadside-unit"
        pose = { x = 0, y = -8 }
        [hub]
    "#;
    std::fs::write(folder.join("idle.toml"), scenario)?;
    let (_up, endpoint) = up_with(&folder, "idle.toml", "check-idle").await?;
    let network = ["--network", "check-idle", "--connect", &endpoint];
    let ending = run(&folder, &[&["check"][..], &network, &["--json"]].concat()).await?;
    assert_eq!(ending.code, Some(0), "{ending:#?}");
    assert_eq!(findings(&ending)?, [("idle".to_owned(), Some("ego".to_owned()))]);
    let says = ["it rides on veh 7, which is not in the world now", "\"idle\": \"veh 7\""];
    assert!(says.iter().all(|words| ending.stdout.contains(words)), "{}", ending.stdout);
    let table = run(&folder, &[&["status"][..], &network].concat()).await?;
    assert!(table.stdout.lines().any(|line| line.starts_with("ego") && line.contains("idle")), "{table:#?}");
    Ok(())
}

/// A car on a road, as JSON.
fn car(now_us: i64) -> String {
    let x = (now_us / 100_000) % 100;
    format!(
        r#"{{"captured_at": {now_us}, "detections": [{{"class": "car", "x": {x}, "y": 3, "yaw": 0, "w": 1.8, "d": 4.5}}]}}"#
    )
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_of_a_network_that_no_hub_serves_are_a_fault_that_names_the_network_of_the_hub()
-> anyhow::Result<()> {
    let folder = folder("check-unserved")?;
    let mut hub =
        V2x::start(&folder, &["hub", "--network", "north", "--listen", "tcp/127.0.0.1:0", "--events"])?;
    let ready: Value = serde_json::from_str(&hub.line().await?)?;
    let endpoint = ready["locators"][0].as_str().context("no endpoint")?.to_owned();
    let check = ["check", "--duration", "1.5s", "--connect", &endpoint];
    // A network that is spelt wrongly: no frame, but there is a hub.
    let mistyped = run(&folder, &[&check[..], &["--network", "nroth"]].concat()).await?;
    assert_eq!(mistyped.code, Some(1), "{mistyped:#?}");
    assert!(mistyped.stdout.replace("\n       ", " ").contains("Use `--network north`"), "{mistyped:#?}");
    let _agent = Detector::start(&endpoint, "v2x/demo/agent/cam1/detections", car).await?;
    let frames = run(&folder, &[&check[..], &["--json"]].concat()).await?;
    assert_eq!(frames.code, Some(1), "{frames:#?}");
    let found = findings(&frames)?;
    assert!(found.contains(&("no-hub".to_owned(), None)), "{frames:#?}");
    assert!(frames.stdout.contains("nobody fuses the"), "{frames:#?}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn without_a_hub_or_with_a_port_in_use_the_error_is_one_sentence() -> anyhow::Result<()> {
    let folder = folder("check-errors")?;
    let none = run(&folder, &["check", "--connect", "tcp/127.0.0.1:1", "--wait", "0.5"]).await?;
    let taken = std::net::TcpListener::bind("127.0.0.1:0")?;
    let endpoint = format!("tcp/{}", taken.local_addr()?);
    let in_use = run(&folder, &["check", "--listen", &endpoint, "--duration", "0.5"]).await?;
    assert!(in_use.stderr.contains("cannot listen on"), "{in_use:#?}");
    for ending in [none, in_use] {
        assert_eq!(ending.code, Some(1), "{ending:#?}");
        let is_raw =
            |line: &&str| line.contains(" WARN ") || line.contains("zenoh::") || line.contains(".rs:");
        let raw: Vec<_> = ending.stderr.lines().filter(is_raw).collect();
        assert!(raw.is_empty(), "{raw:#?}");
    }
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_hub_that_is_there_and_does_not_answer_is_called_overloaded_and_not_absent() -> anyhow::Result<()> {
    let folder = folder("check-busy")?;
    let mut router =
        V2x::start(&folder, &["hub", "--network", "other", "--listen", "tcp/127.0.0.1:0", "--events"])?;
    let ready: Value = serde_json::from_str(&router.line().await?)?;
    let endpoint = ready["locators"][0].as_str().context("no endpoint")?.to_owned();
    let options = SessionOptions { connect: vec![endpoint.clone()], ..SessionOptions::default() };
    let session = session::open(session::client_config(&options)?).await?;
    let _token = session
        .liveliness()
        .declare_token("v2x/busy/hub/b/alive")
        .await
        .map_err(|error| anyhow!("{error}"))?;
    // It takes questions, and has no time for an answer.
    let waiting = Mutex::new(Vec::new());
    let status = session.declare_queryable("v2x/busy/hub/b/status").callback(move |query| {
        waiting.lock().unwrap_or_else(PoisonError::into_inner).push(query);
    });
    let _status = status.await.map_err(|error| anyhow!("{error}"))?;
    let network = ["--network", "busy", "--connect", &endpoint];
    let check = run(&folder, &[&["check", "--duration", "1s", "--json"][..], &network].concat()).await?;
    assert_eq!(check.code, Some(1), "{check:#?}");
    assert!(findings(&check)?.contains(&("overload".to_owned(), None)), "{check:#?}");
    assert!(check.stdout.contains("network busy has hub b, which does not answer within 1"), "{check:#?}");
    let status = run(&folder, &[&["status", "--check"][..], &network].concat()).await?;
    assert_eq!(status.code, Some(1), "{status:#?}");
    assert!(status.stdout.starts_with("degraded: hub b of network busy is there"), "{status:#?}");
    // Of a hub that is not there that is not said.
    let none = run(&folder, &["status", "--check", "--network", "nobody", "--connect", &endpoint]).await?;
    assert!(none.code == Some(3) && none.stdout.starts_with("no hub"), "{none:#?}");
    Ok(())
}
