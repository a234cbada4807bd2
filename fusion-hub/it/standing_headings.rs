//! Headings of what stands: a body does not turn where it is, and motion decides about nothing there.

use crate::consistency::normal;
use crate::world::{agent, at, frame};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, HeadingKind};
use v2x_common::geometry::{BevBox, angle_difference, wrap_angle};
use v2x_common::id::HubId;
use v2x_fusion_hub::engine::{Engine, EngineConfig};

/// Parked cars: x, y (m), and yaw (rad).
const PARKED: [[f64; 3]; 4] = [[5.0, 15.0, 0.7], [20.0, -12.0, 2.9], [-15.0, 8.0, -1.9], [-22.0, -16.0, 0.1]];
/// Standard deviations of positions (m) and headings (rad), as declared.
const SIGMA_M: f64 = 0.3;
const SIGMA_RAD: f64 = 0.05;

/// What an agent makes of a heading, rad.
type Heading = fn(&mut ChaCha8Rng, f64) -> f64;

fn uniform(dice: &mut ChaCha8Rng) -> f64 {
    f64::from(dice.next_u32()) / f64::from(u32::MAX)
}

fn right(dice: &mut ChaCha8Rng, yaw: f64) -> f64 {
    yaw + SIGMA_RAD * normal(dice)
}

fn worthless(dice: &mut ChaCha8Rng, _: f64) -> f64 {
    TAU * uniform(dice)
}

fn turned_at_times(dice: &mut ChaCha8Rng, yaw: f64) -> f64 {
    let turn = if uniform(dice) < 0.3 { PI } else { 0.0 };
    turn + right(dice, yaw)
}

fn a_quarter_off(dice: &mut ChaCha8Rng, yaw: f64) -> f64 {
    FRAC_PI_2 + right(dice, yaw)
}

/// What is published of the parked cars in the last five of 20 s.
#[derive(Debug, Default)]
struct Published {
    /// How many objects.
    n: usize,
    /// By kind of heading: known, axis, unknown.
    kinds: [usize; 3],
    /// Mean speed, m/s, and largest errors of the axis and of the heading, rad.
    speed: f64,
    axis: f64,
    heading: f64,
    /// Largest standard deviation of a heading, rad.
    sigma: f64,
}

fn published(agents: &[Heading]) -> Published {
    let mut engine = Engine::new(EngineConfig::new(HubId::new("hub").expect("test input"), 1));
    let mut dice = ChaCha8Rng::seed_from_u64(7);
    let mut published = Published::default();
    for step in 0..200_i64 {
        for (number, heading) in agents.iter().enumerate() {
            let seen = PARKED.iter().map(|[x, y, yaw]| Detection {
                class: Class::Car,
                score: 1.0,
                bev: BevBox {
                    x: x + SIGMA_M * normal(&mut dice),
                    y: y + SIGMA_M * normal(&mut dice),
                    w: 1.8,
                    d: 4.5,
                    yaw: wrap_angle(heading(&mut dice, *yaw)),
                },
                covariance: BoxCovariance {
                    position: Covariance2::isotropic(SIGMA_M),
                    ww: 0.01,
                    dd: 0.04,
                    yaw: SIGMA_RAD * SIGMA_RAD,
                },
                velocity: None,
                heading: HeadingKind::Known,
                source_track: None,
            });
            let name = agent(["a", "b"][number]);
            let sent = frame(name, step.unsigned_abs(), 100 * step, seen.collect());
            engine.handle_frame(&sent, at(100 * step + 30));
        }
        let list = engine.fused(at(100 * step + 50));
        for object in list.objects.iter().filter(|_| step >= 150) {
            let off = |[x, y, _]: &[f64; 3]| libm::hypot(object.bev.x - x, object.bev.y - y);
            let car = PARKED.iter().min_by(|a, b| off(a).total_cmp(&off(b))).expect("some cars");
            let (vx, vy) = object.velocity;
            published.n += 1;
            published.kinds[match object.heading {
                HeadingKind::Known => 0,
                HeadingKind::Axis => 1,
                HeadingKind::Unknown => 2,
            }] += 1;
            published.speed += libm::hypot(vx, vy);
            let heading = angle_difference(object.bev.yaw, car[2]).abs();
            published.heading = published.heading.max(heading);
            published.axis = published.axis.max(heading.min(PI - heading));
            published.sigma = published.sigma.max(object.yaw_variance.sqrt());
        }
    }
    assert_eq!(published.n, 50 * PARKED.len(), "one object for each car");
    published.speed /= published.n as f64;
    published
}

#[test]
fn headings_that_are_as_declared_make_those_of_parked_cars_known() {
    let good = published(&[right]);
    assert_eq!(good.kinds, [good.n, 0, 0], "{good:?}");
    assert!(good.heading < 0.05 && good.sigma < 0.1 && good.speed < 0.02, "{good:?}");
}

#[test]
fn worthless_headings_leave_those_of_parked_cars_unknown_and_move_nothing() {
    let alone = published(&[worthless]);
    assert_eq!(alone.kinds, [0, 0, alone.n], "{alone:?}");
    assert!(alone.speed < 0.05 && alone.sigma > 0.9, "{alone:?}");
}

#[test]
fn beside_an_agent_whose_headings_are_worthless_those_of_a_better_one_count_for_parked_cars() {
    for agents in [[worthless as Heading, right], [right, worthless]] {
        let both = published(&agents);
        assert!(both.axis < 0.08 && both.speed < 0.05, "{both:?}");
        assert_eq!(both.kinds[2], 0, "{both:?}");
    }
}

#[test]
fn where_two_agents_say_different_axes_for_good_neither_is_taken_for_known() {
    let both = published(&[a_quarter_off, right]);
    assert_eq!(both.kinds, [0, 0, both.n], "{both:?}");
    assert!(both.sigma > 0.7 && both.speed < 0.05, "{both:?}");
}

#[test]
fn fronts_that_one_agent_turns_at_times_are_decided_by_one_that_does_not_and_left_open_without_it() {
    let both = published(&[turned_at_times, right]);
    assert!(both.kinds[0] > both.n * 3 / 4 && both.heading < 0.08, "{both:?}");
    let alone = published(&[turned_at_times]);
    assert_eq!(alone.kinds, [0, alone.n, 0], "{alone:?}");
    assert!(alone.axis < 0.08, "{alone:?}");
}
