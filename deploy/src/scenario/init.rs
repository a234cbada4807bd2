//! Writes the file, and reads it once as a check.

use super::args::{Action, InitArgs, ScenarioArgs};
use super::text::{self, Files};
use crate::{recorded, sumo_home};
use anyhow::{Context, bail};
use std::fs::File;
use std::io::{self, BufReader, Read, Write};
use std::path::{Component, Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::Duration;
use v2x_agent::scenario::{Scenario, open_traffic};
use v2x_agent::trajectories::{ReadOptions, read_begin};

/// So much of SUMO is seen from its first time on, s.
const SEEN_S: f64 = 180.0;
/// Time for SUMO to show it; what came until then is used.
const PATIENCE: Duration = Duration::from_secs(300);
/// Lines of SUMO that are shown where it fails.
const SAID_LINES: usize = 5;
const CROSSING: &str = include_str!("../../scenarios/crossing.toml");

pub(crate) fn run(args: &ScenarioArgs) -> anyhow::Result<()> {
    let Action::Init(args) = &args.action;
    let out = args.out.clone().unwrap_or_else(|| default_out(args.world.as_deref()));
    check_name(&out)?;
    if out.exists() && !args.force {
        bail!("{} exists; choose another name, or give --force to overwrite it", out.display());
    }
    if let (None, Some(option)) = (&args.world, args.of.given()) {
        bail!("{option} is for recorded traffic: give its file by --world");
    }
    let text = match &args.world {
        Some(world) => of_world(args, world, &out)?,
        None => CROSSING.to_owned(),
    };
    std::fs::write(&out, text).with_context(|| format!("writing {}", out.display()))?;
    let scenario = Scenario::load(&out).context("reading what was written")?;
    let agents: Vec<_> = scenario.agents.iter().map(|agent| agent.id().to_string()).collect();
    let _ = writeln!(
        io::stderr(),
        "{}: agents {}\nrun it: v2x up {} --web",
        out.display(),
        agents.join(", "),
        crate::output::shell_word(&out.display().to_string())
    );
    Ok(())
}

/// A scenario is a `.toml`: recorded traffic that is given in its place must not be overwritten, whatever is forced.
fn check_name(out: &Path) -> anyhow::Result<()> {
    if out.extension().is_some_and(|suffix| suffix.eq_ignore_ascii_case("toml")) {
        return Ok(());
    }
    let file = out.display();
    let word = crate::output::shell_word(&file.to_string());
    bail!(
        "{file} is no name for a scenario to write, which ends with .toml; the scenario of recorded traffic in {file} is written by: \
         v2x scenario init --world {word}"
    );
}

fn default_out(world: Option<&Path>) -> PathBuf {
    world
        .and_then(|world| recorded::stem(sumo_config(world).unwrap_or(world)))
        .map_or_else(|| PathBuf::from("scenario.toml"), |stem| PathBuf::from(format!("{stem}.toml")))
}

fn of_world(args: &InitArgs, world: &Path, out: &Path) -> anyhow::Result<String> {
    if let Some(config) = sumo_config(world) {
        if let Some(option) = args.of.given() {
            bail!("{option} is for recorded traffic, and SUMO is run");
        }
        return of_sumo(config, out);
    }
    let (traffic, options) = args.of.open(world)?;
    for warning in &traffic.remarks.warnings {
        tracing::warn!("{}: looks wrong: {warning}", world.display());
    }
    let vtypes = args.of.vtypes.as_deref().map(|file| from_folder_of(out, file)).transpose()?;
    let files = Files { traffic: &from_folder_of(out, world)?, vtypes: vtypes.as_deref() };
    Ok(text::scenario(&traffic, &options, &files))
}

/// The configuration of SUMO that a world names.
fn sumo_config(world: &Path) -> Option<&Path> {
    world.to_str()?.strip_prefix("sumo:").map(Path::new)
}

/// Runs SUMO for a while as fast as it can, to see who drives where.
fn of_sumo(config: &Path, out: &Path) -> anyhow::Result<String> {
    let mut command = sumo_home::command(config)?;
    let text = File::open(config).with_context(|| format!("reading {}", config.display()))?;
    // What SUMO cannot read it says itself.
    let begin_s = read_begin(BufReader::new(text)).ok().flatten().unwrap_or(0.0);
    let fcd = std::env::temp_dir().join(format!("v2x-init-{}.xml", std::process::id()));
    // A port of the configuration would make it wait for a client.
    command.arg("--fcd-output").arg(&fcd).args([
        "--end",
        &(begin_s + SEEN_S).to_string(),
        "--remote-port",
        "0",
    ]);
    let run = watched(command);
    let traffic = open_traffic(&fcd, &ReadOptions::default());
    // At worst a temporary file is left.
    let _ = std::fs::remove_file(&fcd);
    match run.context("running SUMO")? {
        (Some(status), said) if !status.success() => {
            bail!("SUMO ended ({status}); it said:\n{}", beginning(&String::from_utf8_lossy(&said)))
        }
        (Some(_), _) => {}
        (None, _) => tracing::warn!("SUMO was stopped after {PATIENCE:?}; what it showed until then is used"),
    }
    let traffic = traffic.context("in the first minutes of SUMO")?;
    if let Some(words) = sumo_home::long_step(traffic.step.as_secs_f64()) {
        tracing::warn!("{words}");
    }
    Ok(text::live(&traffic, &from_folder_of(out, config)?))
}

/// The first lines of what a program said: the others follow from them.
fn beginning(said: &str) -> String {
    let lines: Vec<_> = said.lines().filter(|line| !line.trim().is_empty()).collect();
    let shown = lines[..lines.len().min(SAID_LINES)].join("\n");
    match lines.len().saturating_sub(SAID_LINES) {
        0 => shown,
        more => format!("{shown}\n… and {more} lines more"),
    }
}

/// Runs a program up to the time limit: its status, if it has ended by itself, and what it said.
fn watched(mut command: Command) -> io::Result<(Option<ExitStatus>, Vec<u8>)> {
    let mut child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn()?;
    let mut stderr = child.stderr.take();
    let (sender, ended) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let mut said = Vec::new();
        // What was read before an error is of use.
        let _ = stderr.as_mut().map(|stderr| stderr.read_to_end(&mut said));
        // Nobody waits any more where it took too long.
        let _ = sender.send(said);
    });
    // Its messages end when it does.
    match ended.recv_timeout(PATIENCE) {
        Ok(said) => Ok((Some(child.wait()?), said)),
        Err(_) => {
            child.kill()?;
            child.wait()?;
            Ok((None, Vec::new()))
        }
    }
}

