//! A log of which nothing can be fused: why, and what to do.

use super::args::FuseArgs;
use super::truth_check::Known;
use crate::data::detection_log::{DetectionLog, Survey};
use crate::data::seconds;
use crate::data::truth_table::TOLERANCE;
use crate::drive::replay::Counts;
use anyhow::bail;
use std::io::Read;
use std::path::Path;
use v2x_common::id::AgentId;
use v2x_common::time::Span;
use v2x_fusion_hub::diagnosis::{Code, Finding};

/// Longest latency that the settings take.
const MOST_LATENCY: Span = Span::from_millis(60_000);
/// What is refused of a log that cannot be used: the first frames of one with times in a wrong unit can be taken.
const REFUSED: (u64, u64) = (9, 10);

/// An error where hardly a frame of a log is taken, or no detection, so that no object was published.
pub(super) fn check<R: Read>(
    (path, log): (&Path, &DetectionLog<R>),
    counts: &Counts,
    (survey, findings): (&Survey, &[Finding]),
) -> anyhow::Result<()> {
    let refused: u64 = counts.refused.values().sum();
    let dropped: u64 = log.remarks().dropped().map(|one| one.count).sum();
    let is_refused = refused * REFUSED.1 >= counts.frames * REFUSED.0;
    if !is_refused && (counts.detections > 0 || dropped == 0) {
        return Ok(());
    }
    let reasons: Vec<_> = counts.refused.iter().map(|(reason, n)| format!("{reason} {n}")).collect();
    let what = match is_refused {
        true => format!("{refused} of {} frames are refused ({})", counts.frames, reasons.join(", ")),
        false => format!("all {dropped} detections are impossible, and are dropped"),
    };
    // Times in a wrong unit explain all the rest.
    let of_times: Vec<_> = findings.iter().filter(|one| one.code == Code::TimeUnit).collect();
    let mut lines: Vec<_> = of_times.iter().map(ToString::to_string).collect();
    if lines.is_empty() {
        lines.extend(counts.refused.keys().filter_map(|reason| remedy(reason, log, survey)));
        lines.extend(log.remarks().dropped().map(|one| {
            format!(
                "{}: {} of its detections: {}; the first is in line {}",
                one.sensor, one.count, one.first, one.first_line
            )
        }));
        lines.extend(findings.iter().filter(|one| one.is_fault()).map(ToString::to_string));
    }
    let lines: String = lines.iter().map(|line| format!("\n  {line}")).collect();
    bail!("nothing of {} can be fused: {what}; no file is written{lines}", path.display())
}

/// An error where a truth has rows, and none of them within the times of the log: nothing could be scored.
pub(super) fn check_truth(args: &FuseArgs, (truth, _): &Known, survey: &Survey) -> anyhow::Result<()> {
    let sensors = || survey.sensors().values();
    let first = sensors().map(|of| of.captured.0).min();
    // Lists are of times up to the last arrival.
    let last = sensors().map(|of| of.captured.1 + of.delay.1.max(Span::ZERO)).max();
    let ((begin, end), Some(first), Some(last)) = (truth.span(), first, last) else { return Ok(()) };
    let is_empty = begin > end;
    if is_empty || begin <= last && end >= first {
        return Ok(());
    }
    bail!(
        "the times of the truth are not those of the log, so that nothing can be scored: {} is of {} to {} s, and {} of {} to {} s; \
         no file is written\n  Write `t` of both in seconds from the same time on: milliseconds divided by 1000, and the same \
         epoch; or leave out --truth",
        args.truth.as_deref().unwrap_or(Path::new("the truth")).display(),
        seconds::text(begin + TOLERANCE),
        seconds::text(end - TOLERANCE),
        args.detections.display(),
        seconds::text(first),
        seconds::text(last)
    )
}

/// What to do about frames that are refused for a reason.
fn remedy<R: Read>(reason: &str, log: &DetectionLog<R>, survey: &Survey) -> Option<String> {
    let delays = || survey.sensors().values().map(|of| of.delay);
    let longest = delays().map(|(_, longest)| longest).max()?;
    let shortest = delays().map(|(shortest, _)| shortest).min()?;
    match reason {
        "too_late" if longest <= MOST_LATENCY => Some(format!(
            "frames arrive up to {0:.0} ms after their capture (`t_arr` less `t`). If they do, add `--delta-max-ms {0:.0}` to this command",
            longest.as_millis_f64().floor() + 1.0
        )),
        "too_late" => Some(format!(
            "frames arrive up to {:.0} s after their capture (`t_arr` less `t`), and 60 s are the most that is taken. Are both \
             times by one clock, and in their own columns?",
            longest.as_secs_f64()
        )),
        "too_early" => Some(format!(
            "frames arrive up to {:.3} s before their capture (`t` is later than `t_arr`). Are the two columns exchanged?",
            (Span::ZERO - shortest).as_secs_f64()
        )),
        "not_listened_to" => {
            let names = |agents: &mut dyn Iterator<Item = &AgentId>| {
                agents.map(AgentId::to_string).collect::<Vec<_>>().join(", ")
            };
            Some(format!(
                "`only_agents` of the settings names {}, and the sensors of the log are {}",
                names(&mut log.settings().only_agents.iter()),
                names(&mut log.sensors())
            ))
        }
        _ => None,
    }
}
