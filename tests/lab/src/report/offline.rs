//! The report of `lab fuse`.

use crate::data::detection_log::Dropped;
use crate::data::detection_log::SensorSurvey;
use crate::drive::replay::SensorOutcome;
use crate::score::offline::TruthScore;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write;
use v2x_common::id::AgentId;
use v2x_fusion_hub::hub::RegistrationStatus;
use v2x_fusion_hub::learning::LearntSensorReport;

/// All figures. A figure without data is null, never 0.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Report {
    /// The method.
    pub method: String,
    /// Sensors in the log.
    pub sensors: usize,
    /// Frames in the log.
    pub frames: u64,
    /// Detections in the log.
    pub detections: u64,
    /// From the first to the last arrival, s.
    pub duration_s: f64,
    /// Ticks, every 0.1 s.
    pub ticks: u64,
    /// Rows of the fused table.
    pub fused_rows: u64,
    /// Frames refused.
    pub refused_frames: u64,
    /// Frames refused, by reason.
    pub refused: BTreeMap<&'static str, u64>,
    /// Impossible detections, which were dropped, by sensor, field and cause.
    pub dropped_detections: Vec<Dropped>,
    /// Detections with an unknown class name.
    pub unknown_classes: u64,
    /// These names, at most 32, each with its number of detections.
    pub unknown_class_names: BTreeMap<String, u64>,
    /// Each sensor by itself.
    pub by_sensor: Vec<SensorFigures>,
    /// What is probably wrong with the log, in words.
    pub warnings: Vec<String>,
    /// The page, where one was asked for.
    pub page: Option<String>,
    /// Computing time of the engine, s.
    pub core_s: f64,
    /// Detections per second of computing time.
    pub detections_per_s: Option<f64>,
    /// The score, where the truth is known.
    pub truth: Option<TruthScore>,
    /// The second list, where there is one.
    pub lagged: Option<LaggedReport>,
}

/// The second list: the same objects, smoothed over a lag.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct LaggedReport {
    /// How far it is behind, ms.
    pub lag_ms: f64,
    /// Its file.
    pub out: Option<String>,
    /// Rows of its table.
    pub fused_rows: u64,
    /// Its score at the ticks of the first list, where the truth is known.
    pub truth: Option<TruthScore>,
}

/// The figures of one sensor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct SensorFigures {
    /// Which sensor.
    pub sensor: AgentId,
    /// Frames.
    pub frames: u64,
    /// Frames per second of capture.
    pub rate_hz: Option<f64>,
    /// Detections, impossible ones left out.
    pub detections: u64,
    /// From capture to arrival, the shortest, ms.
    pub delay_min_ms: f64,
    /// From capture to arrival, the longest, ms.
    pub delay_max_ms: f64,
    /// Mean normalised innovation squared of positions for each degree of freedom: 1 where the stated errors are right,
    /// more where they are too small.
    pub nis_per_dof: Option<f64>,
    /// Innovations in it.
    pub innovations: u64,
    /// The estimate of its clock and pose errors, where its accuracy is declared.
    pub registration: Option<RegistrationStatus>,
    /// What was learnt of it.
    pub learnt: Option<LearntSensorReport>,
}

impl SensorFigures {
    /// Of the frames of a sensor, and of what the engine found of it.
    pub(crate) fn of(sensor: AgentId, survey: &SensorSurvey, outcome: SensorOutcome) -> Self {
        Self {
            sensor,
            frames: survey.frames,
            rate_hz: survey.rate_hz(),
            detections: survey.detections,
            delay_min_ms: survey.delay.0.as_millis_f64(),
            delay_max_ms: survey.delay.1.as_millis_f64(),
            nis_per_dof: outcome.nis_per_dof,
            innovations: outcome.innovations,
            registration: outcome.registration.as_ref().map(RegistrationStatus::of),
            learnt: outcome.learnt,
        }
    }

    fn write(&self, out: &mut String) -> std::fmt::Result {
        let Self { sensor, frames, detections, delay_min_ms, delay_max_ms, innovations, .. } = self;
        write!(
            out,
            "  {:<19} {frames} frames ({} Hz), {detections} detections, {delay_min_ms:.0} to {delay_max_ms:.0} ms late",
            sensor.as_str(),
            figure(self.rate_hz, 1)
        )?;
        match self.nis_per_dof {
            Some(nis) => writeln!(out, ", NIS/dof {nis:.2} ({innovations})")?,
            None => writeln!(out)?,
        }
        if let Some(learnt) =
            self.learnt.as_ref().map(|learnt| learnt.in_words(None)).filter(|words| !words.is_empty())
        {
            writeln!(out, "  {:<19} learnt: {learnt}", "")?;
        }
        match self.registration.as_ref().and_then(RegistrationStatus::in_words) {
            Some(words) => writeln!(out, "  {:<19} {words}", ""),
            None => Ok(()),
        }
    }
}

fn figure(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
}

impl Report {
    /// The report as text.
    pub(crate) fn text(&self) -> String {
        let mut text = String::new();
        // Writing to a text cannot fail.
        let _ = self.write(&mut text);
        text
    }

