//! Fused frames against the truth: matched by provenance, as in the tables, and in a part of the frames by position.

use crate::data::run_log::ReceivedFused;
use crate::score::errors::SizeNorm;
use crate::score::estimate::Estimate;
use crate::score::frame_errors::{ErrorSums, FrameErrors};
use crate::score::frame_metrics::mean_half_nees;
use crate::score::gospa::gospa;
use crate::score::matching::{Frame, MatchingRule, Outcome, PositionRule, Repeats};
use crate::score::sweep::provenance::Provenance;
use crate::score::sweep::record::{BLOCK, Errors, Record, Reference, Subset, distribution};
use crate::score::sweep::snapshots::{Snapshot, Snapshots};
use v2x_common::fused::FusedObject;
use v2x_common::time::Timestamp;
use v2x_fusion_hub::association::assignment::Assigner;

/// One of this many fused frames is matched by position, too.
const BY_POSITION_EVERY: usize = 5;
/// Match radius by position, m. Also the cut-off of GOSPA.
const MATCH_RADIUS_M: f64 = 4.0;
const BY_POSITION: PositionRule = PositionRule { radius_m: Some(MATCH_RADIUS_M), is_class_aware: false };

/// The scored part of a run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scope {
    /// The agent that the others are compared with.
    pub reference: Reference,
    /// Fused frames count from this time on.
    pub start: Timestamp,
    /// Fused frames count up to this time.
    pub end: Timestamp,
}

/// Scores the fused frames of one method.
#[derive(Debug)]
pub(crate) struct Scorer<'a, 'b> {
    snapshots: &'a mut Snapshots<'b>,
    provenance: &'a Provenance,
    scope: Scope,
    assigner: Assigner,
    record: Record,
    /// Of the frames that are matched by position.
    sums_by_position: ErrorSums,
    ages_ms: Vec<f64>,
    other_ages_ms: Vec<f64>,
    to_fused_ms: Vec<f64>,
    to_consumed_ms: Vec<f64>,
    n_frames: usize,
}

impl<'a, 'b> Scorer<'a, 'b> {
    /// A scorer that has no frames yet.
    pub(crate) fn new(snapshots: &'a mut Snapshots<'b>, provenance: &'a Provenance, scope: Scope) -> Self {
        Self {
            snapshots,
            provenance,
            scope,
            assigner: Assigner::default(),
            record: Record::default(),
            sums_by_position: ErrorSums::default(),
            ages_ms: Vec::new(),
            other_ages_ms: Vec::new(),
            to_fused_ms: Vec::new(),
            to_consumed_ms: Vec::new(),
            n_frames: 0,
        }
    }

    /// Adds a fused frame.
    pub(crate) fn add(&mut self, received: &ReceivedFused) {
        let frame = &received.frame;
        if frame.fused_at < self.scope.start || frame.fused_at > self.scope.end {
            return;
        }
        let snapshot = self.snapshots.at(frame.fused_at);
        let estimates: Vec<_> = frame.objects.iter().map(Estimate::from).collect();
        let scored = Frame { estimates: &estimates, truth: &snapshot.objects, counts: &snapshot.counts };
        self.by_provenance(&frame.objects, &scored, &snapshot, frame.fused_at);
        if self.n_frames.is_multiple_of(BY_POSITION_EVERY) {
            self.by_position(&scored, &snapshot);
        }
        self.n_frames += 1;
        let reference = self.scope.reference;
        for included in frame.includes.iter().filter(|included| reference.examines(&included.frame.agent)) {
            self.to_fused_ms.push((frame.fused_at - included.received_at).as_millis_f64());
        }
        self.to_consumed_ms.push((received.received_at - frame.fused_at).as_millis_f64());
    }

