//! Counters of received samples, and their recording in a file.

use anyhow::Context;
use serde_json::{Value, json};
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use v2x_common::keys::Topic;
use v2x_common::recording::{Entry, Recorder};

/// A recording that is being written.
pub(super) struct RecordingFile {
    recorder: Recorder<BufWriter<File>>,
    path: PathBuf,
}

impl RecordingFile {
    pub(super) fn create(path: &Path) -> anyhow::Result<Self> {
        let file = File::create(path).with_context(|| format!("making {}", path.display()))?;
        let recorder =
            Recorder::new(BufWriter::new(file)).with_context(|| format!("writing {}", path.display()))?;
        Ok(Self { recorder, path: path.to_owned() })
    }

    pub(super) fn write(&mut self, entry: &Entry) -> anyhow::Result<()> {
        self.recorder.write(entry).with_context(|| format!("writing {}", self.path.display()))
    }

    pub(super) fn flush(&mut self) -> anyhow::Result<()> {
        self.recorder.flush().with_context(|| format!("writing {}", self.path.display()))
    }
}

/// What has been received so far.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counts {
    pub(super) fused_frames: u64,
    pub(super) detection_frames: u64,
    pub(super) objects: usize,
    pub(super) unreadable: u64,
}

impl Counts {
    /// Counts an entry; true where it is a fused frame.
    pub(super) fn add(&mut self, entry: &Entry) -> bool {
        match Topic::of(&entry.key) {
            Some(Topic::Fused(_) | Topic::Lagged(_) | Topic::Delta(_) | Topic::Tile(..)) => {
                self.fused_frames += 1;
                return true;
            }
            Some(Topic::Detections(_)) => self.detection_frames += 1,
            _ => {}
        }
        false
    }

    pub(super) fn to_json(self, dropped: u64) -> Value {
        json!({
            "fused_frames": self.fused_frames,
            "detection_frames": self.detection_frames,
            "objects": self.objects,
            "unreadable": self.unreadable,
            "dropped": dropped,
        })
    }
}
