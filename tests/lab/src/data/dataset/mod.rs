//! Data sets: synthetic scenes, nuScenes, and CSV tables.

pub(crate) mod csv_file;
pub(crate) mod error;
pub(crate) mod nuscenes;
pub(crate) mod source;
pub mod synthetic;

pub use error::DatasetError;
pub use source::Source;
