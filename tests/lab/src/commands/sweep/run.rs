//! Runs all points without a stored record, on all cores, and collects the rows.

use crate::commands::sweep::live;
use crate::commands::sweep::store::{Store, key};
use crate::commands::sweep::virtual_time;
use crate::drive::parallel;
use crate::drive::sweep::method::SweepMethod;
use crate::drive::sweep::plan::{Plan, Point};
use crate::report::progress::Progress;
use crate::report::sweep::results::Results;
use crate::score::sweep::record::Record;
use anyhow::Context;
use std::collections::BTreeMap;
use std::path::Path;
use tokio_util::sync::CancellationToken;

/// Runs a sweep in virtual time.
pub(crate) fn run_virtual(plan: &Plan, store: &Store, threads: usize) -> anyhow::Result<Results> {
    let points = plan.points()?;
    let mut progress = Progress::begin("runs");
    let work = |place: usize| -> anyhow::Result<Vec<Record>> {
        let point = &points[place];
        let unknown = unknown(plan, point, store);
        let records = virtual_time::run(point, &unknown, plan.length).with_context(|| point.place())?;
        for (method, record) in unknown.iter().zip(&records) {
            store.keep(&key(plan, point, *method), record)?;
        }
        with_known(plan, (point, store), (&unknown, records))
    };
    let done = parallel::map(points.len(), threads, work, |done, of| progress.update(done, of));
    progress.end();
    Ok(Results::of(plan, points, done?))
}

/// Runs a sweep over the network, one point at a time, since parallel runs would disturb each other. `None` after a
/// shutdown; records of finished runs are stored.
pub(crate) async fn run_live(
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
            let run = live::run(point, &unknown, (plan.length, &folder), shutdown).await;
            match run.with_context(|| point.place())? {
                Some(records) => records,
                None => return Ok(None),
            }
        };
        for (method, record) in unknown.iter().zip(&records) {
            store.keep(&key(plan, point, *method), record)?;
        }
        done.push(with_known(plan, (point, store), (&unknown, records))?);
        progress.update(place + 1, points.len());
    }
    progress.end();
    Ok(Some(Results::of(plan, points, done)))
}

/// The methods without a stored record at a point.
fn unknown(plan: &Plan, point: &Point, store: &Store) -> Vec<SweepMethod> {
    plan.methods.iter().copied().filter(|method| store.get(&key(plan, point, *method)).is_none()).collect()
}

/// The records of all methods at a point, in the order of the plan: stored ones and new ones.
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
