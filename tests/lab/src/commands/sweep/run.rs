//! Runs what is not known yet, on all cores, and gathers the rows.

use super::method::SweepMethod;
use super::plan::{Plan, Point};
use super::record::Record;
use super::rows::{Group, Row, note_kept, rows};
use super::store::{Store, key};
use super::{live_point, virtual_point};
use crate::protocol::parallel;
use crate::tables::progress::Progress;
use anyhow::Context;
use std::collections::BTreeMap;
use std::path::Path;
use tokio_util::sync::CancellationToken;

/// What one place with one Δmax came to.
#[derive(Debug)]
pub struct Place {
    /// Of the first seed.
    pub point: Point,
    /// By method, then by seed.
    pub records: Vec<(SweepMethod, Vec<Record>)>,
}

impl Place {
    /// Borrowed, as rows want it.
    fn group(&self) -> Group<'_> {
        self.records.iter().map(|(method, records)| (*method, records.iter().collect())).collect()
    }
}

/// A sweep's results.
#[derive(Debug)]
pub struct Results {
    /// What was run.
    pub plan: Plan,
    /// By value, then by Δmax.
    pub places: Vec<Place>,
}

/// Runs a sweep in virtual time.
pub fn run_virtual(plan: &Plan, store: &Store, threads: usize) -> anyhow::Result<Results> {
    let points = plan.points()?;
    let mut progress = Progress::begin("runs");
    let work = |place: usize| -> anyhow::Result<Vec<Record>> {
        let point = &points[place];
        let unknown = unknown(plan, point, store);
        let records = virtual_point::run(point, &unknown, plan.length).with_context(|| point.place())?;
        for (method, record) in unknown.iter().zip(&records) {
            store.keep(&key(plan, point, *method), record)?;
        }
        with_known(plan, (point, store), (&unknown, records))
    };
    let done = parallel::map(points.len(), threads, work, |done, of| progress.tell(done, of));
    progress.end();
    Ok(Results::of(plan, points, done?))
}

/// Runs a sweep over the network, point after point: two at a time would disturb each other. `None` where shutdown
/// came first; what was finished is kept.
pub async fn run_live(
    plan: &Plan,
    (store, folder): (&Store, &Path),
    shutdown: &CancellationToken,
) -> anyhow::Result<Option<Results>> {
    let points = plan.points()?;
    let mut progress = Progress::begin("live runs");
    let mut done = Vec::with_capacity(points.len());
    for (place, point) in points.iter().enumerate() {
        let unknown = unknown(plan, point, store);
        let records = if unknown.is_empty() {
            Vec::new()
        } else {
            let folder = folder.join("live").join(format!("{place:03}"));
            let run = live_point::run(point, &unknown, (plan.length, &folder), shutdown).await;
            match run.with_context(|| point.place())? {
                Some(records) => records,
                None => return Ok(None),
            }
        };
        for (method, record) in unknown.iter().zip(&records) {
            store.keep(&key(plan, point, *method), record)?;
        }
        done.push(with_known(plan, (point, store), (&unknown, records))?);
        progress.tell(place + 1, points.len());
    }
    progress.end();
    Ok(Some(Results::of(plan, points, done)))
}

/// The methods whose run at a point is not known yet.
fn unknown(plan: &Plan, point: &Point, store: &Store) -> Vec<SweepMethod> {
    plan.methods.iter().copied().filter(|method| store.get(&key(plan, point, *method)).is_none()).collect()
}

/// All methods' records at a point, in the plan's order: what was known, and what has just been run.
fn with_known(
    plan: &Plan,
    (point, store): (&Point, &Store),
    (methods, records): (&[SweepMethod], Vec<Record>),
) -> anyhow::Result<Vec<Record>> {
    let mut fresh = methods.iter().zip(records).collect::<BTreeMap<_, _>>();
    let record = |method: &SweepMethod| {
        let known = || store.get(&key(plan, point, *method)).cloned();
        fresh
            .remove(method)
            .or_else(known)
            .with_context(|| format!("{} was not run {}", method.key(), point.place()))
    };
    plan.methods.iter().map(record).collect()
}

impl Results {
    /// From the records of every point, in the plan's order.
    pub fn of(plan: &Plan, points: Vec<Point>, records: Vec<Vec<Record>>) -> Self {
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
    pub fn rows(&self) -> Vec<Row> {
        let of_place = |place: &Place| rows(&self.plan, &place.point, &place.group());
        let mut rows: Vec<Row> = self.places.iter().flat_map(of_place).collect();
        note_kept(&mut rows);
        rows
    }
}
