//! SUMO as the live world of a network: over TraCI from a small server of our own, and from SUMO itself where it is.

use crate::support::{Ending, V2x, folder, run, send};
use anyhow::{Context, ensure};
use std::path::Path;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use v2x_common::fused::{FusedFrame, FusedObject};
use v2x_common::wire;

/// A scenario for the server below; its vehicle agent rides on a vehicle of SUMO.
const SCENARIO: &str = r#"
    name = "live"
    [world]
    kind = "sumo"
    file = "none.sumocfg"
    road = [{ line = [[-100, 0], [100, 0]] }]
    [[agents]]
    id = "ego"
    kind = "vehicle"
    ride = "driver"
    link = { delay_ms = 20 }
    [[agents]]
    id = "rsu"
    kind = "roadside-unit"
    pose = { x = 0, y = -8 }
    phase_ms = 50
    link = { delay_ms = 20 }
    [hub]
"#;

/// How the server misbehaves.
#[derive(Clone, Copy, PartialEq)]
enum Mischief {
    None,
    /// Closes the connection after so many steps.
    Closes(u32),
    /// Announces a message of 2 GB after so many steps.
    Boasts(u32),
    /// Refuses to step after so many steps.
    Refuses(u32),
}

/// A server that speaks as much TraCI as we ask for: a vehicle that drives to and fro with a person in
/// it, one that stands, and a person with the id of the latter.
async fn serve(listener: TcpListener, mischief: Mischief) -> anyhow::Result<()> {
    loop {
        let (stream, _) = listener.accept().await?;
        // A client that goes ends only its own connection.
        let _ = talk(stream, mischief).await;
    }
}

async fn talk(mut stream: TcpStream, mischief: Mischief) -> anyhow::Result<()> {
    stream.set_nodelay(true)?;
    let mut n_steps = 0_u32;
    loop {
        let length = stream.read_u32().await?;
        let mut request = vec![0; usize::try_from(length)? - 4];
        stream.read_exact(&mut request).await?;
        let (mut rest, mut answer) = (&request[..], Vec::new());
        while let [length, command, ..] = rest {
            let (one, more) = rest.split_at_checked(usize::from(*length)).context("a long command")?;
            rest = more;
            let content = one.get(2..).context("an empty command")?;
            match (command, mischief) {
                (0x02, Mischief::Closes(after)) if n_steps >= after => return Ok(()),
                (0x02, Mischief::Boasts(after)) if n_steps >= after => {
                    stream.write_u32(0x7fff_ffff).await?;
                }
                (0x02, Mischief::Refuses(after)) if n_steps >= after => {
                    answer.extend(status(0x02, 0xff, "a collision"));
                }
                (0x00, _) => {
                    answer.extend(status(0x00, 0, ""));
                    let content = [&22_i32.to_be_bytes()[..], &text("a server of the test")].concat();
                    answer.extend(command_of(0x00, &content));
                }
                (0x02, _) => {
                    // A long jump would keep the client waiting.
                    let to_s = f64::from_be_bytes(content.try_into()?);
                    let t_s = f64::from(n_steps) / 10.0;
                    ensure!(to_s <= t_s + 1.01, "asked for {to_s} s at {t_s} s");
                    n_steps += 1;
                    while f64::from(n_steps) / 10.0 < to_s - 1e-6 {
                        n_steps += 1;
                    }
                    answer.extend(status(0x02, 0, ""));
                    answer.extend(0_i32.to_be_bytes());
                }
                (0xa4 | 0xab | 0xae, _) => {
                    answer.extend(status(*command, 0, ""));
                    let variable = content[0];
                    let object = std::str::from_utf8(&content[5..])?;
                    let value = value(*command, variable, object, f64::from(n_steps) / 10.0);
                    let content = [&[variable][..], &text(object), &value].concat();
                    answer.extend(command_of(command + 0x10, &content));
                }
                (other, _) => answer.extend(status(*other, 0, "")),
            }
        }
        let length = u32::try_from(answer.len())? + 4;
        stream.write_all(&[&length.to_be_bytes()[..], &answer].concat()).await?;
    }
}

