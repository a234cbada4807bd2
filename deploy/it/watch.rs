//! `v2x watch`, the consumer's command.

use crate::support::{Terminal, V2x, folder, run, up, up_with};
use v2x_common::clock;
use v2x_common::keys::Topic;
use v2x_common::lists::ListUpdate;
use v2x_common::recording::Recording;
use v2x_common::time::Span;
use v2x_common::wire;

#[tokio::test(flavor = "multi_thread")]
async fn watch_prints_the_given_number_of_fused_frames_as_json_lines() -> anyhow::Result<()> {
    let folder = folder("watch-json")?;
    let (_up, endpoint) = up(&folder, "watch-json").await?;
    let args = ["watch", "--json", "--count", "3", "--network", "watch-json", "--connect", &endpoint];
    let ending = run(&folder, &args).await?;
    assert_eq!(ending.code, Some(0), "{ending:#?}");
    let frames = ending.stdout.lines().map(|line| wire::json::decode_fused(line.as_bytes()));
    let frames: Vec<_> = frames.collect::<Result<_, _>>()?;
    assert_eq!(frames.len(), 3);
    assert!(frames.is_sorted_by(|a, b| a.sequence < b.sequence && a.fused_at < b.fused_at));
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn watch_and_status_can_believe_one_hub_alone_whoever_spoofs_another() -> anyhow::Result<()> {
    let folder = folder("watch-hub")?;
    let (_up, endpoint) = up(&folder, "watch-hub").await?;
    let at = ["--network", "watch-hub", "--connect", &endpoint];
    let watch = |hub: &'static str| {
        [&["watch", "--json", "--count", "3", "--wait", "5", "--hub", hub], &at[..]].concat()
    };
    let ending = run(&folder, &watch("hub")).await?;
    assert_eq!((ending.code, ending.stdout.lines().count()), (Some(0), 3), "{ending:#?}");
    let ending = run(&folder, &watch("north")).await?;
    assert_eq!((ending.code, ending.stdout.as_str()), (Some(1), ""), "{ending:#?}");
    assert!(ending.stderr.contains("the hub north"), "{ending:#?}");
    let ending = run(&folder, &[&["status", "--hub", "north"], &at[..]].concat()).await?;
    assert_eq!(ending.code, Some(1), "{ending:#?}");
    assert!(ending.stderr.contains("no hub north"), "{ending:#?}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_second_list_is_half_a_second_behind_and_beside_the_live_one() -> anyhow::Result<()> {
    let folder = folder("watch-lagged")?;
    let scenario = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/crossing.toml"))?;
    anyhow::ensure!(scenario.lines().any(|line| line == "[hub]"), "the scenario ends with the hub's table");
    std::fs::write(folder.join("lagged.toml"), scenario + "\nlagged = { lag_ms = 500 }\n")?;
    let (_up, endpoint) = up_with(&folder, "lagged.toml", "watch-lagged").await?;
    let live = ["watch", "--json", "--count", "3", "--network", "watch-lagged", "--connect", &endpoint];
    let lagged = [&live[..], &["--lagged"]].concat();
    for (args, is_lagged) in [(&live[..], false), (&lagged, true)] {
        let ending = run(&folder, args).await?;
        let ended = clock::now();
        assert_eq!(ending.code, Some(0), "{ending:#?}");
        let frames = ending.stdout.lines().map(|line| wire::json::decode_fused(line.as_bytes()));
        let frames: Vec<_> = frames.collect::<Result<_, _>>()?;
        assert_eq!(frames.len(), 3);
        for frame in frames {
            // A busy machine makes frames and lists late, never early: each bound holds at any load.
            if is_lagged {
                assert!(ended - frame.fused_at >= Span::from_millis(500), "{:?}", ended - frame.fused_at);
                assert!(frame.includes.is_empty(), "{:?}", frame.includes);
            } else {
                let newest = frame.agents.iter().map(|health| health.newest_captured_at).max();
                assert!(
                    newest.is_none_or(|newest| newest <= frame.fused_at),
                    "{newest:?} {:?}",
                    frame.fused_at
                );
            }
        }
    }
    Ok(())
}

/// Munich.
const TILES: &str = "tiles = { latitude_deg = 48.137, longitude_deg = 11.575 }";

#[tokio::test(flavor = "multi_thread")]
async fn a_list_by_what_changes_or_by_tile_is_shown_as_the_whole_one_without_contributors()
-> anyhow::Result<()> {
    let folder = folder("watch-parts")?;
    let scenario = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/crossing.toml"))?;
    anyhow::ensure!(scenario.lines().any(|line| line == "[hub]"), "the scenario ends with the hub's table");
    std::fs::write(folder.join("tiles.toml"), format!("{scenario}\n{TILES}\n"))?;
    let (_up, endpoint) = up_with(&folder, "tiles.toml", "watch-parts").await?;
    let whole = ["watch", "--json", "--count", "30", "--network", "watch-parts", "--connect", &endpoint];
    for part in [&["--delta"][..], &["--tile", "120230002213"]] {
        let ending = run(&folder, &[&whole[..], part].concat()).await?;
        assert_eq!(ending.code, Some(0), "{ending:#?}");
        let frames = ending.stdout.lines().map(|line| wire::json::decode_fused(line.as_bytes()));
        let frames: Vec<_> = frames.collect::<Result<_, _>>()?;
        assert_eq!(frames.len(), 30, "{part:?}: a list after each message");
        assert!(frames.is_sorted_by(|a, b| a.sequence <= b.sequence && a.fused_at <= b.fused_at));
        let objects: Vec<_> = frames.iter().flat_map(|frame| &frame.objects).collect();
        assert!(
            !objects.is_empty() && objects.iter().all(|object| object.contributors.is_empty()),
            "{part:?}"
        );
    }
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_recording_of_what_changes_holds_nothing_else() -> anyhow::Result<()> {
    let folder = folder("watch-record-delta")?;
    let (_up, endpoint) = up(&folder, "watch-record-delta").await?;
    let args =
        ["watch", "--delta", "--record", "run.mcap", "--count", "5", "--network", "watch-record-delta"];
    let ending = run(&folder, &[&args[..], &["--connect", &endpoint]].concat()).await?;
    assert_eq!(ending.code, Some(0), "{ending:#?}");
    let recording = Recording::open(&folder.join("run.mcap"))?;
    let entries: Vec<_> = recording.collect::<Result<_, _>>()?;
    assert!(entries.iter().all(|entry| matches!(Topic::of(&entry.key), Some(Topic::Delta(_)))));
    let first =
        entries.first().map(|entry| wire::decode_update(&entry.encoding, &entry.payload)).transpose()?;
    assert!(matches!(first, Some(ListUpdate::Key(_))) && entries.len() == 5, "{} entries", entries.len());
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_tile_that_is_none_is_refused_by_its_digit() -> anyhow::Result<()> {
    let folder = folder("watch-no-tile")?;
    let ending = run(&folder, &["watch", "--tile", "1243"]).await?;
    assert_eq!(ending.code, Some(2), "{ending:#?}");
    assert!(ending.stderr.contains("--tile") && ending.stderr.contains("holds '4'"), "{ending:#?}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn watch_prints_a_table_of_objects_and_agents() -> anyhow::Result<()> {
    let folder = folder("watch-table")?;
    let (_up, endpoint) = up(&folder, "watch-table").await?;
    let mut watch = V2x::start(&folder, &["watch", "--network", "watch-table", "--connect", &endpoint])?;
    let awaited = ["newest measurement", "ego ", "vehicle.car"];
    let mut seen = [false; 3];
    while !seen.iter().all(|is_seen| *is_seen) {
        let line = watch.line().await?;
        anyhow::ensure!(!line.is_empty(), "the table has ended");
        anyhow::ensure!(!line.contains('\u{1b}'), "a pipe has no use for styles: {line:?}");
        for (seen, text) in seen.iter_mut().zip(awaited) {
            *seen |= line.contains(text);
        }
    }
    Ok(())
}

/// `script` gives the program a terminal. Its size is 80 columns, by the `stty` before.
#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread")]
async fn in_a_terminal_the_table_is_drawn_and_a_key_ends_it_and_restores_the_terminal() -> anyhow::Result<()>
{
    let folder = folder("watch-terminal")?;
    let (_up, endpoint) = up(&folder, "watch-terminal").await?;
    let watch = format!(
        "stty cols 80 rows 24; {} watch --network watch-terminal --connect {endpoint}; echo ended with $?",
        env!("CARGO_BIN_EXE_v2x")
    );
    let mut terminal = Terminal::start(&folder, &watch)?;
    // The alternate screen; then the keys, which are drawn below a first table.
    terminal.wait_for("\u{1b}[?1049h").await?;
    terminal.wait_for("q quit").await?;
    terminal.press(b"s").await?;
    terminal.wait_for("class").await?;
    terminal.press(b"q").await?;
    terminal.wait_for("\u{1b}[?1049l").await?;
    terminal.wait_for("ended with 0").await
}

#[tokio::test(flavor = "multi_thread")]
async fn watch_without_a_hub_ends_with_advice() -> anyhow::Result<()> {
    let folder = folder("watch-nothing")?;
    // Port 1 of the loopback: nothing listens there, and no free port of another test is 1.
    let ending = run(&folder, &["watch", "--connect", "tcp/127.0.0.1:1", "--wait", "0.5"]).await?;
    assert_eq!(ending.code, Some(1), "{ending:#?}");
    let advice = ["no hub or router answered", "v2x up crossing", "--connect"];
    assert!(advice.iter().all(|words| ending.stderr.contains(words)), "{ending:#?}");
    assert!(ending.stdout.is_empty(), "{ending:#?}");
    Ok(())
}
