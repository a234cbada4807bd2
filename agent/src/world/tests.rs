use super::{CrossingConfig, HighwayConfig, Route, Station, World, WorldConfig, WorldParameters};
use crate::scenario::Scenario;
use crate::truth::TrueObject;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::FRAC_PI_2;
use v2x_common::class::Class;
use v2x_common::geometry::{BevBox, Pose, angle_difference};
use v2x_common::time::Span;

const CROSSING: &str = include_str!("../../../deploy/scenarios/crossing.toml");
const TEN_AGENTS: &str = include_str!("../../../deploy/scenarios/ten-agents.toml");
const HIGHWAY: &str = include_str!("../../../deploy/scenarios/highway.toml");
const ALL: [&str; 3] = [CROSSING, TEN_AGENTS, HIGHWAY];

fn world(text: &str, seed: u64) -> (Scenario, World) {
    let scenario = Scenario::from_toml(text).unwrap();
    let world = scenario.world(seed);
    (scenario, world)
}

fn objects_at(world: &World, t: Span) -> Vec<TrueObject> {
    let mut objects = Vec::new();
    world.objects_at(t, &mut objects);
    objects
}

/// Times over one loop of 120 s, in steps.
fn times(step_s: f64) -> impl Iterator<Item = Span> {
    (0..)
        .map(move |step| Span::from_secs_f64(f64::from(step) * step_s))
        .take_while(|t| t.as_secs_f64() < 120.0)
}

fn pose(world: &World, agent: usize, t: Span) -> Pose {
    world.agent_pose(agent, t).unwrap()
}

fn is_moving(object: &TrueObject) -> bool {
    object.velocity != (0.0, 0.0)
}

/// Means over the loop of what an agent has in its field of view.
#[derive(Debug)]
struct Density {
    boxes: f64,
    range_m: f64,
    /// Share of the boxes that are in motion at that moment.
    moving: f64,
    /// Share of the boxes whose objects ever move.
    mobile: f64,
}

fn density(scenario: &Scenario, world: &World, agent: usize) -> Density {
    let mobile: BTreeSet<_> =
        times(0.5).flat_map(|t| objects_at(world, t)).filter(is_moving).map(|object| object.id).collect();
    let mut boxes = Vec::new();
    for t in times(0.5) {
        let pose = pose(world, agent, t);
        let seen =
            |o: &TrueObject| scenario.agents[agent].sensor.field_of_view.contains(&pose, o.bev.x, o.bev.y);
        boxes.extend(
            objects_at(world, t).into_iter().filter(seen).map(|o| (pose.distance_to(o.bev.x, o.bev.y), o)),
        );
    }
    let n = boxes.len() as f64;
    let share = |is: &dyn Fn(&TrueObject) -> bool| boxes.iter().filter(|(_, o)| is(o)).count() as f64 / n;
    Density {
        boxes: n / times(0.5).count() as f64,
        range_m: boxes.iter().map(|(range_m, _)| range_m).sum::<f64>() / n,
        moving: share(&is_moving),
        mobile: share(&|o| mobile.contains(&o.id)),
    }
}

#[test]
fn the_default_crossing_has_the_density_and_motion_of_the_papers_scenes() {
    for seed in 1..=3 {
        let (scenario, world) = world(CROSSING, seed);
        for agent in 0..scenario.agents.len() {
            let density = density(&scenario, &world, agent);
            println!("seed {seed} {}: {density:.3?}", scenario.agents[agent].id());
            assert!((20.0..35.0).contains(&density.boxes), "{density:?}");
            assert!((32.0..42.0).contains(&density.range_m), "{density:?}");
            assert!((0.2..0.4).contains(&density.moving), "{density:?}");
            assert!((0.25..0.45).contains(&density.mobile), "{density:?}");
        }
    }
}

