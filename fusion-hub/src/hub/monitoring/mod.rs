//! A hub as supervisors and monitoring systems see it: metrics and health over HTTP, and a file that says that it is ready.

pub(super) mod exported;
mod http;
pub mod metrics;
mod of_agents;
mod out;
mod ready_file;

pub(super) use http::Server;
pub(super) use ready_file::ReadyFile;
