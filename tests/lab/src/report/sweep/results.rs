//! The results of a sweep.

use crate::drive::sweep::method::SweepMethod;
use crate::drive::sweep::plan::{Plan, Point};
use crate::report::sweep::rows::{Group, Row, note_kept, rows};
use crate::score::sweep::record::Record;
/// The results at one point of the grid and one Δmax.
#[derive(Debug)]
pub(crate) struct Place {
    /// The point with the first seed.
    pub point: Point,
    /// By method, then by seed.
    pub records: Vec<(SweepMethod, Vec<Record>)>,
}

impl Place {
    /// The records by method, borrowed.
    fn group(&self) -> Group<'_> {
        self.records.iter().map(|(method, records)| (*method, records.iter().collect())).collect()
    }
}

/// A sweep's results.
#[derive(Debug)]
pub(crate) struct Results {
    /// The plan.
    pub plan: Plan,
    /// By value, then by Δmax.
    pub places: Vec<Place>,
}

impl Results {
    /// From the records of every point, in the plan's order.
    pub(crate) fn of(plan: &Plan, points: Vec<Point>, records: Vec<Vec<Record>>) -> Self {
        let n_seeds = plan.seeds.len().max(1);
        let mut places: Vec<Place> = Vec::new();
        for (number, (point, records)) in points.into_iter().zip(records).enumerate() {
            if number % n_seeds == 0 {
                let records = plan.methods.iter().map(|method| (*method, Vec::new())).collect();
                places.push(Place { point, records });
            }
            let Some(place) = places.last_mut() else { continue };
            for ((_, of_seeds), record) in place.records.iter_mut().zip(records) {
                of_seeds.push(record);
            }
        }
        Self { plan: plan.clone(), places }
    }

    /// The rows of all places.
    pub(crate) fn rows(&self) -> Vec<Row> {
        let of_place = |place: &Place| rows(&self.plan, &place.point, &place.group());
        let mut rows: Vec<Row> = self.places.iter().flat_map(of_place).collect();
        note_kept(&mut rows);
        rows
    }
}
