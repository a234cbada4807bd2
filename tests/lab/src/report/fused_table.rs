//! The fused objects as a table.

use crate::data::seconds;
use anyhow::Context;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use v2x_common::fused::{FusedObject, KINEMATIC_DIAGONAL};
use v2x_common::time::Timestamp;

/// The columns in seconds, metres, m/s and radians; sx to st are standard deviations.
pub(crate) const COLUMNS: [&str; 18] = [
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
];

/// A writer of a table of fused objects.
#[derive(Debug)]
pub(crate) struct FusedTable<W: Write> {
    writer: W,
    rows: u64,
}

impl<W: Write> FusedTable<W> {
    /// Writes the header.
    pub(crate) fn new(mut writer: W) -> std::io::Result<Self> {
        writeln!(writer, "{}", COLUMNS.join(","))?;
        Ok(Self { writer, rows: 0 })
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
            writeln!(self.writer, "{sx},{sy},{svx},{svy},{sw},{sd},{st}")?;
        }
        self.rows += objects.len() as u64;
        Ok(())
    }

    /// Number of rows so far.
    pub(crate) const fn rows(&self) -> u64 {
        self.rows
    }

    /// The inner writer.
    pub(crate) fn into_inner(self) -> W {
        self.writer
    }
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
