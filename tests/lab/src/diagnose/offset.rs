//! Sensors whose map frames differ: the objects of one lie beside those of the other by one constant translation.
//!
//! Differences of positions between simultaneous detections of two sensors are counted in a grid of translations. Where
//! both use one map frame, the translation zero has most of them. Another peak is an offset only where it explains most
//! detections, zero explains few, and the objects were at several places: two parked neighbours, of which each sensor sees
//! one, are no offset.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use v2x_common::class::Class;
use v2x_common::detection::DetectionFrame;
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};

/// Frames captured within this are simultaneous: half the interval of 10 Hz, and some jitter.
const SIMULTANEOUS: Span = Span::from_millis(60);
/// Frames of a sensor that wait for late ones of others: over a second at 10 Hz.
const N_RECENT: usize = 16;
/// Sensors that are compared; a log of more has other problems.
const MAX_SENSORS: usize = 16;
/// Translations along an axis are counted up to this, m.
const REACH_M: f64 = 10.0;
/// Edge of a cell of the grid, m.
const CELL_M: f64 = 0.5;
const N_CELLS: usize = 41;
/// Edge of the places at which objects were, m.
const PLACE_M: f64 = 5.0;
/// Objects must have been at so many places.
const MIN_PLACES: usize = 4;
/// Fewest differences at the peak.
const MIN_PAIRS: u64 = 20;
/// Least share of the detections that the peak explains.
const MIN_SHARE: f64 = 0.5;
/// The peak must have so many times the differences of zero.
const MIN_RATIO: u64 = 3;
/// Least offset, m, and in standard deviations of a difference.
const MIN_OFFSET_M: f64 = 1.0;
const MIN_OFFSET_SIGMAS: f64 = 3.0;

/// A constant translation between two sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Offset {
    /// Two sensors.
    pub sensors: [AgentId; 2],
    /// How far the second one's objects lie east and north of the first one's, m.
    pub by_m: [f64; 2],
    /// Share of the first one's detections near any of the second one's that it explains.
    pub share: f64,
}

/// A detection, as far as it is needed.
#[derive(Clone, Copy, Debug)]
struct Spot {
    at: [f64; 2],
    variance: f64,
    class: Class,
}

#[derive(Clone, Debug)]
struct Recent {
    captured_at: Timestamp,
    spots: Vec<Spot>,
}

/// Counts translations between all pairs of sensors.
#[derive(Clone, Debug, Default)]
pub(crate) struct OffsetSearch {
    recent: BTreeMap<AgentId, VecDeque<Recent>>,
    pairs: BTreeMap<[AgentId; 2], Grid>,
}

/// Differences of two sensors by translation.
#[derive(Clone, Debug, Default)]
struct Grid {
    cells: BTreeMap<(usize, usize), Cell>,
    /// Detections of the first sensor with any of the second one in reach.
    opportunities: u64,
    variance_sum: f64,
    n: u64,
}

#[derive(Clone, Debug, Default)]
struct Cell {
    n: u64,
    sum_m: [f64; 2],
    /// Some of the places of the first sensor's detections.
    places: BTreeSet<[i64; 2]>,
}

impl OffsetSearch {
    /// Adds a frame.
    pub(crate) fn add(&mut self, frame: &DetectionFrame) {
        let (sensor, captured_at) = (frame.id.agent, frame.captured_at);
        let is_known = self.recent.contains_key(&sensor);
        if frame.detections.is_empty() || (!is_known && self.recent.len() >= MAX_SENSORS) {
            return;
        }
        let spots: Vec<_> = frame
            .detections
            .iter()
            .map(|one| {
                let position = one.covariance.position;
                let variance = f64::midpoint(position.xx, position.yy);
                Spot { at: [one.bev.x, one.bev.y], variance, class: one.class }
            })
            .collect();
        for (other, frames) in self.recent.iter().filter(|(other, _)| **other != sensor) {
            let off = |recent: &&Recent| (recent.captured_at - captured_at).abs();
            let nearest = frames.iter().min_by_key(off).filter(|recent| off(recent) <= SIMULTANEOUS);
            let Some(nearest) = nearest else { continue };
            if sensor < *other {
                self.pairs.entry([sensor, *other]).or_default().add(&spots, &nearest.spots);
            } else {
                self.pairs.entry([*other, sensor]).or_default().add(&nearest.spots, &spots);
            }
        }
        let frames = self.recent.entry(sensor).or_default();
        if frames.len() >= N_RECENT {
            frames.pop_front();
        }
        frames.push_back(Recent { captured_at, spots });
    }

    /// The offsets found, by pair.
    pub(crate) fn offsets(&self) -> Vec<Offset> {
        let found = self.pairs.iter().filter_map(|(sensors, grid)| {
            let (by_m, share) = grid.offset()?;
            Some(Offset { sensors: *sensors, by_m, share })
        });
        found.collect()
    }
}

impl Grid {
    fn add(&mut self, first: &[Spot], second: &[Spot]) {
        for a in first {
            let mut is_near = false;
            for b in second.iter().filter(|b| a.class.is_compatible_with(b.class)) {
                let by_m = [b.at[0] - a.at[0], b.at[1] - a.at[1]];
                let [Some(x), Some(y)] = by_m.map(cell) else { continue };
                is_near = true;
                let cell = self.cells.entry((x, y)).or_default();
                cell.n += 1;
                cell.sum_m = [cell.sum_m[0] + by_m[0], cell.sum_m[1] + by_m[1]];
                if cell.places.len() < MIN_PLACES {
                    cell.places.insert(a.at.map(place));
                }
                self.variance_sum += a.variance + b.variance;
                self.n += 1;
            }
            self.opportunities += u64::from(is_near);
        }
    }

