//! The rows of a sweep: means over seeds, with intervals.

use super::method::SweepMethod;
use super::plan::{Plan, Point};
use super::record::{Errors, Fates, PERCENTS, Record, Subset};
use crate::bootstrap::{Pair, bootstrap};
use serde::Serialize;
use std::collections::BTreeMap;

/// A ratio of errors with its 95 % interval (paired bootstrap over stretches of 5 s, common random numbers).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    /// The ratio.
    pub ratio: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Three percentiles, ms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Stage {
    /// The median.
    pub p50: f64,
    /// 95 %.
    pub p95: f64,
    /// 99 %.
    pub p99: f64,
}

/// One method at one place, for one subset of objects. Means are over seeds; what has no data is `None`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// What is compared.
    pub method: &'static str,
    /// What is varied.
    pub axis: String,
    /// Its value; its place in the list where it is no number.
    pub x: f64,
    /// Its value as typed.
    pub x_text: String,
    /// What else is varied.
    pub axis_2: Option<String>,
    /// Its value.
    pub y: Option<f64>,
    /// Δmax of the hub, ms.
    pub delta_max_ms: f64,
    /// Which objects.
    pub subset: &'static str,
    /// Mean distance of fused objects from the truth, m, matched by identity.
    pub mate_m: Option<f64>,
    /// Standard deviation of that over seeds.
    pub mate_trial_std: Option<f64>,
    /// Mean error of dimensions, m.
    pub made_m: Option<f64>,
    /// Mean error of headings, degrees.
    pub maoe_deg: Option<f64>,
    /// Share of fused objects that are right; of subsets `None`, since nobody knows where a false one belongs.
    pub precision: Option<f64>,
    /// Share of objects that are found.
    pub recall: Option<f64>,
    /// Error against that of the first agent alone under the same filter.
    pub versus_alone: Option<Interval>,
    /// Mean distance where matched by place within 4 m (all objects only).
    pub mate_by_place_m: Option<f64>,
    /// Precision of that.
    pub precision_by_place: Option<f64>,
    /// Recall of that.
    pub recall_by_place: Option<f64>,
    /// Mean GOSPA, cut off at 4 m.
    pub gospa_m: Option<f64>,
    /// Mean position NEES over its degrees of freedom.
    pub nees_position: Option<f64>,
    /// Mean normalised innovation squared over its degrees of freedom.
    pub nis: Option<f64>,
    /// Of the other agents' frames: taken in, in sequence.
    pub on_time: Option<f64>,
    /// Taken in, out of sequence.
    pub late: Option<f64>,
    /// Refused.
    pub refused: Option<f64>,
    /// Detections that arrive, bytes a second.
    pub bytes_per_s: f64,
    /// Age of the newest detection in a found object when the frame is told, ms.
    pub age_ms: Option<Stage>,
    /// From capture until a frame can be sent, ms.
    pub capture_to_send_ms: Option<Stage>,
    /// From there to the hub.
    pub send_to_arrive_ms: Option<Stage>,
    /// From there to the first fused frame with it.
    pub arrive_to_fused_ms: Option<Stage>,
    /// From there to a consumer.
    pub fused_to_consumed_ms: Option<Stage>,
    /// The hub's processor time over time; live only.
    pub cpu_share: Option<f64>,
    /// How many seeds.
    pub seeds: usize,
    /// Whether over the network.
    pub live: bool,
}

/// The records of a place and Δmax: by method, then by seed.
pub type Group<'a> = BTreeMap<SweepMethod, Vec<&'a Record>>;

/// All rows of a place.
pub fn rows(plan: &Plan, point: &Point, group: &Group<'_>) -> Vec<Row> {
    let of_method = |method: &SweepMethod| {
        let records = &group[method];
        let alone = group.get(&method.alone()).filter(|_| !method.is_alone());
        Subset::ALL.map(|subset| row(plan, (point, *method), (records, alone.map(Vec::as_slice)), subset))
    };
    plan.methods.iter().filter(|method| group.contains_key(method)).flat_map(of_method).collect()
}

