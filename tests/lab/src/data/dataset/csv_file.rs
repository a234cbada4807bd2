//! Scenes from one table: a row for each box.
//!
//! Columns `scene,frame,t_s,object_id,class,x,y,width,length,yaw,ego_x,ego_y,ego_yaw`, in any order; others are
//! ignored. Metres, radians, seconds since the scene's start, one map frame for each scene. Where the ego's pose is
//! `nan` throughout a scene, agent 1 is in the middle of the scene's boxes.

use crate::data::csv_table::{CsvError, CsvTable, Row};
use crate::data::dataset::error::DatasetError;
use crate::data::scene::{Keyframe, Scene, TrueBox};
use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;
use v2x_agent::truth::ObjectId;
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::time::Span;

/// The columns that are read.
const COLUMNS: [&str; 13] = [
    "scene",
    "frame",
    "t_s",
    "object_id",
    "class",
    "x",
    "y",
    "width",
    "length",
    "yaw",
    "ego_x",
    "ego_y",
    "ego_yaw",
];

/// Latest time in a scene, s.
const MAX_TIME_S: f64 = 1e6;

/// Reads a file.
pub(crate) fn load(path: &Path) -> Result<Vec<Scene>, DatasetError> {
    scenes_of(CsvTable::open(path, (&COLUMNS, &[]))?, path)
}

fn scenes_of(mut table: CsvTable<impl Read>, path: &Path) -> Result<Vec<Scene>, DatasetError> {
    let mut scenes = Scenes::default();
    while let Some(row) = table.next_row()? {
        scenes.add(&row)?;
    }
    let scenes = scenes.finish();
    if scenes.is_empty() { Err(DatasetError::Empty(path.to_owned())) } else { Ok(scenes) }
}

/// The ego's pose; `None` where it is unknown.
fn ego(row: &Row<'_>) -> Result<Option<Pose>, CsvError> {
    let number = |column| row.number(column, |value| !value.is_infinite(), "a number, or nan");
    let (x, y, yaw) = (number("ego_x")?, number("ego_y")?, number("ego_yaw")?);
    Ok((!x.is_nan() && !y.is_nan()).then(|| Pose { x, y, yaw: if yaw.is_nan() { 0.0 } else { yaw } }))
}

/// A keyframe under construction.
struct Frame {
    at: Span,
    ego: Option<Pose>,
    objects: Vec<TrueBox>,
}

/// Scenes under construction, in order of appearance.
#[derive(Default)]
struct Scenes {
    names: Vec<String>,
    frames: Vec<BTreeMap<u32, Frame>>,
    /// Numbers of the objects, in order of appearance.
    ids: Vec<BTreeMap<String, u32>>,
}

impl Scenes {
    fn add(&mut self, row: &Row<'_>) -> Result<(), CsvError> {
        let scene = self.place_of(row.text("scene"));
        let t_s = row.number("t_s", |t| t.abs() <= MAX_TIME_S, "a time in s")?;
        let number: u32 = row.text("frame").parse().map_err(|_| row.wrong("frame", "a whole number"))?;
        let class = row.class("class")?.ok_or_else(|| {
            row.wrong("class", "a nuScenes category, or a common name such as car or pedestrian")
        })?;
        let (ego, bev) = (ego(row)?, row.bev(["width", "length"])?);
        let ids = &mut self.ids[scene];
        let next = u32::try_from(ids.len()).expect("fewer than 2^32 objects fit into memory");
        let id = ObjectId(*ids.entry(row.text("object_id").to_owned()).or_insert(next));
        let frames = &mut self.frames[scene];
        let at = Span::from_secs_f64(t_s);
        let before = frames.range(..number).next_back().map(|(_, frame)| frame.at);
        let after = frames.range(number + 1..).next().map(|(_, frame)| frame.at);
        if before.is_some_and(|before| at <= before) || after.is_some_and(|after| at >= after) {
            return Err(row.wrong("t_s", "a time between those of the frames before and after"));
        }
        let frame = frames.entry(number).or_insert(Frame { at, ego, objects: Vec::new() });
        if frame.at != at {
            return Err(row.wrong("t_s", "the time of the frame's other rows"));
        }
        if frame.objects.iter().any(|object| object.id == id) {
            return Err(row.wrong("object_id", "an object that the frame has not yet"));
        }
        frame.objects.push(TrueBox { id, class, bev });
        Ok(())
    }

    fn place_of(&mut self, name: &str) -> usize {
        let place = self.names.iter().rposition(|known| known == name);
        place.unwrap_or_else(|| {
            self.names.push(name.to_owned());
            self.frames.push(BTreeMap::new());
            self.ids.push(BTreeMap::new());
            self.names.len() - 1
        })
    }

    fn finish(self) -> Vec<Scene> {
        let scenes = self.names.into_iter().zip(self.frames);
        scenes.map(|(name, frames)| Scene::new(name, keyframes(frames))).collect()
    }
}

fn keyframes(frames: BTreeMap<u32, Frame>) -> Vec<Keyframe> {
    let middle = middle(&frames);
    let frames = frames.into_values();
    frames.map(|Frame { at, ego, objects }| Keyframe { at, ego: ego.unwrap_or(middle), objects }).collect()
}

