//! How an agent writes its numbers: unit of headings, order of sizes, unit of positions, stated errors.

use super::observation::Observation;
use v2x_common::class::ClassGroup;
use v2x_common::conventions::YawConvention;
use v2x_common::detection::MAX_COORDINATE_M;
use v2x_common::reported::RawHeadings;

/// Detections in degrees of longitude and latitude lie this close together, in what is read as metres: 5 km.
pub(super) const DEGREES_APART: f64 = 0.05;

/// Of one agent.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Writing {
    pub(super) headings: RawHeadings,
    pub(super) detections: u64,
    pub(super) without_sigma: u64,
    pub(super) sigma_is_set: bool,
    pub(super) vehicles: u64,
    pub(super) wide_vehicles: u64,
    /// Frames of several detections, and those of them whose detections all lie within [`DEGREES_APART`].
    pub(super) several: u64,
    pub(super) several_at_one_place: u64,
    /// The least and the largest x and y, m.
    pub(super) extent: Option<[(f64, f64); 2]>,
    sum: [f64; 2],
    n: u64,
    pub(super) yaw: YawConvention,
    pub(super) sizes_swapped: bool,
}

impl Writing {
    pub(super) fn note(&mut self, seen: &Observation<'_>) {
        let detections = &seen.frame.detections;
        self.headings.merge(&seen.reported.headings);
        self.detections += detections.len() as u64;
        self.without_sigma += seen.reported.without_sigma;
        self.sigma_is_set = seen.reported.sigma_is_set;
        (self.yaw, self.sizes_swapped) = (seen.reported.yaw, seen.reported.sizes_swapped);
        let vehicles = detections.iter().filter(|one| one.class.group() == ClassGroup::FourWheeled);
        for vehicle in vehicles {
            self.vehicles += 1;
            self.wide_vehicles += u64::from(vehicle.bev.w > vehicle.bev.d);
        }
        let places = detections.iter().map(|one| [one.bev.x, one.bev.y]);
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
        if detections.len() > 1 {
            self.several += 1;
            self.several_at_one_place +=
                u64::from(here.iter().all(|(least, most)| most - least < DEGREES_APART));
        }
    }

    /// The mean of its detections, m.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub(super) fn middle(&self) -> Option<[f64; 2]> {
        (self.n > 0).then(|| self.sum.map(|sum| sum / self.n as f64))
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

fn widen(extent: &mut Option<[(f64, f64); 2]>, by: [(f64, f64); 2]) {
    let Some(known) = extent else {
        *extent = Some(by);
        return;
    };
    for (known, (least, most)) in known.iter_mut().zip(by) {
        *known = (known.0.min(least), known.1.max(most));
    }
}
