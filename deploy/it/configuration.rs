//! deploy/docs/configuration.md against the types: its blocks are valid, hold the defaults, and name every key.
//!
//! A block is read as it stands. Lines such as `# key = value` are keys without a default: each run of them is also read
//! without the `#`, in place of lines that set the same key, or the key that the comment names after "instead of". The
//! keys that a type has are those that its error names when it meets an unknown one.

use anyhow::{Context, ensure};
use std::collections::{BTreeMap, BTreeSet};
use toml::{Table, Value};
use v2x_agent::scenario::Scenario;
use v2x_fusion_hub::hub::HubSettings;

const PAGE: &str = include_str!("../docs/configuration.md");
/// A key that no table has.
const UNKNOWN: &str = "no_such_key";

/// The lines of the page's block of this name.
fn block(name: &str) -> anyhow::Result<Vec<&'static str>> {
    let mut lines = PAGE.lines().skip_while(|line| *line != format!("```toml {name}"));
    lines.next().with_context(|| format!("configuration.md has no block {name}"))?;
    Ok(lines.take_while(|line| !line.starts_with("```")).collect())
}

/// The key that a line sets.
fn key(line: &str) -> Option<&str> {
    let (key, _) = line.split_once(" = ")?;
    key.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_').then_some(key)
}

/// What a line without a default says when its `#` is taken away.
fn without_default(line: &str) -> Option<&str> {
    let line = line.strip_prefix("# ")?;
    (key(line).is_some() || line.starts_with('[')).then_some(line)
}

fn parse(lines: &[&str]) -> anyhow::Result<Table> {
    let text = lines.join("\n");
    text.parse().with_context(|| text.clone())
}

/// The block as it stands, and once more with each run of lines without defaults.
fn variants(block: &[&str]) -> anyhow::Result<Vec<Table>> {
    let mut variants = vec![parse(block)?];
    let mut at = 0;
    while at < block.len() {
        let run: Vec<_> = block[at..].iter().map_while(|line| without_default(line)).collect();
        if !run.is_empty() {
            let replaced: BTreeSet<_> = run.iter().flat_map(|line| [key(line), instead_of(line)]).collect();
            let is_kept = |line: &&&str| key(line).is_none_or(|key| !replaced.contains(&Some(key)));
            // A run that begins a table of its own repeats no key.
            let before = block[..at].iter().filter(|line| run[0].starts_with('[') || is_kept(line));
            let after =
                block[at + run.len()..].iter().filter(|line| run[0].starts_with('[') || is_kept(line));
            variants.push(parse(
                &before.copied().chain(run.iter().copied()).chain(after.copied()).collect::<Vec<_>>(),
            )?);
        }
        at += run.len().max(1);
    }
    Ok(variants)
}

/// The key that a line replaces by its comment.
fn instead_of(line: &str) -> Option<&str> {
    let (_, after) = line.split_once("instead of ")?;
    after.split(|c: char| !c.is_ascii_lowercase() && c != '_').next()
}

/// The names of every table by its place, such as `agents.0.link`; the places of single agents' tables have any name.
fn documented(variants: &[Table]) -> BTreeMap<Vec<String>, BTreeSet<String>> {
    fn add(value: &Value, place: &[String], names: &mut BTreeMap<Vec<String>, BTreeSet<String>>) {
        let below: Vec<(String, &Value)> = match value {
            Value::Table(table) => {
                names.entry(place.to_vec()).or_default().extend(table.keys().cloned());
                table.iter().map(|(key, value)| (key.clone(), value)).collect()
            }
            Value::Array(items) => {
                items.iter().enumerate().map(|(idx, item)| (idx.to_string(), item)).collect()
            }
            _ => Vec::new(),
        };
        for (key, value) in below {
            add(value, &[place, &[key]].concat(), names);
        }
    }
    let mut names = BTreeMap::new();
    for variant in variants {
        add(&Value::Table(variant.clone()), &[], &mut names);
    }
    names
}

