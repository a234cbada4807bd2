//! A hub that begins again by itself, in the same process, where Zenoh's code is broken for good.
//!
//! A session of Zenoh that is broken cannot even be closed: its connections would stay, and agents with them. So the program
//! replaces itself: the system closes all connections and frees the port, agents and consumers connect again, and no
//! supervisor waits longer each time.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Duration;
use v2x_common::net::{logging, zenoh_breakers, zenoh_panics};

/// One who breaks it again and again is not to take all of the machine's time.
const AGAIN_AFTER: Duration = Duration::from_millis(200);

/// What the program is started with again.
#[derive(Debug)]
pub(super) struct Again {
    /// Endpoints as they were given.
    listen: Vec<String>,
    /// A recording that would be overwritten, or keep the program from starting.
    recording: Option<PathBuf>,
    /// Where the hub listens, with its ports, once it does.
    locators: OnceLock<Vec<String>>,
}

/// How often this process has begun again, in its environment.
const TIMES: &str = "V2X_BEGAN_AGAIN";
/// By whose messages, as JSON, in its environment.
const BY: &str = "V2X_BEGAN_AGAIN_BY";

/// How often this process has begun again.
pub(super) fn times() -> u32 {
    std::env::var(TIMES).ok().and_then(|times| times.parse().ok()).unwrap_or(0)
}

/// Takes over by whose messages Zenoh's code was broken before this process began again.
pub(super) fn recall_breakers() {
    if let Some(known) = std::env::var(BY).ok().and_then(|known| serde_json::from_str(&known).ok()) {
        zenoh_breakers::recall(known);
    }
}

impl Again {
    pub(super) const fn new(listen: Vec<String>, recording: Option<PathBuf>) -> Self {
        Self { listen, recording, locators: OnceLock::new() }
    }

    /// Notes where the hub listens: it will listen there again where a free port was asked for.
    pub(super) fn note_locators(&self, locators: &[String]) {
        // It is ready once.
        let _ = self.locators.set(locators.to_vec());
    }

    /// Begins again as soon as a lock in Zenoh's code is poisoned.
    pub(super) fn when_zenoh_is_broken(this: std::sync::Arc<Self>) {
        zenoh_panics::when_broken(move |why| {
            let by = zenoh_breakers::breakers_in_words().unwrap_or_else(|| "what somebody sends".to_owned());
            tracing::error!(
                "Zenoh's own code is broken by {by}, and would let nobody in any more: this hub begins again, with an empty list: {why}"
            );
            this.begin();
        });
    }

    fn begin(&self) -> ! {
        logging::flush();
        #[expect(clippy::disallowed_methods, reason = "the thread has panicked and runs nothing else")]
        std::thread::sleep(AGAIN_AFTER);
        if let Some(recording) = &self.recording {
            match set_aside(recording) {
                Ok(path) => tracing::warn!("the recording so far is {}", path.display()),
                Err(error) => tracing::error!("{} cannot be renamed: {error}", recording.display()),
            }
        }
        let mut args = std::env::args_os();
        let program = args.next();
        let args: Vec<_> = args.map(|arg| self.on_the_same_port(arg)).collect();
        tracing::error!("the program cannot begin again, and ends: {}", replaced_by_itself(program, args));
        logging::flush();
        std::process::exit(1)
    }

    /// An argument that asks for a free port asks for the one that the hub has.
    fn on_the_same_port(&self, arg: OsString) -> OsString {
        let ([listen], Some([locator])) = (&self.listen[..], self.locators.get().map(Vec::as_slice)) else {
            return arg;
        };
        match arg.to_str() {
            Some(text) if listen.ends_with(":0") && text.ends_with(listen) => {
                text.replace(listen, locator).into()
            }
            _ => arg,
        }
    }
}

/// Renames a file: `run.mcap` to `run-before-1.mcap`, or the first number that is free.
fn set_aside(path: &Path) -> std::io::Result<PathBuf> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let extension = path.extension().map(|one| format!(".{}", one.to_string_lossy())).unwrap_or_default();
    let named = |number: u32| path.with_file_name(format!("{stem}-before-{number}{extension}"));
    let free = (1..=u32::MAX).map(named).find(|path| !path.exists());
    let aside = free.unwrap_or_else(|| named(0));
    std::fs::rename(path, &aside)?;
    Ok(aside)
}

/// Replaces the program by itself with these arguments; returns why it could not.
#[cfg(unix)]
fn replaced_by_itself(name: Option<OsString>, args: Vec<OsString>) -> std::io::Error {
    use std::os::unix::process::CommandExt;
    let program = match std::env::current_exe() {
        Ok(program) => program,
        Err(error) => return error,
    };
    let mut command = std::process::Command::new(&program);
    command.arg0(name.unwrap_or_else(|| program.into())).args(args);
    // Without them the count goes on.
    let by = serde_json::to_string(&zenoh_breakers::breakers()).unwrap_or_default();
    command.env(TIMES, times().saturating_add(1).to_string()).env(BY, by).exec()
}

#[cfg(not(unix))]
fn replaced_by_itself(_: Option<OsString>, _: Vec<OsString>) -> std::io::Error {
    std::io::ErrorKind::Unsupported.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn before_a_restart_by_itself_a_recording_is_set_aside_under_a_name_that_is_free() {
        let folder = std::env::temp_dir().join(format!("v2x-again-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("run.mcap");
        for (number, text) in [(1, "first"), (2, "second")] {
            std::fs::write(&path, text).unwrap();
            let aside = set_aside(&path).unwrap();
            assert_eq!(aside, folder.join(format!("run-before-{number}.mcap")));
            assert!(!path.exists() && std::fs::read_to_string(aside).unwrap() == text);
        }
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn after_a_restart_by_itself_a_hub_that_was_given_a_free_port_listens_where_it_did() {
        let again = Again::new(vec!["tcp/127.0.0.1:0".to_owned()], None);
        let of = |arg: &str| again.on_the_same_port(arg.into()).into_string().unwrap();
        assert_eq!(of("tcp/127.0.0.1:0"), "tcp/127.0.0.1:0", "it does not listen yet");
        again.note_locators(&["tcp/127.0.0.1:4711".to_owned()]);
        assert_eq!(of("tcp/127.0.0.1:0"), "tcp/127.0.0.1:4711");
        assert_eq!(of("--listen=tcp/127.0.0.1:0"), "--listen=tcp/127.0.0.1:4711");
        assert_eq!(of("--metrics"), "--metrics");
        let fixed = Again::new(vec!["tcp/127.0.0.1:7447".to_owned()], None);
        fixed.note_locators(&["tcp/127.0.0.1:7447".to_owned()]);
        assert_eq!(fixed.on_the_same_port("tcp/127.0.0.1:7447".into()), "tcp/127.0.0.1:7447");
    }
}
