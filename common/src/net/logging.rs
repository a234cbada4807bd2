//! Logs: to standard error, so that standard output stays data.

use tracing_subscriber::EnvFilter;

/// What is logged where nobody says otherwise: our own life cycle, and others' warnings.
pub const DEFAULT_FILTER: &str =
    "warn,v2x=info,v2x_agent=info,v2x_fusion_hub=info,v2x_lab=info,v2x_common=info";

/// Starts logging with a filter such as `debug` or `warn,v2x_fusion_hub=trace`.
pub fn init(filter: &str) -> anyhow::Result<()> {
    let filter = EnvFilter::try_new(filter)
        .map_err(|error| anyhow::anyhow!("--log {filter:?} is no filter: {error}; try --log debug"))?;
    // A second start in one process (tests) keeps the first.
    let _ = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .with_ansi(std::io::IsTerminal::is_terminal(&std::io::stderr()))
        .try_init();
    Ok(())
}
