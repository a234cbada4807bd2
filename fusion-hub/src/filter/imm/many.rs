//! Many objects, four at a time ([`super::lanes`]). What is left over at the end is repeated in the lanes that it does not need.

use super::gaussian::PoseReport;
use super::lanes::apart;
use super::likelihood::Symmetric;
use super::output::{Moments, MomentsOf, Place, PlaceOf, moments_of, place};
use super::params::Params;
use super::passage::{self, Passage};
use super::{Imm, Inflation};
use crate::filter::{Due, Filter, Holds};
use crate::values::{LANES, Measurement, PositionInnovation};
use fearless_simd::{Level, Simd, SimdFrom, dispatch, f64x4};
use v2x_common::geometry::wrap_angle;
use v2x_common::time::Timestamp;

/// How one object moves: for how long (s), and how long it is (m).
#[derive(Clone, Copy, Debug)]
pub(in crate::filter) struct Move {
    pub(in crate::filter) dt_s: f64,
    pub(in crate::filter) length_m: f64,
}

impl Move {
    const NONE: Self = Self { dt_s: 0.0, length_m: 0.0 };
}

impl Imm {
    /// Moves within one step, of what moves by these parameters.
    fn pass_short(&mut self, by: Move, params: &'static Params) {
        self.pass(&Passage::short(by.dt_s, by.length_m, params));
    }
}

/// Four objects of all that there are, and how they move; the last ones may be the same.
type Alike = [(usize, Move); LANES];

/// Moves some objects, each by its own time; `by` says how.
pub(in crate::filter) fn predict_some<F: AsRef<Imm> + AsMut<Imm>, T: Holds<F>>(
    all: &mut [T],
    due: &[Due],
    by: impl Fn(&F, Timestamp) -> Move,
) {
    let level = Level::new();
    for (kind, params) in Params::of_kinds().enumerate() {
        let mut alike = [(0, Move::NONE); LANES];
        let mut n = 0;
        for Due { place, class, to } in due.iter().filter(|due| Params::kind_of(due.class) == kind) {
            let by = by(all[*place].state(), *to);
            if !passage::is_short(by.dt_s, *class) {
                all[*place].state_mut().as_mut().predict(by.dt_s, *class, by.length_m);
                continue;
            }
            alike[n] = (*place, by);
            n += 1;
            if n == LANES {
                dispatch!(level, simd => predict(simd, all, &alike, params));
                n = 0;
            }
        }
        let (place, by) = alike[0];
        match n {
            0 => {}
            1 => all[place].state_mut().as_mut().pass_short(by, params),
            _ => {
                alike[n..].fill((place, by));
                dispatch!(level, simd => predict(simd, all, &alike, params));
            }
        }
    }
}

#[inline(always)]
fn predict<S: Simd, F: AsRef<Imm> + AsMut<Imm>, T: Holds<F>>(
    simd: S,
    all: &mut [T],
    alike: &Alike,
    params: &'static Params,
) {
    let [a, b, c, d] = alike;
    let dt_s = f64x4::simd_from(simd, [a.1.dt_s, b.1.dt_s, c.1.dt_s, d.1.dt_s]);
    let length_m = f64x4::simd_from(simd, [a.1.length_m, b.1.length_m, c.1.length_m, d.1.length_m]);
    let passage = Passage::short(dt_s, length_m, params);
    let objects = [&all[a.0], &all[b.0], &all[c.0], &all[d.0]].map(|object| object.state().as_ref());
    let mut lanes = Imm::in_lanes(simd, objects);
    lanes.pass(&passage);
    let moved = lanes.apart();
    for (lane, (place, _)) in alike.iter().enumerate() {
        *all[*place].state_mut().as_mut() = moved[lane];
    }
}

/// Whether a measurement is one of position, size and heading alone, whose errors are independent of the track's.
pub(in crate::filter) const fn is_plain(z: &Measurement) -> bool {
    !z.is_track && z.velocity.is_none()
}

/// Updates some objects, those at these places, by measurements; calls `take` with the number of each in the list and its
/// innovation. Those that are not plain are updated one by one, sizes included.
pub(in crate::filter) fn update_some<F: Filter + AsRef<Imm> + AsMut<Imm>, T: Holds<F>>(
    objects: &mut [T],
    some: &[(usize, Measurement)],
    take: &mut impl FnMut(usize, PositionInnovation),
) {
    let level = Level::new();
    let mut plain = [0; LANES];
    let mut n = 0;
    for (number, (place, z)) in some.iter().enumerate() {
        if !is_plain(z) {
            take(number, objects[*place].state_mut().update(z));
            continue;
        }
        plain[n] = number;
        n += 1;
        if n == LANES {
            let found = dispatch!(level, simd => update(simd, objects, plain.map(|number| &some[number])));
            plain.into_iter().zip(found).for_each(|(number, innovation)| take(number, innovation));
            n = 0;
        }
    }
    let first = plain[0];
    if n == 1 {
        let (place, z) = &some[first];
        take(first, objects[*place].state_mut().as_mut().update(z, Inflation::NONE));
    } else if n > 1 {
        plain[n..].fill(first);
        let found = dispatch!(level, simd => update(simd, objects, plain.map(|number| &some[number])));
        plain.into_iter().zip(found).take(n).for_each(|(number, innovation)| take(number, innovation));
    }
}

