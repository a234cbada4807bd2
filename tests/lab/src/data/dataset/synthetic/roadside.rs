//! Objects beside the lanes: parked vehicles, pedestrians, cyclists, works.

use crate::data::dataset::synthetic::actor::{Actor, Motion};
use crate::data::dataset::synthetic::body::Body;
use crate::data::dataset::synthetic::streets::{Streets, between, rotated};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;
use v2x_agent::random::{chance, poisson, standard_normal, weighted};
use v2x_agent::world::path::Path;
use v2x_agent::world::profile::Profile;
use v2x_common::class::Class;
use v2x_common::geometry::Pose;

/// Objects beside the roads are within this distance of the crossing, m.
const REACH_M: f64 = 260.0;
/// Distance from the kerb to the middle of parked vehicles, cyclists and the pavement, m.
const PARKING_M: f64 = 1.3;
const CYCLING_M: f64 = 3.4;
const PAVEMENT_M: f64 = 6.0;
/// Length of a parking place, m.
const PARKING_PLACE_M: f64 = 7.0;
/// Longer vehicles do not park here, m.
const LONGEST_PARKED_M: f64 = 6.4;
/// Longer than every scene, s.
const LONG_S: f64 = 1000.0;

/// Vehicles along the kerbs, in the direction of the nearest lane.
pub(super) fn parked(streets: &Streets, rng: &mut ChaCha8Rng) -> Vec<Actor> {
    let mut actors = Vec::new();
    for approach in 0..4 {
        let occupancy = weighted(rng, &[(0.0, 0.45), (0.15, 0.3), (0.45, 0.2), (0.8, 0.05)]);
        let aside_m = -(streets.kerb_m(approach) + PARKING_M);
        let clear_m = streets.junction_m(approach) + 10.0;
        let mut along_m = -REACH_M;
        while along_m < REACH_M {
            let body = Body::parked(rng);
            let is_taken = chance(rng, occupancy) && body.size_m[1] < LONGEST_PARKED_M;
            if is_taken && along_m.abs() > clear_m {
                let pose = rotated(along_m, aside_m + 0.1 * standard_normal(rng).clamp(-2.0, 2.0), approach);
                let yaw = pose.yaw + 0.03 * standard_normal(rng).clamp(-3.0, 3.0);
                actors.push(Actor::standing(body, Pose { yaw, ..pose }));
            }
            along_m += PARKING_PLACE_M + between(rng, (0.0, 1.0));
        }
    }
    actors
}

/// Pedestrians on the pavements: alone or in small groups, walking or standing.
pub(super) fn people(streets: &Streets, rng: &mut ChaCha8Rng) -> Vec<Actor> {
    let mut actors = Vec::new();
    // Per 100 m of pavement; some scenes are crowded.
    let density = weighted(rng, &[(0.3, 0.3), (1.2, 0.4), (3.0, 0.25), (6.0, 0.05)]);
    for approach in 0..4 {
        for _ in 0..poisson(rng, density * 2.0 * REACH_M / 100.0) {
            let along_m = between(rng, (-REACH_M, REACH_M));
            let aside_m = -(streets.kerb_m(approach) + PAVEMENT_M + between(rng, (-1.0, 2.5)));
            if along_m.abs() < streets.junction_m(approach) + 4.0 {
                continue;
            }
            let place = rotated(along_m, aside_m, approach);
            let size = weighted(rng, &[(1, 0.6), (2, 0.28), (3, 0.12)]);
            if chance(rng, 0.75) {
                actors.extend(walkers(place, size, rng));
            } else {
                actors.extend(standers(place, size, rng));
            }
        }
    }
    actors
}

/// Pedestrians side by side along a slightly bent path.
fn walkers(place: Pose, size: u32, rng: &mut ChaCha8Rng) -> Vec<Actor> {
    let back = if chance(rng, 0.5) { PI } else { 0.0 };
    let mut path = Path::from(Pose { yaw: place.yaw + back, ..place });
    for _ in 0..6 {
        let bend = between(rng, (-0.25, 0.25));
        path = path.line(between(rng, (2.0, 9.0))).arc(bend, between(rng, (3.0, 9.0)));
    }
    let speed = (1.25 + 0.25 * standard_normal(rng)).clamp(0.5, 2.2);
    let mut profile = Profile::from(0.0, speed);
    if chance(rng, 0.15) {
        profile = profile.hold(between(rng, (2.0, 12.0))).change_speed(0.0, 1.0).hold(LONG_S);
    }
    let (path, profile) = (Arc::new(path), Arc::new(profile));
    (0..size)
        .map(|member| Actor {
            body: Body::walking(rng),
            motion: Motion::Following(Arc::clone(&path), between(rng, (0.0, 0.5)), Arc::clone(&profile)),
            aside_m: f64::from(member) * between(rng, (0.85, 1.0)),
        })
        .collect()
}

