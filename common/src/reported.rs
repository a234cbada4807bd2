//! What a decoded frame no longer shows of the text that it was read from, and what a diagnosis wants to know.

use crate::conventions::{AngleUnit, Conventions, OffOrigin, YawConvention};
use crate::time::Span;

/// The largest heading of degrees that are wrapped, with a margin for rounding.
const MOST_DEGREES: f64 = 360.5;
/// A whole turn of radians that is read as degrees, rad, with such a margin.
const A_TURN_AS_DEGREES: f64 = 6.3 * (std::f64::consts::PI / 180.0);

/// Headings as they are written, in radians by the agent's conventions, before whole turns are taken away.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RawHeadings {
    /// Headings.
    pub n: u64,
    /// Those beyond a whole turn of 2π.
    pub beyond_a_turn: u64,
    /// Those beyond a whole turn of 360, with a margin for rounding.
    pub beyond_360: u64,
    /// The largest magnitude, rad.
    pub largest: f64,
    /// The least and the most, rad.
    pub range: Option<(f64, f64)>,
}

impl RawHeadings {
    /// Counts a heading, rad. What is no number is none.
    pub fn note(&mut self, yaw: f64) {
        if yaw.is_finite() {
            self.n += 1;
            self.beyond_a_turn += u64::from(yaw.abs() > std::f64::consts::TAU);
            self.beyond_360 += u64::from(yaw.abs() > MOST_DEGREES);
            self.largest = self.largest.max(yaw.abs());
            self.widen((yaw, yaw));
        }
    }

    /// Counts those of another.
    pub fn merge(&mut self, other: &Self) {
        self.n += other.n;
        self.beyond_a_turn += other.beyond_a_turn;
        self.beyond_360 += other.beyond_360;
        self.largest = self.largest.max(other.largest);
        other.range.into_iter().for_each(|range| self.widen(range));
    }

    fn widen(&mut self, (least, most): (f64, f64)) {
        let (from, to) = self.range.unwrap_or((least, most));
        self.range = Some((from.min(least), to.max(most)));
    }

    /// Whether headings that are read as degrees may be radians: none is beyond a turn of these.
    pub fn may_be_radians(&self) -> bool {
        self.n > 0 && self.largest <= A_TURN_AS_DEGREES
    }

    /// Whether all of several are one number.
    pub fn are_one(&self) -> bool {
        self.n > 1 && self.range.is_some_and(|(least, most)| least.to_bits() == most.to_bits())
    }
}

/// Positions that should be longitudes and latitudes near an origin, and are none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OffPlaces {
    /// Positions.
    pub n: u64,
    /// Those that are places the other way round.
    pub exchanged: u64,
    /// The newest.
    pub newest: Option<OffOrigin>,
}

impl OffPlaces {
    /// Counts one.
    pub fn note(&mut self, off: OffOrigin) {
        self.merge(&Self { n: 1, exchanged: u64::from(off.is_exchanged), newest: Some(off) });
    }

    /// Counts those of another, which is newer.
    pub fn merge(&mut self, other: &Self) {
        self.n += other.n;
        self.exchanged += other.exchanged;
        self.newest = other.newest.or(self.newest);
    }
}

/// How a frame was written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reported {
    /// Its headings.
    pub headings: RawHeadings,
    /// What the headings of its detections would be in the other unit, degrees in place of radians or the other way round, rad,
    /// in the order of the detections; empty where they cannot be of that unit.
    pub in_other_unit: Vec<f64>,
    /// Detections that gave no standard deviation of their position, so that the receiver's default was taken.
    pub without_sigma: u64,
    /// The receiver's settings say what this agent's are where it gives none.
    pub sigma_is_set: bool,
    /// Its positions that are no longitudes and latitudes near the origin, where they should be.
    pub off_origin: OffPlaces,
    /// The heading of its sensor's pose as it is given, in radians by the agent's conventions, before whole turns are taken away; zero
    /// where there is none.
    pub pose_yaw: f64,
    /// It is of JSON.
    pub is_json: bool,
    /// It gave a sequence number of its own.
    pub has_sequence: bool,
    /// How its headings were read.
    pub yaw: YawConvention,
    /// Whether its sizes were read the other way round.
    pub sizes_swapped: bool,
    /// What was added to its time.
    pub time_offset: Span,
}

impl Reported {
    /// Whether headings that are read as radians may be degrees, or the other way round.
    pub fn may_be_of_other_unit(&self) -> bool {
        match self.yaw.unit {
            AngleUnit::Rad => self.headings.beyond_a_turn > 0,
            AngleUnit::Deg => self.headings.may_be_radians(),
        }
    }

    /// Of a frame that is read by these conventions; nothing is counted yet.
    pub fn by(conventions: &Conventions, has_sequence: bool) -> Self {
        Self {
            has_sequence,
            yaw: conventions.yaw,
            sizes_swapped: conventions.sizes_swapped,
            time_offset: conventions.time_offset,
            ..Self::default()
        }
    }
}
