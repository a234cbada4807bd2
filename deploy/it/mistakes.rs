//! Mistakes of a user, and the message for each.

use crate::support::{folder, run};
use std::net::TcpListener;
use std::path::Path;

const CROSSING: &str = include_str!("../scenarios/crossing.toml");

#[tokio::test(flavor = "multi_thread")]
async fn a_bad_scenario_is_refused_with_the_name_of_the_wrong_field() -> anyhow::Result<()> {
    let folder = folder("bad-scenarios")?;
    let misspelt = CROSSING.replacen("rate_hz", "rate_herz", 1);
    assert_refused(&folder, "misspelt.toml", Some(&misspelt), &["rate_herz", "line", "rate_hz"]).await?;
    let impossible = CROSSING.replacen("rate_hz = 10", "rate_hz = -3", 1);
    assert_refused(&folder, "impossible.toml", Some(&impossible), &["agents[0].rate_hz", "-3"]).await?;
    let recorded = CROSSING.replacen("kind = \"crossing\"", "file = \"a.csv\"\nkind = \"csv\"", 1);
    let kinds = ["line", "`csv`", "`crossing`, `highway`, `trajectories`"];
    assert_refused(&folder, "kind.toml", Some(&recorded), &kinds).await?;
    let bad_hub = CROSSING.replacen("[hub]", "[hub]\ngate = 0", 1);
    assert_refused(&folder, "hub.toml", Some(&bad_hub), &["hub.gate", "0"]).await?;
    assert_refused(&folder, "missing.toml", None, &["no scenario file", "crossing"]).await
}

/// Refused by both `demo` and `up`, before anything is started.
async fn assert_refused(folder: &Path, name: &str, text: Option<&str>, named: &[&str]) -> anyhow::Result<()> {
    if let Some(text) = text {
        assert_ne!(text, CROSSING, "the mistake is in it");
        std::fs::write(folder.join(name), text)?;
    }
    for args in [["demo", "--scenario", name].as_slice(), &["up", name]] {
        let ending = run(folder, args).await?;
        assert_eq!(ending.code, Some(1), "{ending:#?}");
        let named = named.iter().chain([&name]);
        let not_named: Vec<_> = named.filter(|words| !ending.stderr.contains(**words)).collect();
        assert!(not_named.is_empty(), "{args:?} does not name {not_named:?}: {}", ending.stderr);
        assert!(ending.stdout.is_empty() && !folder.join("v2x-runs").exists(), "{ending:#?}");
    }
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_seed_that_is_no_number_is_refused_with_what_is_expected() -> anyhow::Result<()> {
    let folder = folder("bad-seed")?;
    for args in [["demo", "--seed", "abc"], ["up", "--seed", "abc"], ["links", "--seed", "abc"]] {
        let ending = run(&folder, &args).await?;
        assert_eq!(ending.code, Some(2), "{ending:#?}");
        let named = ["'abc'", "--seed", "a whole number from 0 to 18446744073709551615"];
        assert!(named.iter().all(|words| ending.stderr.contains(words)), "{}", ending.stderr);
    }
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_misspelt_log_level_is_refused_and_logs_of_a_pipe_have_no_colour() -> anyhow::Result<()> {
    let folder = folder("bad-log")?;
    let ending = run(&folder, &["links", "--log", "debgu"]).await?;
    assert_eq!(ending.code, Some(1), "{ending:#?}");
    assert!(
        ["debgu", "off, error, warn, info"].iter().all(|words| ending.stderr.contains(words)),
        "{ending:#?}"
    );
    let ending = run(&folder, &["links", "--log", "warn,v2x_fusion_hub=debug"]).await?;
    assert!(ending.code == Some(0) && !ending.stderr.contains('\u{1b}'), "{ending:#?}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_taken_port_is_named() -> anyhow::Result<()> {
    let folder = folder("taken-port")?;
    let holder = TcpListener::bind("127.0.0.1:0")?;
    let endpoint = format!("tcp/{}", holder.local_addr()?);
    let ending = run(&folder, &["up", "crossing", "--listen", &endpoint, "--out", "run"]).await?;
    assert_eq!(ending.code, Some(1), "{ending:#?}");
    assert!(ending.stderr.contains(&format!("cannot listen on {endpoint}")), "{ending:#?}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn an_unknown_agent_is_named_with_the_agents_of_the_scenario() -> anyhow::Result<()> {
    let folder = folder("no-such-agent")?;
    std::fs::write(folder.join("crossing.toml"), CROSSING)?;
    let ending = run(&folder, &["agent", "--scenario", "crossing.toml", "--id", "drone"]).await?;
    assert_eq!(ending.code, Some(1), "{ending:#?}");
    assert!(["drone", "ego", "rsu"].iter().all(|id| ending.stderr.contains(id)), "{ending:#?}");
    Ok(())
}

#[cfg(not(feature = "foxglove"))]
#[tokio::test(flavor = "multi_thread")]
async fn foxglove_without_its_feature_says_how_to_get_it() -> anyhow::Result<()> {
    let ending = run(&folder("no-foxglove")?, &["watch", "--foxglove"]).await?;
    assert_eq!(ending.code, Some(1), "{ending:#?}");
    assert!(ending.stderr.contains("--features foxglove"), "{}", ending.stderr);
    Ok(())
}
