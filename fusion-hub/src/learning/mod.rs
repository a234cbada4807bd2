//! What is learnt of each agent's sensor while tracks are kept: how far and how surely it detects, how often it sends, and
//! whether its scores say anything.
//!
//! Learning goes by capture time, one epoch of a quarter of a second after the other, each when nothing of it can arrive
//! any more. A frame is read by what had been learnt a fixed time before its capture (`Learner::read`). So what is
//! learnt, and how each frame is read, is a function of the evidence and not of the order in which it arrived, as long as
//! the assignments are.

mod agent_learning;
mod by_frame;
mod class_counts;
mod clutter_counts;
mod detection_counts;
mod epoch;
mod heading_counts;
mod innovation_counts;
mod learner;
mod pose_counts;
mod reading;
mod recent_places;
mod report;
mod score_counts;
mod sensor_statistics;
mod track_memory;

pub(crate) use learner::{FrameSource, Learner};
pub(crate) use reading::{FrameReading, Prior};
pub use report::LearntSensorReport;

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    [
        agent_learning::listed(),
        learner::listed(),
        class_counts::listed(),
        clutter_counts::listed(),
        detection_counts::listed(),
        heading_counts::listed(),
        innovation_counts::listed(),
        vec![pose_counts::listed(), recent_places::listed()],
        score_counts::listed(),
        sensor_statistics::listed(),
        reading::listed(),
    ]
    .concat()
}
