//! `v2x check`: listens, and says in sentences what looks wrong and what to change.

mod args;
mod listener;
mod run;
mod strays;
mod unserved;

pub(crate) use args::CheckArgs;
pub(crate) use run::run;
