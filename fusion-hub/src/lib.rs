//! Late fusion of bird's-eye-view detections.

pub mod assignment;
