//! Frames that say again what was said before.

use super::super::finding::{Code, Finding};
use super::super::window::{AgentSurvey, Source, Surroundings, Window};
use super::one::{MIN_VALUES, One, is_share};
use super::writing;
use v2x_common::id::AgentId;

/// Results that came several times each, frames in which nothing changed, and frames of the hub's own objects.
const MIN_RESULTS: u64 = 5;
const MIN_FROZEN: u64 = 40;
const MIN_FED_BACK: u64 = 3;
/// Frames of another agent.
const MIN_COPIED: u64 = 5;
/// Reports with smaller errors than this are exact, m; and so are those of which innovations are such a part of what they may be, squared.
const EXACT_M: f64 = 0.02;
const EXACT_NIS: f64 = 0.25;
/// So many messages of one time, beyond the first, are parts of what was seen: two may be of two processes.
const PARTS: u64 = 3;
/// So many of each time, beyond the first, under numbers of their own.
const SPLIT_SHARE: f64 = 0.7;
/// Tracks of its own that are back, and the share of them that are too far from where they were.
const MIN_TRACKS: u64 = 50;
const JUMPED_SHARE: f64 = 0.1;
/// Objects that are sent on, and detections of these.
const MIN_STALE: u64 = 3;
const MIN_STALE_DETECTIONS: u64 = 20;
/// Share of frames that are sent again from which they are told.
const AGAIN_SHARE: f64 = 0.1;
/// Share of frames under the number of another one from which numbers are wrong.
const NUMBERS_SHARE: f64 = 0.1;

pub(super) fn findings(one: &One<'_>) -> Vec<Finding> {
    if one.survey.arrivals.is_one_stamp() {
        return Vec::new();
    }
    [numbers(one), repetition(one), feedback(one), stale(one), source_tracks(one)]
        .into_iter()
        .flatten()
        .collect()
}

/// Frames with other detections under the number of the one before, of which only the first is taken.
#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
pub(super) fn numbers(one: &One<'_>) -> Option<Finding> {
    let (contents, frames) = (&one.survey.contents, one.survey.arrivals.frames);
    let is_often = |count: u64| count >= MIN_VALUES / 2 && count as f64 >= NUMBERS_SHARE * frames as f64;
    if is_often(contents.parts) && 2 * contents.parts >= PARTS * contents.times {
        let says = format!(
            "{} of {frames} frames have the time and number of the one before, and other detections: each holds a part of what was \
             seen at one time, and only the first one is taken",
            contents.parts
        );
        let change = "Send all detections of one time in one message";
        return Some(one.fault(Code::PartialFrames, says, change));
    }
    if is_often(contents.split) && contents.split as f64 >= SPLIT_SHARE * contents.times as f64 {
        let says = format!(
            "{} of {frames} frames have the time of the one before, and other detections: each holds a part of what was seen at one time, and \
             is taken for all of it, so that the others deny what it reports",
            contents.split
        );
        let change = "Send all detections of one time in one message; what several sensors see at one time under a name for each";
        return Some(one.fault(Code::PartialFrames, says, change));
    }
    is_often(contents.uncounted).then(|| {
        let says = format!(
            "`sequence` does not count its frames: {} of {frames} have the number of the one before, and are taken for repetitions",
            contents.uncounted
        );
        one.fault(Code::PartialFrames, says, "Count up `sequence` with every message, or leave it out of JSON")
    })
}

fn repetition(one: &One<'_>) -> Option<Finding> {
    let contents = &one.survey.contents;
    let (repeated, compared) = (contents.repeated, contents.compared);
    if is_share(contents.again, contents.again + contents.times, AGAIN_SHARE) {
        let says = format!(
            "{} frames of it came before, with the same time and detections, under another number: each is taken for a measurement of its own",
            contents.again
        );
        let change = "Send each frame once; whoever sends it again, because an answer is late, leaves its `sequence` and `epoch` as they are";
        return Some(one.fault(Code::Repetition, says, change));
    }
    if contents.comes_several_times(MIN_RESULTS) {
        let says = format!(
            "{repeated} of {compared} frames hold, to the last digit, what the one before held, under a new stamp: each result \
             comes several times, and is taken for as many measurements"
        );
        let change = one.words(
            "Send each result once, with the time of its measurement",
            "Keep the first row of each result, with the time of its measurement",
        );
        return Some(one.fault(Code::Repetition, says, change));
    }
    // Positions that are dropped for being nowhere near the origin leave nothing that could differ.
    let is_nowhere = writing::off_origin(one).is_some();
    (!is_nowhere && contents.never_changes(MIN_FROZEN)).then(|| {
        let says = format!(
            "its {compared} frames hold the same detections to the last digit, under new stamps: its detector may hang"
        );
        let change = "Where reports are exact and nothing moves in its view, this is right; a sensor's reports vary";
        one.note(Code::Repetition, says, change)
    })
}

