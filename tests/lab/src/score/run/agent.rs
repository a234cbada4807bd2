//! One agent's raw detections against the truth at `captured_at`, matched by provenance.
//!
//! A vehicle's report of itself is ignored: it comes from its pose, not from its sensor.

use crate::data::run_log::{ReceivedDetections, RunLog};
use crate::data::scene::TrueBox;
use crate::score::coverage::Coverage;
use crate::score::estimate::Estimate;
use crate::score::frame_metrics::{Metrics, Tally, frame_metrics};
use crate::score::matching::{Frame, MatchingRule, Repeats};
use crate::score::run::error::ScoreError;
use crate::score::run::window::Window;
use v2x_agent::truth::TrueObject;
use v2x_fusion_hub::association::assignment::Assigner;

/// Scores every detection frame of the window that the observer at `place` sent: over all objects that it covers, and
/// over those that all agents cover.
pub(super) fn score(
    log: &RunLog,
    place: usize,
    window: Window,
    match_radius_m: f64,
    coverage: &mut Coverage<'_>,
) -> Result<(Metrics, Metrics), ScoreError> {
    let agent = coverage.observers()[place].agent;
    let (mut tally, mut common_tally) = (Tally::default(), Tally::default());
    let mut assigner = Assigner::default();
    let ours = log.detections.iter().filter(|received| received.frame.id.agent == agent);
    for received in ours.filter(|received| window.contains(received.frame.captured_at)) {
        let view = coverage.at(received.frame.captured_at);
        let places = places_in_truth(received, &view.objects)?;
        let estimates: Vec<_> = received.frame.detections.iter().map(Estimate::from).collect();
        let truth: Vec<_> = view.objects.iter().map(TrueBox::from).collect();
        let holds = |object: &TrueObject| view.held[place].binary_search(&object.id).is_ok();
        let counts: Vec<_> = view.objects.iter().map(holds).collect();
        let frame = Frame { estimates: &estimates, truth: &truth, counts: &counts };
        let rule = MatchingRule::ByProvenance { places: &places, repeats: Repeats::ClosestIsMatched };
        let matching = frame.matched(rule, &mut assigner);
        tally.add(&frame_metrics(&frame, &matching, match_radius_m, &mut assigner));
        let common = matching.restricted_to(
            |object| coverage.is_common(&view, truth[object].id),
            |index| coverage.all_see(&view, estimates[index].bev.x, estimates[index].bev.y),
        );
        common_tally.add(&frame_metrics(&frame, &common, match_radius_m, &mut assigner));
    }
    Ok((tally.metrics(), common_tally.metrics()))
}

/// Each detection's place in the truth (by id), `None` for clutter.
fn places_in_truth(
    received: &ReceivedDetections,
    truth: &[TrueObject],
) -> Result<Vec<Option<usize>>, ScoreError> {
    let (frame, identities) = (&received.frame, &received.identities.objects);
    let agent = frame.id.agent;
    if identities.len() != frame.detections.len() {
        let (detections, identities) = (frame.detections.len(), identities.len());
        return Err(ScoreError::Identities { agent, sequence: frame.id.sequence, detections, identities });
    }
    let place = |identity: &Option<_>| match *identity {
        None => Ok(None),
        Some(object) => match truth.binary_search_by_key(&object, |is| is.id) {
            Ok(place) => Ok(Some(place)),
            Err(_) => Err(ScoreError::NotInTruth { agent, object, at: frame.captured_at }),
        },
    };
    identities.iter().map(place).collect()
}