    /// The cell and its neighbours together.
    fn around(&self, (x, y): (usize, usize)) -> Cell {
        let mut sum = Cell::default();
        for x in x.saturating_sub(1)..=x + 1 {
            for cell in self.cells.range((x, y.saturating_sub(1))..=(x, y + 1)).map(|(_, cell)| cell) {
                sum.n += cell.n;
                sum.sum_m = [sum.sum_m[0] + cell.sum_m[0], sum.sum_m[1] + cell.sum_m[1]];
                sum.places.extend(&cell.places);
            }
        }
        sum
    }

    /// The translation, and the share of detections that it explains.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    fn offset(&self) -> Option<([f64; 2], f64)> {
        let peak = self.cells.keys().map(|key| self.around(*key)).max_by_key(|cell| cell.n)?;
        let zero = self.around((N_CELLS / 2, N_CELLS / 2));
        let by_m = peak.sum_m.map(|sum| sum / peak.n as f64);
        let share = peak.n as f64 / self.opportunities as f64;
        let sigma_m = libm::sqrt(self.variance_sum / self.n as f64);
        let is_far = libm::hypot(by_m[0], by_m[1]) > MIN_OFFSET_M.max(MIN_OFFSET_SIGMAS * sigma_m);
        let is_clear = peak.n >= MIN_PAIRS && peak.n >= MIN_RATIO * zero.n && share >= MIN_SHARE;
        (is_far && is_clear && peak.places.len() >= MIN_PLACES).then_some((by_m, share.min(1.0)))
    }
}

/// The cell of a translation along one axis; `None` out of reach.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 40")]
fn cell(by_m: f64) -> Option<usize> {
    (by_m.abs() <= REACH_M).then(|| libm::round((by_m + REACH_M) / CELL_M) as usize)
}

#[expect(clippy::cast_possible_truncation, reason = "coordinates are limited")]
fn place(coordinate_m: f64) -> i64 {
    libm::floor(coordinate_m / PLACE_M) as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::covariance::{BoxCovariance, Covariance2};
    use v2x_common::detection::Detection;
    use v2x_common::geometry::BevBox;
    use v2x_common::id::FrameId;

    /// A frame with cars at these places, which err by a few decimetres.
    fn frame(sensor: &str, k: u32, cars: &[(f64, f64)]) -> DetectionFrame {
        let id = FrameId { agent: AgentId::new(sensor).unwrap(), epoch: 0, sequence: k.into() };
        let error = 0.2 * libm::sin(f64::from(k) * if sensor == "a" { 1.0 } else { 2.3 });
        let detection = |&(x, y): &(f64, f64)| Detection {
            class: Class::Car,
            score: 1.0,
            bev: BevBox { x: x + error, y: y - error, w: 1.8, d: 4.5, yaw: 0.0 },
            covariance: BoxCovariance { position: Covariance2::isotropic(0.04), ww: 0.1, dd: 0.1, yaw: 0.1 },
            velocity: None,
            heading: v2x_common::detection::HeadingKind::Known,
            source_track: None,
        };
        let captured_at = Timestamp::EPOCH + Span::from_millis(100 * i64::from(k));
        DetectionFrame {
            detections: cars.iter().map(detection).collect(),
            ..DetectionFrame::empty(id, captured_at)
        }
    }

    /// What is found of 60 frames of each sensor; the second one's arrive two frames late.
    fn found(a: impl Fn(f64) -> Vec<(f64, f64)>, b: impl Fn(f64) -> Vec<(f64, f64)>) -> Vec<Offset> {
        let mut search = OffsetSearch::default();
        for k in 0..60 {
            search.add(&frame("a", k, &a(0.1 * f64::from(k))));
            if let Some(late) = k.checked_sub(2) {
                search.add(&frame("b", late, &b(0.1 * f64::from(late))));
            }
        }
        search.offsets()
    }

    #[test]
    fn a_constant_translation_of_a_driving_car_is_found() {
        let offsets = found(|t| vec![(8.0 * t, 0.0)], |t| vec![(8.0 * t - 0.6, 1.5)]);
        let [Offset { by_m: [x, y], share, .. }] = offsets.as_slice() else { panic!("{offsets:?}") };
        assert!((x + 0.6).abs() < 0.1 && (y - 1.5).abs() < 0.1 && *share > 0.9, "{offsets:?}");
    }

    #[test]
    fn traffic_in_one_map_frame_has_no_offset() {
        // Two lanes in both directions and a row of parked cars; each sensor misses some.
        let traffic = |t: f64| {
            let mut cars = vec![(8.0 * t, 0.0), (60.0 - 9.0 * t, 3.5), (8.0 * t - 6.5, 0.0)];
            cars.extend((0..8).map(|k| (6.0 * f64::from(k), 7.0)));
            cars
        };
        assert_eq!(found(traffic, |t| traffic(t).split_off(1)), []);
    }

    #[test]
    fn parked_neighbours_that_only_one_sensor_sees_are_no_offset() {
        assert_eq!(found(|_| vec![(10.0, 0.0)], |_| vec![(10.0, 2.5)]), []);
    }

    #[test]
    fn an_offset_within_the_stated_errors_is_none() {
        assert_eq!(found(|t| vec![(8.0 * t, 0.0)], |t| vec![(8.0 * t, 0.7)]), []);
    }
}
