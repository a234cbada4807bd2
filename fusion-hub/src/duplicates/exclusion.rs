//! Tracks whose bodies overlap: two bodies cannot be at one place, whatever the frames hold.
//!
//! Of two vehicles on four wheels the younger one is hidden at once. People, and what they ride, pass each other so closely that
//! their boxes overlap for a moment: of these the younger one is hidden where it began at the place of the other, as a doubled
//! detection does, or where the overlap lasts. Their boxes are small against the errors of their positions, so that a mean of
//! several comparisons counts.

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
/// Two vehicles on four wheels that have overlapped for this long are one; of others the younger one is then hidden.
const MERGED_AFTER: Span = Span::from_millis(500);
/// Any others that have overlapped for this long, and in so many comparisons, are one.
const OTHERS_MERGED_AFTER: Span = Span::from_millis(1000);
const OTHERS_COMPARED: u32 = 3;
/// A track that overlaps another one this soon began at its place.
const SOON: Span = Span::from_millis(1000);
/// The mean overlap is that of so many comparisons, about; one counts for this much at most.
const MEAN_OF: u32 = 4;
const MOST_AT_ONCE: f64 = 2.0;
/// Two tracks may be one, or may still be, from this overlap on, where 1 is as much as two bodies can have.
const PERHAPS: f64 = 0.7;

/// Finds tracks that overlap.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(crate) struct Exclusion {
    compared_at: Option<Timestamp>,
    /// Tracks that overlap, the older one first.
    shared: BTreeMap<(TrackId, TrackId), Shared>,
    /// The younger ones of these, in order.
    hidden: Vec<TrackId>,
    /// The memory is used again.
    candidates: Vec<Candidate>,
}

/// What two tracks have had in common.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Shared {
    since: Timestamp,
    mean: f64,
    compared: u32,
    /// Whether it was too much for two bodies.
    is_one: bool,
}

impl Shared {
    /// After a comparison; `None` of what can well be two bodies.
    fn after(before: Option<&Self>, overlap: f64, keeps_clear: bool, at: Timestamp) -> Option<Self> {
        let begun = Self { since: at, mean: 0.0, compared: 0, is_one: false };
        let Self { since, mean, compared, is_one } = *before.unwrap_or(&begun);
        if keeps_clear {
            return (overlap > 1.0).then_some(Self { since, mean: overlap, compared, is_one: true });
        }
        let compared = compared.saturating_add(1);
        let weight = 1.0 / f64::from(compared.min(MEAN_OF));
        let mean = mean + weight * (overlap.min(MOST_AT_ONCE) - mean);
        (mean >= PERHAPS).then_some(Self { since, mean, compared, is_one: is_one || mean >= 1.0 })
    }
}

/// A body that may exclude others.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Candidate {
    id: TrackId,
    initiated_at: Timestamp,
    /// Whether it is rather a real object than none.
    is_real: bool,
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
        let before = std::mem::take(&mut self.shared);
        self.hidden.clear();
        for (place, one) in candidates.iter().enumerate() {
            let near = candidates[place + 1..].iter().take_while(|other| other.from <= one.to);
            for other in near {
                let overlap = one.body.overlap(&other.body);
                if overlap <= 0.0 {
                    continue;
                }
                let mut pair = [one, other];
                pair.sort_by_key(|candidate| (candidate.initiated_at, candidate.id));
                let key = (pair[0].id, pair[1].id);
                let keeps_clear = one.body.keeps_clear_of(&other.body);
                let Some(shared) = Shared::after(before.get(&key), overlap, keeps_clear, at) else {
                    continue;
                };
                self.shared.insert(key, shared);
                let verdict = judge(pair, &shared, at);
                if verdict >= Verdict::Hidden {
                    self.hidden.push(key.1);
                }
                if verdict == Verdict::Merged {
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

/// What is done with the younger one of two tracks at one place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Verdict {
    Published,
    Hidden,
    Merged,
}

fn judge([older, younger]: [&Candidate; 2], shared: &Shared, at: Timestamp) -> Verdict {
    if !older.is_real || !shared.is_one {
        return Verdict::Published;
    }
    let keeps_clear = older.body.keeps_clear_of(&younger.body);
    let lasted = at - shared.since;
    let is_merged = match keeps_clear {
        true => lasted >= MERGED_AFTER,
        false => lasted >= OTHERS_MERGED_AFTER && shared.compared >= OTHERS_COMPARED,
    };
    if is_merged && younger.is_real {
        Verdict::Merged
    } else if keeps_clear || lasted >= MERGED_AFTER || shared.since - younger.initiated_at <= SOON {
        Verdict::Hidden
    } else {
        Verdict::Published
    }
}

fn candidate<F: Filter>(track: &Track<F>, at: Timestamp) -> Option<Candidate> {
    let latest = track.latest();
    if !track.holders.is_all() {
        return None;
    }
    let state = latest.state.predicted(at, latest.motion_class());
    let predicted = state.predicted_measurement(latest.class());
    let ([x, y], [w, d]) = (predicted.position, predicted.size);
    let bev = BevBox { x, y, w, d, yaw: predicted.yaw };
    let body = Body::of(latest.class(), &bev, &predicted.position_covariance)?;
    let (centre, radius_m) = body.circle();
    let (from, to) = (centre[0] - radius_m, centre[0] + radius_m);
    let (id, initiated_at, is_real) = (track.id, latest.initiated_at, latest.is_rather_real());
    Some(Candidate { id, initiated_at, is_real, body, from, to })
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    let [vehicles, others, soon] = [MERGED_AFTER, OTHERS_MERGED_AFTER, SOON].map(Span::as_secs_f64);
    vec![(
        "duplicates.exclusion",
        format!(
            "vehicles merged after {vehicles} s, others after {others} s and {OTHERS_COMPARED}, hidden before if within {soon} s; mean of {MEAN_OF}, each {MOST_AT_ONCE} at most, from {PERHAPS} on"
        ),
    )]
}
