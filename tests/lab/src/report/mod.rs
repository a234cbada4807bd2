//! Reports: text, Markdown, HTML, LaTeX, CSV and figures.

pub(crate) mod folder;
pub(crate) mod fused_table;
pub(crate) mod markdown;
pub(crate) mod offline;
pub(crate) mod output;
pub(crate) mod page;
pub(crate) mod palette;
pub(crate) mod plot;
pub(crate) mod progress;
pub(crate) mod recording_page;
pub(crate) mod rows_csv;
mod run_curves;
pub(crate) mod run_page;
pub(crate) mod summary;
pub(crate) mod sweep;
pub(crate) mod table;
pub(crate) mod tables;
