//! `agent`: one agent alone.

use clap::Parser;
use std::process::ExitCode;
use v2x_agent::shell::{AgentArgs, run};
use v2x_common::net::{logging, shutdown};

#[derive(Parser)]
#[command(name = "agent", version = v2x_common::version::LONG, about = None, long_about = None, max_term_width = 80)]
struct Cli {
    #[command(flatten)]
    agent: AgentArgs,
    /// What to log (default: life cycle and warnings): a level, or a filter such as warn,v2x_agent=debug
    #[arg(long, default_value = logging::DEFAULT_FILTER, hide_default_value = true, value_name = "FILTER")]
    log: String,
    /// How to log: text for people, json for machines
    #[arg(long, default_value_t, value_name = "FORMAT")]
    log_format: logging::Format,
}

#[tokio::main]
async fn main() -> ExitCode {
    let cli = Cli::parse();
    let result = async {
        logging::init(&cli.log, cli.log_format)?;
        run(cli.agent.clone(), shutdown::token(cli.agent.exit_with_stdin)?).await
    };
    v2x_common::net::exit_code("agent", result.await)
}
