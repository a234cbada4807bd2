//! `v2x record`: all that happens on a network, as an MCAP file that can be replayed and computed again.

mod args;
mod counts;
mod journals;
mod run;

pub(crate) use args::RecordArgs;
pub(crate) use counts::Counts;
pub(crate) use run::{record, run};
