//! Which detection is of which track: gate, cost, optimal assignment.

pub mod csba;
pub mod likelihood;

use crate::filter::PositionInnovation;

use crate::assignment::{Assigner, Candidate};
use crate::filter::{Measurement, State};
use v2x_common::class::Class;
use v2x_common::time::Timestamp;

/// What makes a pair likely.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AssociationCost {
    /// Combined scores of centre, dimension and orientation, as the paper has it.
    #[default]
    Csba,
    /// The negative log-likelihood.
    Likelihood,
}

impl AssociationCost {
    fn of_pair(self, z: &Measurement, state: &State, innovation: &PositionInnovation) -> f64 {
        match self {
            Self::Csba => csba::pair_cost(z, state, innovation.mahalanobis2, &csba::CsbaWeights::PUBLISHED),
            Self::Likelihood => likelihood::pair_cost(z, state, innovation),
        }
    }

    const fn of_staying_alone(self) -> f64 {
        match self {
            Self::Csba => csba::COST_ALONE,
            Self::Likelihood => likelihood::COST_ALONE,
        }
    }
}

/// A track as it stood at the time of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// Its place in the hub's list.
    pub track: usize,
    /// What it is.
    pub class: Class,
    /// Where, predicted to the frame's time.
    pub state: State,
    /// When it was first sighted.
    pub born_at: Timestamp,
}

impl Expected {
    /// The innovation of a measurement that could be of this track: of compatible class and within the gate.
    fn gated(&self, z: &Measurement, gate: f64) -> Option<PositionInnovation> {
        let kinematic = &self.state.kinematic;
        let dx = z.position[0] - kinematic.position[0];
        let dy = z.position[1] - kinematic.position[1];
        // On each axis the distance is bounded by the marginal: most pairs end here.
        let is_near =
            dx * dx <= gate * (kinematic.pp.xx + z.r.xx) && dy * dy <= gate * (kinematic.pp.yy + z.r.yy);
        if !is_near || !z.class.is_compatible_with(self.class) {
            return None;
        }
        let innovation = kinematic.innovation(z.position, &z.r);
        (innovation.mahalanobis2 <= gate).then_some(innovation)
    }

    /// Whether a measurement could be of this track.
    pub fn fits(&self, z: &Measurement, gate: f64) -> bool {
        self.gated(z, gate).is_some()
    }
}

/// Associates frames with tracks; holds the buffers.
#[derive(Debug, Default)]
pub struct Associator {
    assigner: Assigner,
    candidates: Vec<Candidate>,
    by_x: Vec<(f64, u32)>,
}

impl Associator {
    /// For each measurement the place in `expected` of the track that it is of, or `None`.
    ///
    /// Candidates are pairs of compatible class whose squared Mahalanobis distance does not exceed
    /// `gate` (χ² with 2 degrees of freedom); of these the assignment of least total cost.
    pub fn associate(
        &mut self,
        measurements: &[Measurement],
        expected: &[Expected],
        (cost, gate): (AssociationCost, f64),
    ) -> &[Option<u32>] {
        self.candidates.clear();
        self.by_x.clear();
        self.by_x.extend((0..).zip(expected).map(|(col, track)| (track.state.kinematic.position[0], col)));
        self.by_x.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let widest = expected.iter().map(|track| track.state.kinematic.pp.xx).fold(0.0, f64::max);
        for (row, z) in (0..).zip(measurements) {
            // No track further away along x than this can be within the gate.
            let reach = libm::sqrt(gate * (widest + z.r.xx));
            let start = self.by_x.partition_point(|(x, _)| *x < z.position[0] - reach);
            for &(x, col) in &self.by_x[start..] {
                if x > z.position[0] + reach {
                    break;
                }
                let track = &expected[col as usize];
                if let Some(innovation) = track.gated(z, gate) {
                    let cost = cost.of_pair(z, &track.state, &innovation);
                    self.candidates.push(Candidate { row, col, cost });
                }
            }
        }
        self.assigner.solve(measurements.len(), expected.len(), &self.candidates, cost.of_staying_alone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use v2x_common::covariance::Covariance2;

    const GATE: f64 = 16.2;

    fn measurement() -> impl Strategy<Value = Measurement> {
        let class = prop::sample::select(vec![Class::Car, Class::Adult, Class::Unknown]);
        (class, [0.0..8.0f64, 0.0..8.0f64], 0.2..1.5f64, [1.0..3.0f64, 1.0..6.0f64], -3.0..3.0f64).prop_map(
            |(class, position, sigma, size, yaw)| Measurement {
                class,
                position,
                r: Covariance2::isotropic(sigma),
                size,
                relative_variance: [0.04, 0.04],
                yaw,
                yaw_variance: 0.02,
                velocity: None,
            },
        )
    }

    fn expected(z: &Measurement) -> Expected {
        let born_at = Timestamp::EPOCH;
        Expected { track: 0, class: z.class, state: State::born(born_at, z), born_at }
    }

    /// The cost of a pair by the definition, `None` beyond the gate.
    fn cost(z: &Measurement, track: &Expected, which: AssociationCost) -> Option<f64> {
        let innovation = track.state.kinematic.innovation(z.position, &z.r);
        let is_candidate = innovation.mahalanobis2 <= GATE && z.class.is_compatible_with(track.class);
        is_candidate.then(|| which.of_pair(z, &track.state, &innovation))
    }

    /// The least total cost over every assignment.
    fn brute_force(measurements: &[Measurement], tracks: &mut Vec<Expected>, which: AssociationCost) -> f64 {
        let Some((z, rest)) = measurements.split_first() else { return 0.0 };
        let mut best = which.of_staying_alone() + brute_force(rest, tracks, which);
        for place in 0..tracks.len() {
            if let Some(pair) = cost(z, &tracks[place], which) {
                let track = tracks.remove(place);
                best = best.min(pair + brute_force(rest, tracks, which));
                tracks.insert(place, track);
            }
        }
        best
    }

    proptest! {
        #[test]
        fn the_association_is_the_optimum_over_all_assignments_within_the_gate(
            measurements in prop::collection::vec(measurement(), 0..5),
            tracks in prop::collection::vec(measurement(), 0..5),
            which in prop::sample::select(vec![AssociationCost::Csba, AssociationCost::Likelihood]),
        ) {
            let mut tracks: Vec<_> = tracks.iter().map(expected).collect();
            let mut associator = Associator::default();
            let found = associator.associate(&measurements, &tracks, (which, GATE)).to_vec();
            let mut total = 0.0;
            for (z, found) in measurements.iter().zip(found) {
                total += match found {
                    Some(col) => cost(z, &tracks[col as usize], which).expect("only candidates are assigned"),
                    None => which.of_staying_alone(),
                };
            }
            prop_assert!((total - brute_force(&measurements, &mut tracks, which)).abs() < 1e-9);
        }
    }
}
