//! The fused objects as a table.

use crate::data::seconds;
use anyhow::Context;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use v2x_common::class::Class;
use v2x_common::fused::{FusedObject, KINEMATIC_DIAGONAL};
use v2x_common::time::Timestamp;

/// The columns in seconds, metres, m/s and radians; sx to st are standard deviations. New ones come last.
pub(crate) const COLUMNS: [&str; 21] = [
    "t",
    "track_id",
    "class",
    "x",
    "y",
    "vx",
    "vy",
    "w",
    "d",
    "yaw",
    "existence",
    "sx",
    "sy",
    "svx",
    "svy",
    "sw",
    "sd",
    "st",
    "heading",
    "classes",
    "conflict",
];
/// Digits of probabilities.
const PROBABILITY_STEPS: f64 = 1e4;

/// A writer of a table of fused objects.
#[derive(Debug)]
pub(crate) struct FusedTable<W: Write> {
    writer: W,
}

impl<W: Write> FusedTable<W> {
    /// Writes the header.
    pub(crate) fn new(mut writer: W) -> std::io::Result<Self> {
        writeln!(writer, "{}", COLUMNS.join(","))?;
        Ok(Self { writer })
    }

    /// Adds the objects of one time.
    pub(crate) fn write(&mut self, at: Timestamp, objects: &[FusedObject]) -> std::io::Result<()> {
        if objects.is_empty() {
            return Ok(());
        }
        let t = seconds::text(at);
        for object in objects {
            let FusedObject { track, class, bev, velocity: (vx, vy), existence, .. } = object;
            let [sx, sy, svx, svy] =
                KINEMATIC_DIAGONAL.map(|place| libm::sqrt(object.kinematic_covariance[place]));
            let [sw, sd, st] = [object.ww, object.dd, object.yaw_variance].map(libm::sqrt);
            write!(self.writer, "{t},{},{class},{},{},{vx},{vy},", track.0, bev.x, bev.y)?;
            write!(self.writer, "{},{},{},{existence},", bev.w, bev.d, bev.yaw)?;
            write!(self.writer, "{sx},{sy},{svx},{svy},{sw},{sd},{st},")?;
            let conflict = rounded(object.class_conflict);
            writeln!(self.writer, "{},{},{conflict}", object.heading.name(), classes(object))?;
        }
        Ok(())
    }

    /// The inner writer.
    pub(crate) fn into_inner(self) -> W {
        self.writer
    }
}

fn rounded(probability: f64) -> f64 {
    (probability * PROBABILITY_STEPS).round() / PROBABILITY_STEPS
}

/// The classes with their probabilities, the most probable first. What is left open is always said.
fn classes(object: &FusedObject) -> String {
    let mut classes = object.class_probabilities.clone();
    if classes.is_empty() {
        classes.push((object.class, 1.0));
    }
    classes.retain(|(class, probability)| *class == Class::Unknown || rounded(*probability) > 0.0);
    if classes.iter().all(|(class, _)| *class != Class::Unknown) {
        classes.push((Class::Unknown, 0.0));
    }
    let cells = classes.into_iter().map(|(class, probability)| format!("{class}:{}", rounded(probability)));
    cells.collect::<Vec<_>>().join(";")
}

/// A file that gets its name when it is complete, so that an incomplete table is never taken for a complete one.
#[derive(Debug)]
pub(crate) struct NewFile {
    writer: BufWriter<File>,
    /// The temporary and the final path; `None` for a path that is no regular file.
    moves: Option<(PathBuf, PathBuf)>,
}

impl NewFile {
    /// Creates a file that will be at `path`.
    pub(crate) fn create(path: &Path) -> anyhow::Result<Self> {
        let is_device = path.metadata().is_ok_and(|metadata| !metadata.is_file());
        let mut part = path.as_os_str().to_owned();
        part.push(".part");
        let part = if is_device { path.to_owned() } else { PathBuf::from(part) };
        let file = File::create(&part).with_context(|| format!("writing {}", path.display()))?;
        let moves = (!is_device).then(|| (part, path.to_owned()));
        Ok(Self { writer: BufWriter::new(file), moves })
    }

    /// Completes the file.
    pub(crate) fn finish(mut self) -> anyhow::Result<()> {
        self.writer.flush().context("writing the fused objects")?;
        if let Some((part, path)) = self.moves.take() {
            std::fs::rename(&part, &path).with_context(|| format!("writing {}", path.display()))?;
        }
        Ok(())
    }
}

impl Write for NewFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.writer.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.writer.flush()
    }
}

impl Drop for NewFile {
    fn drop(&mut self) {
        if let Some((part, _)) = &self.moves {
            // An incomplete file is removed. If this fails, nothing else can be done.
            let _ = std::fs::remove_file(part);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::geometry::BevBox;
    use v2x_common::heading::HeadingKind;
    use v2x_common::id::TrackId;

    fn last_cells(object: FusedObject) -> String {
        let mut table = FusedTable::new(Vec::new()).unwrap();
        table.write(Timestamp::EPOCH, &[object]).unwrap();
        let text = String::from_utf8(table.into_inner()).unwrap();
        let cells: Vec<&str> = text.lines().nth(1).unwrap().split(',').collect();
        assert_eq!(cells.len(), COLUMNS.len());
        cells[17..].join(",")
    }

    #[test]
    fn headings_classes_and_their_conflict_are_behind_the_other_columns() {
        let bev = BevBox { x: 1.0, y: 2.0, w: 2.0, d: 4.0, yaw: 0.5 };
        let plain = FusedObject::from_box(TrackId(3), Class::Car, bev);
        assert_eq!(last_cells(plain.clone()), "1,known,vehicle.car:1;unknown:0,0");
        let open = FusedObject {
            heading: HeadingKind::Axis,
            class_probabilities: vec![
                (Class::Car, 0.831_26),
                (Class::Truck, 0.12),
                (Class::Unknown, 0.048_72),
                (Class::Trailer, 0.000_02),
            ],
            class_conflict: 0.25,
            yaw_variance: 4.0,
            ..plain
        };
        assert_eq!(last_cells(open), "2,axis,vehicle.car:0.8313;vehicle.truck:0.12;unknown:0.0487,0.25");
    }
}
