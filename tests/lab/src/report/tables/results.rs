//! Everything that was computed for the tables.

use crate::data::scene::{Scene, Statistics};
use crate::drive::keyframes::setting::Setting;
use crate::report::tables::kind::Table;
use crate::report::tables::rows::{Row, rows};
use crate::report::tables::study::{Block, Study};
use crate::score::keyframes::experiments::{Plan, RunError, Scores};
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
        let again = trackers(&blocks).count() * plan.trials as usize * scenes.len();
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
        let (noise, shape) = (block.setting.noise, block.setting.shape);
        self.rows
            .iter()
            .filter(move |row| row.table == block.table && row.noise == noise && row.shape == shape)
    }
}

/// The contenders with tracking metrics, and their settings.
fn trackers(blocks: &[Block]) -> impl Iterator<Item = (Setting, &str)> {
    let blocks = blocks.iter().filter(|block| block.table == Table::Sensors);
    blocks.flat_map(|block| block.contenders.iter().map(|one| (block.setting, one.key())))
}

/// Adds the tracking metrics to the rows of [`Table::Sensors`].
fn note_trackers(
    rows: &mut [Row],
    blocks: &[Block],
    (plan, scenes): (&Plan, &[Scene]),
    progress: impl FnMut(usize, usize),
) -> Result<(), RunError> {
    let cells =
        trackers(blocks).filter_map(|(setting, key)| Some(((setting.noise, key), plan.cell(setting, key)?)));
    let (names, cells): (Vec<_>, Vec<_>) = cells.unzip();
    let scores = plan.track(scenes, &cells, progress)?;
    for ((noise, key), score) in names.into_iter().zip(scores) {
        let is_it = |row: &&mut Row| row.table == Table::Sensors && row.noise == noise && row.method == key;
        rows.iter_mut().filter(is_it).for_each(|row| row.tracker = score);
    }
    Ok(())
}