#[inline(always)]
fn update<S: Simd, F: AsRef<Imm> + AsMut<Imm>, T: Holds<F>>(
    simd: S,
    objects: &mut [T],
    reports: [&(usize, Measurement); LANES],
) -> [PositionInnovation; LANES] {
    let [a, b, c, d] = reports.map(|(place, _)| *place);
    let four = [&objects[a], &objects[b], &objects[c], &objects[d]].map(|object| object.state().as_ref());
    let mut lanes = Imm::in_lanes(simd, four);
    let PlaceOf { position, covariance, .. } = place(&lanes.places());
    let likelihoods = lanes.update_pose(&pose_reports(simd, reports.map(|(_, z)| z)));
    lanes.settle(&likelihoods);
    let updated = lanes.apart();
    for (lane, (place, _)) in reports.iter().enumerate() {
        *objects[*place].state_mut().as_mut() = updated[lane];
    }
    std::array::from_fn(|lane| {
        let (z, [x, y]) = (&reports[lane].1, position.map(|coordinate| coordinate[lane]));
        let s = lane_of(&covariance, lane).plus(&z.r.into());
        PositionInnovation::new([z.position[0] - x, z.position[1] - y], &s.into())
    })
}

#[inline(always)]
fn pose_reports<S: Simd>(simd: S, reports: [&Measurement; LANES]) -> PoseReport<f64x4<S>> {
    let together = |of: fn(&Measurement) -> f64| f64x4::simd_from(simd, reports.map(of));
    PoseReport {
        position: [together(|z| z.position[0]), together(|z| z.position[1])],
        r: Symmetric { xx: together(|z| z.r.xx), xy: together(|z| z.r.xy), yy: together(|z| z.r.yy) },
        yaw: together(|z| wrap_angle(z.yaw)),
        yaw_variance: together(|z| z.yaw_variance),
    }
}

#[inline(always)]
fn lane_of<S: Simd>(matrix: &Symmetric<f64x4<S>>, lane: usize) -> Symmetric {
    Symmetric { xx: matrix.xx[lane], xy: matrix.xy[lane], yy: matrix.yy[lane] }
}

/// Calls `take` with the place of each object: [`Imm::place`].
pub(in crate::filter) fn places_of<T: AsRef<Imm>>(all: &[T], mut take: impl FnMut(Place)) {
    let level = Level::new();
    for objects in all.chunks(LANES) {
        let four = four_of(objects);
        let places: [Place; LANES] = dispatch!(level, simd => places(simd, four));
        places.into_iter().take(objects.len()).for_each(&mut take);
    }
}

#[inline(always)]
fn places<S: Simd>(simd: S, objects: [&Imm; LANES]) -> [Place; LANES] {
    let PlaceOf { position, covariance, widest, yaw, yaw_variance } =
        place(&Imm::in_lanes(simd, objects).places());
    std::array::from_fn(|lane| {
        Place::from(PlaceOf {
            position: [position[0][lane], position[1][lane]],
            covariance: lane_of(&covariance, lane),
            widest: lane_of(&widest, lane),
            yaw: yaw[lane],
            yaw_variance: yaw_variance[lane],
        })
    })
}

/// Calls `take` with the moments of each object: [`Imm::moments`].
pub(in crate::filter) fn moments_of_all<T: AsRef<Imm>>(all: &[T], mut take: impl FnMut(Moments)) {
    let level = Level::new();
    for objects in all.chunks(LANES) {
        let four = four_of(objects);
        let moments: [Moments; LANES] = dispatch!(level, simd => moments(simd, four));
        moments.into_iter().take(objects.len()).for_each(&mut take);
    }
}

#[inline(always)]
fn moments<S: Simd>(simd: S, objects: [&Imm; LANES]) -> [Moments; LANES] {
    let lanes = Imm::in_lanes(simd, objects);
    let MomentsOf { mean, covariance, yaw, yaw_variance } = moments_of(&lanes.kinematics(), &lanes.places());
    let (means, covariances) = (apart(&mean), apart(&covariance));
    std::array::from_fn(|lane| {
        let (mean, covariance) = (means[lane], covariances[lane]);
        let of_lane = MomentsOf { mean, covariance, yaw: yaw[lane], yaw_variance: yaw_variance[lane] };
        Moments::of(&of_lane, objects[lane].weights)
    })
}

/// The objects of a chunk, the first one repeated.
fn four_of<T: AsRef<Imm>>(objects: &[T]) -> [&Imm; LANES] {
    std::array::from_fn(|lane| objects.get(lane).unwrap_or(&objects[0]).as_ref())
}