/// Pedestrians in a circle, each with its own heading.
fn standers(place: Pose, size: u32, rng: &mut ChaCha8Rng) -> Vec<Actor> {
    let first = between(rng, (0.0, TAU));
    (0..size)
        .map(|member| {
            let (sin, cos) = libm::sincos(first + TAU * f64::from(member) / f64::from(size));
            let (x, y) = (place.x + 0.75 * cos, place.y + 0.75 * sin);
            Actor::standing(Body::walking(rng), Pose { x, y, yaw: between(rng, (-PI, PI)) })
        })
        .collect()
}

/// Cyclists between the parked vehicles and the pavement, and some parked bicycles.
pub(super) fn cyclists(streets: &Streets, rng: &mut ChaCha8Rng) -> Vec<Actor> {
    let mut actors = Vec::new();
    for approach in 0..4 {
        let aside_m = -(streets.kerb_m(approach) + CYCLING_M);
        let path = Arc::new(Path::from(rotated(-REACH_M, aside_m, approach)).line(4.0 * REACH_M));
        // All have the same speed, so that none overtakes.
        let profile = Arc::new(Profile::from(0.0, between(rng, (3.0, 6.5))).hold(LONG_S));
        let mut along_m = between(rng, (0.0, 250.0));
        while along_m < 2.0 * REACH_M {
            let body = Body::of(Class::Bicycle, rng);
            let motion = Motion::Following(Arc::clone(&path), along_m, Arc::clone(&profile));
            actors.push(Actor { body, motion, aside_m: between(rng, (-0.3, 0.3)) });
            along_m += between(rng, (60.0, 400.0));
        }
        if chance(rng, 0.3) {
            let along_m = between(rng, (30.0, REACH_M));
            for stand in 0..3 {
                let pose = rotated(along_m + 0.9 * f64::from(stand), aside_m - 4.8, approach);
                let yaw = pose.yaw + PI / 2.0 + 0.1 * standard_normal(rng).clamp(-2.0, 2.0);
                actors.push(Actor::standing(Body::of(Class::Bicycle, rng), Pose { yaw, ..pose }));
            }
        }
    }
    actors
}

/// In some scenes: a row of barriers, a row of cones, construction workers.
pub(super) fn works(streets: &Streets, rng: &mut ChaCha8Rng) -> Vec<Actor> {
    let mut actors = Vec::new();
    if chance(rng, 0.55) {
        return actors;
    }
    let approach = weighted(rng, &[(0, 0.4), (2, 0.4), (1, 0.2)]);
    let begin_m = between(rng, (-60.0, 60.0));
    let aside_m = -(streets.kerb_m(approach) + PAVEMENT_M + 5.0);
    let mut along_m = begin_m;
    for _ in 0..poisson(rng, 11.0) {
        let body = Body::of(Class::Barrier, rng);
        let pose = rotated(along_m, aside_m + 0.1 * standard_normal(rng).clamp(-2.0, 2.0), approach);
        // Its width is along the road.
        let yaw = pose.yaw + PI / 2.0 + 0.05 * standard_normal(rng).clamp(-2.0, 2.0);
        actors.push(Actor::standing(body, Pose { yaw, ..pose }));
        along_m += 3.4 + between(rng, (0.0, 0.6));
    }
    let mut along_m = begin_m;
    for _ in 0..poisson(rng, 8.0) {
        let body = Body::of(Class::TrafficCone, rng);
        let pose = rotated(along_m, aside_m + 3.0, approach);
        actors.push(Actor::standing(body, Pose { yaw: between(rng, (-PI, PI)), ..pose }));
        along_m += between(rng, (1.2, 4.0));
    }
    for _ in 0..poisson(rng, 1.5) {
        let place = rotated(begin_m + between(rng, (0.0, 30.0)), aside_m - 3.0, approach);
        let body = Body::of(Class::ConstructionWorker, rng);
        actors.push(Actor::standing(body, Pose { yaw: between(rng, (-PI, PI)), ..place }));
    }
    actors
}
