//! The rows of a sweep: means over seeds, with intervals.

use crate::drive::sweep::method::SweepMethod;
use crate::drive::sweep::plan::{Plan, Point};
use crate::score::bootstrap::{Pair, bootstrap};
use crate::score::sweep::record::{ByPosition, Errors, FrameCounts, PERCENTS, Record, Subset};
use serde::Serialize;
use std::collections::BTreeMap;

/// A ratio of errors with its 95 % interval (paired bootstrap over seeds, and stretches of 5 s of each, on common
/// random numbers).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Interval {
    /// The ratio.
    pub ratio: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Three percentiles, ms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Stage {
    /// The median.
    pub p50: f64,
    /// 95 %.
    pub p95: f64,
    /// 99 %.
    pub p99: f64,
}

/// One method at one point, for one subset of objects. Means are over seeds. A figure without data is `None`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Row {
    /// The method.
    pub method: &'static str,
    /// The axis.
    pub axis: String,
    /// Its value, or the place in the list if it is no number.
    pub x: f64,
    /// Its value as typed.
    pub x_text: String,
    /// The second axis.
    pub axis_2: Option<String>,
    /// Its value.
    pub y: Option<f64>,
    /// Its value as typed.
    pub y_text: Option<String>,
    /// Δmax of the hub, ms.
    pub delta_max_ms: f64,
    /// The subset of objects.
    pub subset: &'static str,
    /// Mean time of the other agents' frames from capture to the hub, ms.
    pub delay_ms: Option<f64>,
    /// Mean distance of fused objects from the truth, m, matched by provenance. All errors of several boxes of one object
    /// count.
    pub mate_m: Option<f64>,
    /// Standard deviation of that over seeds.
    pub mate_trial_std: Option<f64>,
    /// Mean error of dimensions, m.
    pub made_m: Option<f64>,
    /// Mean error of headings, degrees.
    pub maoe_deg: Option<f64>,
    /// Share of fused objects that are right. False objects count among all objects, and in no subset.
    pub precision: Option<f64>,
    /// Share of objects that are found.
    pub recall: Option<f64>,
    /// Error against that of the first agent alone under the same filter.
    pub versus_alone: Option<Interval>,
    /// The same against a rollback that loses newer data; of `replay` only.
    pub versus_rollback_literal: Option<Interval>,
    /// The gain over the first agent alone, relative to the gain at the first value of the axis.
    pub kept: Option<f64>,
    /// Mean distance where matched by position within 4 m (all objects only).
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
    /// Share of the other agents' frames that arrived with a stamp not earlier than those before (less ε_s).
    pub on_time: Option<f64>,
    /// Share with an earlier stamp.
    pub late: Option<f64>,
    /// Share accepted out of sequence.
    pub rolled_back: Option<f64>,
    /// Share refused.
    pub refused: Option<f64>,
    /// The first agent's frames that were refused, all seeds together.
    pub frames_refused_of_first: u64,
    /// Detections that arrive, bytes per second.
    pub bytes_per_s: f64,
    /// Age of the newest detection in a found object when the frame is published, ms.
    pub age_ms: Option<Stage>,
    /// Age of the other agents' newest one.
    pub other_age_ms: Option<Stage>,
    /// Of the other agents' frames, or of the first one's where it is alone: from capture until it is sent, ms.
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

/// An interval needs at least this many stretches of 5 s.
const FEWEST_STRETCHES: usize = 8;

impl Row {
    /// A row with every field: it defines the columns.
    pub(crate) fn full() -> Self {
        let (interval, stage) = (Some(Interval::default()), Some(Stage::default()));
        Self {
            versus_alone: interval,
            versus_rollback_literal: interval,
            age_ms: stage,
            other_age_ms: stage,
            capture_to_send_ms: stage,
            send_to_arrive_ms: stage,
            arrive_to_fused_ms: stage,
            fused_to_consumed_ms: stage,
            ..Self::default()
        }
    }
}

/// The records of a point: by method, then by seed.
pub(crate) type Group<'a> = BTreeMap<SweepMethod, Vec<&'a Record>>;

/// All rows of a point.
pub(crate) fn rows(plan: &Plan, point: &Point, group: &Group<'_>) -> Vec<Row> {
    let of_method = |method: &SweepMethod| {
        let records = &group[method];
        let of = |other: Option<SweepMethod>| other.and_then(|other| group.get(&other)).map(Vec::as_slice);
        let rollback = Some(SweepMethod::RollbackLiteral).filter(|_| *method == SweepMethod::Replay);
        let runs = Runs { method: *method, records, alone: of(method.alone()), rollback: of(rollback) };
        Subset::ALL.map(|subset| row(plan, point, &runs, subset))
    };
    plan.methods.iter().filter(|method| group.contains_key(method)).flat_map(of_method).collect()
}

/// The runs of a method at a point, by seed, and those that it is compared with.
#[derive(Clone, Copy, Debug)]
struct Runs<'a> {
    method: SweepMethod,
    records: &'a [&'a Record],
    /// Of the first agent alone under the same filter.
    alone: Option<&'a [&'a Record]>,
    /// Of a rollback that loses newer data.
    rollback: Option<&'a [&'a Record]>,
}

