//! `v2x certs`: a private authority, certificates for a hub, agents and viewers, and the access control that goes with them.

mod access;
mod args;
mod authority;
mod commands;
mod configuration;
mod files;
mod list;
mod register;

pub(crate) use args::CertsArgs;
pub(crate) use commands::run;
