//! The columns of a log of detections, as `lab fuse` reads and `lab export` writes it.

/// Required columns.
pub(crate) const COLUMNS: [&str; 14] =
    ["t_arr", "t", "sensor_id", "class", "x", "y", "w", "d", "yaw", "sx", "sy", "sw", "sd", "st"];
