//! Association of one frame with the tracks: gate, cost, optimal assignment.

use super::assignment::Assigner;
use super::candidates::Candidates;
use super::config::{AssociationConfig, AssociationCost, EUCLIDEAN_REACH_M};
use super::gate::distance2;
use super::{csba, likelihood};
use crate::values::{Measurement, PredictedMeasurement};

/// Most candidates of one track, the cheapest: thousands of reports in one place must not stop the hub.
const MOST_EDGES: usize = 16;

/// Associates frames with tracks; holds the buffers.
#[derive(Debug, Default)]
pub struct Associator {
    candidates: Candidates,
    assigner: Assigner,
    /// The tracks that the assigner has to decide on.
    contested: Vec<u32>,
    /// Costs and places of one track's candidates.
    costs: Vec<(f64, u32)>,
    track_of: Vec<Option<u32>>,
    /// Candidates found so far.
    weighed: u64,
}

impl Associator {
    /// Associates a frame: candidates are the pairs of compatible class within the gate; of these the
    /// assignment of least total cost, where a measurement that stays alone costs as much as the worst pair
    /// (for the likelihood: [`likelihood::COST_ALONE`]). Allocates nothing once the buffers have grown.
    pub fn associate(
        &mut self,
        measurements: &[Measurement],
        expected: &[PredictedMeasurement],
        config: &AssociationConfig,
    ) {
        self.find_candidates(measurements, expected, config);
        self.track_of.clear();
        self.track_of.resize(measurements.len(), None);
        let pair = |track: u32, place: u32| (&measurements[place as usize], &expected[track as usize]);
        match config.cost {
            AssociationCost::Csba => self.assign(csba::COST_ALONE, None, |_, track, place| {
                let (z, track) = pair(track, place);
                csba::pair_cost(z, track, &csba::CsbaWeights::PUBLISHED)
            }),
            AssociationCost::Likelihood => {
                let probability = |track: u32| expected[track as usize].report_probability;
                let report_cost = |track| likelihood::report_cost(probability(track));
                self.assign(likelihood::COST_ALONE, Some(&report_cost), |_, track, place| {
                    let (z, track) = pair(track, place);
                    likelihood::pair_cost(z, track, config)
                });
            }
            AssociationCost::Iou => {
                self.assign(1.0, None, |candidates, track, place| {
                    1.0 - candidates.outlines.iou(track, place)
                });
            }
            AssociationCost::Euclidean => self.assign(EUCLIDEAN_REACH_M, None, |_, track, place| {
                let (z, track) = pair(track, place);
                libm::sqrt(distance2(z.position, track.position))
            }),
        }
    }

    /// Finds the pairs of compatible class within the gate, without an assignment.
    pub fn find_candidates(
        &mut self,
        measurements: &[Measurement],
        expected: &[PredictedMeasurement],
        config: &AssociationConfig,
    ) {
        self.candidates.find(measurements, expected, config);
        self.weighed += self.candidates.len() as u64;
    }

    /// How many candidates it has found since it was made.
    pub const fn weighed(&self) -> u64 {
        self.weighed
    }

    /// For each measurement the place in `expected` of its track.
    pub fn track_of(&self) -> &[Option<u32>] {
        &self.track_of
    }

    /// Every pair within the gate, as places in `expected` and in `measurements`, in this order.
    pub fn candidates(&self) -> impl Iterator<Item = (u32, u32)> {
        let by_track = (0..).zip(self.candidates.by_track());
        by_track.flat_map(|(track, places)| places.iter().map(move |place| (track, *place)))
    }

    /// The places of the measurements within the gate of the track at this place in `expected`, in order.
    pub fn candidates_of(&self, expected: usize) -> &[u32] {
        self.candidates.of(expected)
    }

    /// Of how many tracks there are candidates.
    pub fn n_expected(&self) -> usize {
        self.candidates.n_expected()
    }

    /// Of how many tracks the measurement at this place is a candidate.
    pub fn rivals(&self, measurement: u32) -> u32 {
        self.candidates.rivals(measurement)
    }

    /// Decides on the candidates. Where pairs compete, a track's report costs `report_cost` more; where they do not,
    /// a track with a high report probability may still cost less, but none costs more: a track of low existence may
    /// have late data to come. Where it is `None`, no pair costs more than staying alone, and one that competes with
    /// no other is made without evaluating its cost.
    fn assign(
        &mut self,
        cost_alone: f64,
        report_cost: Option<&dyn Fn(u32) -> f64>,
        cost: impl Fn(&Candidates, u32, u32) -> f64,
    ) {
        let Self { candidates, assigner, contested, costs, track_of, .. } = self;
        contested.clear();
        assigner.begin(track_of.len(), cost_alone);
        for (track, places) in (0..).zip(candidates.by_track()) {
            match places {
                [] => {}
                [only] if candidates.rivals(*only) == 1 => {
                    let is_pair = report_cost.is_none_or(|report_cost| {
                        let cost = cost(candidates, track, *only);
                        cost <= cost_alone || cost + report_cost(track) <= cost_alone
                    });
                    if is_pair {
                        track_of[*only as usize] = Some(track);
                    }
                }
                several => {
                    let report_cost = report_cost.map_or(0.0, |cost| cost(track));
                    costs.clear();
                    costs.extend(
                        several.iter().map(|place| (cost(candidates, track, *place) + report_cost, *place)),
                    );
                    if costs.len() > MOST_EDGES {
                        costs.select_nth_unstable_by(MOST_EDGES, |a, b| {
                            a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
                        });
                        costs.truncate(MOST_EDGES);
                        costs.sort_unstable_by_key(|(_, place)| *place);
                    }
                    costs.iter().for_each(|(cost, place)| assigner.edge(*place, *cost));
                    assigner.end_row();
                    contested.push(track);
                }
            }
        }
        for (track, found) in contested.iter().zip(assigner.finish()) {
            if let Some(place) = found {
                track_of[*place as usize] = Some(*track);
            }
        }
    }
}
