//! One item of evidence applied to an estimate.

use super::context::TrackContext;
use super::evidence::Evidence;
use super::frame_store::StoredFrame;
use super::orientation::Read;
use super::snapshot::{FrameEvidence, ReportEvidence, Snapshot};
use crate::filter::Filter;
use crate::values::{CompactMeasurement, Coverage, PositionInnovation, SharedError};

/// Applies an item to an estimate; there is none before the first detection.
#[inline]
pub(super) fn advance<F: Filter>(
    known: &mut Option<Snapshot<F>>,
    item: &Evidence,
    context: &TrackContext<'_>,
) {
    match known {
        Some(known) => apply(known, (item, context.frames.held(item)), None, context),
        None => *known = initial(item, context),
    }
}

/// The estimate after a first detection; `None` of a missed one.
pub(super) fn initial<F: Filter>(item: &Evidence, context: &TrackContext<'_>) -> Option<Snapshot<F>> {
    let held = context.frames.held(item)?;
    let z = context.frames.expanded(item, held);
    let stored = context.frames.get(item.frame);
    let frame = frame_evidence(item, stored);
    let mut initial = Snapshot::initial(&frame, &z, held.score(), context.class_motion);
    initial.shared_error = SharedError::initial(&frame.of_pose(stored.pose_variance(z.position)));
    Some(initial)
}

/// Applies an item, with its measurement as it is held where it is a detection.
#[inline(always)]
pub(super) fn apply<F: Filter>(
    known: &mut Snapshot<F>,
    (item, held): (&Evidence, Option<&CompactMeasurement>),
    predicted: Option<&F>,
    context: &TrackContext<'_>,
) {
    let at = item.captured_at;
    let stored = context.frames.get(item.frame);
    let frame = frame_evidence(item, stored);
    if let Some(held) = held {
        match predicted {
            Some(predicted) => known.state = *predicted,
            None => known.predict(at, context.synchronous),
        }
        let detection = HeldDetection { item, held };
        let read = open(known, detection, context);
        let innovation = known.state.update(&read.z);
        close(known, detection, (&read, &innovation), context);
    } else if let Some(coverage) = &stored.coverage {
        known.add_missed_detection(&frame, coverage, (predicted, context.synchronous));
    }
}

/// A detection of a track, and its measurement as it is held.
#[derive(Clone, Copy)]
pub(super) struct HeldDetection<'a> {
    pub(super) item: &'a Evidence,
    pub(super) held: &'a CompactMeasurement,
}

/// Before the update of a state by a detection of its time: how that is read.
#[inline(always)]
pub(super) fn open<F: Filter>(
    known: &mut Snapshot<F>,
    HeldDetection { item, held }: HeldDetection<'_>,
    context: &TrackContext<'_>,
) -> Read {
    let stored = context.frames.get(item.frame);
    let frame = frame_evidence(item, stored);
    let mut z = context.frames.expanded(item, held);
    known.let_errors_wander(&frame);
    known.reconcile_poses(&frame, stored.pose_variance(z.position), &mut z);
    let discount = known.discount(&frame, &z);
    if discount == 0.0 {
        return known.read(&frame, &z);
    }
    z.r.xx += discount;
    z.r.yy += discount;
    Read { discount, ..known.read(&frame, &z) }
}

/// After the update.
#[inline(always)]
pub(super) fn close<F: Filter>(
    known: &mut Snapshot<F>,
    HeldDetection { item, held }: HeldDetection<'_>,
    (read, innovation): (&Read, &PositionInnovation),
    context: &TrackContext<'_>,
) {
    let stored = context.frames.get(item.frame);
    let range_m = |coverage: &Coverage| coverage.range_for_profile(read.z.position);
    known.finish(&frame_evidence(item, stored), read, innovation, || ReportEvidence {
        over_clutter: held.detection_over_clutter(),
        score: held.score(),
        range_m: stored.coverage.as_ref().map_or(0.0, range_m),
    });
}

fn frame_evidence<'a>(item: &Evidence, stored: &'a StoredFrame) -> FrameEvidence<'a> {
    FrameEvidence { at: item.captured_at, agent: stored.agent, model: &stored.model }
}
