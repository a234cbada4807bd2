//! No process outlives `v2x`, however it ends.
//!
//! [`V2x::end`] is the proof: it returns only when every process that `v2x` started has ended.

use crate::support::{V2x, folder, send, up};
use anyhow::Context;
use std::path::Path;

#[tokio::test(flavor = "multi_thread")]
async fn children_of_a_killed_demo_end() -> anyhow::Result<()> {
    let demo = running_demo(&folder("killed-demo")?).await?;
    let children = children(&demo)?;
    assert_eq!(children.len(), 4);
    let lifeline = |process_id| std::fs::read_link(format!("/proc/{process_id}/fd/3"));
    for (child, words) in children {
        assert_eq!(lifeline(child)?, lifeline(demo.process_id()?)?, "{words:?} does not hold the pipe");
    }
    send("KILL", demo.process_id()?).await?;
    assert_eq!(demo.end().await?.code, None);
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn children_of_a_killed_network_end() -> anyhow::Result<()> {
    let (up, _) = up(&folder("killed-up")?, "killed-up").await?;
    assert_eq!(children(&up)?.len(), 3);
    send("KILL", up.process_id()?).await?;
    assert_eq!(up.end().await?.code, None);
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn ctrl_c_ends_the_demo_with_130() -> anyhow::Result<()> {
    let demo = running_demo(&folder("interrupted-demo")?).await?;
    send("INT", demo.process_id()?).await?;
    let ending = demo.end().await?;
    assert_eq!(ending.code, Some(130), "{ending:#?}");
    assert!(ending.stdout.is_empty() && ending.stderr.contains("interrupted"), "{ending:#?}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn ctrl_c_and_sigterm_end_a_network_with_0() -> anyhow::Result<()> {
    for signal in ["INT", "TERM"] {
        let (up, _) = up(&folder("interrupted-up")?, "interrupted-up").await?;
        send(signal, up.process_id()?).await?;
        let ending = up.end().await?;
        assert_eq!(ending.code, Some(0), "{ending:#?}");
        assert!(ending.stderr.contains("all processes have ended"), "{ending:#?}");
    }
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_crashed_hub_ends_the_demo_with_an_error_that_names_it() -> anyhow::Result<()> {
    let demo = running_demo(&folder("crashed-hub")?).await?;
    send("KILL", child(&demo, "hub")?).await?;
    let ending = demo.end().await?;
    assert_eq!(ending.code, Some(1), "{ending:#?}");
    assert!(ending.stderr.contains("v2x: hub ended") && ending.stderr.contains("SIGKILL"), "{ending:#?}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_crashed_agent_ends_the_network_with_an_error_that_names_it() -> anyhow::Result<()> {
    let (up, _) = up(&folder("crashed-agent")?, "crashed-agent").await?;
    send("KILL", child(&up, "ego")?).await?;
    let ending = up.end().await?;
    assert_eq!(ending.code, Some(1), "{ending:#?}");
    assert!(ending.stderr.contains("ego ended") && ending.stderr.contains("SIGKILL"), "{ending:#?}");
    Ok(())
}

/// A demo with all its processes, long before its end.
async fn running_demo(folder: &Path) -> anyhow::Result<V2x> {
    let mut demo = V2x::start(folder, &["demo", "--duration", "10min", "--out", "run"])?;
    demo.stderr_line("all processes are up").await?;
    Ok(demo)
}

/// The child with this word in its command line.
fn child(of: &V2x, word: &str) -> anyhow::Result<u32> {
    let children = children(of)?;
    let found = children.iter().find(|(_, words)| words.iter().any(|each| each == word));
    let (process_id, _) = found.with_context(|| format!("no {word} in {children:?}"))?;
    Ok(*process_id)
}

/// Process ids and command lines of the children.
fn children(of: &V2x) -> anyhow::Result<Vec<(u32, Vec<String>)>> {
    let parent = of.process_id()?;
    let mut children = Vec::new();
    for entry in std::fs::read_dir("/proc")? {
        let Ok(process_id) = entry?.file_name().to_string_lossy().parse::<u32>() else { continue };
        // Another process may end while this reads its files.
        let Ok(stat) = std::fs::read_to_string(format!("/proc/{process_id}/stat")) else { continue };
        if parent_in(&stat) == Some(parent) {
            let words = std::fs::read_to_string(format!("/proc/{process_id}/cmdline"))?;
            children.push((process_id, words.split('\0').map(str::to_owned).collect()));
        }
    }
    Ok(children)
}

/// The fourth field; the second is a name in brackets, which may hold anything.
fn parent_in(stat: &str) -> Option<u32> {
    let (_, after_name) = stat.rsplit_once(')')?;
    after_name.split_whitespace().nth(1)?.parse().ok()
}
