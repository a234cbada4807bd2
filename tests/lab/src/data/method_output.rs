//! The output of a user's method for a scene, with the true object of each box where the output names detections.

use crate::data::csv_table::{CsvError, CsvTable, Row};
use crate::data::exported::{DetectionId, identity};
use crate::data::fused_box::FusedBox;
use crate::data::observation::AgentReport;
use crate::data::scene::{Keyframe, Scene};
use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;
use v2x_agent::truth::ObjectId;
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::id::TrackId;
use v2x_common::time::{Span, Timestamp};

/// Required columns.
pub(crate) const COLUMNS: [&str; 8] = ["t", "track_id", "class", "x", "y", "w", "d", "yaw"];
const FURTHER_COLUMNS: [&str; 9] = ["det_ids", "existence", "vx", "vy", "sx", "sy", "sw", "sd", "st"];
const SIGMAS: [&str; 5] = ["sx", "sy", "sw", "sd", "st"];
/// A row belongs to a keyframe within this time.
const TOLERANCE: Span = Span::from_millis(1);

/// An exported scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ExportedScene<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// What the agents reported, by keyframe.
    pub reports: &'a [[AgentReport; 2]],
}

/// The output of the method.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct SceneOutput {
    /// By keyframe.
    pub by_keyframe: Vec<Vec<FusedBox>>,
    /// Rows without a keyframe at their time.
    pub ignored_rows: u64,
    /// Rows with an unknown class name.
    pub unknown_classes: u64,
    /// Whether boxes name no detections, so that they are to be matched by position.
    pub is_matched_by_position: bool,
    /// Whether boxes have standard deviations.
    pub claims_accuracy: bool,
}

/// Track ids by name.
#[derive(Debug, Default)]
struct Tracks {
    known: BTreeMap<String, TrackId>,
    next: u64,
}

impl Tracks {
    /// A box without a track name gets a new track id.
    fn id(&mut self, name: &str) -> TrackId {
        let next = TrackId(self.next);
        self.next += 1;
        if name.is_empty() { next } else { *self.known.entry(name.to_owned()).or_insert(next) }
    }
}

impl SceneOutput {
    /// Reads a table; `path` is for errors.
    pub(crate) fn read(table: impl Read, path: &Path, exported: ExportedScene<'_>) -> Result<Self, CsvError> {
        let keyframes = &exported.scene.keyframes;
        let mut table = CsvTable::new(table, path, (&COLUMNS, &FURTHER_COLUMNS))?;
        let mut output = Self {
            by_keyframe: vec![Vec::new(); keyframes.len()],
            is_matched_by_position: !table.has("det_ids"),
            claims_accuracy: SIGMAS.iter().all(|column| table.has(column)),
            ..Self::default()
        };
        let mut tracks = Tracks::default();
        while let Some(row) = table.next_row()? {
            let Some(frame) = keyframe_at(keyframes, row.seconds("t")?) else {
                output.ignored_rows += 1;
                continue;
            };
            let fused = output.fused_box(&row, &mut tracks, (frame, exported))?;
            let boxes = &mut output.by_keyframe[frame];
            if boxes.iter().any(|other| other.track == fused.track) {
                return Err(row.wrong("track_id", "a track that this keyframe has not yet, or nothing"));
            }
            boxes.push(fused);
        }
        Ok(output)
    }

