//! `lab sweep` as a program, also over real Zenoh.

use crate::folder::Folder;
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

fn mate_m(rows: &Value, method: &str, live: bool) -> f64 {
    let is_it = |row: &&Value| row["method"] == method && row["live"] == live && row["subset"] == "all";
    let row = rows.as_array().and_then(|rows| rows.iter().find(is_it)).expect("a row");
    row["mate_m"].as_f64().expect("an error")
}

#[test]
fn hubs_over_the_network_give_the_results_of_virtual_time() {
    let folder = Folder::new("sweep-live");
    let command = "sweep latency=150 --methods single,replay --live --seeds 1 --duration 6s --out out --json";
    let rows = folder.json(command);
    assert_eq!(rows.as_array().map(Vec::len), Some(2 * 2 * 4));
    for method in ["single", "replay"] {
        let (live, simulated) = (mate_m(&rows, method, true), mate_m(&rows, method, false));
        // The frames are the same. Publishing times differ, and the network adds delay.
        assert!(
            (live / simulated - 1.0).abs() < 0.1,
            "{method}: {live} m live, {simulated} m in virtual time"
        );
    }
    assert!(mate_m(&rows, "replay", true) < mate_m(&rows, "single", true));
    let live_row =
        rows.as_array().and_then(|rows| rows.iter().find(|row| row["live"] == true)).expect("a row");
    assert!(live_row["fused_to_consumed_ms"]["p50"].as_f64().is_some_and(|ms| ms > 0.0));
    // Stored runs are not repeated.
    assert_eq!(folder.json(command), rows);
}

#[test]
fn ctrl_c_ends_a_live_sweep_and_all_its_processes() {
    let folder = Folder::new("sweep-interrupted");
    let lab = Path::new(env!("CARGO_BIN_EXE_lab"));
    let arguments = "sweep latency=0 --methods ours --live --seeds 1 --duration 10min --out out";
    let mut sweep = Command::new(lab);
    sweep.args(arguments.split(' ')).current_dir(&folder.0).stderr(Stdio::piped());
    let mut sweep = Running(sweep.spawn().expect("lab runs"));
    let sweep = &mut sweep.0;
    // The log of the agent exists after its start, which is after that of the hub.
    let log = folder.0.join("out/live/000/car.log");
    while !std::fs::read_to_string(&log).is_ok_and(|text| text.contains("connected")) {
        assert!(sweep.try_wait().expect("a child").is_none(), "the sweep ended by itself");
        std::thread::yield_now();
    }
    let children = children_of(sweep.id());
    assert_eq!(children.len(), 4, "a relay, a hub and two agents");
    let killed = Command::new("kill").args(["-INT", &sweep.id().to_string()]).status().expect("kill runs");
    assert!(killed.success());
    let said: Vec<String> =
        BufReader::new(sweep.stderr.take().expect("piped")).lines().map_while(Result::ok).collect();
    assert_eq!(sweep.wait().expect("a child").code(), Some(130), "{said:?}");
    assert!(said.iter().any(|line| line.contains("interrupted")), "{said:?}");
    // They were killed before the program ended, but the system may not have reaped them yet.
    assert!(children.iter().all(|id| !is_running(*id)), "{children:?}");
}

/// A process that is killed at the end of the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
    }
}

fn children_of(id: u32) -> Vec<u32> {
    let path = format!("/proc/{id}/task");
    let tasks = std::fs::read_dir(path).expect("the process runs").filter_map(Result::ok);
    let children = tasks.filter_map(|task| std::fs::read_to_string(task.path().join("children")).ok());
    children
        .flat_map(|text| text.split_whitespace().filter_map(|id| id.parse().ok()).collect::<Vec<u32>>())
        .collect()
}

fn is_running(id: u32) -> bool {
    std::fs::read_to_string(format!("/proc/{id}/stat")).is_ok_and(|stat| !stat.contains(") Z "))
}

#[test]
fn an_invalid_sweep_is_an_error_before_any_run() {
    let folder = Folder::new("sweep-wrong");
    let cases = [
        ("sweep latencies", "latency"),
        ("sweep latency=0,-5", "latency=-5: "),
        ("sweep agents.unknown.rate_hz=1,2", "it has rsu, car"),
        ("sweep latency --duration 1s", "--duration is 1 s"),
        ("sweep latency --scenario missing.toml", "missing.toml"),
        ("sweep delta-max --delta-max 300", "leave it out"),
    ];
    for (arguments, named) in cases {
        let complaint = folder.complaint(arguments);
        assert!(complaint.contains(named), "{arguments}: {complaint}");
    }
}
