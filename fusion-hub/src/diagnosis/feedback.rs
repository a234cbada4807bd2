//! Whether an agent publishes the hub's own objects: then its detections are, to the last digit, where a list had them.
//!
//! What stands may be at the same place in both where reports are exact; so only what moves counts, which is never twice at one place.

use super::observation::Observation;
use std::collections::VecDeque;
use v2x_common::fused::FusedFrame;
use v2x_common::time::{Span, Timestamp};

/// Lists that are remembered, and for how long; and objects of one.
const N_LISTS: usize = 8;
const REMEMBERED: Span = Span::from_millis(1_500);
const MAX_OBJECTS: usize = 256;
/// An object moves from this speed on, m/s.
const MOVING_MPS: f64 = 1.0;
/// Detections of a frame that are looked for.
const MAX_DETECTIONS: usize = 64;
/// The same place, m: on the wire lists hold whole millimetres.
const SAME_M: f64 = 6e-4;
/// Objects of one list in a frame that are no chance.
const LEAST_FOUND: usize = 2;

/// Where moving objects of the newest lists were.
#[derive(Clone, Debug, Default)]
pub(super) struct Published {
    /// By x, with when each list was made.
    lists: VecDeque<(Timestamp, Vec<[f64; 2]>)>,
}

impl Published {
    /// Takes in a list.
    pub(super) fn note(&mut self, list: &FusedFrame) {
        let mut places = match self.lists.len() >= N_LISTS {
            true => self.lists.pop_front().map(|(_, places)| places).unwrap_or_default(),
            false => Vec::new(),
        };
        places.clear();
        let moving = list.objects.iter().filter(|object| {
            let (vx, vy) = object.velocity;
            libm::hypot(vx, vy) >= MOVING_MPS
        });
        places.extend(moving.take(MAX_OBJECTS).map(|object| [object.bev.x, object.bev.y]));
        places.sort_by(|a, b| a[0].total_cmp(&b[0]));
        self.lists.push_back((list.fused_at, places));
    }

    /// Whether a frame holds objects of a list.
    pub(super) fn has_made(&self, seen: &Observation<'_>) -> bool {
        let recent = self.lists.iter().filter(|(at, _)| (seen.received_at - *at).abs() <= REMEMBERED);
        recent.map(|(_, places)| places).any(|places| {
            let detections = seen.frame.detections.iter().take(MAX_DETECTIONS);
            detections.filter(|one| is_among([one.bev.x, one.bev.y], places)).count() >= LEAST_FOUND
        })
    }
}

fn is_among([x, y]: [f64; 2], places: &[[f64; 2]]) -> bool {
    let from = places.partition_point(|place| place[0] < x - SAME_M);
    let near = places[from..].iter().take_while(|place| place[0] <= x + SAME_M);
    near.into_iter().any(|place| (place[1] - y).abs() <= SAME_M)
}
