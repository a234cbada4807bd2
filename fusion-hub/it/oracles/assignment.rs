//! Assignment against `scipy.optimize.linear_sum_assignment` and pathfinding's Kuhn-Munkres.

use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;
use proptest::prelude::*;
use v2x_fusion_hub::association::assignment::{Assigner, Candidate};

#[derive(serde::Deserialize)]
struct Case {
    rows: usize,
    cols: usize,
    alone: f64,
    candidates: Vec<(u32, u32, f64)>,
    optimum: f64,
}

/// The sum of costs of the assignment found, which must be one.
fn total(assigner: &mut Assigner, (rows, cols): (usize, usize), candidates: &[Candidate], alone: f64) -> f64 {
    let mut taken = vec![false; cols];
    let result = assigner.solve(rows, cols, candidates, alone);
    assert_eq!(result.len(), rows);
    let costs = (0..).zip(result).map(|(row, col)| {
        let Some(col) = *col else { return alone };
        assert!(!std::mem::replace(&mut taken[col as usize], true), "column {col} twice");
        candidates.iter().find(|c| (c.row, c.col) == (row, col)).expect("only candidates are assigned").cost
    });
    costs.sum()
}

#[test]
fn the_sum_equals_scipys() {
    let cases: Vec<Case> = serde_json::from_str(include_str!("assignment.json")).unwrap();
    let mut assigner = Assigner::default();
    for case in &cases {
        let candidates: Vec<_> =
            case.candidates.iter().map(|&(row, col, cost)| Candidate { row, col, cost }).collect();
        let ours = total(&mut assigner, (case.rows, case.cols), &candidates, case.alone);
        assert!((ours - case.optimum).abs() < 1e-9, "{}×{}: {ours}, {}", case.rows, case.cols, case.optimum);
    }
}

/// Of the matrix with a column for each row that stays alone.
fn kuhn_munkres(n_rows: usize, n_cols: usize, costs: &[(usize, usize, i32)], alone: i32) -> i64 {
    let mut dense = Matrix::new(n_rows, n_cols + n_rows, 1_000_000_000_i64);
    for row in 0..n_rows {
        dense[(row, n_cols + row)] = i64::from(alone);
    }
    for &(row, col, cost) in costs {
        dense[(row, col)] = i64::from(cost);
    }
    kuhn_munkres_min(&dense).0
}

proptest! {
    #[test]
    fn the_sum_equals_that_of_kuhn_and_munkres(
        n_rows in 1usize..40,
        n_cols in 1usize..40,
        // Small integers are exact in both, and tie often.
        costs in prop::collection::btree_map((0usize..40, 0usize..40), -50..100i32, 0..300),
        alone in -10..90i32,
    ) {
        let costs: Vec<_> = costs
            .into_iter()
            .filter(|((row, col), _)| *row < n_rows && *col < n_cols)
            .map(|((row, col), cost)| (row, col, cost))
            .collect();
        let index = |place: usize| u32::try_from(place).unwrap();
        let candidates: Vec<_> = costs
            .iter()
            .map(|&(row, col, cost)| Candidate { row: index(row), col: index(col), cost: f64::from(cost) })
            .collect();
        let ours = total(&mut Assigner::default(), (n_rows, n_cols), &candidates, f64::from(alone));
        let theirs = i32::try_from(kuhn_munkres(n_rows, n_cols, &costs, alone)).unwrap();
        prop_assert_eq!(ours, f64::from(theirs));
    }
}
