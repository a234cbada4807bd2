//! The candidate pairs of a frame, listed by track.

use super::class_cost::may_be_of;
use super::config::{AssociationConfig, AssociationCost, ClassRule, EUCLIDEAN_REACH_M};
use super::gate::Separation;
use super::gate::{distance2, for_gate, place_for_gate, track_for_gate};
use super::grid::{Grid, Pairs, Spot};
use crate::values::Measurement;
use crate::values::overlap::Footprint;
use crate::values::{ExpectedPlace, PredictedMeasurement};
use v2x_common::covariance::Covariance2;
use v2x_common::geometry::BevBox;

/// The candidates of one frame, with the buffers for the next.
#[derive(Debug, Default)]
pub(super) struct Candidates {
    reported: Vec<Spot>,
    expected: Vec<Spot>,
    grid: Grid,
    /// Pairs that may be within the gate.
    near: Pairs,
    /// Those of track i are places[starts[i]..starts[i + 1]].
    starts: Vec<u32>,
    places: Vec<u32>,
    /// Of how many tracks each measurement is a candidate.
    rivals: Vec<u32>,
    /// Filled where the overlap is the cost.
    pub outlines: Outlines,
}

/// The boxes' outlines.
#[derive(Debug, Default)]
pub(super) struct Outlines {
    reported: Vec<Footprint>,
    expected: Vec<Footprint>,
}

impl Outlines {
    fn fill(&mut self, measurements: &[Measurement], expected: &[PredictedMeasurement]) {
        let outline = |[x, y]: [f64; 2], [w, d]: [f64; 2], yaw| Footprint::of(&BevBox { x, y, w, d, yaw });
        self.reported.clear();
        self.reported.extend(measurements.iter().map(|z| outline(z.position, z.size, z.yaw)));
        self.expected.clear();
        self.expected.extend(expected.iter().map(|track| outline(track.position, track.size, track.yaw)));
    }

    /// The overlap of a track's box and a measurement's.
    pub(super) fn iou(&self, track: u32, place: u32) -> f64 {
        self.expected[track as usize].iou(&self.reported[place as usize])
    }
}

impl Candidates {
    /// The places of the candidate measurements of each track, in order.
    pub(super) fn by_track(&self) -> impl Iterator<Item = &[u32]> {
        self.starts.windows(2).map(|bounds| &self.places[bounds[0] as usize..bounds[1] as usize])
    }

    /// Those of one track.
    pub(super) fn of(&self, track: usize) -> &[u32] {
        &self.places[self.starts[track] as usize..self.starts[track + 1] as usize]
    }

