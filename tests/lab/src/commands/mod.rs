//! The subcommands. Each chooses a source, a method, a matching rule and a report.

mod cpu_time;
mod draws;
mod export;
mod fuse;
#[doc(hidden)]
pub mod help;
mod load;
mod process_time;
mod recorded_run;
mod remarks;
mod report;
mod report_of_recording;
mod rerun;
mod retrack;
mod run_folder;
mod run_parts;
mod run_place;
mod score;
mod simulate;
mod sweep;
mod tables;
mod takeover;
mod throughput;

pub use export::{ExportArgs, export};
pub use fuse::{FuseArgs, fuse};
pub use load::{LoadArgs, load};
pub use remarks::log_remarks;
pub use report::{ReportArgs, report};
pub use rerun::{RerunArgs, rerun};
pub use retrack::{RetrackArgs, retrack};
pub use run_folder::{RunFolder, RunRecord, print_summary};
pub use run_place::{About, RUNS, new_folder};
pub use score::{ScoreArgs, score};
pub use simulate::{SimulateArgs, simulate};
pub use sweep::{SweepArgs, sweep};
pub use tables::{TablesArgs, tables, tables_with};
pub use takeover::{TakeoverArgs, takeover};
pub use throughput::{Heap, ThroughputArgs, throughput};
