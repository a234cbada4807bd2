//! Estimates of several tracks moved through their evidence together: each applies its next detection, then each the one after it,
//! because several of them fit into one instruction. The bits are those of one track after the other.

use super::TrackContext;
use super::application::{HeldDetection, apply, close, open};
use super::evidence::Evidence;
use super::orientation::Read;
use super::snapshot::Snapshot;
use crate::filter::{Due, Filter, Holds};
use crate::values::{CompactMeasurement, Measurement, PositionInnovation};
use v2x_common::time::Timestamp;

/// Estimates that are moved together: so many stay in the nearest memory.
pub(super) const TOGETHER: usize = 16;

/// The estimate of a track on its way through the track's evidence.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run<F> {
    /// Place of the track.
    pub(super) track: usize,
    /// Items that are applied.
    pub(super) count: usize,
    /// Items to apply.
    pub(super) end: usize,
    /// After these items.
    pub(super) known: Snapshot<F>,
}

impl<F> Holds<F> for Run<F> {
    #[inline(always)]
    fn state(&self) -> &F {
        &self.known.state
    }

    #[inline(always)]
    fn state_mut(&mut self) -> &mut F {
        &mut self.known.state
    }
}

/// Where the evidence is.
pub(super) trait Source<F> {
    /// An item of the evidence of the track at a place.
    fn item(&self, track: usize, number: usize) -> Option<&Evidence>;
    /// Is called after each item that is applied, with its time.
    fn note_applied(&mut self, run: &Run<F>, at: Timestamp);
}

/// Moves estimates. The memory is used again.
#[derive(Debug, Default)]
pub(super) struct Together {
    /// Those that are not at their end, by place.
    running: Vec<usize>,
    due: Vec<Due>,
    measurements: Vec<(usize, Measurement)>,
    reads: Vec<Read>,
    innovations: Vec<Option<PositionInnovation>>,
}

impl Together {
    /// Moves all to their ends; [`TOGETHER`] of them at once are fastest.
    pub(super) fn run<F: Filter>(
        &mut self,
        runs: &mut [Run<F>],
        source: &mut impl Source<F>,
        context: &TrackContext<'_>,
    ) {
        self.running.clear();
        self.running.extend(0..runs.len());
        while self.step(runs, source, context) {}
    }

    /// Applies the next detection of each; whether there was one.
    fn step<F: Filter>(
        &mut self,
        runs: &mut [Run<F>],
        source: &mut impl Source<F>,
        context: &TrackContext<'_>,
    ) -> bool {
        let Self { running, due, measurements, reads, innovations } = self;
        running.retain(|place| reaches_detection(&mut runs[*place], source, context));
        due.clear();
        due.extend(running.iter().filter_map(|place| {
            let Run { track, count, known, .. } = &runs[*place];
            let to = source.item(*track, *count)?.captured_at;
            let is_due = (to - known.state.at()).abs() > context.synchronous;
            is_due.then(|| Due { place: *place, class: known.motion_class(), to })
        }));
        F::predict_some(runs, due);
        measurements.clear();
        reads.clear();
        for place in running.iter() {
            let Run { track, count, known, .. } = &mut runs[*place];
            let Some((item, held)) = detection(source, (*track, *count), context) else { continue };
            let read = open(known, HeldDetection { item: &item, held }, context);
            measurements.push((*place, read.z));
            reads.push(read);
        }
        innovations.clear();
        innovations.resize(reads.len(), None);
        F::update_some(runs, measurements, |number, innovation| innovations[number] = Some(innovation));
        for (((place, _), read), innovation) in measurements.iter().zip(reads).zip(innovations) {
            let run = &mut runs[*place];
            let Some((item, held)) = detection(source, (run.track, run.count), context) else { continue };
            if let Some(innovation) = innovation {
                close(&mut run.known, HeldDetection { item: &item, held }, (read, innovation), context);
            }
            run.count += 1;
            source.note_applied(run, item.captured_at);
        }
        !running.is_empty()
    }
}

/// Applies missed detections up to the next detection; whether there is one.
#[inline]
fn reaches_detection<F: Filter>(
    run: &mut Run<F>,
    source: &mut impl Source<F>,
    context: &TrackContext<'_>,
) -> bool {
    while run.count < run.end
        && let Some(item) = source.item(run.track, run.count).copied()
    {
        if context.frames.held(&item).is_some() {
            return true;
        }
        apply(&mut run.known, (&item, None), None, context);
        run.count += 1;
        source.note_applied(run, item.captured_at);
    }
    false
}

/// An item that is a detection, with its measurement.
#[inline(always)]
fn detection<'a, F>(
    source: &impl Source<F>,
    (track, count): (usize, usize),
    context: &TrackContext<'a>,
) -> Option<(Evidence, &'a CompactMeasurement)> {
    let item = *source.item(track, count)?;
    Some((item, context.frames.held(&item)?))
}
