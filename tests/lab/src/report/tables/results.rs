//! Everything that was computed for the tables.

use crate::data::conditions::Conditions;
use crate::data::scene::{Scene, Statistics};
use crate::drive::keyframes::setting::Setting;
use crate::report::tables::kind::Table;
use crate::report::tables::rows::{Row, rows};
use crate::report::tables::study::{Block, Study};
use crate::score::keyframes::experiments::{Cell, Plan, RunError, Scores};
use crate::score::keyframes::moment::{ShowError, Shown};

/// Everything that was computed.
pub(crate) struct Tables {
    pub(crate) blocks: Vec<Block>,
    pub(crate) plan: Plan,
    pub(crate) statistics: Statistics,
    pub(crate) dataset: String,
    pub(crate) rows: Vec<Row>,
    pub(crate) scores: Scores,
    /// What [`Table::Fig5`] shows, where it is wanted.
    pub(crate) shown: Option<Shown>,
}

impl Tables {
    pub(crate) fn of(
        scenes: &[Scene],
        (study, plan): (&Study, Plan),
        dataset: &str,
        mut progress: impl FnMut(usize, usize),
    ) -> Result<Self, ShowError> {
        let blocks = study.blocks();
        // In scenes: tracking metrics need another run over all scenes for each trial.
        let again = trackers(&blocks, &plan).len() * plan.trials as usize * scenes.len();
        let mut first_part = 0;
        let scores = plan.run(scenes, |done, of| {
            first_part = of;
            progress(done, of + again);
        })?;
        let mut rows: Vec<Row> = blocks
            .iter()
            .filter(|block| block.table != Table::Fig5)
            .flat_map(|block| rows(block, &plan, &scores))
            .collect();
        note_trackers(&mut rows, &blocks, (&plan, scenes), |done, _| {
            progress(first_part + done * scenes.len(), first_part + again);
        })?;
        let shown = blocks.iter().find(|block| block.table == Table::Fig5);
        let shown = shown.map(|block| plan.show(scenes, (block.setting, &block.contenders), &study.moment));
        let (shown, statistics) = (shown.transpose()?, Statistics::of(scenes));
        Ok(Self { blocks, plan, statistics, dataset: dataset.to_owned(), rows, scores, shown })
    }

    /// The rows of a block.
    pub(crate) fn rows_of<'a>(&'a self, block: &'a Block) -> impl Iterator<Item = &'a Row> {
        self.rows.iter().filter(|row| block.has(row))
    }
}

impl Block {
    /// Whether a row is of this block.
    fn has(&self, row: &Row) -> bool {
        let Setting { noise, shape, .. } = self.setting;
        row.table == self.table && row.noise == noise && row.shape == shape
    }

    /// Whether its methods have tracking and detection metrics: where detectors miss objects and report others. A table by
    /// class has rows that these are not of, and a picture has none.
    pub(crate) fn has_trackers(&self) -> bool {
        let is_by_method = !matches!(self.table, Table::Fig3 | Table::Nees | Table::Fig5);
        is_by_method && self.setting.conditions != Conditions::Paper
    }
}

/// The contenders with tracking metrics in some table, each once.
fn trackers(blocks: &[Block], plan: &Plan) -> Vec<Cell> {
    let mut cells: Vec<Cell> = Vec::new();
    for block in blocks.iter().filter(|block| block.has_trackers()) {
        let of_block = block.contenders.iter().filter_map(|one| plan.cell(block.setting, one.key()));
        for cell in of_block {
            if !cells.contains(&cell) {
                cells.push(cell);
            }
        }
    }
    cells
}

/// Adds the tracking metrics to the rows of the blocks that have any.
fn note_trackers(
    rows: &mut [Row],
    blocks: &[Block],
    (plan, scenes): (&Plan, &[Scene]),
    progress: impl FnMut(usize, usize),
) -> Result<(), RunError> {
    let cells = trackers(blocks, plan);
    let scores = plan.track(scenes, &cells, progress)?;
    for block in blocks.iter().filter(|block| block.has_trackers()) {
        for row in rows.iter_mut().filter(|row| block.has(row)) {
            let cell = plan.cell(block.setting, &row.method);
            let place = cell.and_then(|cell| cells.iter().position(|one| *one == cell));
            row.tracker = place.map(|place| scores[place]).unwrap_or_default();
        }
    }
    Ok(())
}
