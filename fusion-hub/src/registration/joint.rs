//! The errors of all agents together: mean and covariance, in units of what each declares.

use super::cholesky::{self, NotPositiveDefinite};
use super::group::Group;
use super::model::joined;
use super::pair::Pair;
use super::settings::MEMORY_S;
use super::slot::RegistrationSlot;
use serde::{Deserialize, Serialize};

/// Mean and covariance of every agent's four errors, each N(0, 1) without data.
///
/// Differences are gathered as information until they are applied.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Joint {
    /// Four for each agent.
    n: usize,
    mean: Vec<f64>,
    /// n×n, as all that follow.
    covariance: Vec<f64>,
    lambda: Vec<f64>,
    eta: Vec<f64>,
    is_gathering: bool,
    has_learnt: bool,
    scratch: [Vec<f64>; 2],
}

impl Joint {
    /// Adds an agent, with its prior.
    pub(super) fn grow(&mut self) {
        let (old, n) = (self.n, self.n + 4);
        let mut covariance = identity(n);
        let mut lambda = vec![0.0; n * n];
        for row in 0..old {
            let (from, to) = (row * old..(row + 1) * old, row * n..row * n + old);
            covariance[to.clone()].copy_from_slice(&self.covariance[from.clone()]);
            lambda[to].copy_from_slice(&self.lambda[from]);
        }
        self.n = n;
        self.mean.resize(n, 0.0);
        self.eta.resize(n, 0.0);
        (self.covariance, self.lambda) = (covariance, lambda);
        self.scratch = [vec![0.0; n * n], vec![0.0; n * n]];
    }

    /// Forgets what is known of an agent.
    pub(super) fn forget(&mut self, slot: RegistrationSlot) {
        places(slot).into_iter().for_each(|own| self.forget_one(own));
    }

    /// Expresses what is known of an agent in other units: each error is multiplied by its ratio. Where that is `None`
    /// the error is forgotten.
    pub(super) fn rescale(&mut self, slot: RegistrationSlot, ratios: &[Option<f64>; 4]) {
        for (own, ratio) in places(slot).into_iter().zip(ratios) {
            match ratio {
                Some(ratio) => self.rescale_one(own, *ratio),
                None => self.forget_one(own),
            }
        }
    }

    fn rescale_one(&mut self, own: usize, ratio: f64) {
        self.mean[own] *= ratio;
        self.eta[own] /= ratio;
        for other in 0..self.n {
            for entry in [own * self.n + other, other * self.n + own] {
                self.covariance[entry] *= ratio;
                self.lambda[entry] /= ratio;
            }
        }
    }

    fn forget_one(&mut self, own: usize) {
        (self.mean[own], self.eta[own]) = (0.0, 0.0);
        for other in 0..self.n {
            let unit = if own == other { 1.0 } else { 0.0 };
            for entry in [own * self.n + other, other * self.n + own] {
                (self.covariance[entry], self.lambda[entry]) = (unit, 0.0);
            }
        }
    }

    pub(super) fn mean_of(&self, slot: RegistrationSlot) -> [f64; 4] {
        places(slot).map(|place| self.mean[place])
    }

    pub(super) fn covariance_of(&self, a: RegistrationSlot, b: RegistrationSlot) -> [[f64; 4]; 4] {
        places(a).map(|row| places(b).map(|column| self.covariance[row * self.n + column]))
    }

    pub(super) fn pair(&self, own: RegistrationSlot, partner: RegistrationSlot) -> Pair {
        let places = joined_places(own, partner);
        Pair {
            mean: joined(self.mean_of(own), self.mean_of(partner)),
            covariance: places.map(|row| places.map(|column| self.covariance[row * self.n + column])),
        }
    }

    /// Adds the information of one frame and one partner.
    pub(super) fn gather(&mut self, own: RegistrationSlot, partner: RegistrationSlot, group: &Group) {
        let places = joined_places(own, partner);
        for (row, place) in places.into_iter().enumerate() {
            self.eta[place] += group.eta[row];
            for (column, other) in places.into_iter().enumerate() {
                self.lambda[place * self.n + other] += group.lambda[row][column];
            }
        }
        self.is_gathering = true;
    }

    /// Predicts over `dt_s`, then applies the gathered information. If that is not positive definite, it is dropped.
    pub(super) fn advance(&mut self, dt_s: f64) -> Result<(), NotPositiveDefinite> {
        if !self.is_gathering && !self.has_learnt {
            return Ok(());
        }
        let kept = libm::exp(-dt_s / MEMORY_S);
        let n = self.n;
        self.mean.iter_mut().for_each(|mean| *mean *= kept);
        self.covariance.iter_mut().for_each(|entry| *entry *= kept * kept);
        (0..n).for_each(|k| self.covariance[k * n + k] += 1.0 - kept * kept);
        if !std::mem::take(&mut self.is_gathering) {
            return Ok(());
        }
        let taken = self.take_in();
        self.lambda.fill(0.0);
        self.eta.fill(0.0);
        self.has_learnt |= taken.is_ok();
        taken
    }

