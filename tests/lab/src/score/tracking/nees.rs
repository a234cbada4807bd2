//! NEES: consistency of covariances with errors.
//!
//! The normalised estimation error squared eᵀ S⁻¹ e has a mean of its degrees of freedom where S is right (Bar-Shalom,
//! Li & Kirubarajan 2001, section 5.4.2). Divided by them, 1 is consistent, more is overconfident, less is conservative.
//! Sums are merged over scenes, classes and levels of noise.

use crate::score::errors::{BoxError, nees};
use crate::score::moments::Moments;
use crate::score::tracking::chi2;
use v2x_common::covariance::Covariance2;

/// An invalid covariance.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("the covariance of the {of} is not finite and positive definite")]
pub struct NotACovariance {
    /// Position, yaw or size.
    pub of: &'static str,
}

/// The reported covariance of a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Claim {
    /// Of the position, m².
    pub position: Covariance2,
    /// Of the heading, rad².
    pub yaw: f64,
    /// Of width (x) and depth (y), m².
    pub size: Covariance2,
}

/// NEES over degrees of freedom of some errors of one kind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Nees {
    /// Of eᵀ S⁻¹ e / dof.
    moments: Moments,
    /// Degrees of freedom of all errors.
    dof: u64,
}

impl Nees {
    /// Adds an error of one degree of freedom.
    fn add_scalar(&mut self, error: f64, variance: f64) {
        self.moments.add(Some(error * error / variance));
        self.dof += 1;
    }

    /// Adds an error of two degrees of freedom.
    fn add_vector(&mut self, error: [f64; 2], s: &Covariance2) {
        self.moments.add(Some(nees(error, s) / 2.0));
        self.dof += 2;
    }

    /// Adds others.
    pub fn merge(&mut self, other: &Self) {
        self.moments.merge(&other.moments);
        self.dof += other.dof;
    }

    /// Number of errors.
    pub const fn count(&self) -> u64 {
        self.moments.n()
    }

    /// Mean of NEES / dof; `None` without errors.
    pub fn mean(&self) -> Option<f64> {
        self.moments.mean()
    }

    /// The 95 % interval of the mean if covariances are right and errors are Gaussian and independent: the central quantiles
    /// of χ². Errors of one track at neighbouring times are not independent: then it is too narrow. `None` without errors.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub fn honest_95(&self) -> Option<[f64; 2]> {
        let dof = self.dof as f64;
        (self.dof > 0).then(|| [0.025, 0.975].map(|share| chi2::quantile(share, dof) / dof))
    }
}

/// NEES of boxes by part.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Consistency {
    /// Of the position, 2 degrees of freedom each.
    pub position: Nees,
    /// Of the heading, 1.
    pub yaw: Nees,
    /// Of width and depth, 2.
    pub size: Nees,
}

impl Consistency {
    /// Adds a box.
    ///
    /// # Errors
    /// If a part of the claim is no valid covariance; then nothing is added.
    pub fn add(&mut self, error: &BoxError, claim: &Claim) -> Result<(), NotACovariance> {
        let is_variance = claim.yaw > 0.0 && claim.yaw.is_finite();
        for (is_valid, of) in
            [(claim.position.is_valid(), "position"), (is_variance, "yaw"), (claim.size.is_valid(), "size")]
        {
            if !is_valid {
                return Err(NotACovariance { of });
            }
        }
        self.position.add_vector(error.position, &claim.position);
        self.yaw.add_scalar(error.yaw, claim.yaw);
        self.size.add_vector(error.size, &claim.size);
        Ok(())
    }

    /// Adds others.
    pub fn merge(&mut self, other: &Self) {
        self.position.merge(&other.position);
        self.yaw.merge(&other.yaw);
        self.size.merge(&other.size);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::tracking::testing::at;
    use v2x_common::geometry::BevBox;

    const CLAIM: Claim =
        Claim { position: Covariance2::isotropic(2.0), yaw: 0.04, size: Covariance2::isotropic(0.5) };

    #[test]
    fn each_part_is_over_its_own_degrees_of_freedom() {
        let reported = BevBox { x: 2.0, y: 4.0, w: 2.5, d: 4.0, yaw: -3.0 };
        let error = BoxError::between(&reported, &BevBox { yaw: 3.0, ..at(0.0) });
        let mut consistency = Consistency::default();
        consistency.add(&error, &CLAIM).unwrap();
        let turn = std::f64::consts::TAU - 6.0;
        assert_eq!((consistency.position.mean(), consistency.size.mean()), (Some(2.5), Some(0.5)));
        assert!((consistency.yaw.mean().unwrap() - turn * turn / 0.04).abs() < 1e-9);
    }

    #[test]
    fn an_invalid_covariance_has_no_nees() {
        let mut consistency = Consistency::default();
        let error = BoxError::between(&at(1.0), &at(0.0));
        for (claim, of) in [
            (Claim { position: Covariance2 { xx: 1.0, xy: 1.0, yy: 1.0 }, ..CLAIM }, "position"),
            (Claim { yaw: 0.0, ..CLAIM }, "yaw"),
            (Claim { yaw: f64::NAN, ..CLAIM }, "yaw"),
            (Claim { size: Covariance2::isotropic(f64::INFINITY), ..CLAIM }, "size"),
        ] {
            assert_eq!(consistency.add(&error, &claim), Err(NotACovariance { of }));
        }
        assert_eq!(consistency, Consistency::default());
        assert_eq!((consistency.yaw.mean(), consistency.yaw.honest_95()), (None, None));
    }
}
