//! `v2x demo`: a small network for a limited time, and what fusion gains.

mod args;
mod progress;
mod run;

pub(crate) use args::DemoArgs;
pub(crate) use run::run;
