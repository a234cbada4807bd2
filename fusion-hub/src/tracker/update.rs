//! Third stage: every predicted track gets its evidence, and detections of no known track initiate new ones.

use super::assign::{Assigning, Assignment};
use super::instant::NewestInstant;
use super::occupied::Occupied;
use super::predict::{FrameView, Predictions};
use super::store::TrackStore;
use crate::filter::Filter;
use crate::track::{Evidence, FrameSlot, Read, Track, TrackContext};
use crate::values::{Measurement, ParticleSet};

/// A frame with what the first two stages made of it.
pub(super) struct AssociatedFrame<'a, F> {
    pub(super) frame: FrameView<'a>,
    pub(super) predictions: &'a Predictions<F>,
    pub(super) assignment: &'a Assignment,
}

/// Makes a version of each track for every outcome in which its particles differ.
pub(super) fn split_versions<F: Filter>(
    tracks: &mut TrackStore<F>,
    predictions: &mut Predictions<F>,
    assigning: &Assigning,
    assignment: &mut Assignment,
) {
    for index in predictions.tracks() {
        tracks.get_mut(*index).holders = ParticleSet::NONE;
    }
    for outcome in assigning.outcomes() {
        let place = outcome.col as usize;
        let index = predictions.tracks()[place];
        let is_full = tracks.is_full();
        let track = tracks.get_mut(index);
        if track.holders.is_empty() {
            track.holders = outcome.holders;
            track.disputed_at = outcome.disputed_at;
            assignment.set_detection(place, outcome.report);
        } else if is_full {
            // Without room for another version the particles follow this one.
            track.holders.join(outcome.holders);
        } else {
            let version = tracks.add_version(index, outcome.holders);
            tracks.get_mut(version).disputed_at = outcome.disputed_at;
            predictions.add_version(place, version);
            assignment.add_version(outcome.report);
        }
    }
}

/// Tracks that are being updated together. The memory is used again.
#[derive(Debug, Default)]
pub(super) struct Opened {
    /// Each track, with the measurement that updates it.
    measurements: Vec<(usize, Measurement)>,
    /// How the detection of each is read.
    reads: Vec<Read>,
}

impl Opened {
    fn open<F: Filter>(
        &mut self,
        tracks: &mut TrackStore<F>,
        (index, predicted): (usize, &F),
        detection: &Evidence,
        context: &TrackContext<'_>,
    ) {
        if let Some(read) = tracks.get_mut(index).open(detection, predicted, context) {
            self.measurements.push((index, read.z));
            self.reads.push(read);
        }
    }

    /// All at once: several of them fit into one instruction.
    fn close<F: Filter>(&mut self, tracks: &mut TrackStore<F>, context: &TrackContext<'_>) {
        let Self { measurements, reads } = self;
        tracks.update_some(measurements, |track, number, innovation| {
            track.close(&reads[number], &innovation, context);
        });
        measurements.clear();
        reads.clear();
    }
}

/// Gives every predicted track its detection, or the missed detection.
pub(super) fn update<F: Filter>(
    tracks: &mut TrackStore<F>,
    associated: &AssociatedFrame<'_, F>,
    (retracted, opened): (&[FrameSlot], &mut Opened),
    context: &TrackContext<'_>,
) {
    let AssociatedFrame { frame, predictions, assignment } = associated;
    let captured_at = frame.stored.captured_at;
    for (place, index_of_track) in predictions.tracks().iter().enumerate() {
        let track = tracks.get_mut(*index_of_track);
        let predicted = predictions.state(place);
        if let Some(index) = assignment.detection(place) {
            let detection = Evidence::detection(captured_at, frame.slot, index);
            if F::TOGETHER && track.is_after_all(&detection, context) {
                opened.open(tracks, (*index_of_track, predicted), &detection, context);
                continue;
            }
            let may_be_first =
                track.oldest().is_some_and(|oldest| context.frames.is_before(&detection, oldest));
            track.insert(detection, Some(predicted), context);
            if may_be_first {
                add_missed_detections(track, &detection, retracted, context);
            }
        } else if let Some(coverage) = &frame.stored.coverage
            && coverage.may_cover(predictions.measurements()[place].position)
            && track.initiated_at() <= captured_at
        {
            track.insert(Evidence::missed(captured_at, frame.slot), Some(predicted), context);
        }
    }
    opened.close(tracks, context);
}

/// A detection whose position is less certain than 20 m along an axis begins no track: it would be anywhere. m².
const MOST_AT_BIRTH: f64 = 400.0;

/// Initiates a track with every detection of no known track.
pub(super) fn initiate<F: Filter>(
    tracks: &mut TrackStore<F>,
    associated: &AssociatedFrame<'_, F>,
    instant: &mut NewestInstant<F>,
    context: &TrackContext<'_>,
) {
    let AssociatedFrame { frame, assignment, .. } = associated;
    let is_exclusive = context.exclusion && !assignment.initiations().is_empty();
    let mut occupied = is_exclusive.then(|| Occupied::by(associated.predictions, tracks));
    for initiation in assignment.initiations() {
        let z = &frame.measurements[usize::from(initiation.index)];
        if z.r.xx.max(z.r.yy) > MOST_AT_BIRTH {
            continue;
        }
        if occupied.as_mut().is_some_and(|occupied| !occupied.admits(z)) {
            continue;
        }
        let detection = Evidence::detection(frame.stored.captured_at, frame.slot, initiation.index);
        let id = || instant.take_id(&detection);
        if let Some(track) = tracks.initiate(detection, id, context) {
            track.holders = initiation.holders;
            add_missed_detections(track, &detection, instant.retracted(), context);
        }
    }
}

/// Adds to a track, whose first detection this may be, a missed detection for every frame since then that it has no evidence
/// from, except frames that are still to be associated again. What was missed before the first detection is no evidence;
/// should an earlier detection arrive, it is added then.
fn add_missed_detections<F: Filter>(
    track: &mut Track<F>,
    first: &Evidence,
    retracted: &[FrameSlot],
    context: &TrackContext<'_>,
) {
    for (slot, frame) in context.frames.since(first.captured_at) {
        let Some(coverage) = &frame.coverage else { continue };
        if slot == first.frame
            || retracted.contains(&slot)
            || track.has_evidence_from(frame.captured_at, slot)
        {
            continue;
        }
        // Approximate: whether it was covered is decided when the evidence is evaluated.
        if coverage.may_cover(track.latest().state.rough_position().0) {
            track.insert(Evidence::missed(frame.captured_at, slot), None, context);
        }
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    vec![("tracker.most_at_birth_m2", MOST_AT_BIRTH.to_string())]
}
