//! How an agent writes its numbers: unit of headings, order of sizes, unit of positions, stated errors.

use super::observation::Observation;
use v2x_common::class::ClassGroup;
use v2x_common::reported::RawHeadings;

/// Detections in degrees of longitude and latitude lie this close together, in what is read as metres: 5 km.
const DEGREES_APART: f64 = 0.05;

/// Of one agent.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Writing {
    pub(super) headings: RawHeadings,
    pub(super) detections: u64,
    pub(super) without_sigma: u64,
    pub(super) vehicles: u64,
    pub(super) wide_vehicles: u64,
    /// Frames of several detections, and those of them whose detections all lie within [`DEGREES_APART`].
    pub(super) several: u64,
    pub(super) several_at_one_place: u64,
    /// The least and the largest x and y, m.
    pub(super) extent: Option<[(f64, f64); 2]>,
}

impl Writing {
    pub(super) fn note(&mut self, seen: &Observation<'_>) {
        let detections = &seen.frame.detections;
        self.headings.merge(&seen.reported.headings);
        self.detections += detections.len() as u64;
        self.without_sigma += seen.reported.without_sigma;
        let vehicles = detections.iter().filter(|one| one.class.group() == ClassGroup::FourWheeled);
        for vehicle in vehicles {
            self.vehicles += 1;
            self.wide_vehicles += u64::from(vehicle.bev.w > vehicle.bev.d);
        }
        let places = detections.iter().map(|one| [one.bev.x, one.bev.y]);
        let places = places.filter(|place| place.iter().all(|one| one.is_finite()));
        let mut here: Option<[(f64, f64); 2]> = None;
        places.for_each(|place| widen(&mut here, place.map(|one| (one, one))));
        let Some(here) = here else { return };
        widen(&mut self.extent, here);
        if detections.len() > 1 {
            self.several += 1;
            self.several_at_one_place +=
                u64::from(here.iter().all(|(least, most)| most - least < DEGREES_APART));
        }
    }

    /// The middle of its detections, m.
    pub(super) fn middle(&self) -> Option<[f64; 2]> {
        self.extent.map(|extent| extent.map(|(least, most)| f64::midpoint(least, most)))
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
