//! The world as a table, which can be the world of a scenario.

use anyhow::Context;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use v2x_agent::trajectories::{LiveObject, WorldStep};

/// A table that is written step by step.
pub(super) struct Table {
    writer: csv::Writer<BufWriter<File>>,
}

impl Table {
    pub(super) fn create(path: &Path) -> anyhow::Result<Self> {
        let file = File::create(path).with_context(|| format!("writing {}", path.display()))?;
        let mut writer = csv::Writer::from_writer(BufWriter::new(file));
        writer.write_record(["t", "id", "class", "x", "y", "yaw", "w", "d"])?;
        Ok(Self { writer })
    }

    /// Writes the rows of a step. Numbers are written so that they are read as the same bits.
    #[expect(clippy::cast_precision_loss, reason = "µs of a run are far below 2^53")]
    pub(super) fn write(&mut self, step: &WorldStep) -> anyhow::Result<()> {
        let t_s = (step.t_us as f64 / 1e6).to_string();
        for LiveObject { id, class, x, y, yaw, w, d, .. } in &step.objects {
            let numbers = [x, y, yaw, w, d].map(f64::to_string);
            let row = [t_s.as_str(), id, class.name()].into_iter().chain(numbers.iter().map(String::as_str));
            self.writer.write_record(row)?;
        }
        self.writer.flush().context("writing the world")
    }
}
