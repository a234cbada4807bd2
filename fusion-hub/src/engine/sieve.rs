//! Impossible detections are dropped, and the rest of their frame is used.
//!
//! A detection is named by its place in the frame as it was sent. So the places of what was dropped are kept, for the
//! measurement ids that are published later.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use v2x_common::detection::{DetectionFrame, InvalidValue};
use v2x_common::fused::FusedObject;
use v2x_common::id::{FrameId, MeasurementId};
use v2x_common::time::{Span, Timestamp};

/// Most frames of which the dropped places are kept.
const MAX_THINNED: usize = 1024;
/// How long they are kept: longer than any track lives without a detection.
const KEPT_FOR: Span = Span::from_millis(60_000);

/// What was left out of one frame.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Thinned {
    seen_at: Timestamp,
    /// Places in the frame as it was sent, in order.
    dropped: Vec<u16>,
}

/// Drops impossible detections.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Sieve {
    /// A frame without its impossible detections; its buffers are used again.
    #[serde(skip)]
    frame: Option<DetectionFrame>,
    thinned: BTreeMap<FrameId, Thinned>,
}

impl Sieve {
    /// The frame without its impossible detections, and `None` where it has none. Each of them is given to `note`. The
    /// frame's buffers come back by [`Self::give_back`].
    pub(super) fn thin(
        &mut self,
        frame: &DetectionFrame,
        mut note: impl FnMut(InvalidValue),
    ) -> Option<(DetectionFrame, Vec<u16>)> {
        let origin = frame.sensor_pose.as_ref();
        let first = frame.detections.iter().position(|one| one.validate(origin).is_err())?;
        let mut thin =
            self.frame.take().unwrap_or_else(|| DetectionFrame::empty(frame.id, frame.captured_at));
        thin.id = frame.id;
        thin.captured_at = frame.captured_at;
        thin.sensor_pose = frame.sensor_pose;
        thin.sensor_revision = frame.sensor_revision;
        thin.map_frame = frame.map_frame;
        thin.detections.clear();
        thin.detections.extend_from_slice(&frame.detections[..first]);
        let mut dropped = Vec::new();
        for (index, detection) in frame.detections.iter().enumerate().skip(first) {
            match detection.validate(origin) {
                Ok(()) => thin.detections.push(*detection),
                Err(invalid) => {
                    note(InvalidValue { index: Some(index), ..invalid });
                    // The number of detections is checked before: it has 13 bits.
                    dropped.extend(u16::try_from(index));
                }
            }
        }
        Some((thin, dropped))
    }

    /// Takes back the buffers of a frame, and the places of what it lacks, where it was accepted at this time.
    pub(super) fn give_back(
        &mut self,
        (frame, dropped): (DetectionFrame, Vec<u16>),
        accepted_at: Option<Timestamp>,
    ) {
        if let Some(seen_at) = accepted_at {
            self.thinned.retain(|_, thinned| seen_at - thinned.seen_at <= KEPT_FOR);
            if self.thinned.len() >= MAX_THINNED {
                let oldest = self.thinned.iter().min_by_key(|(_, thinned)| thinned.seen_at);
                if let Some(oldest) = oldest.map(|(id, _)| *id) {
                    self.thinned.remove(&oldest);
                }
            }
            self.thinned.insert(frame.id, Thinned { seen_at, dropped });
        }
        self.frame = Some(frame);
    }

    /// Names the contributing measurements by their places in the frames as they were sent.
    pub(super) fn name_as_sent(&self, objects: &mut [FusedObject]) {
        if self.thinned.is_empty() {
            return;
        }
        objects.iter_mut().flat_map(|object| &mut object.contributors).for_each(|id| self.restore(id));
    }

    fn restore(&self, id: &mut MeasurementId) {
        let Some(thinned) = self.thinned.get(&id.frame) else { return };
        for dropped in &thinned.dropped {
            if *dropped > id.index {
                return;
            }
            id.index += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::class::Class;
    use v2x_common::covariance::{BoxCovariance, Covariance2};
    use v2x_common::detection::Detection;
    use v2x_common::geometry::BevBox;
    use v2x_common::id::{AgentId, TrackId};

    fn frame(widths_m: &[f64]) -> DetectionFrame {
        let id = FrameId { agent: AgentId::new("a").unwrap(), epoch: 0, sequence: 3 };
        let detection = |w: &f64| Detection {
            class: Class::Car,
            score: 1.0,
            bev: BevBox { x: 0.0, y: 0.0, w: *w, d: 4.0, yaw: 0.0 },
            covariance: BoxCovariance { position: Covariance2::isotropic(0.1), ww: 0.1, dd: 0.1, yaw: 0.1 },
            velocity: None,
            heading: v2x_common::detection::HeadingKind::Known,
            source_track: None,
        };
        DetectionFrame {
            detections: widths_m.iter().map(detection).collect(),
            ..DetectionFrame::empty(id, Timestamp::EPOCH)
        }
    }

    #[test]
    fn impossible_detections_are_dropped_and_the_others_keep_their_names() {
        let mut sieve = Sieve::default();
        assert!(sieve.thin(&frame(&[1.0, 2.0]), |_| unreachable!()).is_none());
        let sent = frame(&[0.0, 2.0, f64::NAN, f64::NAN, 3.0]);
        let mut notes = Vec::new();
        let thinned = sieve.thin(&sent, |invalid| notes.push((invalid.index, invalid.cause()))).unwrap();
        let widths: Vec<_> = thinned.0.detections.iter().map(|one| one.bev.w).collect();
        assert_eq!(widths, [2.0, 3.0]);
        assert_eq!(notes, [(Some(0), "out of range"), (Some(2), "not finite"), (Some(3), "not finite")]);
        sieve.give_back(thinned, Some(Timestamp::EPOCH));
        let contributors = [0, 1].map(|index| MeasurementId { frame: sent.id, index });
        let mut objects = [FusedObject {
            contributors: contributors.to_vec(),
            ..FusedObject::from_box(TrackId(0), Class::Car, sent.detections[1].bev)
        }];
        sieve.name_as_sent(&mut objects);
        let places: Vec<_> = objects[0].contributors.iter().map(|id| id.index).collect();
        assert_eq!(places, [1, 4]);
    }

    #[test]
    fn places_are_kept_of_a_bounded_number_of_frames() {
        let mut sieve = Sieve::default();
        for k in 0..MAX_THINNED as u64 + 10 {
            let mut sent = frame(&[0.0]);
            sent.id.sequence = k;
            let thinned = sieve.thin(&sent, |_| ()).unwrap();
            sieve.give_back(thinned, Some(Timestamp::EPOCH));
        }
        assert_eq!(sieve.thinned.len(), MAX_THINNED);
        let thinned = sieve.thin(&frame(&[0.0]), |_| ()).unwrap();
        sieve.give_back(thinned, Some(Timestamp::EPOCH + KEPT_FOR + KEPT_FOR));
        assert_eq!(sieve.thinned.len(), 1);
    }
}
