//! The lists of objects: the live one, and the second one that is a lag behind. Each has a file and a score.

use super::truth_check::{Diagnoses, Known};
use crate::drive::driver::Consumer;
use crate::drive::ticks::Ticks;
use crate::report::fused_table::{FusedTable, NewFile};
use crate::score::offline::{TruthScore, TruthScorer};
use anyhow::Context;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::FusedFrame;
use v2x_common::geometry::Pose;
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};

/// One list: its file, and its score where the truth is known.
#[derive(Debug)]
pub(super) struct List {
    table: Option<FusedTable<NewFile>>,
    scorer: Option<TruthScorer>,
    rows: u64,
}

impl List {
    /// A list that is written to this file, if any.
    pub(super) fn new(path: Option<&Path>, truth: Option<&Known>) -> anyhow::Result<Self> {
        let table =
            |path: &Path| FusedTable::new(NewFile::create(path)?).context("writing the fused objects");
        let scorer = |(truth, region): &Known| TruthScorer::new(truth.clone(), *region);
        Ok(Self { table: path.map(table).transpose()?, scorer: truth.map(scorer), rows: 0 })
    }

    fn add(&mut self, frame: &FusedFrame) -> anyhow::Result<()> {
        self.rows += frame.objects.len() as u64;
        if let Some(table) = &mut self.table {
            // With a lag, fused objects are estimates for an earlier time than their publication.
            table.write(frame.fused_at, &frame.objects).context("writing the fused objects")?;
        }
        if let Some(scorer) = &mut self.scorer {
            scorer.add(frame.fused_at, &frame.objects);
        }
        Ok(())
    }

    fn note_sensor(&mut self, sensor: AgentId, pose: Pose) {
        if let Some(scorer) = &mut self.scorer {
            scorer.note_sensor(sensor, pose);
        }
    }

    /// Nothing is there at these ticks, of which each one holds for a lag before; not before `begin`.
    fn add_nothing(&mut self, ticks: Ticks, lag: Span, begin: Timestamp) {
        if let Some(scorer) = &mut self.scorer {
            let (first, last) = scorer.span();
            let ticks = ticks.clamped_to(first.max(begin) + lag, last + lag);
            ticks.for_each(|at| scorer.add(at - lag, &[]));
        }
    }

    /// Whether no object has been in it.
    pub(super) const fn is_empty(&self) -> bool {
        self.rows == 0
    }

    /// Completes the file. Returns the number of rows, and the score.
    pub(super) fn finish(self) -> anyhow::Result<(u64, Option<TruthScore>)> {
        if let Some(table) = self.table {
            table.into_inner().finish()?;
        }
        Ok((self.rows, self.scorer.as_ref().map(TruthScorer::score)))
    }
}

/// The second list. It has the ticks of the first one.
#[derive(Debug)]
pub(super) struct LaggedList {
    pub(super) list: List,
    pub(super) lag: Span,
    /// Where it is written.
    pub(super) path: Option<PathBuf>,
    /// The first arrival.
    begin: Option<Timestamp>,
    /// Where sensors were, by arrival, as far as the list is behind.
    ahead: VecDeque<(Timestamp, AgentId, Pose)>,
}

impl LaggedList {
    /// A list that is so far behind.
    pub(super) fn new(lag: Span, path: Option<PathBuf>, truth: Option<&Known>) -> anyhow::Result<Self> {
        let list = List::new(path.as_deref(), truth)?;
        Ok(Self { list, lag, path, begin: None, ahead: VecDeque::new() })
    }

    fn add(&mut self, frame: &FusedFrame) -> anyhow::Result<()> {
        if self.begin.is_none_or(|begin| frame.fused_at < begin) {
            return Ok(());
        }
        while let Some((_, sensor, pose)) = self.ahead.pop_front_if(|(at, ..)| *at <= frame.fused_at) {
            self.list.note_sensor(sensor, pose);
        }
        self.list.add(frame)
    }
}

/// Receives what the engine publishes.
#[derive(Debug)]
pub(super) struct Sink<'a> {
    pub(super) live: List,
    pub(super) lagged: Option<LaggedList>,
    pub(super) diagnosis: &'a RefCell<Diagnoses>,
}

impl Consumer for Sink<'_> {
    type Error = anyhow::Error;

    fn note_arrival(&mut self, frame: &DetectionFrame, received_at: Timestamp) {
        if let Some(lagged) = &mut self.lagged {
            lagged.begin.get_or_insert(received_at);
        }
        let Some(pose) = frame.sensor_pose else { return };
        self.live.note_sensor(frame.id.agent, pose);
        if let Some(lagged) = &mut self.lagged {
            lagged.ahead.push_back((received_at, frame.id.agent, pose));
        }
    }

    fn receive(&mut self, _: Timestamp, frame: &FusedFrame) -> anyhow::Result<()> {
        self.diagnosis.borrow_mut().note_list(frame);
        self.live.add(frame)
    }

    fn receive_lagged(&mut self, frame: &FusedFrame) -> anyhow::Result<()> {
        self.lagged.as_mut().map_or(Ok(()), |lagged| lagged.add(frame))
    }

    fn receive_nothing(&mut self, ticks: Ticks) {
        self.live.add_nothing(ticks, Span::ZERO, Timestamp::MIN);
        if let Some(LaggedList { list, lag, begin: Some(begin), .. }) = &mut self.lagged {
            list.add_nothing(ticks, *lag, *begin);
        }
    }
}
