//! From linked tables to scenes.

use super::scene::{AnnotatedFrame, AnnotatedScene, Annotation};
use super::table::{OpenTable, Record, TableError, each};
use std::collections::{HashMap, HashSet};
use v2x_common::class::Class;
use v2x_common::detection::{MAX_COORDINATE_M, MAX_SIZE_M, MIN_SIZE_M};
use v2x_common::geometry::{BevBox, Pose, wrap_angle};
use v2x_common::time::Timestamp;

/// The sensor whose sweeps define keyframes.
const LIDAR: &str = "LIDAR_TOP";

/// Of the length of a quaternion: tables may hold rounded numbers.
const UNIT_TOLERANCE: f64 = 0.01;

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
    instances: Vec<String>,
    samples: Vec<Sample>,
    /// By instance token, in order of appearance.
    ids: HashMap<String, u32>,
}

#[derive(Debug)]
struct Sample {
    token: String,
    at: Timestamp,
    ego: Ego,
    boxes: Vec<Annotation>,
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
    pub(super) fn read_classes(&mut self, open: &OpenTable<'_>) -> Result<(), TableError> {
        // Segmentation adds categories that no box has: those are wrong only where an instance is of them.
        let mut categories = HashMap::new();
        each(open, "category", |record| {
            let name = record.text("name")?;
            let class = Class::ALL.into_iter().find(|class| name == class.name());
            let class = class.ok_or_else(|| record.wrong("name", "one of the 23 nuScenes categories"));
            categories.insert(record.text("token")?.to_owned(), class);
            Ok(())
        })?;
        each(open, "instance", |record| {
            let category = record.text("category_token")?;
            let known = categories.get(category);
            let known = known.ok_or_else(|| record.wrong("category_token", "a token of table category"))?;
            let Ok(class) = known else {
                return categories.remove(category).map_or(Ok(()), |refused| refused.map(|_| ()));
            };
            self.classes.insert(record.text("token")?.to_owned(), *class);
            Ok(())
        })
    }

    pub(super) fn read_scenes(
        &mut self,
        open: &OpenTable<'_>,
        is_wanted: &dyn Fn(&str) -> bool,
    ) -> Result<(), TableError> {
        each(open, "scene", |record| {
            let name = record.text("name")?;
            if is_wanted(name) {
                self.scene_of.insert(record.text("token")?.to_owned(), self.scenes.len());
                let name = name.to_owned();
                self.scenes.push(Draft {
                    name,
                    samples: Vec::new(),
                    instances: Vec::new(),
                    ids: HashMap::new(),
                });
            }
            Ok(())
        })
    }

    pub(super) fn read_samples(&mut self, open: &OpenTable<'_>) -> Result<(), TableError> {
        each(open, "sample", |record| {
            let Some(scene) = self.scene_of.get(record.text("scene_token")?) else { return Ok(()) };
            let at = Timestamp::from_micros(record.whole("timestamp")?)
                .ok_or_else(|| record.wrong("timestamp", "microseconds since 1970"))?;
            let token = record.text("token")?.to_owned();
            self.scenes[*scene].samples.push(Sample { token, at, ego: Ego::NoSweep, boxes: Vec::new() });
            Ok(())
        })?;
        for (scene, draft) in self.scenes.iter_mut().enumerate() {
            draft.samples.sort_by_key(|sample| sample.at);
            if let Some([_, twice]) = draft.samples.windows(2).find(|pair| pair[0].at == pair[1].at) {
                return Err(TableError::Field {
                    table: "sample",
                    record: twice.token.clone(),
                    field: "timestamp",
                    value: twice.at.as_micros().into(),
                    expected: "a time that no other sample of its scene has",
                });
            }
            let places = draft.samples.iter().enumerate();
            self.place_of.extend(places.map(|(frame, sample)| (sample.token.clone(), (scene, frame))));
        }
        Ok(())
    }

