//! Where SUMO is on this machine.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Why SUMO cannot be started.
#[derive(Debug, thiserror::Error)]
pub(crate) enum NoSumo {
    /// No program.
    #[error(
        "SUMO is not there: no `sumo` is on the PATH, and SUMO_HOME is not set; install it by  pip install eclipse-sumo  \
         (in an environment that is active), or set SUMO_HOME to its folder"
    )]
    Program,
    /// `SUMO_HOME` is wrong.
    #[error("SUMO_HOME is {}, but {} is not there", home.display(), program.display())]
    Home {
        /// Its value.
        home: PathBuf,
        /// Where the program should be.
        program: PathBuf,
    },
    /// Another file of SUMO than its configuration.
    #[error(
        "{} is no configuration of SUMO: name the .sumocfg that has it as an input (sumo:FILE.sumocfg); there are {others}",
        path.display()
    )]
    Input {
        /// The path.
        path: PathBuf,
        /// Names of the configurations that there are.
        others: String,
    },
    /// No configuration.
    #[error("no SUMO configuration {}; found there are {others}", path.display())]
    Configuration {
        /// The path.
        path: PathBuf,
        /// Names of those that there are.
        others: String,
    },
}

/// Longer steps are worth a word, s.
const LONG_STEP_S: f64 = 0.5;

/// What is to be said of steps of this length, where they are long.
pub(crate) fn long_step(step_s: f64) -> Option<String> {
    (step_s > LONG_STEP_S).then(|| {
        format!(
            "SUMO's steps are {step_s} s long, and places between them are interpolated on straight lines; \
             <step-length value=\"0.1\"/> in its configuration is smoother"
        )
    })
}

/// The command that runs SUMO with a configuration.
pub(crate) fn command(config: &Path) -> Result<Command, NoSumo> {
    if !config.is_file() {
        return Err(NoSumo::Configuration { path: config.to_owned(), others: others(config) });
    }
    if is_input(config) {
        return Err(NoSumo::Input { path: config.to_owned(), others: others(config) });
    }
    let home = std::env::var_os("SUMO_HOME").filter(|home| !home.is_empty());
    let program = find(home.as_deref(), std::env::var_os("PATH").as_deref())?;
    let mut command = match home_of_wheel(&program).filter(|_| home.is_none()) {
        Some(home) => {
            let mut command = Command::new(home.join("bin").join(name()));
            command.env("PROJ_DATA", home.join("data/proj")).env("SUMO_HOME", home);
            command
        }
        None => Command::new(program),
    };
    command.arg("--configuration-file").arg(config).args(["--no-step-log", "true"]);
    Ok(command)
}

/// Whether a file is a network or a demand by its name, which SUMO reads by a configuration.
fn is_input(path: &Path) -> bool {
    let name = path.file_name().and_then(OsStr::to_str).unwrap_or_default();
    [".net.xml", ".rou.xml", ".net.xml.gz", ".rou.xml.gz"].iter().any(|suffix| name.ends_with(suffix))
}

/// The program: of `SUMO_HOME`, else on the `PATH`.
fn find(home: Option<&OsStr>, path: Option<&OsStr>) -> Result<PathBuf, NoSumo> {
    if let Some(home) = home {
        let home = PathBuf::from(home);
        let program = home.join("bin").join(name());
        return if program.is_file() { Ok(program) } else { Err(NoSumo::Home { home, program }) };
    }
    let folders = path.map(std::env::split_paths).into_iter().flatten();
    let found = folders.map(|folder| folder.join(name())).find(|program| program.is_file());
    found.ok_or(NoSumo::Program)
}

fn name() -> String {
    format!("sumo{}", std::env::consts::EXE_SUFFIX)
}

/// Where SUMO is, if the program is the script of PyPI's wheel, which starts it as a child: started by ourselves it ends
/// with us, however that is.
fn home_of_wheel(script: &Path) -> Option<PathBuf> {
    let text = std::fs::read_to_string(script).ok().filter(|text| text.contains("from sumo import"))?;
    let python = text.lines().next()?.strip_prefix("#!")?.trim();
    let answer = Command::new(python).args(["-c", "import sumo; print(sumo.SUMO_HOME)"]).output().ok()?;
    let home = PathBuf::from(String::from_utf8(answer.stdout).ok()?.trim());
    home.join("bin").join(name()).is_file().then_some(home)
}

/// The configurations beside a missing one, as words.
fn others(config: &Path) -> String {
    let folder = config.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    let mut names: Vec<_> = names.filter(|name| name.ends_with(".sumocfg")).collect();
    names.sort_unstable();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_program_is_said_with_how_to_install_it() {
        let message = find(None, Some(OsStr::new("/no-such-folder"))).unwrap_err().to_string();
        assert!(message.contains("pip install eclipse-sumo"), "{message}");
        let message = find(Some(OsStr::new("/no-such-home")), None).unwrap_err().to_string();
        assert!(message.starts_with("SUMO_HOME is /no-such-home, but /no-such-home/bin/sumo"), "{message}");
    }

    #[test]
    fn a_network_is_no_configuration_and_is_answered_with_those_that_there_are() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/sumo");
        let message = command(&folder.join("crossing.net.xml")).unwrap_err().to_string();
        assert!(message.contains("name the .sumocfg") && message.ends_with("crossing.sumocfg"), "{message}");
    }
}
