//! Estimates of several tracks at an earlier time: what a late frame finds.

use super::TrackContext;
use super::evidence::Evidence;
use super::snapshot::Snapshot;
use super::together::{Run, Source, TOGETHER, Together};
use super::track::Track;
use crate::filter::Filter;
use v2x_common::time::Timestamp;

/// Reads them. The memory is used again.
#[derive(Debug)]
pub(crate) struct PastReader<F> {
    runs: Vec<Run<F>>,
    together: Together,
}

impl<F> Default for PastReader<F> {
    fn default() -> Self {
        Self { runs: Vec::new(), together: Together::default() }
    }
}

/// Tracks that stay as they are.
struct Kept<'a, F>(&'a [Track<F>]);

impl<F: Filter> Source<F> for Kept<'_, F> {
    #[inline(always)]
    fn item(&self, track: usize, number: usize) -> Option<&Evidence> {
        self.0[track].item(number)
    }

    #[inline(always)]
    fn note_applied(&mut self, _: &Run<F>, _: Timestamp) {}
}

impl<F: Filter> PastReader<F> {
    /// The estimates at a time of the tracks at these places, in their order: those of [`Track::filtered_at`].
    pub(crate) fn read(
        &mut self,
        tracks: &[Track<F>],
        (places, at): (&[usize], Timestamp),
        context: &TrackContext<'_>,
    ) -> impl Iterator<Item = &Snapshot<F>> {
        let Self { runs, together } = self;
        runs.clear();
        runs.extend(places.iter().map(|place| tracks[*place].run_to(at, *place, context)));
        for some in runs.chunks_mut(TOGETHER) {
            together.run(some, &mut Kept(tracks), context);
        }
        runs.iter().map(|run| &run.known)
    }
}
