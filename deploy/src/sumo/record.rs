//! The world as a table, which can be the world of a scenario.

use anyhow::{Context, ensure};
use std::fs::File;
use std::io::Write;
use std::path::Path;
use v2x_agent::trajectories::{LiveObject, MAX_ROWS, WorldStep};

/// Longer tables are not written, bytes: a network may run for days.
const MAX_LENGTH: u64 = 1 << 30;
/// A recorded world is not longer, µs: 7 days.
const MAX_TIME_US: i64 = 7 * 86_400 * 1_000_000;

/// A table that is written step by step.
#[derive(Debug)]
pub(super) struct Table {
    file: File,
    /// Rows of whole steps so far.
    n_rows: usize,
    /// Length of whole steps so far, bytes.
    length: u64,
}

impl Table {
    pub(super) fn create(path: &Path) -> anyhow::Result<Self> {
        let file = File::create(path).with_context(|| format!("writing {}", path.display()))?;
        let mut table = Self { file, n_rows: 0, length: 0 };
        table.append(b"t,id,class,x,y,yaw,w,d\n").with_context(|| format!("writing {}", path.display()))?;
        Ok(table)
    }

    /// Writes the rows of a step, all or none of them. An error says why the table ends before this step.
    pub(super) fn write(&mut self, step: &WorldStep) -> anyhow::Result<()> {
        let n_rows = self.n_rows + step.objects.len();
        ensure!(n_rows <= MAX_ROWS, "a recorded world has at most {MAX_ROWS} rows");
        ensure!(step.t_us <= MAX_TIME_US, "a recorded world has at most 7 days");
        let rows = rows(step)?;
        let length = self.length + rows.len() as u64;
        ensure!(length <= MAX_LENGTH, "it has {} bytes, and at most {MAX_LENGTH} are written", self.length);
        self.append(&rows)?;
        self.n_rows = n_rows;
        Ok(())
    }

    fn append(&mut self, text: &[u8]) -> std::io::Result<()> {
        if let Err(cause) = self.file.write_all(text) {
            // A part of a row could not be read. Where even this fails, reading says so.
            let _ = self.file.set_len(self.length);
            return Err(cause);
        }
        self.length += text.len() as u64;
        Ok(())
    }
}

/// Numbers are written so that they are read as the same bits.
#[expect(clippy::cast_precision_loss, reason = "µs of a run are far below 2^53")]
fn rows(step: &WorldStep) -> anyhow::Result<Vec<u8>> {
    let t_s = (step.t_us as f64 / 1e6).to_string();
    let mut writer = csv::Writer::from_writer(Vec::new());
    for LiveObject { id, class, x, y, yaw, w, d, .. } in &step.objects {
        let numbers = [x, y, yaw, w, d].map(f64::to_string);
        let row = [t_s.as_str(), id, class.name()].into_iter().chain(numbers.iter().map(String::as_str));
        writer.write_record(row)?;
    }
    writer.into_inner().context("writing rows")
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::class::Class;

    fn step() -> WorldStep {
        let id = "a, \"b\"".to_owned();
        let car = LiveObject { number: 1, id, class: Class::Car, x: 0.1, y: 2.0, yaw: 0.0, w: 1.8, d: 4.5 };
        WorldStep { start_us: 7, t_us: 100_000, objects: vec![car] }
    }

    #[test]
    fn a_table_ends_with_a_whole_step_before_it_is_too_long() {
        let path = std::env::temp_dir().join(format!("v2x-record-{}.csv", std::process::id()));
        let mut table = Table::create(&path).unwrap();
        table.write(&step()).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text, "t,id,class,x,y,yaw,w,d\n0.1,\"a, \"\"b\"\"\",vehicle.car,0.1,2,0,1.8,4.5\n");
        let late = WorldStep { t_us: MAX_TIME_US + 1, ..step() };
        assert!(table.write(&late).unwrap_err().to_string().contains("7 days"));
        table.n_rows = MAX_ROWS;
        assert!(table.write(&step()).unwrap_err().to_string().contains("10000000 rows"));
        (table.n_rows, table.length) = (1, MAX_LENGTH);
        assert!(table.write(&step()).unwrap_err().to_string().contains("at most 1073741824 are written"));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
        std::fs::remove_file(path).unwrap();
    }
}
