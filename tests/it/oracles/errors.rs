//! ASE against nuscenes-devkit, NEES against numpy and scipy.

use serde::Deserialize;
use v2x_common::covariance::Covariance2;
use v2x_common::geometry::BevBox;
use v2x_lab::BoxError;
use v2x_lab::tracking::nees::{Claim, Consistency, Nees};
use v2x_lab::tracking::scale::scale_error;

#[derive(Deserialize)]
struct Sizes {
    a: [f64; 2],
    b: [f64; 2],
    ase: f64,
}

#[test]
fn the_scale_error_is_the_devkits() {
    let cases: Vec<Sizes> = serde_json::from_str(include_str!("sizes.json")).unwrap();
    let of = |[w, d]: [f64; 2]| BevBox { x: 0.0, y: 0.0, w, d, yaw: 0.0 };
    for Sizes { a, b, ase } in &cases {
        assert!((scale_error(&of(*a), &of(*b)) - ase).abs() <= 1e-9, "{a:?} and {b:?}");
    }
}

#[derive(Deserialize)]
struct Errors {
    dof: usize,
    /// Each sample is an error vector and the upper triangle of its covariance.
    samples: Vec<Vec<f64>>,
    mean: f64,
    band: [f64; 2],
}

const EXACT: BoxError = BoxError { position: [0.0; 2], yaw: 0.0, size: [0.0; 2] };
const HONEST: Claim =
    Claim { position: Covariance2::isotropic(1.0), yaw: 1.0, size: Covariance2::isotropic(1.0) };

#[track_caller]
fn assert_nees(nees: &Nees, case: &Errors) {
    assert_eq!(nees.count(), case.samples.len() as u64);
    let (mean, band) = (nees.mean().expect("errors"), nees.honest_95().expect("errors"));
    assert!((mean / case.mean - 1.0).abs() <= 1e-9, "{mean}, expected {}", case.mean);
    for (ours, theirs) in band.iter().zip(case.band) {
        assert!((ours / theirs - 1.0).abs() <= 1e-9, "{band:?}, expected {:?}", case.band);
    }
}

#[test]
fn nees_and_its_band_are_those_of_numpy_and_scipy() {
    let cases: Vec<Errors> = serde_json::from_str(include_str!("nees.json")).unwrap();
    for case in &cases {
        let mut consistency = Consistency::default();
        for sample in &case.samples {
            let (error, claim) = match *sample.as_slice() {
                [yaw, variance] => (BoxError { yaw, ..EXACT }, Claim { yaw: variance, ..HONEST }),
                [x, y, xx, xy, yy] => {
                    let (error, covariance) = ([x, y], Covariance2 { xx, xy, yy });
                    (
                        BoxError { position: error, size: error, ..EXACT },
                        Claim { position: covariance, size: covariance, ..HONEST },
                    )
                }
                _ => panic!("one error or two with their covariance"),
            };
            consistency.add(&error, &claim).unwrap();
        }
        if case.dof == 1 {
            assert_nees(&consistency.yaw, case);
        } else {
            assert_nees(&consistency.position, case);
            assert_nees(&consistency.size, case);
        }
    }
}