fn row(
    plan: &Plan,
    (point, method): (&Point, SweepMethod),
    (records, alone): (&[&Record], Option<&[&Record]>),
    subset: Subset,
) -> Row {
    let errors: Vec<Errors> = records.iter().map(|record| total(record, subset)).collect();
    let mean_of = |sum: fn(&Errors) -> f64| mean(errors.iter().filter_map(|e| ratio(sum(e), e.found)));
    let is_all = subset == Subset::All;
    let place: Vec<Errors> = records.iter().map(|record| record.geometric.errors).collect();
    let of_all = |value: Option<f64>| value.filter(|_| is_all);
    let mut fates = Fates::default();
    records.iter().for_each(|record| fates.add(&record.fates));
    let n_frames = fates.on_time + fates.late + fates.refused;
    let share = |n: u64| ratio(n as f64, n_frames);
    let stage = |of: fn(&Record) -> &Vec<f64>| stage(records, of);
    Row {
        method: method.key(),
        axis: plan.axes[0].name.clone(),
        x: point.values[0].x,
        x_text: point.values[0].text.clone(),
        axis_2: plan.axes.get(1).map(|axis| axis.name.clone()),
        y: point.values.get(1).map(|value| value.x),
        delta_max_ms: point.delta_max_ms,
        subset: subset.name(),
        mate_m: mean_of(|e| e.ate_m),
        mate_trial_std: std(errors.iter().filter_map(|e| ratio(e.ate_m, e.found))),
        made_m: mean_of(|e| e.ade_m),
        maoe_deg: mean_of(|e| e.aoe_deg),
        precision: of_all(mean(errors.iter().filter_map(|e| ratio(e.found as f64, e.found + e.false_)))),
        recall: mean(errors.iter().filter_map(|e| ratio(e.found as f64, e.found + e.missed))),
        versus_alone: alone.and_then(|alone| versus(alone, records, subset)),
        mate_by_place_m: of_all(mean(place.iter().filter_map(|e| ratio(e.ate_m, e.found)))),
        precision_by_place: of_all(mean(
            place.iter().filter_map(|e| ratio(e.found as f64, e.found + e.false_)),
        )),
        recall_by_place: of_all(mean(place.iter().filter_map(|e| ratio(e.found as f64, e.found + e.missed)))),
        gospa_m: of_all(mean(records.iter().filter_map(|r| ratio(r.geometric.gospa_m, r.geometric.frames)))),
        nees_position: of_all(mean(records.iter().filter_map(|r| ratio(r.nees.0, r.nees.1)))),
        nis: of_all(mean(records.iter().filter_map(|r| ratio(r.nis.0, r.nis.1)))),
        on_time: share(fates.on_time),
        late: share(fates.late),
        refused: share(fates.refused),
        bytes_per_s: mean(records.iter().map(|record| record.bytes_per_s)).unwrap_or(0.0),
        age_ms: stage(|record| &record.age_ms),
        capture_to_send_ms: stage(|record| &record.capture_to_send_ms),
        send_to_arrive_ms: stage(|record| &record.send_to_arrive_ms),
        arrive_to_fused_ms: stage(|record| &record.arrive_to_fused_ms),
        fused_to_consumed_ms: stage(|record| &record.fused_to_consumed_ms),
        cpu_share: mean(records.iter().filter_map(|record| record.cpu_share)),
        seeds: records.len(),
        live: plan.live,
    }
}

/// All stretches of a run together.
pub fn total(record: &Record, subset: Subset) -> Errors {
    let mut total = Errors::default();
    record.blocks.iter().for_each(|block| total.add(&block[subset as usize]));
    total
}

fn versus(alone: &[&Record], records: &[&Record], subset: Subset) -> Option<Interval> {
    let mut pairs: Vec<Pair> = Vec::new();
    for (alone, record) in alone.iter().zip(records) {
        for (alone, block) in alone.blocks.iter().zip(&record.blocks) {
            let sum = |errors: &Errors| (errors.ate_m, errors.found as f64);
            pairs.push([sum(&block[subset as usize]), sum(&alone[subset as usize])]);
        }
    }
    let ratio = bootstrap(&pairs, 1);
    ratio.ratio.is_finite().then_some(Interval { ratio: ratio.ratio, low: ratio.low, high: ratio.high })
}

/// A distribution's percentiles, averaged over runs.
pub fn mean_distribution(records: &[&Record], of: impl Fn(&Record) -> &Vec<f64>) -> Option<Vec<f64>> {
    let full: Vec<&Vec<f64>> =
        records.iter().map(|record| of(record)).filter(|values| !values.is_empty()).collect();
    if full.is_empty() {
        return None;
    }
    Some(
        (0..PERCENTS.len())
            .map(|place| full.iter().map(|values| values[place]).sum::<f64>() / full.len() as f64)
            .collect(),
    )
}

fn stage(records: &[&Record], of: fn(&Record) -> &Vec<f64>) -> Option<Stage> {
    let values = mean_distribution(records, of)?;
    let at = |percent: u32| PERCENTS.iter().position(|known| *known == percent).map(|place| values[place]);
    Some(Stage { p50: at(50)?, p95: at(95)?, p99: at(99)? })
}

fn ratio(sum: f64, n: u64) -> Option<f64> {
    (n > 0).then(|| sum / n as f64)
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, n) = values.fold((0.0, 0), |(sum, n), value| (sum + value, n + 1));
    ratio(sum, n)
}

/// Standard deviation of a sample; `None` of fewer than two.
fn std(values: impl Iterator<Item = f64>) -> Option<f64> {
    let values: Vec<f64> = values.collect();
    let mean = mean(values.iter().copied())?;
    let n = values.len() as u64;
    let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    (n > 1).then(|| libm::sqrt(squares / (n - 1) as f64))
}
