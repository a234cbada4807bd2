//! The fused list against the truth at `fused_at`.

use crate::data::run_log::ReceivedFused;
use crate::score::coverage::Coverage;
use crate::score::matching::{Matching, Outcome, match_by_distance};
use crate::score::metrics::{Mean, Prediction, Tally, frame_metrics};
use crate::score::run::summary::{FusedSummary, TrackSummary};
use crate::score::run::window::Window;
use std::collections::{BTreeMap, BTreeSet};
use v2x_agent::truth::{ObjectId, TrueObject};
use v2x_common::covariance::Covariance2;
use v2x_common::fused::FusedObject;
use v2x_common::id::TrackId;
use v2x_fusion_hub::assignment::Assigner;

/// What came of the fused frames.
pub(super) struct FusedScore {
    pub(super) summary: FusedSummary,
    pub(super) frame_errors: Vec<(usize, f64)>,
}

/// Judges every fused frame of the window.
pub(super) fn score(
    fused: &[ReceivedFused],
    window: Window,
    match_radius_m: f64,
    coverage: &mut Coverage<'_>,
) -> FusedScore {
    let (mut tally, mut common_tally) = (Tally::default(), Tally::default());
    let mut keeping = TrackKeeping::default();
    let mut frame_errors = Vec::new();
    let mut assigner = Assigner::default();
    for (place, received) in fused.iter().enumerate().filter(|(_, r)| window.contains(r.frame.fused_at)) {
        let frame = &received.frame;
        let view = coverage.at(frame.fused_at);
        let predictions: Vec<_> = frame.objects.iter().map(prediction).collect();
        let boxes: Vec<_> = frame.objects.iter().map(|object| object.bev).collect();
        let counts: Vec<_> =
            view.objects.iter().map(|object| coverage.is_covered(&view, object.id)).collect();
        let matching = match_by_distance(&boxes, &view.objects, &counts, match_radius_m, &mut assigner);
        let metrics = frame_metrics(&predictions, &view.objects, &matching, match_radius_m, &mut assigner);
        frame_errors.extend(metrics.ate_m.map(|ate_m| (place, ate_m)));
        tally.add(&metrics);
        keeping.add(&frame.objects, &view.objects, &matching);
        let common = matching.restricted_to(
            |place| coverage.is_common(&view, view.objects[place].id),
            |index| coverage.all_see(&view, boxes[index].x, boxes[index].y),
        );
        common_tally.add(&frame_metrics(&predictions, &view.objects, &common, match_radius_m, &mut assigner));
    }
    let summary =
        FusedSummary { metrics: tally.metrics(), common: common_tally.metrics(), tracks: keeping.summary() };
    FusedScore { summary, frame_errors }
}

/// A fused object as it is judged.
pub(crate) fn prediction(object: &FusedObject) -> Prediction {
    // xx, x-y and yy of the upper triangle (v2x_common::fused::KINEMATIC_INDEX).
    let [xx, xy, _, _, yy, ..] = object.kinematic_covariance;
    Prediction { bev: object.bev, position: Covariance2 { xx, xy, yy } }
}

/// Which tracks matched each true object.
#[derive(Debug, Default)]
pub(crate) struct TrackKeeping {
    latest: BTreeMap<ObjectId, TrackId>,
    tracks: BTreeMap<ObjectId, BTreeSet<TrackId>>,
    switches: u64,
}

impl TrackKeeping {
    /// Takes in a frame's objects and their matches.
    pub(crate) fn add(&mut self, objects: &[FusedObject], truth: &[TrueObject], matching: &Matching) {
        for (fused, outcome) in objects.iter().zip(&matching.outcomes) {
            let Outcome::Matched(place) = *outcome else { continue };
            let id = truth[place].id;
            self.tracks.entry(id).or_default().insert(fused.track);
            let before = self.latest.insert(id, fused.track);
            self.switches += u64::from(before.is_some_and(|before| before != fused.track));
        }
    }

    /// What they come to.
    pub(crate) fn summary(&self) -> TrackSummary {
        let mut ids = Mean::default();
        for tracks in self.tracks.values() {
            #[expect(clippy::cast_precision_loss, reason = "a count of tracks")]
            ids.add(Some(tracks.len() as f64));
        }
        TrackSummary {
            objects: self.tracks.len() as u64,
            ids_per_object: ids.value(),
            id_switches: self.switches,
        }
    }
}