    fn write(&self, out: &mut String) -> std::fmt::Result {
        let Self { method, sensors, frames, detections, duration_s, ticks, fused_rows, .. } = self;
        writeln!(
            out,
            "{method}: {detections} detections in {frames} frames of {sensors} sensors, {duration_s:.1} s"
        )?;
        writeln!(out, "  fused               {fused_rows} rows at {ticks} ticks")?;
        let rate = self.detections_per_s.map_or_else(|| "-".to_owned(), |rate| format!("{rate:.0}"));
        writeln!(out, "  detections/s/core   {rate} ({:.3} s in the engine)", self.core_s)?;
        let reasons: Vec<_> = self.refused.iter().map(|(reason, n)| format!("{reason} {n}")).collect();
        let reasons = if reasons.is_empty() { "none".to_owned() } else { reasons.join(", ") };
        writeln!(out, "  frames refused      {reasons}")?;
        for Dropped { sensor, field, cause, count, first_line, first } in &self.dropped_detections {
            writeln!(
                out,
                "  dropped             {count} detections of {sensor}: {field} {cause}; the first in line {first_line}: {first}"
            )?;
        }
        if self.unknown_classes > 0 {
            let names: Vec<_> =
                self.unknown_class_names.iter().map(|(name, n)| format!("{name} {n}")).collect();
            let (n, names) = (self.unknown_classes, names.join(", "));
            writeln!(out, "  unknown classes     {n} detections: {names}")?;
        }
        self.by_sensor.iter().try_for_each(|sensor| sensor.write(out))?;
        self.warnings.iter().try_for_each(|warning| writeln!(out, "  warning             {warning}"))?;
        self.page.iter().try_for_each(|page| writeln!(out, "  page                {page}"))?;
        self.truth.iter().try_for_each(|score| score.write(out))?;
        self.lagged.iter().try_for_each(|lagged| lagged.write(out))
    }
}

impl LaggedReport {
    fn write(&self, out: &mut String) -> std::fmt::Result {
        let file = self.out.as_ref().map(|path| format!(" in {path}")).unwrap_or_default();
        writeln!(out, "the second list, {} ms behind: {} rows{file}", self.lag_ms, self.fused_rows)?;
        self.truth.iter().try_for_each(|score| score.write(out))
    }
}

impl TruthScore {
    /// As words, line by line.
    pub(crate) fn lines(&self) -> Vec<String> {
        let mut text = String::new();
        // Writing to a text cannot fail.
        let _ = self.write(&mut text);
        text.lines().map(|line| line.trim().trim_end_matches(':').to_owned()).collect()
    }

    fn write(&self, out: &mut String) -> std::fmt::Result {
        let m = &self.metrics;
        writeln!(
            out,
            "against the truth, at {} ticks, matched within {} m and class:",
            m.frames, self.match_radius_m
        )?;
        writeln!(
            out,
            "  ATE {} m   ADE {} m   AOE {}°   velocity {} m/s",
            figure(m.ate_m, 3),
            figure(m.ade_m, 3),
            figure(m.aoe_deg, 2),
            figure(self.velocity_error_mps, 3)
        )?;
        writeln!(
            out,
            "  precision {}   recall {}   GOSPA {} m",
            figure(m.precision, 4),
            figure(m.recall, 4),
            figure(m.gospa_m, 3)
        )?;
        let t = &self.tracking;
        writeln!(
            out,
            "  F1 {}   MOTA {}   IDF1 {}   HOTA {}   AMOTA {}   NEES/dof {}",
            figure(self.f1, 4),
            figure(t.mota, 4),
            figure(t.idf1, 4),
            figure(t.hota, 4),
            figure(t.amota, 4),
            figure(m.nees_position, 2)
        )?;
        let h = &self.headings;
        let percent = |share: Option<f64>| figure(share.map(|share| 100.0 * share), 1);
        writeln!(
            out,
            "  headings turned by more than 90° {} %   moving (above 1 m/s over a second): median {}°, turned {} %",
            percent(h.turned_share),
            figure(h.moving_heading_median_deg, 2),
            percent(h.moving_turned_share)
        )?;
        let d = &self.detection;
        let list = |values: Option<&[f64]>| match values {
            Some(values) => values.iter().map(|value| format!("{value:.3}")).collect::<Vec<_>>().join(" "),
            None => "-".to_owned(),
        };
        writeln!(
            out,
            "  AP at IoU .3 .5 .7: {}   at 0.5, 1, 2, 4 m: {}   mAP {}",
            list(d.ap_iou.as_ref().map(<[f64; 3]>::as_slice)),
            list(d.ap_distance.as_ref().map(<[f64; 4]>::as_slice)),
            figure(d.map, 3)
        )?;
        writeln!(
            out,
            "  nuScenes at 2 m: ATE {} m   ASE {}   AOE {} rad   AVE {} m/s   NDS without attributes {}",
            figure(d.nuscenes_ate_m, 3),
            figure(d.nuscenes_ase, 3),
            figure(d.nuscenes_aoe_rad, 3),
            figure(d.nuscenes_ave_mps, 3),
            figure(d.nds_without_attributes, 3)
        )?;
        let (switches, ids) = (self.id_switches, figure(self.ids_per_object, 2));
        writeln!(out, "  ID switches {switches}   tracks per object {ids}")?;
        if self.unknown_classes > 0 {
            writeln!(out, "  unknown classes in {} rows of the truth", self.unknown_classes)?;
        }
        Ok(())
    }
}
