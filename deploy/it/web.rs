//! The page of the live view, as a browser and as a stranger meet it.

use crate::check::Detector;
use crate::support::{TIMEOUT, V2x, folder, run, send};
use anyhow::{Context, ensure};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;
use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};
use tokio::net::TcpStream;

/// Numbers of one object, of one detection and of one true object in the page's messages.
const OBJECT: usize = 19;
const DETECTION: usize = 10;
const TRUTH: usize = 9;

#[tokio::test(flavor = "multi_thread")]
async fn the_page_and_its_files_are_served_with_a_strict_policy() -> anyhow::Result<()> {
    let (_watch, address) = view(&folder("web-page")?).await?;
    let page = get(&address, "/", &[]).await?;
    assert!(page.starts_with("HTTP/1.1 200") && page.contains("<title>v2x live view"), "{page}");
    for header in
        ["content-security-policy: default-src 'none'", "x-content-type-options: nosniff", "no-store"]
    {
        assert!(page.contains(header), "{header} in {page}");
    }
    for path in ["/style.css", "/js/main.js", "/icon.svg"] {
        assert!(get(&address, path, &[]).await?.starts_with("HTTP/1.1 200"), "{path}");
    }
    for path in ["/no-such-file", "/../Cargo.toml", "/js/"] {
        assert!(get(&address, path, &[]).await?.starts_with("HTTP/1.1 404"), "{path}");
    }
    let posted = request(&address, "POST", "/", &[("Host", &address), ("Content-Length", "0")]).await?;
    assert!(posted.starts_with("HTTP/1.1 405"), "{posted}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_spoofed_host_name_or_origin_is_refused() -> anyhow::Result<()> {
    let (_watch, address) = view(&folder("web-guard")?).await?;
    for path in ["/", "/events"] {
        let rebound = request(&address, "GET", path, &[("Host", "evil.example")]).await?;
        assert!(rebound.starts_with("HTTP/1.1 403"), "{rebound}");
        let headers = [("Host", &*address), ("Origin", "https://evil.example")];
        let foreign = request(&address, "GET", path, &headers).await?;
        assert!(foreign.starts_with("HTTP/1.1 403") && !foreign.contains("data:"), "{foreign}");
    }
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_network_is_shown_in_well_formed_messages_and_ctrl_c_ends_it() -> anyhow::Result<()> {
    let folder = folder("web-up")?;
    let args = ["up", "crossing", "--listen", "tcp/127.0.0.1:0", "--network", "web-up", "--out", "run"];
    let mut up = V2x::start(&folder, &[&args[..], &["--web", "0"]].concat())?;
    let address = address(&mut up).await?;
    let mut events = Events::open(&address).await?;
    let mut seen = BTreeMap::new();
    let kinds = ["hello", "connection", "presence", "sensor", "status", "detections", "fused"];
    while !kinds.iter().all(|kind| seen.contains_key(*kind)) {
        let message = events.next().await?;
        let kind = message["t"].as_str().context("a message has a kind")?.to_owned();
        // The first lists have no objects, because not all agents are there yet.
        if kind != "fused" || message["objects"].as_array().is_some_and(|objects| !objects.is_empty()) {
            seen.insert(kind, message);
        }
    }
    assert_eq!(
        (&seen["hello"]["network"], &seen["hello"]["scenario"]),
        (&"web-up".into(), &"crossing".into())
    );
    assert!(length(&seen["hello"], "roads")? > 8);
    assert_eq!(length(&seen["detections"], "detections")? % DETECTION, 0);
    let fused = &seen["fused"];
    let n_objects = length(fused, "tracks")?;
    assert_eq!((length(fused, "objects")?, length(fused, "contributors")?), (OBJECT * n_objects, n_objects));
    assert_eq!(length(fused, "truth")? % TRUTH, 0);
    assert!(length(fused, "truth")? > 20 * TRUTH && fused["errors"]["of"] == n_objects, "{fused}");
    assert_eq!(seen["status"]["hubs"][0]["network"], "web-up");
    assert!(["ego", "rsu"].contains(&seen["sensor"]["agent"].as_str().unwrap_or_default()));
    // The stream is still open.
    send("INT", up.process_id()?).await?;
    let ending = up.end().await?;
    assert_eq!(ending.code, Some(0), "{ending:#?}");
    events.end().await
}

/// A car 10 m ahead of a sensor and 2 m to its left; the heading is a compass'.
fn ahead(now_us: i64) -> String {
    format!(r#"{{"captured_at": {now_us}, "detections": [{{"class": "car", "x": 10, "y": 2, "yaw": 270}}]}}"#)
}

#[tokio::test(flavor = "multi_thread")]
async fn the_frames_of_an_agent_with_its_own_conventions_are_shown_as_the_hub_reads_them()
-> anyhow::Result<()> {
    let folder = folder("web-conventions")?;
    let table = "[hub.agents.cam]\nframe = \"sensor\"\npose = { x = 300, y = 200, yaw = 0 }\n\
                 yaw = { unit = \"deg\", turn = \"cw\" }\n";
    std::fs::write(
        folder.join("own.toml"),
        format!("{}\n{table}", include_str!("../scenarios/crossing.toml")),
    )?;
    let args = ["up", "own.toml", "--listen", "tcp/127.0.0.1:0", "--network", "web-own", "--out", "run"];
    let mut up = V2x::start(&folder, &[&args[..], &["--web", "0"]].concat())?;
    let line = up.stderr_line(" is up: hub at ").await?;
    let endpoint = line.split_whitespace().find(|word| word.starts_with("tcp/")).context("no endpoint")?;
    let address = address(&mut up).await?;
    let key = "v2x/web-own/agent/cam/detections";
    let _cam = Detector::start(endpoint.trim_end_matches(','), key, ahead).await?;
    let mut events = Events::open(&address).await?;
    loop {
        let message = events.next().await?;
        if message["t"] == "detections" && message["agent"] == "cam" {
            let numbers: Vec<_> = message["detections"].as_array().context("detections")?.iter().collect();
            let number = |k: usize| numbers[k].as_f64().unwrap_or(f64::NAN);
            assert_eq!((number(2), number(3), message["pose"][0].as_f64()), (310.0, 202.0, Some(300.0)));
            assert!((number(6) - std::f64::consts::FRAC_PI_2).abs() < 1e-2, "{message}");
            return Ok(());
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_taken_address_is_an_error_that_says_what_to_do() -> anyhow::Result<()> {
    let folder = folder("web-taken")?;
    let (_watch, address) = view(&folder).await?;
    for command in [&["watch"][..], &["up", "crossing"], &["demo"]] {
        let ending = run(&folder, &[command, &["--web", &address]].concat()).await?;
        assert_eq!(ending.code, Some(1), "{ending:#?}");
        assert!(
            ending.stderr.contains("is taken") && ending.stderr.contains("--web 127.0.0.1:0"),
            "{ending:#?}"
        );
    }
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_demo_in_the_browser_runs_until_ctrl_c_and_is_scored() -> anyhow::Result<()> {
    let folder = folder("web-demo")?;
    let mut demo = V2x::start(&folder, &["demo", "--web", "0", "--out", "run"])?;
    let address = address(&mut demo).await?;
    demo.stderr_line("Ctrl-C ends it").await?;
    // The shortest run that is scored takes 4 s.
    demo.stderr_line(" s, until Ctrl-C: ").await?;
    assert!(get(&address, "/", &[]).await?.starts_with("HTTP/1.1 200"));
    send("INT", demo.process_id()?).await?;
    let ending = demo.end().await?;
    assert_eq!(ending.code, Some(0), "{ending:#?}");
    assert!(ending.stdout.contains("PASSED"), "{ending:#?}");
    Ok(())
}

/// A view of a network that is not there.
async fn view(folder: &Path) -> anyhow::Result<(V2x, String)> {
    // Port 1 of the loopback: nothing listens there.
    let mut watch = V2x::start(folder, &["watch", "--web", "127.0.0.1:0", "--connect", "tcp/127.0.0.1:1"])?;
    let address = address(&mut watch).await?;
    Ok((watch, address))
}

/// Host and port of the page, as it is printed.
pub(crate) async fn address(v2x: &mut V2x) -> anyhow::Result<String> {
    let line = v2x.stderr_line("live view: ").await?;
    let url = line.split_whitespace().find_map(|word| word.strip_prefix("http://"));
    Ok(url.context("no address")?.trim_end_matches('/').to_owned())
}

async fn get(address: &str, path: &str, headers: &[(&str, &str)]) -> anyhow::Result<String> {
    request(address, "GET", path, &[&[("Host", address)], headers].concat()).await
}

/// The whole answer.
async fn request(
    address: &str,
    method: &str,
    path: &str,
    headers: &[(&str, &str)],
) -> anyhow::Result<String> {
    let mut stream = opened(address, method, path, headers).await?;
    let mut answer = Vec::new();
    tokio::time::timeout(TIMEOUT, stream.read_to_end(&mut answer)).await.context("no whole answer")??;
    Ok(String::from_utf8_lossy(&answer).into_owned())
}

async fn opened(
    address: &str,
    method: &str,
    path: &str,
    headers: &[(&str, &str)],
) -> anyhow::Result<TcpStream> {
    let mut stream = TcpStream::connect(address).await?;
    let headers: String = headers.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
    let head = format!("{method} {path} HTTP/1.1\r\n{headers}Connection: close\r\n\r\n");
    stream.write_all(head.as_bytes()).await?;
    Ok(stream)
}

/// The stream of events of one browser.
pub(crate) struct Events(BufReader<TcpStream>);

impl Events {
    pub(crate) async fn open(address: &str) -> anyhow::Result<Self> {
        Ok(Self(BufReader::new(opened(address, "GET", "/events", &[("Host", address)]).await?)))
    }

    /// The next message. Lines of the chunked encoding are left out.
    pub(crate) async fn next(&mut self) -> anyhow::Result<Value> {
        loop {
            let mut line = String::new();
            let read = tokio::time::timeout(TIMEOUT, self.0.read_line(&mut line)).await;
            ensure!(read.context("no event")?? > 0, "the stream has ended");
            if let Some(json) = line.strip_prefix("data: ") {
                return serde_json::from_str(json).with_context(|| line.clone());
            }
        }
    }

    /// Reads until the end.
    async fn end(mut self) -> anyhow::Result<()> {
        let mut rest = Vec::new();
        tokio::time::timeout(TIMEOUT, self.0.read_to_end(&mut rest)).await.context("it does not end")??;
        Ok(())
    }
}

fn length(message: &Value, list: &str) -> anyhow::Result<usize> {
    message[list].as_array().map(Vec::len).with_context(|| format!("no list {list} in {message}"))
}
