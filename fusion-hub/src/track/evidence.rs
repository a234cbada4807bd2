//! What speaks for or against a track, each piece at its own time.

use crate::filter::Measurement;
use v2x_common::geometry::Pose;
use v2x_common::id::{FrameId, MeasurementId};
use v2x_common::sensor::{Body, FieldOfView};
use v2x_common::time::Timestamp;

/// The order of evidence: by capture time, then by names and numbers. Never by arrival.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct EvidenceKey {
    /// When it was measured.
    pub captured_at: Timestamp,
    /// In which frame.
    pub frame: FrameId,
    /// Place in the frame; for a look that found nothing, one past every place.
    pub index: u16,
}

impl EvidenceKey {
    /// Which detection it was.
    pub fn measurement(&self) -> MeasurementId {
        MeasurementId { frame: self.frame, index: self.index }
    }
}

/// A report of the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// What was measured.
    pub z: Measurement,
    /// Natural logarithm of detection probability over clutter density (m²); ∞ without clutter.
    pub ln_detection_over_clutter: f64,
    /// Odds that such a report, if it is of nothing known, is of something real.
    pub birth_odds: f64,
}

/// A look of an agent that did not report the object. Whether the object was in view is decided when the
/// evidence is evaluated, with the state of that moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Where the sensor was.
    pub pose: Pose,
    /// What it sees.
    pub field_of_view: FieldOfView,
    /// The vehicle around it, through which it does not see.
    pub body: Option<Body>,
    /// Probability that it misses what is in view.
    pub miss_probability: f64,
}

/// One piece of evidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Evidence {
    /// The object was reported.
    Sighting(Sighting),
    /// It was not.
    Look(Look),
}

impl Look {
    /// Whether an object of this size would have been in view: well inside, since at the border nobody knows.
    pub fn covers(&self, x: f64, y: f64, margin_m: f64) -> bool {
        self.field_of_view.contains_within(&self.pose, x, y, margin_m)
            && !self.body.is_some_and(|body| {
                self.pose.distance_to(x, y) < body.at(&self.pose).circumradius() + margin_m
            })
    }
}
