//! Logs: to standard error, because standard output is for data.

use std::ffi::OsStr;
use std::io::IsTerminal;
use tracing_subscriber::EnvFilter;

/// The default filter: the life cycle of our own programs, and warnings of other crates.
pub const DEFAULT_FILTER: &str =
    "warn,v2x=info,v2x_agent=info,v2x_fusion_hub=info,v2x_lab=info,v2x_common=info";

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

/// Starts logging with a filter such as `debug` or `warn,v2x_fusion_hub=trace`. In colour where standard error is a
/// terminal and the environment variable `NO_COLOR` is not set (<https://no-color.org>).
pub fn init(filter: &str) -> Result<(), InvalidFilter> {
    let filter = parse(filter)?;
    let in_colour = is_in_colour(std::io::stderr().is_terminal(), std::env::var_os("NO_COLOR").as_deref());
    // A second start in one process (tests) keeps the first.
    let _ = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .with_ansi(in_colour)
        .try_init();
    Ok(())
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

fn is_in_colour(is_terminal: bool, no_color: Option<&OsStr>) -> bool {
    is_terminal && no_color.is_none_or(OsStr::is_empty)
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
    fn colour_needs_a_terminal_and_no_no_color() {
        assert!(is_in_colour(true, None) && is_in_colour(true, Some(OsStr::new(""))));
        assert!(!is_in_colour(true, Some(OsStr::new("1"))));
        assert!(!is_in_colour(false, None));
    }
}
