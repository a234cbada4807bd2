//! Which detection is of which track: gate, cost, optimal assignment.

mod csba;

pub use csba::{COST_ALONE, CsbaWeights, pair_cost};

use crate::assignment::{Assigner, Candidate};
use crate::filter::{Measurement, State};
use v2x_common::class::Class;

/// A track as it stood at the time of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// Its place in the hub's list.
    pub track: usize,
    /// What it is.
    pub class: Class,
    /// Where, predicted to the frame's time.
    pub state: State,
}

/// Associates frames with tracks; holds the buffers.
#[derive(Debug, Default)]
pub struct Associator {
    assigner: Assigner,
    candidates: Vec<Candidate>,
}

impl Associator {
    /// For each measurement the place in `expected` of the track that it is of, or `None`.
    ///
    /// Candidates are pairs of compatible class whose squared Mahalanobis distance does not exceed
    /// `gate` (χ² with 2 degrees of freedom); of these the assignment of least total CSBA cost.
    pub fn associate(
        &mut self,
        measurements: &[Measurement],
        expected: &[Expected],
        gate: f64,
    ) -> &[Option<u32>] {
        self.candidates.clear();
        for (row, z) in (0..).zip(measurements) {
            for (col, track) in (0..).zip(expected) {
                if !is_near(z, track, gate) || !z.class.is_compatible_with(track.class) {
                    continue;
                }
                let innovation = track.state.kinematic.innovation(z.position, &z.r);
                if innovation.mahalanobis2 <= gate {
                    let cost = pair_cost(z, &track.state, innovation.mahalanobis2, &CsbaWeights::PUBLISHED);
                    self.candidates.push(Candidate { row, col, cost });
                }
            }
        }
        self.assigner.solve(measurements.len(), expected.len(), &self.candidates, COST_ALONE)
    }
}

/// Whether a pair can be within the gate at all: on each axis the distance is bounded by the marginal.
fn is_near(z: &Measurement, track: &Expected, gate: f64) -> bool {
    let kinematic = &track.state.kinematic;
    let dx = z.position[0] - kinematic.position[0];
    let dy = z.position[1] - kinematic.position[1];
    dx * dx <= gate * (kinematic.pp.xx + z.r.xx) && dy * dy <= gate * (kinematic.pp.yy + z.r.yy)
}