    /// How many tracks there are.
    pub(super) fn n_expected(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// How many pairs there are.
    pub(super) fn len(&self) -> usize {
        self.places.len()
    }

    /// Of how many tracks a measurement may be.
    pub(super) fn rivals(&self, place: u32) -> u32 {
        self.rivals[place as usize]
    }

    /// Finds them.
    pub(super) fn find(
        &mut self,
        measurements: &[Measurement],
        expected: &[PredictedMeasurement],
        config: &AssociationConfig,
    ) {
        let ignores_class = config.classes == ClassRule::Ignored;
        let confusable = config.classes == ClassRule::Evidence && config.cost == AssociationCost::Likelihood;
        // Here and below `&` for `&&`: an unpredictable condition should not be a branch.
        let fits_class = |z: &Measurement, track: &PredictedMeasurement| {
            let is_confused = || confusable && may_be_of(z, track);
            ignores_class || z.class.is_compatible_with(track.class) || is_confused()
        };
        let pair = |track: u32, place: u32| (&measurements[place as usize], &expected[track as usize]);
        match config.cost {
            AssociationCost::Csba | AssociationCost::Likelihood => {
                let spread = |p: &Covariance2| [p.xx, p.yy];
                let by_positions = config.turned_headings;
                let reach = |track: &PredictedMeasurement| match &track.by_positions {
                    Some(other) if by_positions => reach_of_both(track, other, config.gate),
                    _ => spread(&track_for_gate(track)),
                };
                self.place(
                    measurements.iter().map(|z| (z.position, spread(&for_gate(z)))),
                    expected.iter().map(|track| (track.position, reach(track))),
                );
                self.gather(config.gate, |_, track, place| {
                    let (z, track) = pair(track, place);
                    let is_near = Separation::to_gate(z, track).is_within(config.gate);
                    let is_elsewhere = || {
                        by_positions
                            && track
                                .by_positions
                                .as_ref()
                                .is_some_and(|other| Separation::to_gate_of(z, other).is_within(config.gate))
                    };
                    fits_class(z, track) & (is_near || is_elsewhere())
                });
            }
            AssociationCost::Iou => {
                self.outlines.fill(measurements, expected);
                let spread = |[w, d]: [f64; 2]| [(w * w + d * d) / 4.0; 2];
                self.place(
                    measurements.iter().map(|z| (z.position, spread(z.size))),
                    expected.iter().map(|track| (track.position, spread(track.size))),
                );
                // The circles around two boxes reach a + b, and (a + b)² ≤ 2 (a² + b²).
                self.gather(2.0, |outlines, track, place| {
                    let (z, expected) = pair(track, place);
                    fits_class(z, expected) && outlines.iou(track, place) > 0.0
                });
            }
            AssociationCost::Euclidean => {
                let reach2 = EUCLIDEAN_REACH_M * EUCLIDEAN_REACH_M;
                self.place(
                    measurements.iter().map(|z| (z.position, [0.0; 2])),
                    expected.iter().map(|track| (track.position, [reach2; 2])),
                );
                self.gather(1.0, |_, track, place| {
                    let (z, track) = pair(track, place);
                    fits_class(z, track) & (distance2(z.position, track.position) <= reach2)
                });
            }
        }
    }

    /// Notes positions and spreads for the grid.
    fn place(
        &mut self,
        reported: impl Iterator<Item = ([f64; 2], [f64; 2])>,
        expected: impl Iterator<Item = ([f64; 2], [f64; 2])>,
    ) {
        let spot = |(position, spread)| Spot { position, spread };
        self.reported.clear();
        self.reported.extend(reported.map(spot));
        self.expected.clear();
        self.expected.extend(expected.map(spot));
    }

    /// Lists for each track the measurements near it that `fits` accepts.
    fn gather(&mut self, scale: f64, fits: impl Fn(&Outlines, u32, u32) -> bool) {
        let Self { reported, expected, grid, near, starts, places, rivals, outlines } = self;
        grid.fill(scale, reported, expected);
        grid.pairs(expected, near);
        rivals.clear();
        rivals.resize(reported.len(), 0);
        starts.clear();
        starts.resize(expected.len() + 1, 0);
        places.clear();
        places.resize(near.as_slice().len(), 0);
        let mut count = 0;
        for &[track, place] in near.as_slice() {
            let fits = fits(outlines, track, place);
            places[count] = place;
            count += usize::from(fits);
            rivals[place as usize] += u32::from(fits);
            starts[track as usize + 1] += u32::from(fits);
        }
        places.truncate(count);
        for track in 0..expected.len() {
            starts[track + 1] += starts[track];
            let of_track = starts[track] as usize..starts[track + 1] as usize;
            if of_track.len() > 1 {
                places[of_track].sort_unstable();
            }
        }
    }
}

/// The spread about a track's place that holds another place and its spread, too, m².
fn reach_of_both(track: &PredictedMeasurement, other: &ExpectedPlace, gate: f64) -> [f64; 2] {
    let own = track_for_gate(track);
    let others = place_for_gate(other);
    let off = |axis: usize| {
        let off_m = other.position[axis] - track.position[axis];
        off_m * off_m / gate
    };
    // (a + b)² ≤ 2 (a² + b²).
    [own.xx.max(2.0 * (others.xx + off(0))), own.yy.max(2.0 * (others.yy + off(1)))]
}
