//! The fused list against the truth at `fused_at`.

use crate::data::run_log::ReceivedFused;
use crate::data::scene::TrueBox;
use crate::score::continuity::TrackContinuity;
use crate::score::coverage::Coverage;
use crate::score::estimate::Estimate;
use crate::score::frame_metrics::{Tally, frame_metrics};
use crate::score::matching::{Frame, MatchingRule, PositionRule};
use crate::score::run::summary::FusedSummary;
use crate::score::run::window::Window;
use v2x_fusion_hub::association::assignment::Assigner;

/// The score of the fused frames.
pub(super) struct FusedScore {
    pub(super) summary: FusedSummary,
    pub(super) frame_errors: Vec<(usize, f64)>,
    pub(super) frame_nees: Vec<(usize, f64)>,
}

/// Scores every fused frame of the window.
pub(super) fn score(
    fused: &[ReceivedFused],
    window: Window,
    match_radius_m: f64,
    coverage: &mut Coverage<'_>,
) -> FusedScore {
    let (mut tally, mut common_tally) = (Tally::default(), Tally::default());
    let mut continuity = TrackContinuity::default();
    let (mut frame_errors, mut frame_nees) = (Vec::new(), Vec::new());
    let mut assigner = Assigner::default();
    for (place, received) in fused.iter().enumerate().filter(|(_, r)| window.contains(r.frame.fused_at)) {
        let frame = &received.frame;
        let view = coverage.at(frame.fused_at);
        let estimates: Vec<_> = frame.objects.iter().map(Estimate::from).collect();
        let truth: Vec<_> = view.objects.iter().map(TrueBox::from).collect();
        let counts: Vec<_> = truth.iter().map(|object| coverage.is_covered(&view, object.id)).collect();
        let scored = Frame { estimates: &estimates, truth: &truth, counts: &counts };
        let rule = PositionRule { radius_m: Some(match_radius_m), is_class_aware: false };
        let matching = scored.matched(MatchingRule::ByPosition(rule), &mut assigner);
        let metrics = frame_metrics(&scored, &matching, match_radius_m, &mut assigner);
        frame_errors.extend(metrics.ate_m().map(|ate_m| (place, ate_m)));
        frame_nees.extend(metrics.nees_position.map(|nees| (place, nees)));
        tally.add(&metrics);
        continuity.add(&frame.objects, &truth, &matching);
        let common = matching.restricted_to(
            |place| coverage.is_common(&view, truth[place].id),
            |index| coverage.all_see(&view, estimates[index].bev.x, estimates[index].bev.y),
        );
        common_tally.add(&frame_metrics(&scored, &common, match_radius_m, &mut assigner));
    }
    let summary = FusedSummary {
        metrics: tally.metrics(),
        common: common_tally.metrics(),
        tracks: continuity.summary(),
    };
    FusedScore { summary, frame_errors, frame_nees }
}