#[test]
fn ten_agents_have_about_fifty_objects_each_in_view() {
    let (scenario, world) = world(TEN_AGENTS, 1);
    assert_eq!(scenario.agents.len(), 10);
    for agent in 0..10 {
        let density = density(&scenario, &world, agent);
        println!("{}: {density:.3?}", scenario.agents[agent].id());
        assert!((40.0..75.0).contains(&density.boxes), "{density:?}");
    }
}

#[test]
fn the_agents_of_the_default_crossing_share_objects_at_all_times() {
    for seed in 1..=3 {
        let (scenario, world) = world(CROSSING, seed);
        let mut counts = Vec::new();
        for t in times(0.5) {
            let poses = [pose(&world, 0, t), pose(&world, 1, t)];
            let fov = [scenario.agents[0].sensor.field_of_view, scenario.agents[1].sensor.field_of_view];
            let shared =
                |o: &&TrueObject| (0..2).all(|agent| fov[agent].contains(&poses[agent], o.bev.x, o.bev.y));
            let n_shared = objects_at(&world, t).iter().filter(shared).count();
            assert!(n_shared >= 8, "seed {seed}: {n_shared} at {t}");
            counts.push(n_shared);
        }
        let mean = counts.iter().sum::<usize>() as f64 / counts.len() as f64;
        println!("seed {seed}: {mean:.1} shared objects, at least {:?}", counts.iter().min());
    }
}

#[test]
fn the_ego_drives_most_of_the_time_and_stays_near_the_crossing() {
    let (_, world) = world(CROSSING, 1);
    let ego = world.agent_object(0).unwrap();
    let laps: Vec<TrueObject> =
        times(0.1).map(|t| *objects_at(&world, t).iter().find(|o| o.id == ego).unwrap()).collect();
    let n_moving = laps.iter().filter(|o| is_moving(o)).count();
    assert!(n_moving * 2 > laps.len(), "{n_moving} of {}", laps.len());
    assert!(laps.iter().all(|o| o.bev.x.abs() < 60.0 && o.bev.y.abs() < 60.0));
    assert_eq!(pose(&world, 0, Span::ZERO), laps[0].bev.pose());
    assert_eq!(world.agent_object(1), None);
}

#[test]
fn no_motor_vehicle_touches_another_object_and_people_touch_for_a_short_time_only() {
    let set = |text: &str, changes: &[(&str, &str)]| {
        changes.iter().fold(text.to_owned(), |text, (from, to)| {
            assert!(text.contains(from), "{from}");
            text.replace(from, to)
        })
    };
    let full =
        [("works = 14", "works = 28"), ("traffic = 0.9", "traffic = 1"), ("parked = 36", "parked = 120")];
    let crowd =
        set(TEN_AGENTS, &[("bicycles = 2", "bicycles = 8"), ("pedestrians = 16", "pedestrians = 48")]);
    let crowd = set(&crowd, &full);
    let jam = set(
        HIGHWAY,
        &[("parked = 6", "parked = 40"), ("works = 12", "works = 200"), ("lanes = 3", "lanes = 4")],
    );
    let jam = set(&jam, &[("traffic = 0.5", "traffic = 1")]);
    let quick = set(TEN_AGENTS, &[("[world]", "loop_s = 100\n[world]")]);
    let slow = set(TEN_AGENTS, &[("[world]", "loop_s = 179\n[world]")]);
    let shipped = ALL.map(str::to_owned);
    for text in shipped.into_iter().chain([crowd, jam, quick, slow]) {
        for seed in 1..=5 {
            let (scenario, world) = world(&text, seed);
            let mut touches: BTreeMap<_, u32> = BTreeMap::new();
            for t in times(0.2) {
                let objects = objects_at(&world, t);
                for (i, a) in objects.iter().enumerate() {
                    for b in objects[i + 1..].iter().filter(|b| overlap(&a.bev, &b.bev)) {
                        let is_light = |o: &TrueObject| o.class.is_pedestrian() || o.class == Class::Bicycle;
                        assert!(
                            is_light(a) && is_light(b),
                            "{} seed {seed} at {t}: {a:?} {b:?}",
                            scenario.name
                        );
                        *touches.entry((a.id, b.id)).or_default() += 1;
                    }
                }
            }
            // 5 s at a stretch of 0.2 s: two who walk the same way overtake each other in less.
            for (pair, count) in touches {
                assert!(count <= 25, "{} seed {seed}: {pair:?} {count} times", scenario.name);
            }
        }
    }
}

