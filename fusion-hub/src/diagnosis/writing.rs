//! How an agent writes its numbers: unit of headings, order of sizes, unit of positions, stated errors.

use super::observation::Observation;
use v2x_common::class::{Class, ClassGroup};
use v2x_common::conventions::YawConvention;
use v2x_common::detection::{Detection, MAX_COORDINATE_M};
use v2x_common::reported::{OffPlaces, RawHeadings};
use v2x_common::time::Span;

/// Detections in degrees of longitude and latitude lie this close together, in what is read as metres: 5 km.
pub(super) const DEGREES_APART: f64 = 0.05;
/// Frames of more detections are not searched for twins.
const MAX_LOOKED_AT: usize = 64;
/// Several bodies have no room within this, m.
const ONE_SPOT_M: f64 = 1.0;

/// Boxes of an unknown class are taken for vehicles, whichever side is the longer one, by their sides, m.
const LONG_M: (f64, f64) = (3.0, 20.0);
const SHORT_M: (f64, f64) = (1.4, 3.2);
/// Three objects or more at one place are no boxes of one car; of two it is not known.
pub(super) const SEVERAL: usize = 3;
/// Frames of fewer objects of which the middle is kept.
const MAX_MIDDLES: usize = 128;

/// Of one agent.
#[derive(Clone, Debug, Default)]
pub(super) struct Writing {
    pub(super) headings: RawHeadings,
    pub(super) off_origin: OffPlaces,
    pub(super) is_json: bool,
    pub(super) detections: u64,
    pub(super) without_sigma: u64,
    pub(super) sigma_is_set: bool,
    pub(super) vehicles: u64,
    pub(super) wide_vehicles: u64,
    /// Those whose middle lies within another one of the same frame; of frames with not too many.
    pub(super) twin_vehicles: u64,
    /// Vehicles of such frames.
    pub(super) looked_at: u64,
    /// Frames of three detections or more, and those of them whose detections all lie within [`DEGREES_APART`].
    pub(super) several: u64,
    pub(super) several_at_one_place: u64,
    /// And those whose detections have no room where they all lie.
    pub(super) several_in_one_spot: u64,
    /// The least and the largest x and y, m.
    pub(super) extent: Option<[(f64, f64); 2]>,
    sum: [f64; 2],
    n: u64,
    /// Distances from the sensor, where its pose is known, m: their sum and number.
    ranges: (f64, u64),
    /// The middles of frames of one or two detections, with their number.
    middles: Vec<([f64; 2], usize)>,
    /// Stated standard deviations of positions, m: their sum and number.
    sigma: (f64, u64),
    /// Frames whose sensor's pose is turned by more than a whole turn, and the last such heading, rad.
    pub(super) turned_poses: u64,
    pub(super) turned_pose_rad: f64,
    pub(super) yaw: YawConvention,
    pub(super) sizes_swapped: bool,
    pub(super) time_offset: Span,
}

/// A whole turn, with a margin for rounding, rad.
const A_TURN_RAD: f64 = 6.3;

impl Writing {
    pub(super) fn note(&mut self, seen: &Observation<'_>) {
        let detections = &seen.frame.detections;
        self.headings.merge(&seen.reported.headings);
        self.off_origin.merge(&seen.reported.off_origin);
        self.detections += detections.len() as u64;
        self.without_sigma += seen.reported.without_sigma;
        self.sigma_is_set = seen.reported.sigma_is_set;
        self.is_json = seen.reported.is_json;
        if seen.reported.pose_yaw.abs() > A_TURN_RAD {
            self.turned_poses += 1;
            self.turned_pose_rad = seen.reported.pose_yaw;
        }
        (self.yaw, self.sizes_swapped) = (seen.reported.yaw, seen.reported.sizes_swapped);
        self.time_offset = seen.reported.time_offset;
        let sigma = detections.iter().map(|one| one.covariance.position);
        let sigma = sigma.map(|one| libm::sqrt(f64::midpoint(one.xx, one.yy))).filter(|one| one.is_finite());
        for sigma_m in sigma {
            self.sigma = (self.sigma.0 + sigma_m, self.sigma.1 + 1);
        }
        let vehicles = detections.iter().filter(|one| is_vehicle(one));
        for vehicle in vehicles {
            // Negative ones are no sizes.
            self.vehicles += u64::from(vehicle.bev.d > 0.0);
            self.wide_vehicles += u64::from(vehicle.bev.d > 0.0 && vehicle.bev.w > vehicle.bev.d);
        }
        if detections.len() <= MAX_LOOKED_AT {
            self.note_twins(detections);
        }
        let places = detections.iter().map(|one| [one.bev.x, one.bev.y]);
        if let Some(pose) = seen.frame.sensor_pose {
            let ranges = detections.iter().map(|one| pose.distance_to(one.bev.x, one.bev.y));
            for range_m in ranges.filter(|range_m| range_m.is_finite()) {
                self.ranges = (self.ranges.0 + range_m, self.ranges.1 + 1);
            }
        }
        // What is beyond is dropped by the hub.
        let places = places.filter(|place| place.iter().all(|one| one.abs() <= MAX_COORDINATE_M / 10.0));
        let mut here: Option<[(f64, f64); 2]> = None;
        for place in places {
            widen(&mut here, place.map(|one| (one, one)));
            self.sum = [self.sum[0] + place[0], self.sum[1] + place[1]];
            self.n += 1;
        }
        let Some(here) = here else { return };
        widen(&mut self.extent, here);
        if detections.len() < SEVERAL && self.middles.len() < MAX_MIDDLES {
            let middle = here.map(|(least, most)| f64::midpoint(least, most));
            self.middles.push((middle, detections.len()));
        }
        if detections.len() >= SEVERAL {
            self.several += 1;
            let lie_within = |apart: f64| u64::from(here.iter().all(|(least, most)| most - least < apart));
            self.several_at_one_place += lie_within(DEGREES_APART);
            self.several_in_one_spot += lie_within(ONE_SPOT_M);
        }
    }

