//! From linked tables to scenes.

use crate::data::dataset::nuscenes::split::Split;
use crate::data::dataset::nuscenes::table::{Record, TableError, each};
use crate::data::scene::{Keyframe, Scene, TrueBox};
use std::collections::{HashMap, HashSet};
use std::path::Path;
use v2x_agent::truth::ObjectId;
use v2x_common::class::Class;
use v2x_common::detection::{MAX_SIZE_M, MIN_SIZE_M};
use v2x_common::geometry::{BevBox, Pose, wrap_angle};
use v2x_common::time::Timestamp;

/// The sensor whose sweeps define keyframes.
const LIDAR: &str = "LIDAR_TOP";

/// Place of a scene, and of a keyframe in it.
type Place = (usize, usize);

/// Scenes under construction. Hash maps are only looked up, never iterated.
#[derive(Debug, Default)]
pub(super) struct Assembly {
    /// By instance token.
    classes: HashMap<String, Class>,
    scenes: Vec<Draft>,
    /// By scene token.
    scene_of: HashMap<String, usize>,
    /// By sample token.
    place_of: HashMap<String, Place>,
}

#[derive(Debug)]
struct Draft {
    name: String,
    samples: Vec<Sample>,
    /// By instance token, in order of appearance.
    ids: HashMap<String, u32>,
}

#[derive(Debug)]
struct Sample {
    token: String,
    at: Timestamp,
    ego: Ego,
    objects: Vec<TrueBox>,
}

/// What is known of the vehicle's pose at a keyframe.
#[derive(Debug)]
enum Ego {
    NoSweep,
    /// The sweep names a pose that was not read yet.
    Missing(TableError),
    At(Pose),
}

impl Assembly {
    pub(super) fn read_classes(&mut self, folder: &Path) -> Result<(), TableError> {
        let mut categories = HashMap::new();
        each(folder, "category", |record| {
            let class = Class::ALL
                .into_iter()
                .find(|class| record.text("name").is_ok_and(|name| name == class.name()));
            let class = class.ok_or_else(|| record.wrong("name", "one of the 23 nuScenes categories"))?;
            categories.insert(record.text("token")?.to_owned(), class);
            Ok(())
        })?;
        each(folder, "instance", |record| {
            let class = categories.get(record.text("category_token")?);
            let class = class.ok_or_else(|| record.wrong("category_token", "a token of table category"))?;
            self.classes.insert(record.text("token")?.to_owned(), *class);
            Ok(())
        })
    }

    pub(super) fn read_scenes(&mut self, folder: &Path, split: &Split) -> Result<(), TableError> {
        each(folder, "scene", |record| {
            let name = record.text("name")?;
            if split.has(name) {
                self.scene_of.insert(record.text("token")?.to_owned(), self.scenes.len());
                let name = name.to_owned();
                self.scenes.push(Draft { name, samples: Vec::new(), ids: HashMap::new() });
            }
            Ok(())
        })
    }

    pub(super) fn read_samples(&mut self, folder: &Path) -> Result<(), TableError> {
        each(folder, "sample", |record| {
            let Some(scene) = self.scene_of.get(record.text("scene_token")?) else { return Ok(()) };
            let at = Timestamp::from_micros(record.whole("timestamp")?)
                .ok_or_else(|| record.wrong("timestamp", "microseconds since 1970"))?;
            let token = record.text("token")?.to_owned();
            self.scenes[*scene].samples.push(Sample { token, at, ego: Ego::NoSweep, objects: Vec::new() });
            Ok(())
        })?;
        for (scene, draft) in self.scenes.iter_mut().enumerate() {
            draft.samples.sort_by_key(|sample| sample.at);
            let places = draft.samples.iter().enumerate();
            self.place_of.extend(places.map(|(frame, sample)| (sample.token.clone(), (scene, frame))));
        }
        Ok(())
    }