/// Whether two boxes have a point in common (separating axes).
fn overlap(a: &BevBox, b: &BevBox) -> bool {
    if a.pose().distance_to(b.x, b.y) > a.circumradius() + b.circumradius() {
        return false;
    }
    [a.yaw, a.yaw + FRAC_PI_2, b.yaw, b.yaw + FRAC_PI_2].iter().all(|axis| {
        let (sin, cos) = libm::sincos(*axis);
        let extent = |bev: &BevBox| {
            let along = bev.corners().map(|(x, y)| x * cos + y * sin);
            (along.iter().copied().fold(f64::MAX, f64::min), along.iter().copied().fold(f64::MIN, f64::max))
        };
        let ((a_min, a_max), (b_min, b_max)) = (extent(a), extent(b));
        a_min < b_max && b_min < a_max
    })
}

#[test]
fn velocity_is_the_derivative_of_position_and_heading_its_direction() {
    let h = Span::from_micros(500);
    for text in ALL {
        let (_, world) = world(text, 2);
        for t in times(0.73) {
            let before: BTreeMap<_, _> = objects_at(&world, t - h).into_iter().map(|o| (o.id, o)).collect();
            let after: BTreeMap<_, _> = objects_at(&world, t + h).into_iter().map(|o| (o.id, o)).collect();
            for object in objects_at(&world, t) {
                let (Some(a), Some(b)) = (before.get(&object.id), after.get(&object.id)) else { continue };
                let slope = ((b.bev.x - a.bev.x) * 1e3, (b.bev.y - a.bev.y) * 1e3);
                let (vx, vy) = object.velocity;
                // At 5 m/s² over 1 ms the slope may be off by 5 mm/s where the acceleration changes.
                assert!(
                    (slope.0 - vx).abs() < 5e-3 && (slope.1 - vy).abs() < 5e-3,
                    "{object:?} {slope:?} at {t}"
                );
                if is_moving(&object) {
                    let off = angle_difference(libm::atan2(vy, vx), object.bev.yaw);
                    assert!(off.abs() < 1e-6, "{object:?}");
                }
            }
        }
    }
}

/// No acceleration along or across the heading is above 3 m/s² (a vehicle's turn at 5 m/s takes 2.9).
#[test]
fn no_vehicle_accelerates_by_more_than_3_5_metres_per_second_squared() {
    let step = Span::from_millis(20);
    for text in ALL {
        let (_, world) = world(text, 1);
        for t in times(0.31) {
            let after: BTreeMap<_, _> = objects_at(&world, t + step).into_iter().map(|o| (o.id, o)).collect();
            for a in objects_at(&world, t).into_iter().filter(|o| !o.class.is_pedestrian()) {
                let Some(b) = after.get(&a.id) else { continue };
                let change = libm::hypot(b.velocity.0 - a.velocity.0, b.velocity.1 - a.velocity.1) / 0.02;
                assert!(change < 3.5, "{change} m/s² {a:?} at {t}");
            }
        }
    }
}