/// Objects that drove, and then stay where they were to the last digit: a list that forgets none.
fn stale(one: &One<'_>) -> Option<Finding> {
    let (stale, coasting) = (&one.survey.stale, &one.survey.coasting);
    let is_often = |objects: u64, detections: u64| objects >= MIN_STALE && detections >= MIN_STALE_DETECTIONS;
    let stays = is_often(stale.objects, stale.detections);
    (stays || is_often(coasting.objects, coasting.detections)).then(|| {
        let drives_on = || {
            format!(
                "it sends on what it has lost: {} vehicles scattered as what is seen does, and then drive on for seconds exactly straight, to the \
                 millimetre ({} detections)",
                coasting.objects, coasting.detections
            )
        };
        let stands = || {
            format!(
                "it sends on what it has lost: {} vehicles drove, and from one frame to the next stay where they were, to the last digit, for \
                 seconds ({} detections)",
                stale.objects, stale.detections
            )
        };
        let says = if stays { stands() } else { drives_on() };
        let change = one.words(
            "Send what the sensor sees in each frame. Of a tracker's list leave out tracks that this frame has not updated: they never vanish, and \
             the hub takes each for an object that is seen",
            "Leave out rows of tracks that the frame has not updated: they never vanish, and each is taken for an object that is seen",
        );
        one.fault(Code::StaleObjects, says, change)
    })
}

/// Numbers of tracks that go from one object to another, such as places in a list.
#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
fn source_tracks(one: &One<'_>) -> Option<Finding> {
    let tracks = &one.survey.own_tracks;
    let is_often =
        tracks.returned >= MIN_TRACKS && tracks.jumped as f64 >= JUMPED_SHARE * tracks.returned as f64;
    is_often.then(|| {
        let says = format!(
            "its `source_track` goes from one object to another: {} of {} times the same number was back, it was further away than \
             anything moves",
            tracks.jumped, tracks.returned
        );
        let change = one.words(
            "`source_track` is the number of a track that a tracker keeps on one object, and no place in a list; leave it out where there is none",
            "The column source_track is the number of a track that a tracker keeps on one object, and no place in a list; leave it empty where \
             there is none",
        );
        one.fault(Code::SourceTracks, says, change)
    })
}

fn feedback(one: &One<'_>) -> Option<Finding> {
    // In a log lists are of the times of frames: exact reports are where they are.
    let fed_back = if one.around.source == Source::Network { one.survey.fed_back } else { 0 };
    (fed_back >= MIN_FED_BACK).then(|| {
        let says = format!(
            "it publishes this hub's own objects: frames of it ({fed_back}) have them, to the last digit, where a list had them"
        );
        let change = "An agent publishes what its own sensor sees. What was fused comes back as a second witness of itself, and errors \
                      grow: read lists, and publish none of them as detections";
        one.fault(Code::Feedback, says, change)
    })
}

/// Agents that publish what another one has published.
pub(super) fn copies(window: &Window, around: &Surroundings<'_>) -> Vec<Finding> {
    let of = |survey: &AgentSurvey| {
        let most = survey.copied.iter().max_by_key(|(_, count)| **count);
        most.map(|(whose, count)| (*whose, *count)).filter(|(_, count)| *count >= MIN_COPIED)
    };
    let copies = window.agents.iter().filter_map(|(agent, survey)| Some((*agent, of(survey)?)));
    // In a log both come at one time, and each may be the first one.
    let is_first = |agent: AgentId, (whose, count): (AgentId, u64)| {
        let back = window.agents.get(&whose).and_then(|other| other.copied.get(&agent)).copied().unwrap_or(0);
        (count, agent) >= (back, whose)
    };
    let copies = copies.filter(|(agent, of)| is_first(*agent, *of));
    let copies = copies
        .filter(|(agent, (whose, _))| ![agent, whose].into_iter().any(|one| is_exact(one, window, around)));
    copies
        .map(|(agent, (whose, count))| {
            let says = format!(
                "it publishes what {whose} has published: {count} frames of it have their detections, to the millimetre, where \
                 {whose} had them"
            );
            let change = format!(
                "Two sensors never agree so: what comes twice counts as two witnesses, and what is fused is taken for better than it is. Let \
                 {agent} publish what its own sensor sees, or leave it out"
            );
            Finding::fault(Code::Copy, agent, says, change)
        })
        .collect()
}

/// Whether what an agent reports may have no errors, as in a simulation: then two can agree to the millimetre. So it is as long as nobody knows.
fn is_exact(agent: &AgentId, window: &Window, around: &Surroundings<'_>) -> bool {
    let sigma_m = window.agents.get(agent).and_then(|survey| survey.writing.mean_sigma_m());
    let Some(record) = around.engine.agents().record(agent) else { return true };
    let nis = record.statistics.recent_nis_per_dof(around.engine.now());
    let learnt = around.engine.learnt(agent).map_or(1.0, |learnt| learnt.sigma_factor);
    sigma_m.is_none_or(|sigma_m| sigma_m < EXACT_M) || nis.is_none_or(|nis| nis * learnt * learnt < EXACT_NIS)
}
