use super::*;
use proptest::prelude::*;

fn total(result: &[Option<u32>], candidates: &[Candidate], unmatched_cost: f64) -> f64 {
    let cost_of = |row: usize, col: u32| {
        let found = candidates.iter().filter(|c| c.row as usize == row && c.col == col);
        found.map(|c| c.cost).fold(f64::INFINITY, f64::min)
    };
    result.iter().enumerate().map(|(row, col)| col.map_or(unmatched_cost, |col| cost_of(row, col))).sum()
}

/// Every assignment tried.
fn brute_force(row: usize, n_rows: usize, free: &mut [bool], candidates: &[Candidate], alone: f64) -> f64 {
    if row == n_rows {
        return 0.0;
    }
    let mut best = alone + brute_force(row + 1, n_rows, free, candidates, alone);
    for candidate in candidates.iter().filter(|c| c.row as usize == row) {
        if std::mem::take(&mut free[candidate.col as usize]) {
            best = best.min(candidate.cost + brute_force(row + 1, n_rows, free, candidates, alone));
            free[candidate.col as usize] = true;
        }
    }
    best
}

#[test]
fn a_greedy_choice_is_revised_where_the_sum_is_less() {
    let c = |row, col, cost| Candidate { row, col, cost };
    let candidates = [c(0, 0, 1.0), c(0, 1, 2.0), c(1, 0, 1.5)];
    assert_eq!(Assigner::default().solve(2, 2, &candidates, 10.0), [Some(1), Some(0)]);
}

#[test]
fn a_pair_that_costs_more_than_an_unmatched_row_is_not_made() {
    let candidates = [Candidate { row: 0, col: 0, cost: 1.1 }];
    assert_eq!(Assigner::default().solve(1, 1, &candidates, 1.0), [None]);
    assert_eq!(Assigner::default().solve(0, 3, &[], 1.0), []);
    assert_eq!(Assigner::default().solve(2, 0, &[], 1.0), [None, None]);
}

proptest! {
    #[test]
    fn the_sum_is_the_brute_force_optimum(
        n_rows in 0usize..6,
        n_cols in 1usize..6,
        raw in prop::collection::vec((0u32..6, 0u32..6, -5.0..10.0f64), 0..20),
        alone in -1.0..8.0f64,
    ) {
        let mut candidates: Vec<Candidate> = Vec::new();
        for (row, col, cost) in raw {
            let new = candidates.iter().all(|c| (c.row, c.col) != (row, col));
            if (row as usize) < n_rows && (col as usize) < n_cols && new {
                candidates.push(Candidate { row, col, cost });
            }
        }
        let mut assigner = Assigner::default();
        // A reused solver must not keep state.
        assigner.solve(2, 2, &[Candidate { row: 1, col: 1, cost: 0.5 }], 1.0);
        let result = assigner.solve(n_rows, n_cols, &candidates, alone).to_vec();
        let mut taken: Vec<_> = result.iter().flatten().collect();
        taken.sort_unstable();
        prop_assert!(taken.windows(2).all(|pair| pair[0] != pair[1]));
        let best = brute_force(0, n_rows, &mut vec![true; n_cols], &candidates, alone);
        prop_assert!((total(&result, &candidates, alone) - best).abs() < 1e-9);
    }
}