    /// Counts as the paper's tables do: of several boxes of one object all errors add up, and all but one are false.
    fn by_provenance(
        &mut self,
        objects: &[FusedObject],
        frame: &Frame<'_>,
        snapshot: &Snapshot,
        at: Timestamp,
    ) {
        let first = self.scope.reference.agent;
        let place = |object: &FusedObject| {
            let id = self.provenance.object(object, first)?;
            frame.truth.binary_search_by_key(&id, |object| object.id).ok()
        };
        let places: Vec<_> = objects.iter().map(place).collect();
        let rule = MatchingRule::ByProvenance { places: &places, repeats: Repeats::ErrorsAddUp };
        // An estimate of no object counts only where both agents cover.
        let matching = frame
            .matched(rule, &mut self.assigner)
            .restricted_to(|_| true, |index| self.is_in_view(frame, snapshot, index));
        let errors = FrameErrors::of(frame, &matching, SizeNorm::RootOfSquares);
        let sums = Subset::ALL.map(|subset| {
            // An estimate of no object is in no other subset.
            errors.sums(|place| {
                place.map_or(subset == Subset::All, |place| snapshot.subsets[place][subset as usize])
            })
        });
        self.add_to_block(&sums, at);
        for (index, outcome) in matching.outcomes.iter().enumerate() {
            if outcome.place().is_some() {
                self.add_ages(&objects[index], at);
            }
        }
    }

    fn is_in_view(&self, frame: &Frame<'_>, snapshot: &Snapshot, index: usize) -> bool {
        let bev = &frame.estimates[index].bev;
        self.snapshots.is_in_view(snapshot, bev.x, bev.y)
    }

    fn add_to_block(&mut self, sums: &[ErrorSums; 4], at: Timestamp) {
        let place = usize::try_from((at - self.scope.start).as_nanos() / BLOCK.as_nanos()).unwrap_or(0);
        if self.record.blocks.len() <= place {
            self.record.blocks.resize(place + 1, [Errors::default(); 4]);
        }
        self.record.blocks[place].iter_mut().zip(sums).for_each(|(block, sums)| block.add_frame(sums));
    }

    fn add_ages(&mut self, object: &FusedObject, at: Timestamp) {
        let first = self.scope.reference.agent;
        let ages = || {
            let contributions = self.provenance.of(object);
            contributions.map(|one| (one.agent, (at - one.captured_at).as_millis_f64()))
        };
        let of_all = ages().map(|(_, age_ms)| age_ms).reduce(f64::min);
        let others = ages().filter(|(agent, _)| *agent != first);
        let of_others = others.map(|(_, age_ms)| age_ms).reduce(f64::min);
        self.ages_ms.extend(of_all);
        self.other_ages_ms.extend(of_others);
    }

    fn by_position(&mut self, frame: &Frame<'_>, snapshot: &Snapshot) {
        let matching = frame.matched(MatchingRule::ByPosition(BY_POSITION), &mut self.assigner);
        let matching = matching.restricted_to(|_| true, |index| self.is_in_view(frame, snapshot, index));
        let errors = FrameErrors::of(frame, &matching, SizeNorm::RootOfSquares);
        errors.add_to(&mut self.sums_by_position, |_| true);
        if let Some(nees) = mean_half_nees(frame, &matching) {
            self.record.nees = (self.record.nees.0 + nees, self.record.nees.1 + 1);
        }
        let outcomes = frame.estimates.iter().zip(&matching.outcomes);
        let counted = outcomes.filter(|(_, outcome)| **outcome != Outcome::Ignored);
        let estimates: Vec<_> = counted.map(|(estimate, _)| estimate.bev).collect();
        let truth = frame.truth.iter().zip(frame.counts).filter(|(_, counts)| **counts);
        let truth: Vec<_> = truth.map(|(object, _)| object.bev).collect();
        let by_position = &mut self.record.by_position;
        by_position.gospa_m += gospa(&estimates, &truth, MATCH_RADIUS_M, &mut self.assigner).distance_m();
        by_position.frames += 1;
    }

    /// The record, without the figures of frames in transit.
    pub(crate) fn finish(self) -> Record {
        let Self {
            mut record, sums_by_position, ages_ms, other_ages_ms, to_fused_ms, to_consumed_ms, ..
        } = self;
        record.by_position.errors = Errors::of_translations(&sums_by_position);
        record.age_ms = distribution(ages_ms);
        record.other_age_ms = distribution(other_ages_ms);
        record.arrive_to_fused_ms = distribution(to_fused_ms);
        record.fused_to_consumed_ms = distribution(to_consumed_ms);
        record
    }
}
