//! Logs: to standard error, because standard output is for data.

use super::log_queue::LogQueue;
use super::{tls, zenoh_logs, zenoh_refusals, zenoh_speakers};
use std::collections::VecDeque;
use std::ffi::OsStr;
use std::fmt;
use std::io::{IsTerminal, Stderr, Write};
use std::str::FromStr;
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;
use tracing_subscriber::filter::FilterExt;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;
use tracing_subscriber::{EnvFilter, Layer};

/// The default filter: the life cycle of our own programs, and warnings of other crates. The hub counts the
/// handshakes that `zenoh_link_tls` refuses, and logs their number every ten seconds at most. What Zenoh's orchestrator warns of is the
/// error of a session that does not open ("Timeout!"), which is returned, too, and of which our own programs say the cause.
pub const DEFAULT_FILTER: &str = "warn,zenoh_link_tls=error,zenoh::net::runtime::orchestrator=error,v2x=info,v2x_agent=info,v2x_fusion_hub=info,v2x_lab=info,v2x_common=info";

/// The levels that a filter can name.
const LEVELS: [&str; 6] = ["off", "error", "warn", "info", "debug", "trace"];

/// A text is not a filter of logs.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "--log {filter:?}: {reason}; expected a level ({}) or a filter such as warn,v2x_fusion_hub=debug",
    LEVELS.join(", ")
)]
pub struct InvalidFilter {
    /// The whole text.
    pub filter: String,
    /// The cause.
    pub reason: String,
}

/// For whom logs are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Format {
    /// For people.
    #[default]
    Text,
    /// For machines: each message a line of JSON, with `timestamp`, `level`, `target`, `fields.message` and further fields.
    Json,
}

impl FromStr for Format {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "text" => Ok(Self::Text),
            "json" => Ok(Self::Json),
            _ => Err("expected text or json".to_owned()),
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Text => "text",
            Self::Json => "json",
        })
    }
}

/// How long what was logged has at the end of a process to be written.
const FLUSHED_WITHIN: Duration = Duration::from_secs(1);

/// What writes the logs, once they have begun.
static QUEUE: OnceLock<LogQueue> = OnceLock::new();

static FORMAT: OnceLock<Format> = OnceLock::new();

/// The format of this process, which its children are given.
pub fn format() -> Format {
    FORMAT.get().copied().unwrap_or_default()
}

/// Starts logging with a filter such as `debug` or `warn,v2x_fusion_hub=trace`. Text is in colour where standard error is
/// a terminal and the environment variable `NO_COLOR` is not set (<https://no-color.org>).
pub fn init(filter: &str, format: Format) -> Result<(), InvalidFilter> {
    let filter = parse(filter)?;
    let in_colour = std::io::stderr().is_terminal() && wants_colour();
    // Without a thread whoever logs writes.
    if QUEUE.get().is_none()
        && let Ok(queue) = LogQueue::begin(HoldableStderr(std::io::stderr()))
    {
        let _ = QUEUE.set(queue);
    }
    let printed = tracing_subscriber::fmt::layer().with_writer(|| Out);
    let printed = match format {
        Format::Text => printed.with_ansi(in_colour).boxed(),
        Format::Json => printed.json().boxed(),
    };
    let printed = printed.with_filter(filter.and(zenoh_logs::FewOfEach));
    // A second start in one process (tests) keeps the first.
    let layers = tracing_subscriber::registry().with(printed).with(zenoh_refusals::layer());
    if layers.with(zenoh_speakers::layer()).try_init().is_ok() {
        let _ = FORMAT.set(format);
    }
    Ok(())
}

/// Whether colours are wanted: the environment variable `NO_COLOR` is not set (<https://no-color.org>).
pub fn wants_colour() -> bool {
    allows_colour(std::env::var_os("NO_COLOR").as_deref())
}

/// Messages that are held are at most so many, the newest.
const MAX_HELD: usize = 100;

/// What is held instead of written; `None` where nothing is.
static HELD: Mutex<Option<VecDeque<Vec<u8>>>> = Mutex::new(None);

fn held() -> MutexGuard<'static, Option<VecDeque<Vec<u8>>>> {
    // Each change of it is one statement: a poisoned lock is safe to use.
    HELD.lock().unwrap_or_else(PoisonError::into_inner)
}

/// While it lives, what is logged to a terminal waits, so that it does not damage a page that is drawn there. When it is
/// dropped the newest of it is written.
#[derive(Debug)]
#[must_use = "logs are held as long as this value lives"]
pub struct Held(());