/// The mean position of all boxes.
#[expect(clippy::cast_precision_loss, reason = "numbers of boxes")]
fn middle(frames: &BTreeMap<u32, Frame>) -> Pose {
    let boxes = || frames.values().flat_map(|frame| &frame.objects);
    let (n, sum) =
        (boxes().count() as f64, |of: fn(&BevBox) -> f64| boxes().map(|one| of(&one.bev)).sum::<f64>());
    Pose { x: sum(|bev| bev.x) / n, y: sum(|bev| bev.y) / n, yaw: 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "scene,frame,t_s,object_id,class,x,y,vx,vy,width,length,yaw,ego_x,ego_y,ego_yaw\n";

    fn read(text: &str) -> Result<Vec<Scene>, DatasetError> {
        let path = Path::new("boxes.csv");
        scenes_of(CsvTable::new(text.as_bytes(), path, (&COLUMNS, &[]))?, path)
    }

    fn parse(rows: &str) -> Result<Vec<Scene>, DatasetError> {
        read(&format!("{HEADER}{rows}"))
    }

    fn error(rows: &str) -> String {
        parse(rows).unwrap_err().to_string()
    }

    #[test]
    fn rows_become_scenes() {
        let scenes = parse(
            "a,0,0.0,x7,vehicle.car,1,2,nan,nan,1.8,4.5,3.5,10,20,0.5\n\
             b,0,0.0,q,pedestrian,0,0,0,0,0.7,0.7,0,nan,nan,nan\n\
             a,1,0.5,x7,vehicle.car,4,2,nan,nan,1.8,4.5,3.5,11,20,0.5\n\
             a,1,0.5,x8,car,5,6,nan,nan,1.8,4.5,0,11,20,0.5\n\
             b,0,0.0,r,cone,4,2,0,0,0.4,0.4,0,nan,nan,nan\n",
        )
        .unwrap();
        assert_eq!(scenes.len(), 2);
        let [first, second] = &scenes[0].keyframes[..] else { panic!("two keyframes") };
        assert_eq!((first.ego.x, second.at), (10.0, Span::from_millis(500)));
        assert_eq!(second.objects.len(), 2);
        assert!((first.objects[0].bev.yaw - (3.5 - std::f64::consts::TAU)).abs() < 1e-12);
        assert!(scenes[0].is_moving(ObjectId(0)) && !scenes[0].is_moving(ObjectId(1)));
        let stood = scenes[1].keyframes[0].ego;
        assert_eq!((stood.x, stood.y), (2.0, 1.0), "in the middle of the boxes");
    }

    #[test]
    fn errors_name_line_and_column() {
        const GOOD: &str = "a,0,0.0,x7,vehicle.car,1,2,nan,nan,1.8,4.5,0,10,20,0.5\n";
        let second = |row: &str| error(&format!("{GOOD}{row}\n"));
        for (row, place) in [
            ("a,0,0.0,x8,vehicle.car,1,2", "line 3, column ego_x: \"\""),
            ("a,0,0.0,x8,,1,2,0,0,1.8,4.5,0,10,20,0", "line 3, column class: \"\", expected a class"),
            ("a,0,0,0,x8,car,1,2,0,0,1,4.5,0,10,20,0", "line 3: 16 cells under 15 columns"),
            ("a,0,0.0,x8,vehicle.car,one,2,0,0,1.8,4.5,0,10,20,0", "line 3, column x: \"one\""),
            (
                "a,0,0.0,x8,vehicle.car,1,2,0,0,0,4.5,0,10,20,0",
                "line 3, column width: \"0\", expected 0.001 to",
            ),
            ("a,0,0.0,x8,spaceship,1,2,0,0,1,4.5,0,10,20,0", "line 3, column class: \"spaceship\""),
            ("a,-1,0.0,x8,car,1,2,0,0,1,4.5,0,10,20,0", "line 3, column frame: \"-1\""),
            ("a,0,0.1,x8,car,1,2,0,0,1,4.5,0,10,20,0", "line 3, column t_s: \"0.1\""),
            ("a,1,0.0,x8,car,1,2,0,0,1,4.5,0,10,20,0", "line 3, column t_s: \"0.0\""),
            ("a,0,0.0,x7,car,1,2,0,0,1,4.5,0,10,20,0", "line 3, column object_id: \"x7\""),
            ("a,0,0.0,x8,car,1,2,0,0,1,4.5,nan,10,20,0", "line 3, column yaw: \"nan\""),
        ] {
            let message = second(row);
            assert!(message.starts_with(&format!("boxes.csv, {place}")), "{message}");
        }
    }

    #[test]
    fn a_missing_column_and_an_empty_table_are_named() {
        let no_yaw = HEADER.replace(",yaw", ",jaw");
        let message = read(&no_yaw).unwrap_err().to_string();
        assert!(message.starts_with("boxes.csv has no column yaw; needed are scene,frame"), "{message}");
        assert_eq!(error(""), "boxes.csv holds no boxes");
    }
}
