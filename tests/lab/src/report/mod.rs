//! Results for people and for other programs: text, Markdown, HTML, LaTeX, CSV and figures.

pub mod folder;
pub mod fused_table;
pub mod markdown;
pub mod offline;
pub mod page;
pub mod plot;
pub mod progress;
pub mod rows_csv;
pub mod summary;
pub mod sweep;
pub mod table;
pub mod tables;
