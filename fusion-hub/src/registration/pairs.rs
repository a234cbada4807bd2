//! Which objects of a frame other agents detect, too, at about the same time: read from the assignment.

use super::model::{RegistrationReport, SharedObject, Source};
use super::settings::{LONGEST_GAP, MAX_SHARED_OF_FRAME, REPORTS_FOR_VELOCITY};
use super::slot::RegistrationSlot;
use crate::filter::Filter;
use crate::track::{Evidence, FrameSlot, FrameStore, Track};
use crate::tracker::Assigned;
use serde::{Deserialize, Serialize};
use v2x_common::time::Span;

/// Finds pairs of detections of one object by two agents. Of two agents each detection is compared once, so that no
/// error counts twice.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(crate) struct PairFinder {
    /// By frame slot: the agent, if registration has it.
    sources: Vec<Option<Source>>,
    /// By frame slot, for each detection: the agents with whose detections it was compared, a bit each.
    compared: Vec<Vec<u32>>,
    /// The shared objects of the newest frame.
    #[serde(skip)]
    shared: Vec<SharedObject>,
}

impl PairFinder {
    /// Notes the agent of a frame that has just been stored.
    pub(crate) fn begin_frame(&mut self, slot: FrameSlot, source: Option<Source>, n_detections: usize) {
        self.shared.clear();
        if self.sources.len() <= slot.index() {
            self.sources.resize(slot.index() + 1, None);
            self.compared.resize_with(slot.index() + 1, Vec::new);
        }
        self.sources[slot.index()] = source;
        let compared = &mut self.compared[slot.index()];
        compared.clear();
        if source.is_some() {
            // Spare capacity: memory grows rarely.
            compared.reserve(n_detections.next_power_of_two());
            compared.resize(n_detections, 0);
        }
    }

    /// Finds for each detection of a tracked object one of another agent.
    pub(crate) fn observe<F: Filter>(&mut self, assigned: &Assigned<'_, F>) {
        let Some(source) = self.source_of(assigned.slot) else { return };
        let n = assigned.predictions.len();
        // Where there are more detections than the limit, each frame begins with other ones.
        let offset =
            usize::try_from(assigned.frame.id.sequence).unwrap_or(0).wrapping_mul(MAX_SHARED_OF_FRAME);
        for step in 0..n {
            let place = (offset % n + step) % n;
            let Some(detection) = assigned.detection(place) else { continue };
            let track = assigned.track(place);
            if !track.holders.leads() || track.latest().n_reports < REPORTS_FOR_VELOCITY {
                continue;
            }
            let Some(own) = self.report(&detection, assigned.frames) else { continue };
            let Some((other, partner)) = self.partner_of(track, (&source, &detection), assigned.frames)
            else {
                continue;
            };
            self.note_compared(&detection, partner.source.slot);
            self.note_compared(&other, source.slot);
            let motion = assigned.predictions.state(place).motion();
            self.shared.push(SharedObject { own, partner, motion });
            if self.shared.len() == MAX_SHARED_OF_FRAME {
                break;
            }
        }
    }

    /// The shared objects of the newest frame.
    pub(crate) fn shared(&self) -> &[SharedObject] {
        &self.shared
    }

    /// The most informative detection of another agent: one of a reference where the agent is none (and the other way
    /// round), then the nearest in time, then the first.
    fn partner_of<F: Filter>(
        &self,
        track: &Track<F>,
        (own, detection): (&Source, &Evidence),
        frames: &FrameStore,
    ) -> Option<(Evidence, RegistrationReport)> {
        let mut best: Option<((bool, Span), Evidence)> = None;
        for other in track.detections_near(detection.captured_at, LONGEST_GAP) {
            let Some(source) = self.source_of(other.frame) else { continue };
            let is_used = || self.was_compared(other, own.slot) || self.was_compared(detection, source.slot);
            if source.slot == own.slot || is_used() {
                continue;
            }
            let gap = (other.captured_at - detection.captured_at).abs();
            let order = (source.is_reference == own.is_reference, gap);
            let is_no_track = || frames.held(other).is_some_and(|held| !held.is_track);
            if best.is_none_or(|(known, _)| order < known) && is_no_track() {
                best = Some((order, *other));
            }
        }
        let (_, other) = best?;
        Some((other, self.report(&other, frames)?))
    }

    fn source_of(&self, slot: FrameSlot) -> Option<Source> {
        self.sources.get(slot.index()).copied().flatten()
    }

    /// A detection as registration compares it; `None` for an unknown agent or a foreign track.
    fn report(&self, detection: &Evidence, frames: &FrameStore) -> Option<RegistrationReport> {
        let source = self.source_of(detection.frame)?;
        let z = frames.measurement(detection)?;
        (!z.is_track).then_some(RegistrationReport {
            source,
            captured_at: detection.captured_at,
            position: z.position,
            r: z.r,
            yaw: z.yaw,
            yaw_variance: z.yaw_variance,
        })
    }

    fn was_compared(&self, detection: &Evidence, with: RegistrationSlot) -> bool {
        let compared = self.compared[detection.frame.index()].get(usize::from(detection.index()));
        compared.is_some_and(|agents| agents & (1 << with.index()) != 0)
    }

    fn note_compared(&mut self, detection: &Evidence, with: RegistrationSlot) {
        let compared = &mut self.compared[detection.frame.index()];
        if let Some(agents) = compared.get_mut(usize::from(detection.index())) {
            *agents |= 1 << with.index();
        }
    }
}
