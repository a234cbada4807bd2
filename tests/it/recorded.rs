//! Recorded traffic as the truth of the laboratory's commands, started in another folder than its files are in.

use crate::folder::Folder;

const JUNCTION: &str = include_str!("../../deploy/examples/recorded/junction.csv");
const SCENARIO: &str = include_str!("../../deploy/examples/recorded/junction.toml");

fn folder(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("mine/junction.csv", JUNCTION);
    folder.write("mine/junction.toml", SCENARIO);
    folder
}

#[test]
fn a_recorded_world_is_simulated_and_scored_against_itself() {
    let folder = folder("recorded-simulate");
    let summary = folder.json("simulate mine/junction.toml --duration 40s --json");
    let ate_m = summary["fused"]["ate_m"].as_f64();
    assert!(ate_m.is_some_and(|ate_m| ate_m < 0.5), "{summary}");
    assert_eq!(folder.json("simulate mine/junction.toml --duration 40s --json"), summary);
}

#[test]
fn a_simulation_whose_hub_reads_frames_wrongly_fails_and_says_why() {
    let folder = folder("recorded-misread");
    // The scenario ends with the table of the hub.
    let wrong = "only_agents = [\"rsu\"]\n[hub.agents.rsu]\nframe = \"ego\"\n";
    folder.write("mine/wrong.toml", &format!("{SCENARIO}\n{wrong}"));
    let complaint = folder.complaint("simulate mine/wrong.toml --duration 20s");
    assert!(complaint.contains("[hub.agents.NAME]"), "{complaint}");
}

#[test]
fn a_sweep_varies_agents_in_recorded_traffic() {
    let folder = folder("recorded-sweep");
    let sweep = "sweep latency=0,400 --scenario mine/junction.toml --seeds 1 --duration 20s --methods drop-late,ours --json";
    let rows = folder.json(sweep);
    let text = rows.to_string();
    assert!(text.contains("ours") && text.contains("400"), "{text}");
    let complaint =
        folder.complaint("sweep agents.ego.ride=veh5,nobody --scenario mine/junction.toml --out other");
    assert!(complaint.contains("agents[0].ride is \"nobody\"") && complaint.contains("veh1"), "{complaint}");
}
