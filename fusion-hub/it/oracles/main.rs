//! The engine's arithmetic against independent implementations: fixtures that `make.py` and `make_wbf.py` made, and a solver
//! crate.

mod assignment;
mod intersection;
mod kalman;
mod overlap;
mod wbf;

use v2x_common::covariance::Covariance2;

/// A 2×2 covariance from its upper triangle.
fn covariance([xx, xy, yy]: [f64; 3]) -> Covariance2 {
    Covariance2 { xx, xy, yy }
}

#[track_caller]
fn assert_close(ours: &[f64], theirs: &[f64], tolerance: f64) {
    assert_eq!(ours.len(), theirs.len());
    for (place, (ours, theirs)) in ours.iter().zip(theirs).enumerate() {
        let scale = theirs.abs().max(1.0);
        assert!((ours - theirs).abs() <= tolerance * scale, "at {place}: {ours}, expected {theirs}");
    }
}
