use super::pairs::MOST_NEAR;
use super::*;

const COUNT: usize = 2000;

/// A point for every 100 m², in a square.
fn spots(spread: f64) -> Vec<Spot> {
    let side = libm::sqrt(100.0 * 2000.0);
    // A sequence without pattern to the grid: the fractional parts of multiples of irrational numbers.
    let place = |step: f64, i: u32| side * (f64::from(i) * step).fract();
    let position = |i| [place(0.754_877_666_246_692_8, i), place(0.569_840_290_998_053_2, i)];
    (0..2000).map(|i| Spot { position: position(i), spread: [spread; 2] }).collect()
}

/// Number of points visited in all.
fn work(points: &[Spot], queries: &[Spot]) -> usize {
    let (mut grid, mut pairs) = (Grid::default(), Pairs::default());
    grid.fill(16.2, points, queries);
    grid.pairs(queries, &mut pairs);
    assert!(pairs.as_slice().len() >= COUNT - 2, "each but an outlier is near its own");
    pairs.visited
}

#[test]
fn each_query_visits_a_few_points() {
    assert!(work(&spots(0.25), &spots(0.25)) < 5 * COUNT);
}

#[test]
fn a_far_outlier_and_an_uncertain_point_do_not_slow_other_queries() {
    let far = [3e7, -2e9];
    let unknown = [1e12, 1e13];
    for position in [far, [100.0; 2]] {
        for spread in [unknown, [0.25; 2]] {
            let (mut points, mut queries) = (spots(0.25), spots(0.25));
            points[17] = Spot { position, spread };
            queries[900] = Spot { position, spread };
            // One query that visits all points, and one point that all queries visit.
            assert!(work(&points, &queries) < 7 * COUNT, "{position:?} {spread:?}");
        }
    }
}

#[test]
fn points_of_very_different_spread_do_not_widen_each_others_search() {
    let mut points = spots(0.04);
    points.iter_mut().step_by(20).for_each(|point| point.spread = [25.0; 2]);
    // Those 5 % have a reach of 20 m, and with it 16 others in the square.
    assert!(work(&points, &spots(0.04)) < 8 * COUNT);
}

#[test]
fn a_query_of_any_reach_finds_each_near_point_once() {
    // Of all shapes, and nearly as many cells as there are points: then rows begin to share buckets.
    let points = spots(0.25);
    let (mut grid, mut pairs) = (Grid::default(), Pairs::default());
    grid.fill(1.0, &points, &points);
    for (step, query) in (1..1200).map(f64::from).zip(&points) {
        let reach = [0.1 * step, 9400.0 / step];
        let query = Spot { spread: reach.map(|reach| reach * reach), ..*query };
        grid.pairs(&[query], &mut pairs);
        let mut found: Vec<_> = pairs.as_slice().iter().map(|pair| pair[1]).collect();
        found.sort_unstable();
        let near = (0u32..).zip(&points).filter(|(_, point)| {
            let delta = |axis: usize| (point.position[axis] - query.position[axis]).abs();
            let limit = |axis: usize| libm::sqrt(query.spread[axis] + 0.25);
            delta(0) <= limit(0) && delta(1) <= limit(1)
        });
        let near: Vec<_> = near.map(|(place, _)| place).collect();
        if near.len() <= MOST_NEAR {
            assert_eq!(found, near, "reach {reach:?} m");
        } else {
            let is_near = |place: &u32| near.binary_search(place).is_ok();
            assert!(found.len() >= MOST_NEAR && found.iter().all(is_near), "reach {reach:?} m");
        }
    }
}

#[test]
fn points_that_are_not_numbers_are_near_no_other() {
    let (mut points, queries) = (spots(0.25), spots(0.25));
    points[3].position = [f64::NAN, 0.0];
    points[4].position = [f64::INFINITY, f64::NEG_INFINITY];
    points[5].spread = [f64::NAN; 2];
    let (mut grid, mut pairs) = (Grid::default(), Pairs::default());
    grid.fill(16.2, &points, &queries);
    grid.pairs(&queries, &mut pairs);
    assert!(pairs.as_slice().iter().all(|[_, point]| *point != 3 && *point != 4));
    assert!((6..2000).all(|place| pairs.as_slice().contains(&[place, place])));
}

#[test]
fn a_point_exactly_at_the_reach_is_near_at_any_coordinate() {
    for origin in [0.0, 1e8] {
        let query = Spot { position: [origin, origin], spread: [4.0; 2] };
        let at = |x: f64, y: f64| Spot { position: [origin + x, origin + y], spread: [0.0; 2] };
        let mut points = vec![at(2.0, 0.0), at(-2.0, 2.0), at(2.1, 0.0)];
        // Enough others that the grid is searched, not all points.
        points.extend((1..60).map(|k| at(10.0 * f64::from(k), 50.0)));
        let (mut grid, mut pairs) = (Grid::default(), Pairs::default());
        grid.fill(1.0, &points, &[query]);
        grid.pairs(&[query], &mut pairs);
        let mut found: Vec<_> = pairs.as_slice().iter().map(|pair| pair[1]).collect();
        found.sort_unstable();
        assert_eq!(found, [0, 1], "at {origin}");
    }
}
