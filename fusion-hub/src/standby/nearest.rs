//! Which objects of two lists are the same: those that are the nearest to each other.

use v2x_common::fused::FusedObject;
use v2x_common::id::TrackId;
use v2x_common::time::Span;

/// Two hubs that take in the same frames differ by little; by as much as their uncertainty when one of them has just started.
const NEAR_M: f64 = 1.0;
/// However uncertain they are.
const FAR_M: f64 = 5.0;

/// An object of a list: where it is, and how uncertain that is.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Place {
    pub(super) track: TrackId,
    /// East and north, m.
    position: (f64, f64),
    /// m/s.
    velocity: (f64, f64),
    /// Sum of the variances of the position, m².
    variance: f64,
}

impl Place {
    pub(super) fn of(object: &FusedObject) -> Self {
        Self {
            track: object.track,
            position: (object.bev.x, object.bev.y),
            velocity: object.velocity,
            variance: object.kinematic_covariance[0] + object.kinematic_covariance[4],
        }
    }

    /// The place some time later, at constant velocity.
    pub(super) fn after(&self, time: Span) -> Self {
        let seconds = time.as_secs_f64();
        let (x, y) = self.position;
        Self { position: (x + self.velocity.0 * seconds, y + self.velocity.1 * seconds), ..*self }
    }

    /// How far apart the two are, m², where that is within so many gates.
    pub(super) fn within(&self, other: &Self, gates: f64) -> Option<f64> {
        let (dx, dy) = (self.position.0 - other.position.0, self.position.1 - other.position.1);
        let squared = dx * dx + dy * dy;
        let gate = gates * (NEAR_M + libm::sqrt(self.variance + other.variance)).min(FAR_M);
        (squared <= gate * gate).then_some(squared)
    }
}

/// Pairs of objects that are the nearest to each other and within the gate: places in the first and in the second list.
pub(super) fn mutually_nearest(first: &[Place], second: &[Place]) -> Vec<(usize, usize)> {
    let mut by_x: Vec<usize> = (0..second.len()).collect();
    by_x.sort_by(|one, other| second[*one].position.0.total_cmp(&second[*other].position.0));
    let mut of_first = vec![None; first.len()];
    let mut of_second = vec![None; second.len()];
    for (i, place) in first.iter().enumerate() {
        let x = place.position.0;
        let begin = by_x.partition_point(|j| second[*j].position.0 < x - FAR_M);
        for &j in by_x[begin..].iter().take_while(|j| second[**j].position.0 <= x + FAR_M) {
            let Some(distance) = place.within(&second[j], 1.0) else { continue };
            keep_nearer(&mut of_first[i], distance, j);
            keep_nearer(&mut of_second[j], distance, i);
        }
    }
    let is_mutual = |(i, nearest): (usize, &Option<(f64, usize)>)| {
        let (_, j) = (*nearest)?;
        of_second[j].is_some_and(|(_, back)| back == i).then_some((i, j))
    };
    of_first.iter().enumerate().filter_map(is_mutual).collect()
}

/// Of two that are as near the first one in its list counts, in whatever order they are looked at.
fn keep_nearer(nearest: &mut Option<(f64, usize)>, distance: f64, place: usize) {
    if nearest.is_none_or(|(least, at)| distance < least || (distance == least && place < at)) {
        *nearest = Some((distance, place));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(number: u32, x: f64, variance: f64) -> Place {
        Place { track: TrackId::new(1, number), position: (x, 0.0), velocity: (10.0, 0.0), variance }
    }

    #[test]
    fn a_standby_pairs_only_objects_that_are_the_nearest_to_each_other() {
        let first = [place(0, 0.0, 0.01), place(1, 0.6, 0.01), place(2, 50.0, 0.01)];
        let second = [place(0, 51.5, 0.01), place(1, 0.5, 0.01)];
        assert_eq!(mutually_nearest(&first, &second), [(1, 1)], "0 is near it, too, and 2 is 1.5 m off");
        assert_eq!(mutually_nearest(&[place(2, 50.0, 0.3)], &second), [(0, 0)], "less certain");
        assert!(mutually_nearest(&[place(2, 40.0, 1e9)], &second).is_empty(), "beyond any gate");
        assert!(mutually_nearest(&[place(2, f64::NAN, 0.0)], &second).is_empty());
    }

    #[test]
    fn a_place_that_a_standby_looks_at_moves_on_with_its_velocity() {
        assert!(
            place(0, 0.0, 0.0).after(Span::from_millis(-100)).within(&place(0, -1.0, 0.0), 1e-9).is_some()
        );
    }
}