fn text(text: &str) -> Vec<u8> {
    let length = u32::try_from(text.len()).unwrap_or(0);
    [&length.to_be_bytes()[..], text.as_bytes()].concat()
}

fn command_of(number: u8, content: &[u8]) -> Vec<u8> {
    let length = u8::try_from(content.len() + 2).unwrap_or(0);
    [&[length, number], content].concat()
}

fn status(number: u8, result: u8, why: &str) -> Vec<u8> {
    command_of(number, &[&[result][..], &text(why)].concat())
}

/// Type and value of a variable at a time, s.
fn value(command: u8, variable: u8, object: &str, t_s: f64) -> Vec<u8> {
    let double = |value: f64| [&[0x0b][..], &value.to_be_bytes()].concat();
    match (command, variable) {
        (0xab, 0x66) => double(t_s),
        (0xab, 0x7b) => double(0.1),
        (_, 0x00) => {
            let ids: &[&str] = if command == 0xa4 { &["stands", "driver"] } else { &["stands", "rider"] };
            let n = u32::try_from(ids.len()).unwrap_or(0);
            ids.iter().fold([&[0x0e][..], &n.to_be_bytes()].concat(), |list, id| [list, text(id)].concat())
        }
        (_, 0x42) => {
            // Front bumpers of vehicles.
            let (x, y) = match (command, object) {
                (_, "driver" | "rider") => (-30.0 - 30.0 * libm::cos(0.2 * t_s), 0.0),
                (0xa4, _) => (12.25, 4.0),
                _ => (5.0, -5.0),
            };
            [&[0x01][..], &f64::to_be_bytes(x), &f64::to_be_bytes(y)].concat()
        }
        // East, by a compass.
        (_, 0x43) => double(90.0),
        (_, 0x44) => double(if command == 0xa4 { 4.5 } else { 0.5 }),
        (_, 0xc3) => [&[0x0c][..], &text(if object == "rider" { "driver" } else { "" })].concat(),
        (_, 0x4d) => double(if command == 0xa4 { 1.8 } else { 0.5 }),
        _ => [&[0x0c][..], &text("passenger")].concat(),
    }
}

/// Starts a server; returns its address.
async fn traci(mischief: Mischief) -> anyhow::Result<String> {
    let listener = TcpListener::bind("127.0.0.1:0").await?;
    let address = listener.local_addr()?.to_string();
    tokio::spawn(serve(listener, mischief));
    Ok(address)
}

/// Starts a network in this world; returns it with the hub's endpoint.
async fn up(folder: &Path, world: &str, network: &str) -> anyhow::Result<(V2x, String)> {
    std::fs::write(folder.join("live.toml"), SCENARIO)?;
    let listen = ["--listen", "tcp/127.0.0.1:0", "--network", network, "--out", "run"];
    let mut up = V2x::start(folder, &[&["up", "live.toml", "--world", world][..], &listen].concat())?;
    let line = up.stderr_line(" is up: hub at ").await?;
    let endpoint = line.split_whitespace().find(|word| word.starts_with("tcp/")).context("no endpoint")?;
    Ok((up, endpoint.trim_end_matches(',').to_owned()))
}