/// The path of a file as it is written in a scenario: relative to the scenario's folder where both have a folder in common.
fn from_folder_of(scenario: &Path, file: &Path) -> anyhow::Result<String> {
    let folder = match scenario.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let absolute =
        |path: &Path| std::path::absolute(path).with_context(|| format!("finding {}", path.display()));
    if let (Ok(below), Some(true)) =
        (absolute(file)?.strip_prefix(absolute(folder)?), file.to_str().map(|text| !text.contains("..")))
    {
        return below.to_str().map(str::to_owned).context("a path that is not UTF-8");
    }
    // Of folders behind links a path with `..` leads elsewhere.
    let real = |path: &Path| path.canonicalize().with_context(|| format!("finding {}", path.display()));
    let path = relative(&real(folder)?, &real(file)?);
    path.to_str().map(str::to_owned).with_context(|| format!("the path {} is not UTF-8", path.display()))
}

/// The way from a folder to a file, both absolute; the file as it is where only the root is common.
fn relative(folder: &Path, file: &Path) -> PathBuf {
    let common = folder.components().zip(file.components()).take_while(|(a, b)| a == b).count();
    if common <= 1 {
        return file.to_owned();
    }
    let up = folder.components().skip(common).map(|_| Component::ParentDir);
    up.chain(file.components().skip(common)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_what_a_program_says_the_first_lines_are_shown() {
        assert_eq!(beginning("Error: a\n\nQuitting.\n"), "Error: a\nQuitting.");
        assert_eq!(beginning(&"e\n".repeat(300)), "e\ne\ne\ne\ne\n… and 295 lines more");
    }

    #[test]
    fn what_does_not_end_with_toml_is_never_written_over_even_when_forced() {
        let traffic = std::env::temp_dir().join(format!("v2x-init-{}.csv", std::process::id()));
        std::fs::write(&traffic, "t,id").unwrap();
        let of = recorded::TrafficArgs::default();
        let init = InitArgs { world: None, of, out: Some(traffic.clone()), force: true };
        let refused = run(&ScenarioArgs { action: Action::Init(init) }).unwrap_err().to_string();
        let text = std::fs::read_to_string(&traffic).unwrap();
        std::fs::remove_file(&traffic).unwrap();
        assert_eq!(text, "t,id");
        assert!(refused.contains("v2x scenario init --world ") && refused.contains(".csv"), "{refused}");
        assert!(check_name(Path::new("mine.TOML")).is_ok() && check_name(Path::new("mine")).is_err());
    }

    #[test]
    fn a_file_elsewhere_is_named_from_the_scenarios_folder() {
        for (folder, file, expected) in [
            ("/home/a/traffic", "/home/a/traffic/t.csv", "t.csv"),
            ("/home/a/traffic", "/home/a/traffic/data/t.csv", "data/t.csv"),
            ("/home/a/traffic/mine", "/home/a/data/t.csv", "../../data/t.csv"),
            ("/home/a", "/data/t.csv", "/data/t.csv"),
        ] {
            assert_eq!(relative(Path::new(folder), Path::new(file)), Path::new(expected));
        }
    }
}
