//! Recorded traffic.

use std::sync::Arc;
use v2x_common::class::Class;
use v2x_common::time::Span;

use super::trajectory::Trajectory;

/// The object that carried the sensors of a recording.
pub(super) const EGO: &str = "ego";

/// What the text was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// CSV with columns t, id, class, x, y.
    Csv,
    /// The laboratory's CSV.
    Laboratory,
    /// CSV of the INTERACTION data set.
    Interaction,
    /// Floating-car data of SUMO.
    SumoFcd,
    /// A scene of nuScenes' tables.
    NuScenes,
    /// A CommonRoad scenario.
    CommonRoad,
    /// What another program publishes.
    Live,
}

impl Format {
    /// In words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Csv => "CSV",
            Self::Laboratory => "CSV of the laboratory",
            Self::Interaction => "INTERACTION CSV",
            Self::SumoFcd => "SUMO floating-car data",
            Self::NuScenes => "nuScenes tables",
            Self::CommonRoad => "CommonRoad scenario",
            Self::Live => "live world",
        }
    }
}

/// One recorded object.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedObject {
    /// Its id in the file.
    pub name: String,
    /// Its class.
    pub class: Class,
    /// Across its heading, m.
    pub w: f64,
    /// Along its heading, m.
    pub d: f64,
    /// Where it is.
    pub trajectory: Arc<Trajectory>,
}

/// What is to be said about a recording.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Remarks {
    /// What was done with it.
    pub notes: Vec<String>,
    /// What looks wrong, and what to change.
    pub warnings: Vec<String>,
}

/// Recorded traffic, in metres and radians, from time 0 on.
#[derive(Clone, Debug, PartialEq)]
pub struct Traffic {
    /// What the text was.
    pub format: Format,
    /// In order of their first row.
    pub objects: Vec<RecordedObject>,
    /// Number of rows that are kept.
    pub n_rows: usize,
    /// The file's time at time 0, s.
    pub first_s: f64,
    /// From the first row to the last.
    pub length: Span,
    /// The middle time between two rows of an object.
    pub step: Span,
    /// An object that has no row for longer is absent.
    pub max_gap: Span,
    /// What was subtracted from the file's coordinates, m.
    pub origin: (f64, f64),
    /// The scene that was read, where the file has scenes.
    pub scene: Option<String>,
    /// Borders of lanes for pictures, where the file has any, m.
    pub areas: Vec<Vec<(f64, f64)>>,
    /// What is to be said about it.
    pub remarks: Remarks,
}

impl Traffic {
    /// The index of an object by its id in the file.
    pub fn object_index(&self, name: &str) -> Option<usize> {
        self.objects.iter().position(|object| object.name == name)
    }

    /// The smallest rectangle around all places: west, south, east, north, m.
    pub fn extent(&self) -> [f64; 4] {
        let samples = self.objects.iter().flat_map(|object| object.trajectory.samples());
        samples.fold([f64::MAX, f64::MAX, f64::MIN, f64::MIN], |[west, south, east, north], sample| {
            let (x, y) = (sample.pose.x, sample.pose.y);
            [west.min(x), south.min(y), east.max(x), north.max(y)]
        })
    }
}