fn row(plan: &Plan, point: &Point, runs: &Runs<'_>, subset: Subset) -> Row {
    let Runs { method, records, alone, rollback } = *runs;
    let runs: Vec<Errors> = records.iter().map(|record| total(record, subset)).collect();
    let (mut all, mut place, mut frames) = (Errors::default(), ByPosition::default(), FrameCounts::default());
    runs.iter().for_each(|run| all.add(run));
    for record in records {
        place.errors.add(&record.by_position.errors);
        (place.gospa_m, place.frames) =
            (place.gospa_m + record.by_position.gospa_m, place.frames + record.by_position.frames);
        frames.add(&record.frames);
    }
    let is_all = subset == Subset::All;
    let of_all = |value: Option<f64>| value.filter(|_| is_all);
    let pooled = |of: fn(&Record) -> (f64, u64)| {
        let sums = records.iter().map(|record| of(record));
        let (sum, n) = sums.fold((0.0, 0), |(sum, n), (value, count)| (sum + value, n + count));
        ratio(sum, n)
    };
    let by_place = place.errors;
    let stage = |of: fn(&Record) -> &Vec<f64>| stage(records, of);
    Row {
        method: method.key(),
        axis: plan.axes[0].name.clone(),
        x: point.values[0].x,
        x_text: point.values[0].text.clone(),
        axis_2: plan.axes.get(1).map(|axis| axis.name.clone()),
        y: point.values.get(1).map(|value| value.x),
        y_text: point.values.get(1).map(|value| value.text.clone()),
        delta_max_ms: point.delta_max_ms,
        subset: subset.name(),
        delay_ms: mean(records.iter().filter_map(|record| record.delay_ms)),
        mate_m: ratio(all.ate_m, all.found),
        mate_trial_std: std(runs.iter().filter_map(|run| ratio(run.ate_m, run.found))),
        made_m: ratio(all.ade_m, all.found),
        maoe_deg: ratio(all.aoe_deg, all.found),
        precision: ratio(all.found as f64, all.found + all.false_),
        recall: ratio(all.found as f64, all.found + all.missed),
        versus_alone: alone.and_then(|alone| versus(alone, records, subset)),
        versus_rollback_literal: rollback.and_then(|rollback| versus(rollback, records, subset)),
        kept: None,
        mate_by_place_m: of_all(ratio(by_place.ate_m, by_place.found)),
        precision_by_place: of_all(ratio(by_place.found as f64, by_place.found + by_place.false_)),
        recall_by_place: of_all(ratio(by_place.found as f64, by_place.found + by_place.missed)),
        gospa_m: of_all(ratio(place.gospa_m, place.frames)),
        nees_position: of_all(pooled(|record| record.nees)),
        nis: of_all(pooled(|record| record.nis)),
        on_time: ratio((frames.arrived - frames.late) as f64, frames.arrived),
        late: ratio(frames.late as f64, frames.arrived),
        rolled_back: ratio(frames.rolled_back as f64, frames.handled),
        refused: ratio(frames.refused as f64, frames.handled),
        frames_refused_of_first: frames.refused_of_first,
        bytes_per_s: mean(records.iter().map(|record| record.bytes_per_s)).unwrap_or(0.0),
        age_ms: stage(|record| &record.age_ms),
        other_age_ms: stage(|record| &record.other_age_ms),
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
pub(crate) fn total(record: &Record, subset: Subset) -> Errors {
    let mut total = Errors::default();
    record.blocks.iter().for_each(|block| total.add(&block[subset as usize]));
    total
}

/// The ratio of two methods' errors; `None` where there are too few stretches for an interval.
fn versus(baseline: &[&Record], records: &[&Record], subset: Subset) -> Option<Interval> {
    let sum = |block: &[Errors; 4]| (block[subset as usize].ate_m, block[subset as usize].found as f64);
    let of_seed = |(baseline, record): (&&Record, &&Record)| -> Vec<Pair> {
        record.blocks.iter().zip(&baseline.blocks).map(|(own, baseline)| [sum(own), sum(baseline)]).collect()
    };
    let seeds: Vec<Vec<Pair>> = baseline.iter().zip(records).map(of_seed).collect();
    if seeds.iter().map(Vec::len).sum::<usize>() < FEWEST_STRETCHES {
        return None;
    }
    let ratio = bootstrap(&seeds, 1);
    ratio.ratio.is_finite().then_some(Interval { ratio: ratio.ratio, low: ratio.low, high: ratio.high })
}

/// Fills in `kept`: the gain over the first agent alone, relative to that at the first value of the axis.
pub(crate) fn note_kept(rows: &mut [Row]) {
    let gain = |row: &Row| Some(row.mate_m? / row.versus_alone?.ratio - row.mate_m?);
    let is_family = |a: &Row, b: &Row| {
        (a.method, a.subset, a.live) == (b.method, b.subset, b.live)
            && (a.y == b.y && a.delta_max_ms == b.delta_max_ms)
    };
    let mut references: Vec<Row> = Vec::new();
    for row in rows {
        let reference = match references.iter().find(|reference| is_family(reference, row)) {
            Some(reference) => gain(reference),
            None => {
                references.push(row.clone());
                gain(row)
            }
        };
        row.kept = gain(row).zip(reference).filter(|(_, all)| *all > 0.0).map(|(gain, all)| gain / all);
    }
}

/// A distribution's percentiles, averaged over runs.
pub(crate) fn mean_distribution(records: &[&Record], of: impl Fn(&Record) -> &Vec<f64>) -> Option<Vec<f64>> {
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

/// Standard deviation of a sample; `None` with fewer than two values.
fn std(values: impl Iterator<Item = f64>) -> Option<f64> {
    let values: Vec<f64> = values.collect();
    let mean = mean(values.iter().copied())?;
    let n = values.len() as u64;
    let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    (n > 1).then(|| libm::sqrt(squares / (n - 1) as f64))
}