/// The same table with an unknown key at a place, if it has that place.
fn with_unknown(table: &Table, place: &[String]) -> Option<Table> {
    let mut whole = Value::Table(table.clone());
    let mut at = &mut whole;
    for name in place {
        at = match at {
            Value::Array(items) => items.get_mut(name.parse::<usize>().ok()?)?,
            Value::Table(table) => table.get_mut(name)?,
            _ => return None,
        };
    }
    at.as_table_mut()?.insert(UNKNOWN.to_owned(), Value::Table(Table::new()));
    whole.as_table().cloned()
}

/// Every variant is valid, and every name that the type has at a place is documented there; at `free` all names are valid.
fn assert_complete(
    variants: &[Table],
    free: &str,
    read: impl Fn(&Table) -> Result<(), String>,
) -> anyhow::Result<()> {
    for variant in variants {
        read(variant).map_err(|error| anyhow::anyhow!("{error}\n{variant}"))?;
    }
    // The names of classes are the user's own.
    let is_closed = |place: &[String]| place.last().is_none_or(|name| name != "classes");
    for (place, names) in documented(variants).into_iter().filter(|(place, _)| is_closed(place)) {
        for probe in variants.iter().filter_map(|variant| with_unknown(variant, &place)) {
            let Err(error) = read(&probe) else {
                ensure!(place == [free], "{place:?} takes any key");
                continue;
            };
            // unknown field `x`, expected one of `a`, `b` in `place`
            let (_, expected) = error.split_once("expected ").with_context(|| error.clone())?;
            let expected = expected.split(" in `").next().unwrap_or_default();
            let listed: BTreeSet<_> = expected.split('`').skip(1).step_by(2).map(str::to_owned).collect();
            ensure!(error.contains(UNKNOWN) && !listed.is_empty(), "{place:?}: {error}");
            let missing: Vec<_> = listed.difference(&names).collect();
            ensure!(missing.is_empty(), "configuration.md does not name {missing:?} in {place:?}");
        }
    }
    Ok(())
}

fn read_hub(table: &Table) -> Result<HubSettings, String> {
    HubSettings::from_table(table.clone()).map_err(|error| error.to_string())
}

fn read_scenario(table: &Table) -> Result<Scenario, String> {
    Scenario::from_toml(&table.to_string()).map_err(|error| error.to_string())
}

fn hub_of(mut file: Table) -> Table {
    match file.remove("hub") {
        Some(Value::Table(hub)) => hub,
        _ => Table::new(),
    }
}

/// A scenario whose agent has this table under a key.
fn with_agents(scenario: &Table, key: &str, table: &Table) -> Table {
    let mut scenario = scenario.clone();
    let agents = scenario.get_mut("agents").and_then(Value::as_array_mut);
    for agent in agents.into_iter().flatten().filter_map(Value::as_table_mut) {
        agent.insert(key.to_owned(), Value::Table(table.clone()));
    }
    scenario
}

/// Headers, and the keys without which the file is refused.
fn required<'a>(block: &[&'a str]) -> Vec<&'a str> {
    let is_required =
        |line: &&&str| line.starts_with('[') || key(line).is_some() && line.contains("required");
    block.iter().filter(is_required).copied().collect()
}

#[test]
fn the_hub_table_of_the_page_holds_the_defaults() -> anyhow::Result<()> {
    let hub = hub_of(parse(&block("hub")?)?);
    assert_eq!(read_hub(&hub), Ok(HubSettings::default()));
    Ok(())
}

#[test]
fn every_key_of_the_hub_table_is_on_the_page() -> anyhow::Result<()> {
    let variants: Vec<_> = variants(&block("hub")?)?.into_iter().map(hub_of).collect();
    // Names of agents.
    assert_complete(&variants, "agents", |table| read_hub(table).map(|_| ()))
}

