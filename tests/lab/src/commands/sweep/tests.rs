//! Whole sweeps in virtual time.

use crate::commands::sweep::run::run_virtual;
use crate::commands::sweep::store::Store;
use crate::drive::sweep::method::SweepMethod;
use crate::drive::sweep::plan::{Length, Plan};
use crate::drive::sweep::scenarios::DEFAULT_SCENARIO;
use crate::report::sweep::rows::Row;
use crate::report::sweep::{files, text};
use crate::score::sweep::record::Subset;
use std::path::PathBuf;
use v2x_common::time::Span;

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("v2x-sweep-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    folder
}

fn plan(axes: &[&str], methods: &[SweepMethod], seconds: i64) -> Plan {
    Plan {
        base: DEFAULT_SCENARIO.parse().unwrap(),
        axes: axes.iter().map(|axis| axis.parse().unwrap()).collect(),
        delta_max_ms: vec![None],
        seeds: vec![1],
        methods: methods.to_vec(),
        length: Length { duration: Span::from_millis(1000 * seconds), settle: Span::from_millis(2000) },
        live: false,
    }
}

fn rows(plan: &Plan, name: &str) -> Vec<Row> {
    let folder = folder(name);
    let rows = run_virtual(plan, &Store::open(&folder).unwrap(), 2).unwrap().rows();
    std::fs::remove_dir_all(folder).unwrap();
    rows
}

fn mate_m(rows: &[Row], method: SweepMethod, x: f64) -> f64 {
    let is_it = |row: &&Row| row.method == method.key() && row.x == x && row.subset == Subset::All.name();
    rows.iter().find(is_it).unwrap().mate_m.unwrap()
}

#[test]
fn beyond_delta_max_another_agent_has_no_influence() {
    use SweepMethod::{DropLate, Ours, Replay, RollbackLiteral, Single, SingleOurs};
    let plan = plan(&["latency=900"], &SweepMethod::ALL, 8);
    let rows = rows(&plan, "beyond");
    for (method, alone) in
        [(Replay, Single), (RollbackLiteral, Single), (DropLate, Single), (Ours, SingleOurs)]
    {
        assert_eq!(mate_m(&rows, method, 900.0), mate_m(&rows, alone, 900.0), "{}", method.key());
    }
    let refused = rows.iter().find(|row| row.method == "ours").unwrap().refused;
    assert_eq!(refused, Some(1.0));
}

#[test]
fn replaying_late_data_lowers_the_error_and_losing_newer_data_raises_it() {
    use SweepMethod::{Replay, RollbackLiteral, Single};
    let mut plan = plan(&["latency=0,200"], &[Single, RollbackLiteral, Replay], 16);
    plan.seeds = vec![1, 2, 3];
    let rows = rows(&plan, "replay");
    let at = |method, x| mate_m(&rows, method, x);
    assert!(at(Replay, 0.0) < at(Replay, 200.0) && at(Replay, 200.0) < at(Single, 200.0));
    assert!(at(RollbackLiteral, 200.0) > at(Single, 200.0));
    let versus = rows.iter().find(|row| row.method == "replay" && row.x == 200.0).unwrap().versus_alone;
    assert!(versus.is_some_and(|versus| versus.low < versus.ratio && versus.high < 1.0), "{versus:?}");
    let kept = |x| rows.iter().find(|row| row.method == "replay" && row.x == x).unwrap().kept.unwrap();
    assert!(kept(0.0) == 1.0 && (0.1..0.95).contains(&kept(200.0)), "{}", kept(200.0));
}

#[test]
fn a_stopped_sweep_continues_and_gives_the_same_results() {
    let folder = folder("resume");
    let whole = plan(&["loss=0,0.5"], &[SweepMethod::Single, SweepMethod::Ours], 5);
    let first = plan(&["loss=0"], &[SweepMethod::Ours], 5);
    run_virtual(&first, &Store::open(&folder).unwrap(), 1).unwrap();
    let store = Store::open(&folder).unwrap();
    assert_eq!(store.len(), 1);
    let resumed = run_virtual(&whole, &store, 2).unwrap().rows();
    assert_eq!(Store::open(&folder).unwrap().len(), 4);
    let again = run_virtual(&whole, &Store::open(&folder).unwrap(), 2).unwrap().rows();
    assert!(resumed == again, "kept rows differ");
    assert!(resumed == rows(&whole, "fresh"), "a resumed sweep differs from one in one go");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_grid_has_one_curve_for_each_second_value_and_is_written_to_files() {
    let folder = folder("grid");
    let plan = plan(&["latency=0,300", "agents=1,2"], &[SweepMethod::Ours], 5);
    let results = run_virtual(&plan, &Store::open(&folder).unwrap(), 2).unwrap();
    let rows = results.rows();
    assert_eq!(rows.len(), 4 * 4);
    // A single agent does not depend on the delay of the other one.
    let alone: Vec<_> = rows.iter().filter(|row| row.y == Some(1.0)).map(|row| row.mate_m).collect();
    assert_eq!(alone[..4], alone[4..]);
    let printed = text::terminal(&rows);
    assert!(
        printed.contains("agents 1, Δmax 500 ms") && printed.contains("agents 2, Δmax 500 ms"),
        "{printed}"
    );
    files::write(&rows, &[results], "lab sweep", &folder).unwrap();
    let written = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    assert_eq!(written("rows.csv").lines().count(), 1 + rows.len());
    assert!(written("rows.csv").starts_with("method,axis,x,"));
    assert!(written("report.html").contains("agents 2") && written("plots/error.svg").contains("mATE"));
    std::fs::remove_dir_all(folder).unwrap();
}
