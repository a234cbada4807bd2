//! `v2x watch`: a consumer of fused objects.

mod args;
mod browser;
mod lines;
mod lists;
mod objects;
mod page;
mod roster;
mod run;
mod screen;
mod statuses;
#[cfg(test)]
mod tests;
mod view;

pub(crate) use args::WatchArgs;
pub(crate) use run::run;