    fn fused_box(
        &mut self,
        row: &Row<'_>,
        tracks: &mut Tracks,
        (frame, exported): (usize, ExportedScene<'_>),
    ) -> Result<FusedBox, CsvError> {
        let class = row.class("class")?;
        self.unknown_classes += u64::from(class.is_none());
        let existence = match row.text("existence") {
            "" => 1.0,
            _ => row.number("existence", |p| (0.0..=1.0).contains(&p), "0 to 1, or nothing")?,
        };
        let covariance = if self.claims_accuracy { covariance(row)? } else { BoxCovariance::default() };
        let speed = |column| row.number_if_any(column, "a speed in m/s, or nothing");
        let velocity = speed("vx")?.zip(speed("vy")?).map(<[f64; 2]>::from);
        let object = if self.is_matched_by_position { None } else { by_ids(row, frame, exported.reports)? };
        Ok(FusedBox {
            bev: row.bev(["w", "d"])?,
            class: class.unwrap_or(Class::Unknown),
            existence,
            velocity,
            covariance,
            track: tracks.id(row.text("track_id")),
            object,
        })
    }
}

fn keyframe_at(keyframes: &[Keyframe], at: Timestamp) -> Option<usize> {
    let at = at - Timestamp::EPOCH;
    let place = keyframes.partition_point(|keyframe| keyframe.at + TOLERANCE < at);
    let is_near = keyframes.get(place).is_some_and(|keyframe| (keyframe.at - at).abs() <= TOLERANCE);
    is_near.then_some(place)
}

fn covariance(row: &Row<'_>) -> Result<BoxCovariance, CsvError> {
    let variance = |column| {
        let sigma = row.number(column, |sigma| sigma > 0.0 && sigma.is_finite(), "a standard deviation")?;
        Ok::<_, CsvError>(sigma * sigma)
    };
    let [xx, yy] = [variance("sx")?, variance("sy")?];
    let position = Covariance2 { xx, xy: 0.0, yy };
    Ok(BoxCovariance { position, ww: variance("sw")?, dd: variance("sd")?, yaw: variance("st")? })
}

fn by_ids(row: &Row<'_>, frame: usize, reports: &[[AgentReport; 2]]) -> Result<Option<ObjectId>, CsvError> {
    let wrong = || row.wrong("det_ids", "det_id values of the export, with ; or spaces between");
    let names = row.text("det_ids").split([';', ' ']).map(str::trim).filter(|name| !name.is_empty());
    let ids = names.map(str::parse).collect::<Result<Vec<DetectionId>, _>>().map_err(|_| wrong())?;
    identity(ids, frame, reports).map_err(|_| wrong())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::test_scenes::{car, scene_of};
    use v2x_common::geometry::Pose;

    fn report(objects: &[Option<u32>]) -> AgentReport {
        let identities = objects.iter().map(|id| id.map(ObjectId)).collect();
        AgentReport { pose: Pose::default(), detections: Vec::new(), identities }
    }

    /// Two keyframes of three cars.
    fn read(text: &str) -> Result<SceneOutput, CsvError> {
        let cars = [car(0, 0.0, 0.0), car(1, 10.0, 0.0), car(2, 20.0, 0.0)];
        let scene = scene_of(&[&cars, &cars]);
        let reports = [
            [report(&[Some(2), Some(0)]), report(&[Some(1), None])],
            [report(&[Some(1), Some(0)]), report(&[Some(2)])],
        ];
        SceneOutput::read(
            text.as_bytes(),
            Path::new("f.csv"),
            ExportedScene { scene: &scene, reports: &reports },
        )
    }

    fn objects(output: &SceneOutput) -> Vec<Vec<Option<u32>>> {
        let of = |boxes: &Vec<FusedBox>| boxes.iter().map(|one| one.object.map(|id| id.0)).collect();
        output.by_keyframe.iter().map(of).collect()
    }

    #[test]
    fn identity_is_that_of_agent_1_then_of_agent_2_then_of_the_newest_detection() {
        let output = read(
            "t,track_id,class,x,y,w,d,yaw,det_ids\n\
             0,a,car,0,0,2,4,0,agent-2:0:0;agent-1:0:1\n\
             0,,car,0,0,2,4,0,agent-2:0:1\n\
             0,,car,0,0,2,4,0,\n\
             0.5,a,car,0,0,2,4,0,agent-1:0:0 agent-2:1:0\n\
             0.5,b,car,0,0,2,4,0,agent-2:0:0; agent-1:0:0\n\
             0.7,b,car,0,0,2,4,0,agent-2:0:0\n",
        )
        .unwrap();
        assert_eq!(objects(&output), [vec![Some(0), None, None], vec![Some(2), Some(2)]]);
        assert_eq!(
            (output.ignored_rows, output.is_matched_by_position, output.claims_accuracy),
            (1, false, false)
        );
        let tracks: Vec<_> = output.by_keyframe.iter().flatten().map(|one| one.track.0).collect();
        assert_eq!((tracks[0], tracks[0] == tracks[1], tracks[1] == tracks[2]), (tracks[3], false, false));
    }

    #[test]
    fn a_velocity_is_read_where_both_of_its_parts_are_given() {
        let output =
            read("t,track_id,class,x,y,w,d,yaw,vx,vy\n0,a,car,0,0,2,4,0,3,-4\n0,b,car,9,0,2,4,0,3,\n")
                .unwrap();
        let velocities: Vec<_> = output.by_keyframe[0].iter().map(|one| one.velocity).collect();
        assert_eq!(velocities, [Some([3.0, -4.0]), None]);
    }

    #[test]
    fn a_detection_of_this_keyframe_has_priority_over_one_of_another_keyframe() {
        let output = read(
            "t,track_id,class,x,y,w,d,yaw,det_ids\n0,a,car,0,0,2,4,0,agent-1:1:0;agent-2:0:0;agent-1:1:1\n",
        );
        assert_eq!(objects(&output.unwrap())[0], [Some(1)]);
    }

    #[test]
    fn covariances_and_unknown_classes_are_read() {
        let output = read(
            "t,track_id,class,x,y,w,d,yaw,sx,sy,sw,sd,st\n\
             0.0004,a,car,9,0,2,4,0,1,2,3,4,5\n0,e,spaceship,90,0,2,4,0,1,1,1,1,1\n",
        )
        .unwrap();
        assert!(output.is_matched_by_position && output.claims_accuracy);
        assert_eq!(output.unknown_classes, 1);
        let BoxCovariance { position, ww, dd, yaw } = output.by_keyframe[0][0].covariance;
        assert_eq!((position.xx, position.yy, ww, dd, yaw), (1.0, 4.0, 9.0, 16.0, 25.0));
    }

    #[test]
    fn errors_name_line_and_column() {
        let header = "t,track_id,class,x,y,w,d,yaw,det_ids,existence,sx,sy,sw,sd,st\n";
        let good = "0,a,car,0,0,2,4,0,agent-1:0:0,,1,1,1,1,1";
        for (row, place) in [
            ("0,b,car,0,0,2,4,0,agent-1:2:0,,1,1,1,1,1", "column det_ids: \"agent-1:2:0\""),
            ("0,b,car,0,0,2,4,0,agent-1:0:2,,1,1,1,1,1", "column det_ids: \"agent-1:0:2\""),
            ("0,b,car,0,0,2,4,0,17,,1,1,1,1,1", "column det_ids: \"17\""),
            ("0,a,car,0,0,2,4,0,agent-1:0:0,,1,1,1,1,1", "column track_id: \"a\""),
            ("0,b,car,0,0,2,4,0,agent-1:0:0,2,1,1,1,1,1", "column existence: \"2\""),
            ("0,b,car,0,0,2,4,0,agent-1:0:0,,1,0,1,1,1", "column sy: \"0\""),
            ("0,b,car,0,0,-2,4,0,agent-1:0:0,,1,1,1,1,1", "column w: \"-2\""),
        ] {
            let message = read(&format!("{header}{good}\n{row}\n")).unwrap_err().to_string();
            assert!(message.starts_with(&format!("f.csv, line 3, {place}")), "{message}");
        }
        let message = read("t,x,y,w,d,yaw\n").unwrap_err().to_string();
        assert!(message.starts_with("f.csv has no column track_id, class;"), "{message}");
    }
}
