//! Whether the tracks that an agent names are those of objects: a number that stays with one.

use super::observation::Observation;
use std::collections::BTreeMap;
use v2x_common::time::{Span, Timestamp};

/// Numbers that are remembered, and for how long.
const MAX_TRACKS: usize = 512;
const REMEMBERED: Span = Span::from_millis(1_000);
/// What is further from its last place than this and what moves goes there is another object, m and m/s.
const JUMP_M: f64 = 4.0;
const FASTEST_MPS: f64 = 60.0;

/// Of one agent.
#[derive(Clone, Debug, Default)]
pub(super) struct OwnTracks {
    last: BTreeMap<u64, ([f64; 2], Timestamp)>,
    /// Detections under a number that was there within the last second, and those that are too far from where it was.
    pub(super) returned: u64,
    pub(super) jumped: u64,
}

impl OwnTracks {
    pub(super) fn note(&mut self, seen: &Observation<'_>) {
        let now = seen.frame.captured_at;
        if self.last.len() >= MAX_TRACKS {
            self.last.retain(|_, (_, at)| (now - *at).abs() <= REMEMBERED);
        }
        for one in &seen.frame.detections {
            let Some(track) = one.source_track else { continue };
            let place = [one.bev.x, one.bev.y];
            if let Some((was, at)) = self.last.get(&track).filter(|(_, at)| (now - *at).abs() <= REMEMBERED) {
                let reach_m = JUMP_M + FASTEST_MPS * (now - *at).abs().as_secs_f64();
                self.returned += 1;
                self.jumped += u64::from(libm::hypot(place[0] - was[0], place[1] - was[1]) > reach_m);
            }
            if self.last.len() < MAX_TRACKS || self.last.contains_key(&track) {
                self.last.insert(track, (place, now));
            }
        }
    }
}
