//! Where scenes come from.

pub mod csv_file;
pub mod error;
pub mod nuscenes;
pub mod source;
pub mod synthetic;

pub use error::DatasetError;
pub use source::Source;