fn names(text: &str, expected: &[&str]) -> anyhow::Result<()> {
    let missing: Vec<_> = expected.iter().filter(|part| !text.contains(**part)).collect();
    ensure!(missing.is_empty(), "{missing:?} is not in {text}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn agents_of_several_processes_see_what_sumo_drives() -> anyhow::Result<()> {
    let folder = folder("sumo-up")?;
    let world = format!("traci:{}", traci(Mischief::None).await?);
    let (up, endpoint) = up(&folder, &world, "sumo-up").await?;
    // A third agent, started by hand in a scenario of its own.
    std::fs::write(folder.join("hand.toml"), SCENARIO.replace("\"rsu\"", "\"hand\""))?;
    let network = ["--network", "sumo-up", "--connect", &endpoint];
    let hand = ["agent", "--scenario", "hand.toml", "--world", &world, "--id", "hand"];
    let hand = V2x::start(&folder, &[&hand[..], &network].concat())?;
    let mut watch = V2x::start(&folder, &[&["watch", "--json"][..], &network].concat())?;
    let is_complete = |frame: &FusedFrame| {
        let near = |x: f64, y: f64| frame.objects.iter().any(|one| one.bev.pose().distance_to(x, y) < 1.0);
        let is_driver = |one: &FusedObject| one.bev.y.abs() < 1.0;
        let hears = |id: &str| frame.agents.iter().any(|one| one.agent.as_str() == id && one.accepted > 5);
        // The middle of a vehicle is behind its front.
        near(10.0, 4.0)
            && near(5.0, -5.0)
            && frame.objects.iter().any(is_driver)
            && ["ego", "rsu", "hand"].into_iter().all(hears)
    };
    let mut last = String::new();
    for _ in 0..2000 {
        last = watch.line().await?;
        if is_complete(&wire::json::decode_fused(last.as_bytes())?) {
            break;
        }
    }
    assert!(is_complete(&wire::json::decode_fused(last.as_bytes())?), "{last}");
    for program in [watch, hand] {
        send("INT", program.process_id()?).await?;
        assert_eq!(program.end().await?.code, Some(0));
    }
    send("INT", up.process_id()?).await?;
    let ending = up.end().await?;
    assert_eq!(ending.code, Some(0), "{ending:#?}");
    // What SUMO drove is the recorded world of the run's scenario.
    let scenario = v2x_agent::Scenario::load(folder.join("run/scenario.toml"))?;
    let world = scenario.world.recorded().context("no recorded world")?;
    let ids: Vec<_> = world.traffic.objects.iter().map(|object| object.name.as_str()).collect();
    assert_eq!(ids, ["driver", "stands", "person:stands"], "and who is in a vehicle is no object of its own");
    assert!(!world.is_live() && world.roads.len() == 1 && world.traffic.first_s == 0.0);
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_run_in_sumos_world_is_scored_against_what_sumo_drove() -> anyhow::Result<()> {
    let folder = folder("sumo-demo")?;
    let world = format!("traci = \"{}\"\nbegin_s = 4.25", traci(Mischief::None).await?);
    // A second vehicle agent rides on what never comes.
    let absent = "[[agents]]\nid = \"absent\"\nkind = \"vehicle\"\nride = \"never\"\n[hub]";
    let scenario = SCENARIO.replace("file = \"none.sumocfg\"", &world).replace("[hub]", absent);
    std::fs::write(folder.join("live.toml"), scenario)?;
    let args = ["demo", "--scenario", "live.toml", "--duration", "8s", "--out", "run", "--json"];
    let ending = run(&folder, &args).await?;
    let said = "agent absent rides on \"never\", which never came; the run's scenario is without it";
    names(&ending.stderr, &[said])?;
    let summary: serde_json::Value =
        serde_json::from_str(&ending.stdout).with_context(|| format!("{ending:#?}"))?;
    let ate_m = summary["fused"]["ate_m"].as_f64().with_context(|| summary.to_string())?;
    assert!(ate_m < 1.0, "{ate_m} m from what SUMO drove: {summary}");
    Ok(())
}

/// How a network ends whose SUMO does this.
async fn ending_of(name: &str, mischief: Mischief) -> anyhow::Result<Ending> {
    let folder = folder(name)?;
    let world = format!("traci:{}", traci(mischief).await?);
    let (up, _) = up(&folder, &world, name).await?;
    up.end().await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_sumo_that_goes_or_breaks_ends_the_network_with_the_reason() -> anyhow::Result<()> {
    for (name, mischief, expected) in [
        ("sumo-closes", Mischief::Closes(40), "SUMO closed the connection"),
        ("sumo-boasts", Mischief::Boasts(40), "a message of SUMO has 2147483647 bytes, expected 4 to"),
        ("sumo-refuses", Mischief::Refuses(40), "SUMO refuses command 0x02: a collision"),
    ] {
        let ending = ending_of(name, mischief).await?;
        assert_eq!(ending.code, Some(1), "{ending:#?}");
        names(&ending.stderr, &[expected])?;
    }
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_world_that_cannot_be_is_refused_with_what_to_change() -> anyhow::Result<()> {
    let folder = folder("sumo-mistakes")?;
    std::fs::write(folder.join("live.toml"), SCENARIO)?;
    std::fs::write(folder.join("other.sumocfg"), "<configuration/>")?;
    let nobody = {
        let listener = TcpListener::bind("127.0.0.1:0").await?;
        format!("traci:{}", listener.local_addr()?)
    };
    let up = ["up", "live.toml", "--listen", "tcp/127.0.0.1:0", "--network", "sumo-mistakes", "--out", "run"];
    for (args, code, expected) in [
        (
            [&up[..], &["--world", "sumo:my.sumocfg"]].concat(),
            1,
            ["no SUMO configuration", "found there are other.sumocfg"],
        ),
        (
            [&up[..], &["--world", &nobody]].concat(),
            1,
            ["no SUMO answers at 127.0.0.1", "start it with --remote-port"],
        ),
        ([&up[..], &["--world", "other.sumocfg"]].concat(), 2, ["is no world", "expected sumo:CFG"]),
        (vec!["world", "live.toml"], 1, ["v2x world cannot know it", "--fcd-output"]),
        (
            vec!["scenario", "init", "--world", "sumo:my.sumocfg"],
            1,
            ["no SUMO configuration", "other.sumocfg"],
        ),
    ] {
        let ending = run(&folder, &args).await?;
        assert_eq!(ending.code, Some(code), "{ending:#?}");
        names(&ending.stderr, &expected)?;
    }
    Ok(())
}

/// Whether SUMO can be started here.
fn has_sumo() -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::var_os("SUMO_HOME").is_some()
        || std::env::split_paths(&path).any(|folder| folder.join("sumo").is_file())
}

#[tokio::test(flavor = "multi_thread")]
async fn sumo_itself_is_the_world_of_the_example() -> anyhow::Result<()> {
    if !has_sumo() {
        eprintln!("not tried: no SUMO here (pip install eclipse-sumo)");
        return Ok(());
    }
    let folder = folder("sumo-itself")?;
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/sumo");
    for file in ["crossing.sumocfg", "crossing.net.xml", "demand.rou.xml"] {
        std::fs::copy(examples.join(file), folder.join(file))?;
    }
    let init = run(&folder, &["scenario", "init", "--world", "sumo:crossing.sumocfg", "my.toml"]).await?;
    assert_eq!(init.code, Some(0), "{init:#?}");
    names(&std::fs::read_to_string(folder.join("my.toml"))?, &["kind = \"sumo\"", "ride = \"ego\""])?;
    // A configuration that begins later, and whose port would make SUMO wait.
    let late = std::fs::read_to_string(folder.join("crossing.sumocfg"))?.replace(
        "<time>",
        "<traci_server><remote-port value=\"8813\"/></traci_server><time><begin value=\"1:00:00\"/>",
    );
    std::fs::write(folder.join("late.sumocfg"), late)?;
    let init = run(&folder, &["scenario", "init", "--world", "sumo:late.sumocfg", "late.toml"]).await?;
    assert_eq!(init.code, Some(0), "{init:#?}");
    let args = ["demo", "--scenario", "my.toml", "--duration", "10s", "--out", "run", "--json"];
    let ending = run(&folder, &args).await?;
    let summary: serde_json::Value =
        serde_json::from_str(&ending.stdout).with_context(|| format!("{ending:#?}"))?;
    let ate_m = summary["fused"]["ate_m"].as_f64().with_context(|| summary.to_string())?;
    assert!(ate_m < 1.0, "{ate_m} m from what SUMO drove: {summary}");
    let wrong =
        std::fs::read_to_string(folder.join("crossing.sumocfg"))?.replace("crossing.net.xml", "none.net.xml");
    std::fs::write(folder.join("crossing.sumocfg"), wrong)?;
    let ending = run(&folder, &args).await?;
    assert_eq!(ending.code, Some(1), "{ending:#?}");
    names(&ending.stderr, &["none.net.xml", "not accessible"])
}