    /// Reads the ego poses of the lidar's key frames.
    pub(super) fn read_ego_poses(&mut self, open: &OpenTable<'_>) -> Result<(), TableError> {
        let (mut sensors, mut lidars) = (HashSet::new(), HashSet::new());
        each(open, "sensor", |record| {
            if record.text("channel")? == LIDAR {
                sensors.insert(record.text("token")?.to_owned());
            }
            Ok(())
        })?;
        each(open, "calibrated_sensor", |record| {
            if sensors.contains(record.text("sensor_token")?) {
                lidars.insert(record.text("token")?.to_owned());
            }
            Ok(())
        })?;
        let mut places_of_pose: HashMap<String, Vec<Place>> = HashMap::new();
        each(open, "sample_data", |record| {
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
        each(open, "ego_pose", |record| {
            for (scene, frame) in places_of_pose.get(record.text("token")?).into_iter().flatten() {
                self.scenes[*scene].samples[*frame].ego = Ego::At(pose(record)?);
            }
            Ok(())
        })
    }

    pub(super) fn read_boxes(&mut self, open: &OpenTable<'_>) -> Result<(), TableError> {
        each(open, "sample_annotation", |record| {
            let Some((scene, frame)) = self.place_of.get(record.text("sample_token")?) else { return Ok(()) };
            let instance = record.text("instance_token")?;
            let class = self.classes.get(instance);
            let class = *class.ok_or_else(|| record.wrong("instance_token", "a token of table instance"))?;
            let draft = &mut self.scenes[*scene];
            let number = draft.instance(instance);
            let boxes = &mut draft.samples[*frame].boxes;
            if boxes.iter().any(|other| other.instance == number) {
                return Err(record.wrong("instance_token", "an instance that the sample has not yet"));
            }
            boxes.push(Annotation { instance: number, class, bev: bev(record)? });
            Ok(())
        })
    }

    pub(super) fn finish(self) -> Result<Vec<AnnotatedScene>, TableError> {
        let scenes = self.scenes.into_iter().filter(|draft| !draft.samples.is_empty());
        let scene = |Draft { name, instances, samples, .. }| {
            Ok(AnnotatedScene { name, instances, keyframes: keyframes(samples)? })
        };
        scenes.map(scene).collect()
    }
}

impl Draft {
    /// The number of an instance.
    fn instance(&mut self, token: &str) -> u32 {
        if let Some(number) = self.ids.get(token) {
            return *number;
        }
        let number = u32::try_from(self.instances.len()).expect("fewer than 2^32 objects fit into memory");
        self.instances.push(token.to_owned());
        self.ids.insert(token.to_owned(), number);
        number
    }
}

fn keyframes(samples: Vec<Sample>) -> Result<Vec<AnnotatedFrame>, TableError> {
    let keyframe = |Sample { token, at, ego, boxes }| match ego {
        Ego::At(ego) => Ok(AnnotatedFrame { at, ego, boxes }),
        Ego::Missing(error) => Err(error),
        Ego::NoSweep => Err(TableError::NoSweep { record: token }),
    };
    samples.into_iter().map(keyframe).collect()
}

/// Position and heading of a record with translation and rotation.
fn pose(record: &Record) -> Result<Pose, TableError> {
    const PLACE: &str = "3 numbers, at most 1e8 m";
    const ROTATION: &str = "a quaternion of 4 numbers, of length 1";
    let [x, y, _] = record.numbers("translation", PLACE)?;
    if x.abs() > MAX_COORDINATE_M || y.abs() > MAX_COORDINATE_M {
        return Err(record.wrong("translation", PLACE));
    }
    let [w, i, j, k] = record.numbers("rotation", ROTATION)?;
    let length = libm::sqrt(w * w + i * i + j * j + k * k);
    if (length - 1.0).abs() > UNIT_TOLERANCE {
        return Err(record.wrong("rotation", ROTATION));
    }
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