    fn note_twins(&mut self, detections: &[Detection]) {
        for (n, one) in detections.iter().enumerate().filter(|(_, one)| is_vehicle(one)) {
            self.looked_at += 1;
            // Bodies touch where their middles are as far apart as they are wide; these overlap by half at least.
            let is_twin = |other: &&Detection| {
                let apart = libm::hypot(one.bev.x - other.bev.x, one.bev.y - other.bev.y);
                let widths = [one, other].map(|one| one.bev.w.min(one.bev.d));
                apart < (widths[0] + widths[1]) / 4.0
            };
            let mut before = detections[..n].iter().filter(|other| is_vehicle(other));
            self.twin_vehicles += u64::from(before.any(|other| is_twin(&other)));
        }
    }

    /// The mean of its detections, m.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub(super) fn middle(&self) -> Option<[f64; 2]> {
        (self.n > 0).then(|| self.sum.map(|sum| sum / self.n as f64))
    }

    /// How far its detections are from its sensor in the mean, m, and their number; `None` without a pose.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub(super) fn mean_range(&self) -> Option<(f64, u64)> {
        let (sum, n) = self.ranges;
        (n > 0).then(|| (sum / n as f64, n))
    }

    /// The mean standard deviation of its positions, m.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub(super) fn mean_sigma_m(&self) -> Option<f64> {
        let (sum, n) = self.sigma;
        (n > 0).then(|| sum / n as f64)
    }

    /// How far the one or two objects that it sees moved steadily, by its numbers; `None` of what stands, or moves otherwise. The
    /// noise of what stands goes to and fro, and an estimate that settles slows down.
    pub(super) fn steady_motion(&self) -> Option<f64> {
        const STEPS: usize = 8;
        const STRAIGHT: f64 = 0.8;
        const HALVES: f64 = 2.5;
        let (n, number) = (self.middles.len(), self.middles.first()?.1);
        if n < 2 * STEPS || self.middles.iter().any(|(_, of)| *of != number) {
            return None;
        }
        let at = |step: usize| self.middles[step * (n - 1) / STEPS].0;
        let between = |a: usize, b: usize| libm::hypot(at(b)[0] - at(a)[0], at(b)[1] - at(a)[1]);
        let length: f64 = (0..STEPS).map(|step| between(step, step + 1)).sum();
        let (whole, first, second) = (between(0, STEPS), between(0, STEPS / 2), between(STEPS / 2, STEPS));
        let is_steady = whole >= STRAIGHT * length && first <= HALVES * second && second <= HALVES * first;
        (is_steady && whole > 0.0).then_some(whole)
    }

    /// How far its detections lie apart along x and along y.
    pub(super) fn spread(&self) -> Option<f64> {
        self.extent.map(|[x, y]| (x.1 - x.0).max(y.1 - y.0))
    }

    /// Whether every position can be a longitude and a latitude in degrees, in one order or the other.
    pub(super) fn can_be_degrees(&self) -> bool {
        self.extent.is_some_and(|[x, y]| {
            let within = |(least, most): (f64, f64), limit: f64| least >= -limit && most <= limit;
            (within(x, 180.0) && within(y, 90.0)) || (within(x, 90.0) && within(y, 180.0))
        })
    }
}

fn is_vehicle(one: &Detection) -> bool {
    match one.class.group() {
        ClassGroup::FourWheeled => true,
        _ if one.class == Class::Unknown => {
            let (w, d) = (one.bev.w, one.bev.d);
            let within = |value: f64, (least, most): (f64, f64)| (least..=most).contains(&value);
            within(w.max(d), LONG_M) && within(w.min(d), SHORT_M)
        }
        _ => false,
    }
}

fn widen(extent: &mut Option<[(f64, f64); 2]>, by: [(f64, f64); 2]) {
    let Some(known) = extent else {
        *extent = Some(by);
        return;
    };
    for (known, (least, most)) in known.iter_mut().zip(by) {
        *known = (known.0.min(least), known.1.max(most));
    }
}
