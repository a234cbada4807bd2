//! Covariance intersection: the weight against a search, the fused estimate against Stone Soup.

use super::{assert_close, covariance};
use v2x_common::covariance::Covariance2;
use v2x_fusion_hub::filter::{Kinematic, intersection_weight};

#[derive(serde::Deserialize)]
struct Case {
    a: [f64; 3],
    b: [f64; 3],
    za: [f64; 2],
    zb: [f64; 2],
    omega: f64,
    determinant: f64,
    fused: Option<Fused>,
}

#[derive(serde::Deserialize)]
struct Fused {
    mean: [f64; 2],
    covariance: [f64; 3],
}

fn scaled(covariance: &Covariance2, by: f64) -> Covariance2 {
    Covariance2 { xx: covariance.xx * by, xy: covariance.xy * by, yy: covariance.yy * by }
}

#[test]
fn the_weight_equals_a_search_and_inflation_equals_stone_soups_fusion() {
    let cases: Vec<Case> = serde_json::from_str(include_str!("intersection.json")).unwrap();
    assert!(cases.iter().filter(|case| case.fused.is_some()).count() >= 10);
    for case in &cases {
        let (a, b) = (covariance(case.a), covariance(case.b));
        let omega = intersection_weight(&a, &b);
        // A search finds where a parabola is flat only to the root of the arithmetic's precision.
        assert!((omega - case.omega).abs() < 1e-6, "{omega}, expected {}", case.omega);
        let Some(fused) = &case.fused else {
            let best = a.determinant().min(b.determinant());
            assert_close(&[best], &[case.determinant], 1e-9);
            continue;
        };
        // At the fixture's own weight, so that what differs is the update alone.
        let prior = scaled(&a, 1.0 / case.omega);
        let mut state = Kinematic::initial(case.za, prior, 1.0, None);
        state.update_position(case.zb, &scaled(&b, 1.0 / (1.0 - case.omega)));
        assert_close(&state.position, &fused.mean, 1e-9);
        assert_close(&[state.pp.xx, state.pp.xy, state.pp.yy], &fused.covariance, 1e-9);
        assert_close(&[state.pp.determinant()], &[case.determinant], 1e-9);
    }
}