#[test]
fn objects_appear_and_disappear_out_of_the_view_of_all_agents() {
    let step = Span::from_millis(100);
    for text in ALL {
        let (scenario, world) = world(text, 3);
        // One step beyond the loop: the wrap is a time like any other.
        for t in times(0.1).chain([Span::from_millis(119_999), Span::from_millis(120_000)]) {
            let (now, next) = (objects_at(&world, t), objects_at(&world, t + step));
            let ids: BTreeMap<_, _> = next.iter().map(|o| (o.id, o)).collect();
            for object in &now {
                let stays = ids.get(&object.id).is_some_and(|o| {
                    // 35 m/s for 0.1 s, and some rounding.
                    object.bev.pose().distance_to(o.bev.x, o.bev.y) < 3.6
                });
                for agent in (0..scenario.agents.len()).filter(|_| !stays) {
                    let pose = pose(&world, agent, t);
                    let fov = &scenario.agents[agent].sensor.field_of_view;
                    assert!(!fov.contains(&pose, object.bev.x, object.bev.y), "{object:?} at {t}");
                }
            }
        }
    }
}

#[test]
fn the_world_repeats_bit_for_bit_also_before_its_start() {
    for text in ALL {
        let (_, world) = world(text, 1);
        for t in times(7.7) {
            let objects = objects_at(&world, t);
            assert_eq!(objects, objects_at(&world, t + world.loop_length()));
            assert_eq!(objects, objects_at(&world, t - world.loop_length()));
            assert!(objects.is_sorted_by_key(|o| o.id));
        }
    }
}

#[test]
fn the_seed_determines_the_world() {
    let t = Span::from_millis(12_345);
    let [first, again, other] = [1, 1, 2].map(|seed| objects_at(&world(CROSSING, seed).1, t));
    assert_eq!(first, again);
    assert_ne!(first, other);
}

#[test]
fn one_more_agent_does_not_change_other_objects() {
    let (_, before) = world(CROSSING, 1);
    let unit = "[[agents]]\nid = \"x\"\nkind = \"roadside-unit\"\npose = { x = 0, y = 0 }\n[hub]";
    let car = "[[agents]]\nid = \"x\"\nkind = \"vehicle\"\npose = { x = 12, y = -20 }\n[hub]";
    let (_, with_unit) = world(&CROSSING.replace("[hub]", unit), 1);
    let (_, with_car) = world(&CROSSING.replace("[hub]", car), 1);
    for t in times(3.1) {
        let objects = objects_at(&before, t);
        assert_eq!(objects, objects_at(&with_unit, t));
        let mut others = objects_at(&with_car, t);
        others.retain(|o| Some(o.id) != with_car.agent_object(2));
        assert_eq!(objects, others);
    }
}

#[test]
fn a_loop_of_any_valid_length_makes_a_world() {
    for loop_s in [100.0, 133.3, 179.9, 180.1, 300.0, 3600.0] {
        for text in ALL {
            let mut scenario = Scenario::from_toml(text).unwrap();
            scenario.loop_length = Span::from_secs_f64(loop_s);
            let world = scenario.world(1);
            assert!(objects_at(&world, Span::from_millis(50_000)).len() > 20, "{loop_s}");
        }
    }
}

#[test]
fn parameters_of_which_no_world_can_be_made_are_refused_by_name() {
    type Change = fn(&mut WorldParameters);
    let cases: [(&str, Change); 7] = [
        ("loop_length", |world| world.loop_length = Span::ZERO),
        ("traffic", |world| {
            world.config =
                WorldConfig::Crossing(CrossingConfig { traffic: f64::NAN, ..CrossingConfig::default() });
        }),
        ("parked", |world| {
            world.config = WorldConfig::Crossing(CrossingConfig { parked: 121, ..CrossingConfig::default() });
        }),
        ("lanes", |world| {
            world.config = WorldConfig::Highway(HighwayConfig { lanes: 5, ..HighwayConfig::default() });
        }),
        ("route", |world| world.config = WorldConfig::Highway(HighwayConfig::default())),
        ("route", |world| world.agents[0].station = Station::Driving(Route::Block(4))),
        ("agents", |world| world.agents[1].id = world.agents[0].id),
    ];
    for (field, change) in cases {
        let mut parameters = Scenario::from_toml(CROSSING).unwrap().world_parameters();
        change(&mut parameters);
        assert_eq!(World::new(&parameters, 1).unwrap_err().field, field);
    }
}
