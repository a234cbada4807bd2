//! Recorded traffic: where objects were, read from text that users have.
//!
//! | format | how it is known |
//! |---|---|
//! | CSV | columns by name, in any order, separated by commas, semicolons or tabs |
//! | the laboratory's CSV | columns `t_s`, `object_id`, …; the ego is an object, too |
//! | INTERACTION CSV | columns `track_id`, `timestamp_ms`, `agent_type`, `psi_rad`, … |
//! | SUMO floating-car data | XML with the root `fcd-export` |
//! | CommonRoad | XML with the root `commonRoad` |
//! | nuScenes | a folder of its tables; [`read_tables`] |
//!
//! [`read`] takes a reader and keeps one row for each object and time, of a window of time where one is given. All else
//! streams, so that the length of the text does not matter. The result is in metres, x east, y north, heading in radians
//! counter-clockwise from x, at the middle of each object; time begins at 0 with the earliest row.

mod annotated;
mod builder;
mod columns;
mod commonroad;
mod error;
mod fcd;
mod headings;
mod live;
mod names;
mod newlines;
mod obstacle;
mod options;
mod paces;
mod read;
mod remarks;
mod sizes;
mod sumo_net;
mod table;
mod traffic;
mod trajectory;
mod units;
mod vtypes;
mod xml;

pub use annotated::read_tables;
pub use builder::MAX_ROWS;
pub use error::{Part, TrafficError};
pub use live::{LiveObject, StepError, Window, WorldStep};
pub use names::Names;
pub use newlines::{Newlines, line_of};
pub use options::{ReadOptions, VehicleType};
pub use read::{read, separator_of};
pub use sumo_net::{Lane, read_begin, read_lanes, read_net_file};
pub use traffic::{Format, RecordedObject, Remarks, Traffic};
pub use trajectory::{Sample, State, Trajectory};
pub use vtypes::{class_of_vehicle_class, read_vehicle_types};

#[cfg(test)]
mod tests;
