//! A scene of nuScenes as recorded traffic.

use super::builder::{At, Builder, Kind, Row};
use super::error::TrafficError;
use super::options::ReadOptions;
use super::traffic::{EGO, Format, Traffic};
use crate::nuscenes::{self, AnnotatedFrame, AnnotatedScene, OpenTable};
use v2x_common::time::Timestamp;

/// The data set's ego vehicle: width and length of a Renault Zoe, m.
const EGO_SIZE_M: (f64, f64) = (1.73, 4.084);
/// From its rear axle, which the poses are of, forward to its middle: half its length without the rear overhang, m.
const REAR_AXLE_TO_MIDDLE_M: f64 = 4.084 / 2.0 - 0.657;
/// Scenes that are named in a message.
const NAMED: usize = 12;

/// Reads one scene of nuScenes' tables: the one that is asked for, or the first one.
///
/// The annotated objects have their instances' tokens as ids, and the vehicle with the sensors is the object `ego`.
pub fn read_tables(open: &OpenTable<'_>, options: &ReadOptions) -> Result<Traffic, TrafficError> {
    let names = nuscenes::scene_names(open)?;
    let first = names.first().ok_or_else(|| TrafficError::Empty(" in table scene".to_owned()))?;
    let wanted = options.scene.as_ref().unwrap_or(first);
    if !names.contains(wanted) {
        return Err(TrafficError::NoSuchScene { wanted: wanted.clone(), known: list(&names) });
    }
    let scenes = nuscenes::scenes(open, &|name| name == wanted)?;
    let scene = scenes.into_iter().next();
    let scene = scene.ok_or_else(|| TrafficError::Empty(format!(" of scene {wanted} in table sample")))?;
    let mut builder = Builder::new(options);
    if options.scene.is_none() && names.len() > 1 {
        let note = format!("scene {wanted} of several; others by  scene = \"…\": {}", list(&names));
        builder.remarks.notes.push(note);
    }
    builder.scene = Some(wanted.clone());
    let start = scene.keyframes.first().map_or(Timestamp::EPOCH, |keyframe| keyframe.at);
    for keyframe in &scene.keyframes {
        add(&mut builder, &scene, keyframe, start)?;
    }
    builder.finish(Format::NuScenes)
}

/// The rows of a keyframe.
fn add(
    builder: &mut Builder<'_>,
    scene: &AnnotatedScene,
    keyframe: &AnnotatedFrame,
    start: Timestamp,
) -> Result<(), TrafficError> {
    let t_s = (keyframe.at - start).as_secs_f64();
    // The tables have no lines, and no object twice at a time.
    let row = |id, kind, at, (w, d)| Row { line: 0, t_s, id, kind, at, size: (Some(w), Some(d)) };
    let at = |x, y, yaw| At { x, y, yaw, is_front: false };
    for one in &keyframe.boxes {
        let id = scene.instances.get(one.instance as usize).map_or("", String::as_str);
        let kind = Kind::Name(one.class.name());
        builder.add(&row(id, kind, at(one.bev.x, one.bev.y, one.bev.yaw), (one.bev.w, one.bev.d)))?;
    }
    let (x, y) = keyframe.ego.offset(REAR_AXLE_TO_MIDDLE_M, 0.0);
    builder.add(&row(EGO, Kind::Name("car"), at(x, y, keyframe.ego.yaw), EGO_SIZE_M))
}

/// Some of the names.
fn list(names: &[String]) -> String {
    let rest = names.len().saturating_sub(NAMED);
    let more = if rest > 0 { format!(" and {rest} more") } else { String::new() };
    format!("{}{more}", names[..names.len() - rest].join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nuscenes::tests::{open, tables};
    use v2x_common::class::Class;
    use v2x_common::time::Span;

    fn read(scene: Option<&str>) -> Result<Traffic, TrafficError> {
        let options = ReadOptions { scene: scene.map(str::to_owned), ..ReadOptions::default() };
        read_tables(&open(&tables()), &options)
    }

    #[test]
    fn a_scene_is_traffic_in_which_the_vehicle_with_the_sensors_is_an_object() {
        let traffic = read(None).unwrap();
        assert_eq!((traffic.scene.as_deref(), traffic.length), (Some("scene-0003"), Span::from_millis(1000)));
        let names: Vec<_> = traffic.objects.iter().map(|object| object.name.as_str()).collect();
        assert_eq!(names, ["i1", "i2", "ego"]);
        let at = |name: &str, millis| {
            let object = &traffic.objects[traffic.object_index(name).unwrap()];
            (object, object.trajectory.at(Span::from_millis(millis)).unwrap())
        };
        let (car, state) = at("i1", 250);
        assert_eq!((car.class, state.pose.x, state.velocity), (Class::Car, 11.0, (4.0, 0.0)));
        // It looks west: the middle of its body is west of its rear axle.
        let (ego, state) = at("ego", 500);
        assert!((ego.w - 1.73).abs() < 1e-9 && (ego.d - 4.084).abs() < 1e-9, "{} × {}", ego.w, ego.d);
        assert!((state.pose.x - (25.0 - 1.385)).abs() < 1e-9, "{state:?}");
        assert!(traffic.remarks.notes[0].contains("others by  scene"), "{:?}", traffic.remarks);
    }

    #[test]
    fn a_scene_is_chosen_by_its_name_and_a_wrong_name_lists_those_that_there_are() {
        assert_eq!(read(Some("scene-0004")).unwrap().objects.len(), 2);
        let message = read(Some("scene-0005")).unwrap_err().to_string();
        assert_eq!(message, "has no scene \"scene-0005\"; it has scene-0003, scene-0004");
    }

    #[test]
    fn a_missing_table_is_named() {
        let mut tables = tables();
        tables.remove("ego_pose");
        let message = read_tables(&open(&tables), &ReadOptions::default()).unwrap_err().to_string();
        assert!(message.starts_with("cannot read table ego_pose"), "{message}");
    }
}
