//! Tracks whose bodies overlap: two vehicles cannot be at one place, whatever the frames hold.

use crate::filter::Filter;
use crate::track::Track;
use crate::values::Body;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use v2x_common::geometry::BevBox;
use v2x_common::id::TrackId;
use v2x_common::time::{Span, Timestamp};

/// How often tracks are compared.
const EVERY: Span = Span::from_millis(250);
/// Two tracks that have overlapped for this long are one.
const MERGED_AFTER: Span = Span::from_millis(500);

/// Finds tracks that overlap.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(crate) struct Exclusion {
    compared_at: Option<Timestamp>,
    /// Since when two tracks overlap, the older track first.
    since: BTreeMap<(TrackId, TrackId), Timestamp>,
    /// The younger ones of these, in order.
    hidden: Vec<TrackId>,
    /// The memory is used again.
    candidates: Vec<Candidate>,
}

/// A body that may exclude others.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Candidate {
    id: TrackId,
    initiated_at: Timestamp,
    body: Body,
    /// Along x, m.
    from: f64,
    to: f64,
}

impl Exclusion {
    /// Compares tracks at a capture time, where that is due. Pairs that are to be merged are added to `found`, the older
    /// track first.
    pub(crate) fn observe<F: Filter>(
        &mut self,
        at: Timestamp,
        tracks: &[Track<F>],
        found: &mut Vec<(TrackId, TrackId)>,
    ) {
        if self.compared_at.is_some_and(|compared_at| at - compared_at < EVERY) {
            return;
        }
        self.compared_at = Some(at);
        let mut candidates = std::mem::take(&mut self.candidates);
        candidates.clear();
        candidates.extend(tracks.iter().filter_map(|track| candidate(track, at)));
        candidates.sort_unstable_by(|a, b| a.from.total_cmp(&b.from).then(a.id.cmp(&b.id)));
        let before = std::mem::take(&mut self.since);
        self.hidden.clear();
        for (place, one) in candidates.iter().enumerate() {
            let near = candidates[place + 1..].iter().take_while(|other| other.from <= one.to);
            for other in near.filter(|other| one.body.is_same(&other.body)) {
                let mut pair = [one, other];
                pair.sort_by_key(|candidate| (candidate.initiated_at, candidate.id));
                let key = (pair[0].id, pair[1].id);
                let since = before.get(&key).copied().unwrap_or(at);
                self.since.insert(key, since);
                self.hidden.push(key.1);
                if at - since >= MERGED_AFTER {
                    found.push(key);
                }
            }
        }
        self.hidden.sort_unstable();
        self.candidates = candidates;
    }

    /// Whether a track is not published, because an older one is at its place.
    pub(crate) fn hides(&self, track: TrackId) -> bool {
        self.hidden.binary_search(&track).is_ok()
    }
}

fn candidate<F: Filter>(track: &Track<F>, at: Timestamp) -> Option<Candidate> {
    let latest = track.latest();
    if !track.holders.is_all() || !latest.is_rather_real() {
        return None;
    }
    let state = latest.state.predicted(at, latest.motion_class());
    let predicted = state.predicted_measurement(latest.class());
    let ([x, y], [w, d]) = (predicted.position, predicted.size);
    let p = &predicted.position_covariance;
    let body = Body::of(latest.class(), &BevBox { x, y, w, d, yaw: predicted.yaw }, p.xx.max(p.yy))?;
    let (centre, radius_m) = body.circle();
    let (from, to) = (centre[0] - radius_m, centre[0] + radius_m);
    Some(Candidate { id: track.id, initiated_at: latest.initiated_at, body, from, to })
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    vec![("duplicates.exclusion_merges_after_s", MERGED_AFTER.as_secs_f64().to_string())]
}
