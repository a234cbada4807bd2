//! Synthetic scenes: city streets with the mix of classes, ranges and motions of nuScenes.
//!
//! A main road with a crossing, seen from a vehicle on it: traffic in lanes that drives, turns, stops, waits and
//! starts; parked cars; pedestrians; cyclists; works with cones and barriers. 40 keyframes at 2 Hz. The world is the same
//! in every run: the seed of a table is for noise only. Boxes are exact: errors of annotation are not simulated.

mod actor;
mod body;
mod roadside;
mod streets;
mod traffic;

use crate::data::noise::{Purpose, Realisation};
use crate::data::scene::{Keyframe, Scene, TrueBox};
use actor::Actor;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;
use streets::Streets;
use v2x_agent::random::uniform;
use v2x_agent::truth::ObjectId;
use v2x_common::geometry::{BevBox, Pose, wrap_angle};
use v2x_common::time::Span;

/// Number of scenes: that of nuScenes' validation split.
pub const N_SCENES: u32 = 150;
const N_KEYFRAMES: i64 = 40;
const KEYFRAME_MS: i64 = 500;
/// Objects further from agent 1 are not annotated, m.
const RANGE_M: f64 = 64.0;
/// Seed of the world. Another seed gives other scenes and other tables.
const WORLD_SEED: u64 = 20_260_722;
/// Scenes are placed in a map of this size, m.
const MAP_M: f64 = 2000.0;

/// Parts of a scene, each with its own random numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    Place,
    Streets,
    Traffic,
    Parked,
    People,
    Cyclists,
    Works,
}

fn rng(scene: &str, part: Part) -> ChaCha8Rng {
    let world = Realisation { seed: WORLD_SEED, trial: 0 };
    world.rng(scene, 0, Purpose::Order { agent: part as u32 })
}

/// All scenes.
pub fn scenes() -> Vec<Scene> {
    (0..N_SCENES).map(scene).collect()
}

/// The scene of this number.
pub fn scene(number: u32) -> Scene {
    let name = format!("synthetic-{number:03}");
    let streets = Streets::new(&mut rng(&name, Part::Streets));
    let (ego, mut actors) = traffic::traffic(&streets, &mut rng(&name, Part::Traffic));
    actors.extend(roadside::parked(&streets, &mut rng(&name, Part::Parked)));
    actors.extend(roadside::people(&streets, &mut rng(&name, Part::People)));
    actors.extend(roadside::cyclists(&streets, &mut rng(&name, Part::Cyclists)));
    actors.extend(roadside::works(&streets, &mut rng(&name, Part::Works)));
    let mut place = rng(&name, Part::Place);
    let x = uniform(&mut place, 0.0, MAP_M);
    let map = Pose { x, y: uniform(&mut place, 0.0, MAP_M), yaw: uniform(&mut place, 0.0, TAU) };
    let keyframes = (0..N_KEYFRAMES).map(|frame| keyframe(frame, &ego, &actors, &map)).collect();
    Scene::new(name, keyframes)
}

fn keyframe(frame: i64, ego: &Actor, actors: &[Actor], map: &Pose) -> Keyframe {
    let at = Span::from_millis(frame * KEYFRAME_MS);
    let ego = placed(&ego.pose(at), map);
    let annotated = |(id, actor): (u32, &Actor)| {
        let Pose { x, y, yaw } = placed(&actor.pose(at), map);
        let [w, d] = actor.body.size_m;
        let bev = BevBox { x, y, w, d, yaw };
        (ego.distance_to(x, y) <= RANGE_M).then_some(TrueBox {
            id: ObjectId(id),
            class: actor.body.class,
            bev,
        })
    };
    Keyframe { at, ego, objects: (0..).zip(actors).filter_map(annotated).collect() }
}

/// A pose of the scene in the map frame.
fn placed(pose: &Pose, map: &Pose) -> Pose {
    let (x, y) = map.offset(pose.x, pose.y);
    Pose { x, y, yaw: wrap_angle(pose.yaw + map.yaw) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::scene::Statistics;
    use v2x_fusion_hub::values::overlap::iou;

    #[test]
    fn the_world_has_the_statistics_of_nuscenes_and_never_changes() {
        let scenes = scenes();
        let statistics = Statistics::of(&scenes);
        assert_eq!((statistics.scenes, statistics.keyframes), (150, 6000));
        // 36.0 boxes a frame, 47.8 % of them of objects that move.
        assert_eq!(
            (statistics.objects, statistics.boxes, statistics.moving_boxes),
            (24_312, 216_161, 103_337)
        );
        let boxes = scenes.iter().flat_map(|scene| &scene.keyframes).flat_map(|keyframe| &keyframe.objects);
        let numbers = boxes.flat_map(|TrueBox { bev: BevBox { x, y, w, d, yaw }, .. }| [x, y, w, d, yaw]);
        let hash = numbers.fold(0u64, |hash, number| {
            hash.rotate_left(5).wrapping_add(number.to_bits()).wrapping_mul(0x0100_0000_01b3)
        });
        assert_eq!(hash, 16_934_118_017_925_968_431, "every table changes with the world");
    }

    #[test]
    fn bodies_do_not_drive_through_each_other() {
        let (mut pairs, mut boxes) = (0, 0);
        for number in (0..N_SCENES).step_by(10) {
            for keyframe in &scene(number).keyframes {
                let objects = &keyframe.objects;
                boxes += objects.len();
                for (place, one) in objects.iter().enumerate() {
                    let overlaps = |other: &&TrueBox| iou(&one.bev, &other.bev) > 0.05;
                    pairs += objects[place + 1..].iter().filter(overlaps).count();
                }
            }
        }
        // Boxes of pedestrians in a group may touch; hardly any others do.
        assert!(pairs * 200 < boxes, "{pairs} overlapping pairs of {boxes} boxes");
    }

    #[test]
    fn objects_move_continuously_and_head_along_their_velocity() {
        for number in (0..N_SCENES).step_by(25) {
            let scene = scene(number);
            for frames in scene.keyframes.windows(2) {
                for now in &frames[1].objects {
                    let Some(before) = frames[0].objects.iter().find(|one| one.id == now.id) else {
                        continue;
                    };
                    let travelled_m = before.bev.pose().distance_to(now.bev.x, now.bev.y);
                    assert!(travelled_m < 9.0, "{travelled_m} m in half a second: {now:?}");
                    if travelled_m > 0.3 {
                        let bearing = before.bev.pose().bearing_to(now.bev.x, now.bev.y).abs();
                        assert!(bearing < 0.9, "goes {bearing} rad off its heading: {now:?}");
                    }
                }
            }
        }
    }
}
