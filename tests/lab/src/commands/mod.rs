//! The command lines: each chooses a source, a method, a matching rule and a report.

pub mod cpu_time;
pub mod draws;
pub mod export;
pub mod fuse;
pub mod run_folder;
pub mod score;
pub mod simulate;
pub mod sweep;
pub mod tables;
pub mod throughput;