/// Holds back logs if standard error is a terminal.
pub fn hold() -> Held {
    if std::io::stderr().is_terminal() {
        held().get_or_insert_default();
    }
    Held(())
}

impl Drop for Held {
    fn drop(&mut self) {
        let messages = held().take().unwrap_or_default();
        let mut stderr = std::io::stderr().lock();
        for message in messages {
            // A closed standard error is no fault of whoever logs.
            let _ = stderr.write_all(&message);
        }
    }
}

/// Waits until what was logged is written, for a second at most: before a process ends, and before it prints why.
pub fn flush() {
    if let Some(queue) = QUEUE.get() {
        queue.flush(FLUSHED_WITHIN);
    }
}

/// Where messages go, each of them whole.
struct Out;

impl Write for Out {
    fn write(&mut self, message: &[u8]) -> std::io::Result<usize> {
        match QUEUE.get() {
            Some(queue) => {
                queue.put(message);
                Ok(message.len())
            }
            None => HoldableStderr(std::io::stderr()).write(message),
        }
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Standard error, unless logs are held.
struct HoldableStderr(Stderr);

impl Write for HoldableStderr {
    /// A message comes whole; secrets of a configuration are taken out of it.
    fn write(&mut self, message: &[u8]) -> std::io::Result<usize> {
        let redacted = tls::redacted(message);
        let shown = redacted.as_deref().unwrap_or(message);
        let mut held = held();
        let Some(messages) = held.as_mut() else {
            drop(held);
            return self.0.write_all(shown).map(|()| message.len());
        };
        if messages.len() == MAX_HELD {
            messages.pop_front();
        }
        messages.push_back(shown.to_vec());
        Ok(message.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.flush()
    }
}

/// A directive without `=` is taken as the name of a target by the library: a misspelt level would silence all logs.
fn parse(filter: &str) -> Result<EnvFilter, InvalidFilter> {
    let invalid = |reason: String| InvalidFilter { filter: filter.to_owned(), reason };
    let is_level = |text: &str| LEVELS.iter().any(|level| level.eq_ignore_ascii_case(text));
    let directives: Vec<_> = filter.split(',').map(str::trim).collect();
    if let Some(unknown) = directives.iter().find(|text| !is_level(text) && !text.contains(['=', '['])) {
        return Err(invalid(format!("{unknown:?} is not a level")));
    }
    EnvFilter::try_new(directives.join(",")).map_err(|error| invalid(error.to_string()))
}

fn allows_colour(no_color: Option<&OsStr>) -> bool {
    no_color.is_none_or(OsStr::is_empty)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelt_level_is_an_error_that_names_it_and_lists_the_levels() {
        for (filter, named) in [
            ("debgu", "\"debgu\" is not a level"),
            ("", "\"\" is not a level"),
            ("warn,debgu", "\"debgu\" is not a level"),
            ("v2x_fusion_hub", "\"v2x_fusion_hub\" is not a level"),
            ("v2x_fusion_hub=debgu", "--log \"v2x_fusion_hub=debgu\""),
        ] {
            let message = parse(filter).unwrap_err().to_string();
            assert!(message.contains(named), "{message}");
            assert!(message.contains("off, error, warn, info, debug, trace"), "{message}");
        }
    }

    #[test]
    fn levels_and_filters_of_targets_are_accepted() {
        for filter in ["debug", "WARN", "warn,v2x_fusion_hub=debug", "off, v2x=trace", DEFAULT_FILTER] {
            assert!(parse(filter).is_ok(), "{filter}");
        }
    }

    #[test]
    fn a_format_is_read_as_it_is_written_and_another_names_both() {
        for format in [Format::Text, Format::Json] {
            assert_eq!(format.to_string().parse(), Ok(format));
        }
        assert!("JSON".parse::<Format>().unwrap_err().contains("text or json"));
    }

    #[test]
    fn colour_is_wanted_unless_no_color_is_set_to_something() {
        assert!(allows_colour(None) && allows_colour(Some(OsStr::new(""))));
        assert!(!allows_colour(Some(OsStr::new("1"))));
    }

    #[test]
    fn of_what_is_held_the_newest_messages_are_kept() {
        *held() = Some(VecDeque::new());
        let mut log = HoldableStderr(std::io::stderr());
        for number in 0..=MAX_HELD {
            log.write_all(format!("message {number}\n").as_bytes()).unwrap();
        }
        let kept = held().take().unwrap();
        assert_eq!((kept.len(), &kept[0][..]), (MAX_HELD, &b"message 1\n"[..]));
    }
}
