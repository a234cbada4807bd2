//! The report of `lab fuse`.

use crate::score::offline::TruthScore;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write;

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
    /// Detections with an unknown class name.
    pub unknown_classes: u64,
    /// Computing time of the engine, s.
    pub core_s: f64,
    /// Detections per second of computing time.
    pub detections_per_s: Option<f64>,
    /// The score, where the truth is known.
    pub truth: Option<TruthScore>,
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
        if self.unknown_classes > 0 {
            writeln!(out, "  unknown classes     {} detections", self.unknown_classes)?;
        }
        match &self.truth {
            Some(score) => score.write(out),
            None => Ok(()),
        }
    }
}

impl TruthScore {
    fn write(&self, out: &mut String) -> std::fmt::Result {
        let figure = |value: Option<f64>, digits: usize| {
            value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
        };
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
            "  headings turned by more than 90° {} %   moving (above 1 m/s): median {}°, turned {} %",
            percent(h.turned_share),
            figure(h.moving_heading_median_deg, 2),
            percent(h.moving_turned_share)
        )?;
        let (switches, ids) = (self.id_switches, figure(self.ids_per_object, 2));
        writeln!(out, "  ID switches {switches}   tracks per object {ids}")?;
        if self.unknown_classes > 0 {
            writeln!(out, "  unknown classes in {} rows of the truth", self.unknown_classes)?;
        }
        Ok(())
    }
}