    /// Reads the ego poses of the lidar's key frames.
    pub(super) fn read_ego_poses(&mut self, folder: &Path) -> Result<(), TableError> {
        let (mut sensors, mut lidars) = (HashSet::new(), HashSet::new());
        each(folder, "sensor", |record| {
            if record.text("channel")? == LIDAR {
                sensors.insert(record.text("token")?.to_owned());
            }
            Ok(())
        })?;
        each(folder, "calibrated_sensor", |record| {
            if sensors.contains(record.text("sensor_token")?) {
                lidars.insert(record.text("token")?.to_owned());
            }
            Ok(())
        })?;
        let mut places_of_pose: HashMap<String, Vec<Place>> = HashMap::new();
        each(folder, "sample_data", |record| {
            let is_wanted =
                record.flag("is_key_frame")? && lidars.contains(record.text("calibrated_sensor_token")?);
            if let Some(place) = self.place_of.get(record.text("sample_token")?).filter(|_| is_wanted) {
                let token = record.text("ego_pose_token")?.to_owned();
                let (scene, frame) = *place;
                self.scenes[scene].samples[frame].ego =
                    Ego::Missing(record.wrong("ego_pose_token", "a token of table ego_pose"));
                places_of_pose.entry(token).or_default().push(*place);
            }
            Ok(())
        })?;
        each(folder, "ego_pose", |record| {
            for (scene, frame) in places_of_pose.get(record.text("token")?).into_iter().flatten() {
                self.scenes[*scene].samples[*frame].ego = Ego::At(pose(record)?);
            }
            Ok(())
        })
    }

    pub(super) fn read_boxes(&mut self, folder: &Path) -> Result<(), TableError> {
        each(folder, "sample_annotation", |record| {
            let Some((scene, frame)) = self.place_of.get(record.text("sample_token")?) else { return Ok(()) };
            let instance = record.text("instance_token")?;
            let class = self.classes.get(instance);
            let class = *class.ok_or_else(|| record.wrong("instance_token", "a token of table instance"))?;
            let draft = &mut self.scenes[*scene];
            let next = u32::try_from(draft.ids.len()).expect("fewer than 2^32 objects fit into memory");
            let id = ObjectId(*draft.ids.entry(instance.to_owned()).or_insert(next));
            let objects = &mut draft.samples[*frame].objects;
            if objects.iter().any(|object| object.id == id) {
                return Err(record.wrong("instance_token", "an instance that the sample has not yet"));
            }
            objects.push(TrueBox { id, class, bev: bev(record)? });
            Ok(())
        })
    }

    pub(super) fn finish(self) -> Result<Vec<Scene>, TableError> {
        let scenes = self.scenes.into_iter().filter(|draft| !draft.samples.is_empty());
        scenes.map(|draft| Ok(Scene::new(draft.name, keyframes(draft.samples)?))).collect()
    }
}

fn keyframes(samples: Vec<Sample>) -> Result<Vec<Keyframe>, TableError> {
    let start = samples.first().map_or(Timestamp::EPOCH, |sample| sample.at);
    let keyframe = |sample: Sample| {
        let Sample { token, at, ego, objects } = sample;
        let ego = match ego {
            Ego::At(pose) => pose,
            Ego::Missing(error) => return Err(error),
            Ego::NoSweep => return Err(TableError::NoSweep { record: token }),
        };
        Ok(Keyframe { at: at - start, ego, objects })
    };
    samples.into_iter().map(keyframe).collect()
}

/// Position and heading of a record with translation and rotation.
fn pose(record: &Record) -> Result<Pose, TableError> {
    let [x, y, _] = record.numbers("translation", "3 numbers")?;
    let [w, i, j, k] = record.numbers("rotation", "a quaternion of 4 numbers")?;
    // The direction of the rotated x axis, as in the devkit's `quaternion_yaw`.
    let yaw = libm::atan2(2.0 * (w * k + i * j), 1.0 - 2.0 * (j * j + k * k));
    Ok(Pose { x, y, yaw: wrap_angle(yaw) })
}

fn bev(record: &Record) -> Result<BevBox, TableError> {
    const EXPECTED: &str = "width, length and height, 0.001 to 65 m";
    let [w, d, _] = record.numbers("size", EXPECTED)?;
    let allowed = MIN_SIZE_M..=MAX_SIZE_M;
    if !allowed.contains(&w) || !allowed.contains(&d) {
        return Err(record.wrong("size", EXPECTED));
    }
    let Pose { x, y, yaw } = pose(record)?;
    Ok(BevBox { x, y, w, d, yaw })
}