    fn take_in(&mut self) -> Result<(), NotPositiveDefinite> {
        let n = self.n;
        let [posterior, scratch] = &mut self.scratch;
        posterior.copy_from_slice(&self.covariance);
        cholesky::invert(posterior, scratch, n)?;
        posterior.iter_mut().zip(&self.lambda).for_each(|(entry, lambda)| *entry += lambda);
        cholesky::invert(posterior, scratch, n)?;
        // Unexplained: η − Λ m.
        for row in 0..n {
            let explained: f64 =
                self.lambda[row * n..(row + 1) * n].iter().zip(&self.mean).map(|(l, m)| l * m).sum();
            self.eta[row] -= explained;
        }
        for row in 0..n {
            let step: f64 = posterior[row * n..(row + 1) * n].iter().zip(&self.eta).map(|(p, e)| p * e).sum();
            self.mean[row] += step;
        }
        std::mem::swap(&mut self.covariance, posterior);
        Ok(())
    }
}

fn places(slot: RegistrationSlot) -> [usize; 4] {
    [0, 1, 2, 3].map(|k| 4 * slot.index() + k)
}

fn joined_places(own: RegistrationSlot, partner: RegistrationSlot) -> [usize; 8] {
    let ([a, b, c, d], [e, f, g, h]) = (places(own), places(partner));
    [a, b, c, d, e, f, g, h]
}

fn identity(n: usize) -> Vec<f64> {
    let mut matrix = vec![0.0; n * n];
    (0..n).for_each(|k| matrix[k * n + k] = 1.0);
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    /// d = own − partner of the first error, with this much information.
    fn difference(d: f64, information: f64) -> Group {
        let mut group = Group::EMPTY;
        for (row, column, sign) in [(0, 0, 1.0), (0, 4, -1.0), (4, 0, -1.0), (4, 4, 1.0)] {
            group.lambda[row][column] = sign * information;
        }
        (group.eta[0], group.eta[4], group.count) = (d * information, -d * information, 1);
        group
    }

    fn joint(n_agents: u8) -> Joint {
        let mut joint = Joint::default();
        (0..n_agents).for_each(|_| joint.grow());
        joint
    }

    #[test]
    fn of_a_difference_each_of_two_gets_half_and_their_sum_stays_as_unknown_as_it_was() {
        let mut joint = joint(3);
        let (a, b) = (RegistrationSlot(2), RegistrationSlot(0));
        joint.gather(a, b, &difference(1.0, 1e6));
        joint.advance(0.0).unwrap();
        assert!((joint.mean_of(a)[0] - 0.5).abs() < 1e-5 && (joint.mean_of(b)[0] + 0.5).abs() < 1e-5);
        let [own, cross] = [joint.covariance_of(a, a)[0][0], joint.covariance_of(a, b)[0][0]];
        // Var(a + b) = 2 as before, Var(a − b) = 0.
        assert!((own + cross - 1.0).abs() < 1e-5 && (own - cross).abs() < 1e-5, "{own} {cross}");
        assert_eq!(joint.mean_of(RegistrationSlot(1)), [0.0; 4]);
    }

    #[test]
    fn without_data_everything_is_as_unknown_as_at_first() {
        let mut joint = joint(2);
        joint.gather(RegistrationSlot(0), RegistrationSlot(1), &difference(1.0, 100.0));
        joint.advance(0.5).unwrap();
        let before = joint.covariance_of(RegistrationSlot(0), RegistrationSlot(0))[0][0];
        joint.advance(60.0).unwrap();
        let after = joint.covariance_of(RegistrationSlot(0), RegistrationSlot(0))[0][0];
        let kept = libm::exp(-2.0);
        assert!((after - (kept * before + 1.0 - kept)).abs() < 1e-12);
        joint.advance(1e6).unwrap();
        assert_eq!(
            (
                joint.mean_of(RegistrationSlot(0)),
                joint.covariance_of(RegistrationSlot(0), RegistrationSlot(1))
            ),
            ([0.0; 4], [[0.0; 4]; 4])
        );
    }

    #[test]
    fn a_newcomer_in_a_place_knows_nothing_of_who_was_there_and_others_keep_theirs() {
        let mut joint = joint(2);
        joint.gather(RegistrationSlot(0), RegistrationSlot(1), &difference(1.0, 100.0));
        joint.advance(0.0).unwrap();
        let kept = (
            joint.mean_of(RegistrationSlot(1)),
            joint.covariance_of(RegistrationSlot(1), RegistrationSlot(1)),
        );
        joint.forget(RegistrationSlot(0));
        joint.grow();
        assert_eq!(
            (
                joint.mean_of(RegistrationSlot(0)),
                joint.covariance_of(RegistrationSlot(0), RegistrationSlot(1))
            ),
            ([0.0; 4], [[0.0; 4]; 4])
        );
        assert_eq!(
            (
                joint.mean_of(RegistrationSlot(1)),
                joint.covariance_of(RegistrationSlot(1), RegistrationSlot(1))
            ),
            kept
        );
    }

    #[test]
    fn numbers_that_cannot_be_are_dropped_and_harm_nothing() {
        let mut joint = joint(2);
        joint.gather(RegistrationSlot(0), RegistrationSlot(1), &difference(f64::NAN, f64::NAN));
        assert_eq!(joint.advance(1.0), Err(NotPositiveDefinite));
        joint.gather(RegistrationSlot(0), RegistrationSlot(1), &difference(1.0, 100.0));
        assert_eq!(joint.advance(1.0), Ok(()));
        assert!(joint.mean_of(RegistrationSlot(0))[0] > 0.4);
    }
}
