//! Vehicles in lanes. All vehicles of a lane have the same motion, one behind the other, so that they never collide.

use crate::data::dataset::synthetic::actor::{Actor, Motion};
use crate::data::dataset::synthetic::body::Body;
use crate::data::dataset::synthetic::streets::{APPROACH_M, Lane, Phase, Streets, Turn, between};
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;
use v2x_agent::random::{chance, standard_normal, weighted};
use v2x_agent::world::profile::{Profile, speed_change_distance_m};
use v2x_common::class::Class;

/// Range of agent 1's initial distance to the crossing's middle, m.
const EGO_BEFORE_M: (f64, f64) = (15.0, 110.0);
const EGO_SIZE_M: [f64; 2] = [1.73, 4.08];
/// Range of the vehicles' initial positions along their lanes, m.
const FIRST_M: f64 = 60.0;
const LAST_M: f64 = 400.0;
/// Standard deviation of a vehicle's lateral offset in its lane, m.
const ASIDE_M: f64 = 0.15;
/// Longer than every scene, s.
const LONG_S: f64 = 1000.0;

/// The motion of all vehicles of a lane.
#[derive(Clone, Debug)]
struct Flow {
    turn: Turn,
    profile: Profile,
    /// Range of the gaps between vehicles, m.
    gaps_m: (f64, f64),
    /// Share of occupied places.
    density: f64,
    /// Where the first vehicle stops, if the lane waits: m along the path, and the distance driven until then.
    waits_at: Option<(f64, f64)>,
}

/// Agent 1, and all other vehicles in lanes.
pub(super) fn traffic(streets: &Streets, rng: &mut ChaCha8Rng) -> (Actor, Vec<Actor>) {
    let mut actors = Vec::new();
    let own_place = weighted(rng, &[(0, 0.5), (streets.lanes_of(0) - 1, 0.5)]);
    let mut ego = None;
    for lane in streets.lanes() {
        let flow = flow(streets, lane, rng);
        let own =
            (lane == Lane { approach: 0, place: own_place }).then(|| APPROACH_M - between(rng, EGO_BEFORE_M));
        let mut platoon = platoon(streets, lane, (&flow, own), rng);
        if own.is_some() && !platoon.is_empty() {
            ego = Some(platoon.remove(0));
        }
        actors.extend(platoon);
    }
    (ego.expect("one of the main road's lanes is agent 1's"), actors)
}

fn flow(streets: &Streets, lane: Lane, rng: &mut ChaCha8Rng) -> Flow {
    let is_main = lane.approach.is_multiple_of(2);
    let density = weighted(rng, &[(0.25, 0.35), (0.5, 0.4), (0.8, 0.25)]);
    match streets.phase {
        Phase::MainGreen if is_main => driving(streets, lane, density, rng),
        Phase::CrossGreen if !is_main => driving(streets, lane, density, rng),
        Phase::OwnGreen if lane.approach == 0 => driving(streets, lane, density, rng),
        Phase::MainStarts if is_main => {
            let wait_s = between(rng, (1.0, 8.0));
            let speed = between(rng, (6.0, 13.0));
            let profile = Profile::from(0.0, 0.0).hold(wait_s).change_speed(speed, between(rng, (0.8, 1.8)));
            let waits_at = Some((streets.stop_line_m(lane), 0.0));
            Flow { turn: Turn::Straight, profile, gaps_m: (2.5, 6.0), density, waits_at }
        }
        Phase::MainStops if is_main => stopping(streets, lane, density, rng),
        _ if chance(rng, 0.45) => stopping(streets, lane, density, rng),
        _ => {
            let waits_at = Some((streets.stop_line_m(lane), 0.0));
            let profile = Profile::from(0.0, 0.0).hold(LONG_S);
            Flow { turn: Turn::Straight, profile, gaps_m: (2.0, 3.5), density, waits_at }
        }
    }
}

fn driving(streets: &Streets, lane: Lane, density: f64, rng: &mut ChaCha8Rng) -> Flow {
    let is_outermost = lane.place + 1 == streets.lanes_of(lane.approach);
    // A left turn crosses opposite traffic: it is allowed only while that waits.
    let turns_left = streets.phase == Phase::OwnGreen && lane.place == 0 && chance(rng, 0.5);
    if turns_left || (is_outermost && chance(rng, 0.25)) {
        let turn = if turns_left { Turn::Left } else { Turn::Right };
        let profile = Profile::from(0.0, between(rng, (3.5, 6.0))).hold(LONG_S);
        return Flow { turn, profile, gaps_m: (5.0, 15.0), density, waits_at: None };
    }
    let speed = between(rng, (5.0, 14.0));
    let other = between(rng, (5.0, 14.0));
    let profile = Profile::from(0.0, speed)
        .hold(between(rng, (1.0, 15.0)))
        .change_speed(other, between(rng, (0.4, 1.5)))
        .hold(between(rng, (1.0, 6.0)))
        .change_speed(between(rng, (5.0, 14.0)), between(rng, (0.4, 1.5)));
    Flow { turn: Turn::Straight, profile, gaps_m: (6.0, 22.0), density, waits_at: None }
}

fn stopping(streets: &Streets, lane: Lane, density: f64, rng: &mut ChaCha8Rng) -> Flow {
    let (speed, rate) = (between(rng, (5.0, 12.0)), between(rng, (1.0, 2.5)));
    let before_s = between(rng, (0.0, 8.0));
    let distance_m = before_s * speed + speed_change_distance_m(speed, 0.0, rate);
    let profile = Profile::from(0.0, speed).hold(before_s).change_speed(0.0, rate).hold(LONG_S);
    let waits_at = Some((streets.stop_line_m(lane), distance_m));
    Flow { turn: Turn::Straight, profile, gaps_m: (2.5, 6.0), density, waits_at }
}

/// The vehicles of a lane. Agent 1 is the first where it is in this lane: `own` m along the path, or behind the stop line
/// in a lane that waits.
fn platoon(
    streets: &Streets,
    lane: Lane,
    (flow, own): (&Flow, Option<f64>),
    rng: &mut ChaCha8Rng,
) -> Vec<Actor> {
    let path = Arc::new(streets.path(lane, flow.turn));
    let profile = Arc::new(flow.profile.clone());
    let place = |body: Body, from_m: f64, rng: &mut ChaCha8Rng| Actor {
        body,
        motion: Motion::Following(Arc::clone(&path), from_m, Arc::clone(&profile)),
        aside_m: ASIDE_M * standard_normal(rng).clamp(-2.0, 2.0),
    };
    let front_m = flow.waits_at.map_or(LAST_M, |(line_m, distance_m)| line_m - distance_m);
    let mut actors = Vec::new();
    let ego_body = Body { class: Class::Car, size_m: EGO_SIZE_M };
    let own = own.map(|own_m| own_m.min(front_m - EGO_SIZE_M[1]));
    if let Some(own_m) = own {
        actors.push(place(ego_body, own_m, rng));
    }
    // From the front backwards. A vehicle that would touch agent 1 is left out.
    let mut front_m = front_m;
    while front_m > FIRST_M {
        let body = Body::driving(rng);
        let length_m = body.size_m[1];
        let centre_m = front_m - length_m / 2.0;
        let room_m = (length_m + EGO_SIZE_M[1]) / 2.0 + 1.5;
        let is_free = own.is_none_or(|own_m| (own_m - centre_m).abs() > room_m);
        if is_free && chance(rng, flow.density) {
            actors.push(place(body, centre_m, rng));
        }
        front_m -= length_m + between(rng, flow.gaps_m);
    }
    actors
}