#[test]
fn the_scenarios_of_the_page_hold_the_defaults() -> anyhow::Result<()> {
    let block_of_scenario = block("scenario")?;
    let (whole, least) = (parse(&block_of_scenario)?, parse(&required(&block_of_scenario))?);
    let scenario = read_scenario(&least);
    assert!(scenario.is_ok(), "{scenario:?}");
    assert_eq!(read_scenario(&whole), scenario);
    for (key, name) in [("link", "link"), ("noise", "noise")] {
        let table = parse(&block(name)?)?;
        assert_eq!(read_scenario(&with_agents(&least, key, &table)), scenario, "{key}");
    }
    let highway = |lines: &[&str]| Ok::<_, anyhow::Error>(read_scenario(&at_highway(&whole, &parse(lines)?)));
    let block_of_highway = block("highway")?;
    assert_eq!(highway(&block_of_highway)?, highway(&required(&block_of_highway))?);
    Ok(())
}

#[test]
fn every_key_of_a_scenario_is_on_the_page() -> anyhow::Result<()> {
    let mut all = variants(&block("scenario")?)?;
    let whole = all.first().context("the block itself")?.clone();
    for name in ["link", "noise"] {
        all.extend(variants(&block(name)?)?.iter().map(|table| with_agents(&whole, name, table)));
    }
    all.push(at_highway(&whole, &parse(&block("highway")?)?));
    let traffic = recorded_with_a_scene()?;
    all.extend(variants(&block("trajectories")?)?.iter().map(|table| on_the_road(&whole, table, &traffic)));
    all.extend(variants(&block("sumo")?)?.iter().map(|table| on_the_road(&whole, table, "crossing.sumocfg")));
    // A scenario does not read the hub's table.
    assert_complete(&all, "hub", |table| read_scenario(table).map(|_| ()))
}

/// A file of recorded traffic that has the scene of the page.
fn recorded_with_a_scene() -> anyhow::Result<String> {
    let junction = include_str!("../examples/recorded/junction.csv");
    let rows = junction.lines().enumerate().map(|(row, line)| {
        let scene = if row == 0 { "scene" } else { "one" };
        format!("{line},{scene}\n")
    });
    let file = concat!(env!("CARGO_TARGET_TMPDIR"), "/configuration.csv");
    std::fs::write(file, rows.collect::<String>())?;
    Ok(file.to_owned())
}

/// The scenario with recorded traffic, whose agent rides on one of its objects; the paths of its files lead to real ones.
fn on_the_road(scenario: &Table, block: &Table, traffic: &str) -> Table {
    let mut world = block.clone();
    let mut roads = world.remove("world").and_then(|inner| inner.get("road").cloned());
    for road in roads.iter_mut().filter_map(Value::as_array_mut).flatten().filter_map(Value::as_table_mut) {
        // These are of lines only.
        if road.contains_key("polygon") {
            road.retain(|key, _| key == "polygon");
        }
    }
    world.extend(roads.map(|roads| ("road".to_owned(), roads)));
    if !world.contains_key("traci") {
        world.insert("file".to_owned(), Value::from(traffic));
    }
    if world.contains_key("vtypes") {
        let demand = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/sumo/demand.rou.xml");
        world.insert("vtypes".to_owned(), Value::from(demand));
    }
    let mut scenario = scenario.clone();
    scenario.remove("loop_s");
    scenario.insert("world".to_owned(), Value::Table(world));
    let agents = scenario.get_mut("agents").and_then(Value::as_array_mut);
    for agent in agents.into_iter().flatten().filter_map(Value::as_table_mut) {
        agent.remove("route");
        agent.insert("ride".to_owned(), Value::from("veh5"));
    }
    scenario
}

/// The scenario in another world, on one of its routes.
fn at_highway(scenario: &Table, world: &Table) -> Table {
    let mut scenario = scenario.clone();
    scenario.insert("world".to_owned(), Value::Table(world.clone()));
    let agents = scenario.get_mut("agents").and_then(Value::as_array_mut);
    for agent in agents.into_iter().flatten().filter_map(Value::as_table_mut) {
        agent.insert("route".to_owned(), Value::from("service-south"));
    }
    scenario
}

#[test]
fn every_method_of_the_hub_is_on_the_page_of_methods() {
    let page = include_str!("../docs/methods.md");
    for preset in v2x_fusion_hub::fusion::PRESETS {
        assert!(page.contains(&format!("`{}`", preset.key)), "methods.md does not name {}", preset.key);
    }
}
