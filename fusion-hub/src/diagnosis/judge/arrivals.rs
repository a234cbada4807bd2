//! Clock, link, gaps, and processes of one name.

use super::super::finding::{Code, Finding};
use super::contents;
use super::one::{MIN_VALUES, One};
use v2x_common::duration::in_words;
use v2x_common::time::Span;

/// Frames that arrive earlier than this before their capture: clocks are not read more exactly.
pub(super) const AHEAD: Span = Span::from_millis(-5);
/// Frames that all arrive later than this after their capture.
const LONG_DELAY: Span = Span::from_millis(250);
/// A delay is constant, as that of a clock is and that of a slow link is not, where it varies by less than this share.
const CONSTANT_SHARE: f64 = 0.1;
/// Fewest frames that say anything of a clock: a sensor may send one in two seconds.
const MIN_FRAMES: u64 = 4;
/// Clocks that objects show to agree within this are right, s; a difference from the other one on is one in any case.
const RIGHT_S: f64 = 0.08;
const WRONG_S: f64 = 0.15;
/// The largest correction that a hub takes.
const MOST_OFFSET: Span = Span::from_millis(60_000);
/// What is further behind is of another day.
const A_DAY: Span = Span::from_millis(86_400_000);
/// A clock error that objects show is the cause of a delay from this share on.
const CAUSE_SHARE: f64 = 0.5;
/// Shares of missing frames from which they are reported, and from which they are a fault.
const GAPS: (f64, f64) = (0.05, 0.3);
/// A rate below this share of the declared one is reported.
const LOW_RATE: f64 = 0.6;
/// A rate from this share of the declared one on may be that of two processes.
const HIGH_RATE: f64 = 1.7;
/// Shares of frames from which they are those of two processes: that show what the last but one showed, and that go back in time.
const RETURNS_SHARE: f64 = 0.3;
const BACKWARDS_SHARE: f64 = 0.2;
/// Stamps that differ so much from arrivals scatter, s, or the link is irregular.
const SCATTERED_S: f64 = 0.03;
/// Stamps that scatter by so much are no times of measurement, s; and by such a part of what they are ahead, they are why.
const STAMPS_JITTER_S: f64 = 0.01;
const CAUSE_OF_LEAD: f64 = 0.2;
/// Times of transport that vary by more, s.
const JITTER_S: f64 = 0.1;
/// Standard deviations within which a clock error is one that its agent declares.
const DECLARED_SIGMAS: f64 = 3.0;

/// What the objects that an agent shares with others show of its clock.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ClockByObjects {
    /// How far it is behind, s; `None` where nothing that moves is shared.
    pub(super) behind_s: Option<f64>,
    /// Whether they are where others see them at the times of its stamps.
    pub(super) agrees: bool,
}

pub(super) fn findings(one: &One<'_>, by_objects: ClockByObjects) -> Vec<Finding> {
    if let Some(found) = one_stamp(one) {
        // Delays, numbers and repetitions only follow from it.
        return vec![found];
    }
    // What numbers do not count is said where they are.
    let streams = || two_processes(one).or_else(|| two_streams(one));
    let streams = if contents::numbers(one).is_none() { streams() } else { None };
    [clock(one, by_objects), streams, gaps(one), rate(one), jitter(one)].into_iter().flatten().collect()
}

/// Stamps that never advance: neither a clock nor a link does that.
fn one_stamp(one: &One<'_>) -> Option<Finding> {
    let arrivals = &one.survey.arrivals;
    arrivals.is_one_stamp().then(|| {
        let says = format!("`captured_at` is the same in all its frames ({} frames)", arrivals.frames);
        let change = one.words(
            "Stamp each frame anew, with the time of its measurement",
            "Write each row's own time in the column t",
        );
        one.fault(Code::OneStamp, says, change)
    })
}

fn clock(one: &One<'_>, ClockByObjects { behind_s, agrees }: ClockByObjects) -> Option<Finding> {
    let arrivals = &one.survey.arrivals;
    let (least, most) = arrivals.delay()?;
    if arrivals.frames < MIN_FRAMES {
        return None;
    }
    if arrivals.counts_from_1980() {
        let says = "its `captured_at` counts from 1980, as GPS does, and not from 1970: all its frames are refused (too_late)";
        let change = one.words(
            "Add 315964800 s to GPS time, and take the leap seconds away (18 s since 2017): `captured_at` is Unix time, in UTC",
            "Add 315964800 s to GPS time in the column t, and take the leap seconds away (18 s since 2017)",
        );
        return Some(one.fault(Code::TimeUnit, says.to_owned(), change));
    }
    if least < AHEAD {
        let is_ahead_always = arrivals.mean_delay_s() < AHEAD.as_secs_f64();
        return Some(match agrees && is_ahead_always {
            true => stamps_jitter(one, (-least, most)).unwrap_or_else(|| predicts(one, -least)),
            false => ahead(one, (-least, most)),
        });
    }
    // By the hub's clock it cannot be further behind: nothing arrives before it is captured.
    let behind = Span::from_secs_f64(behind_s.unwrap_or(0.0)).min(least);
    let behind_least_s = WRONG_S.min(CAUSE_SHARE * least.as_secs_f64()).max(RIGHT_S);
    if behind.as_secs_f64() >= behind_least_s {
        let says = format!(
            "its clock is behind by about {}: its objects are where others see them so much later, and its frames arrive at \
             least {} after their capture time",
            ms(behind),
            ms(least)
        );
        return Some(one.fault(Code::ClockBehind, says, set_clock(one, behind)));
    }
    if least < LONG_DELAY {
        return None;
    }
    let delays = format!("its frames arrive {} to {} after their capture time", ms(least), ms(most));
    if behind_s.is_some_and(|behind_s| behind_s.abs() < RIGHT_S) {
        let says = format!("{delays}, and objects that others see too show that its clock is right");
        return Some(one.note(Code::LinkSlow, says, "The link or the detector is slow"));
    }
    let is_constant = arrivals.jitter_s() < CONSTANT_SHARE * least.as_secs_f64();
    let compare = one.words(
        "Compare its clock with the hub's",
        "Compare its clock with the one by which the column t_arr was written",
    );
    let change = format!("{compare}. {}", set_clock(one, least));
    Some(if is_constant {
        let says = format!("{delays}, all alike: its clock is behind, or its link is slow");
        one.fault(Code::ClockBehindOrLinkSlow, says, change)
    } else {
        let says = format!("{delays}: its link is slow, or its clock is behind");
        one.note(Code::ClockBehindOrLinkSlow, says, change)
    })
}

/// As people say it.
fn ms(span: Span) -> String {
    in_words(span.as_secs_f64())
}

/// What to do about a clock that is behind by so much.
fn set_clock(one: &One<'_>, behind: Span) -> String {
    let set = one.words("Set its clock (chrony, PTP)", "Correct its times in the column t");
    if behind > A_DAY {
        return format!(
            "{set}; {}",
            one.words(
                "is it a recording that is sent again? `v2x replay` gives it times of today, and so has whoever sends one",
                "are they of another day?"
            )
        );
    }
    if behind.abs() > MOST_OFFSET {
        return format!(
            "{set}; {}",
            one.words("is it local time instead of UTC?", "are they local time instead of UTC?")
        );
    }
    // What is seen is what the offset that is there already leaves.
    let before = one.survey.writing.time_offset;
    let setting = one.setting(&format!("time_offset_ms = {:.0}", (before + behind).as_millis_f64()));
    let instead = if before == Span::ZERO {
        String::new()
    } else {
        format!(" in place of {:.0}", before.as_millis_f64())
    };
    format!("{set}, or write {setting}{instead}")
}

/// Stamps that are ahead, of objects that are there then.
fn predicts(one: &One<'_>, by: Span) -> Finding {
    let says = format!(
        "its frames arrive up to {} before their capture time, and its objects are where others see them at that time: it sends \
         predictions",
        ms(by)
    );
    let change = "Its clock is right. Measurements say more than predictions of them, whose errors are not independent: send those, \
                  with the time of measurement";
    one.note(Code::ClockAhead, says, change)
}

fn ahead(one: &One<'_>, (by, most): (Span, Span)) -> Finding {
    let record = one.around.engine.agents().record(&one.agent);
    let declared_s =
        record.and_then(|record| record.description).map_or(0.0, |sensor| sensor.accuracy.clock_s);
    let by_ms = ms(by);
    let says = format!(
        "its frames arrive up to {by_ms} before their capture time: its clock is ahead by at least that"
    );
    if by.as_secs_f64() <= DECLARED_SIGMAS * declared_s {
        return one.note(
            Code::ClockAhead,
            says,
            "It declares such an error; the hub estimates and corrects it",
        );
    }
    if let Some(found) = stamps_jitter(one, (by, most)) {
        return found;
    }
    // The frames that show it are the odd ones where stamps scatter.
    let jitter_s = one.survey.arrivals.jitter_s();
    if jitter_s >= SCATTERED_S && one.survey.arrivals.mean_delay_s() >= AHEAD.as_secs_f64() {
        let says = format!(
            "its frames arrive from {by_ms} before their capture time to {} after it, {:.0} ms (standard deviation) about {:.0} ms: \
             its stamps scatter, or its clock is ahead and its link irregular",
            ms(most),
            1e3 * jitter_s,
            1e3 * one.survey.arrivals.mean_delay_s()
        );
        let change = "Stamp each frame with the time of its measurement, by one clock that is set (chrony, PTP); no `time_offset_ms` \
                      mends stamps that scatter";
        return one.fault(Code::ClockAhead, says, change);
    }
    one.fault(Code::ClockAhead, says, set_clock(one, -by))
}

/// Stamps that scatter, so that some are ahead: an offset shifts all of them alike.
fn stamps_jitter(one: &One<'_>, (by, most): (Span, Span)) -> Option<Finding> {
    let arrivals = &one.survey.arrivals;
    let least_s = STAMPS_JITTER_S.max(CAUSE_OF_LEAD * by.as_secs_f64());
    let jitter_s = arrivals.scatter_of_stamps_s().filter(|jitter_s| *jitter_s >= least_s)?;
    let mean = Span::from_secs_f64(arrivals.mean_delay_s());
    let is_ahead = mean < AHEAD;
    let also = match is_ahead {
        true => format!(". In the mean they are ahead by {}, too", ms(-mean)),
        false => String::new(),
    };
    let says = format!(
        "its stamps jitter by {:.0} ms (standard deviation) against the even arrival of its frames, which come from {} before their capture time \
         to {} after it{also}",
        1e3 * jitter_s,
        ms(by),
        ms(most)
    );
    let change = format!(
        "{}: no `time_offset_ms` mends stamps that scatter{}",
        one.words(
            "Stamp each frame with the time at which its sensor measured, by one clock that is set (chrony, PTP), and not by rounded times, the \
             times of another thread, or two clocks in turn",
            "Write in the column t when the sensor measured, by one clock, and not rounded times or those of two clocks in turn",
        ),
        if is_ahead { "; what is left after that can be one" } else { "" }
    );
    Some(one.fault(Code::StampsJitter, says, change))
}

#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
fn two_processes(one: &One<'_>) -> Option<Finding> {
    let arrivals = &one.survey.arrivals;
    let frames = arrivals.frames as f64;
    let is_often = |count: u64| count >= MIN_VALUES / 2 && count as f64 >= 0.1 * frames;
    let duplicates = one.survey.refused.get("duplicate").map_or(0, |(count, _)| *count);
    let says = if is_often(arrivals.epoch_returns) {
        format!(
            "frames of two starts of this agent come in turn ({} times): two processes use its name, and the second one is held off",
            arrivals.epoch_returns
        )
    } else if is_often(arrivals.place_returns()) {
        let times = arrivals.place_returns();
        format!("its sensor jumps between two places and back ({times} times): two processes use its name")
    } else if is_often(arrivals.falls()) {
        let times = arrivals.falls();
        format!("its sequence numbers fall back again and again ({times} times): two processes use its name")
    } else if is_often(duplicates) {
        format!(
            "{duplicates} of {} frames came before with the same number: each is sent twice, or two processes use its name",
            arrivals.frames
        )
    } else {
        return None;
    };
    Some(one.fault(Code::TwoProcesses, says, "Give each process a name of its own, or end one of them"))
}

/// What only the contents of frames and their times show.
#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
fn two_streams(one: &One<'_>) -> Option<Finding> {
    let streams = &one.survey.streams;
    let compared = streams.compared;
    let is_often = |count: u64, share: f64| count >= MIN_VALUES && count as f64 >= share * compared as f64;
    let returns = streams.content_returns();
    if is_often(returns, RETURNS_SHARE) {
        let says = format!(
            "its frames show two sets of objects in turn ({returns} of {compared} times what the last frame but one or two showed \
             was back, and what the last one showed was not there): two processes use its name, or one sends by turns what \
             several sensors see, or what it sees at one time in two messages"
        );
        let change = "Give each process and each sensor a name of its own, or end one of them";
        return Some(one.fault(Code::TwoProcesses, says, change));
    }
    let backwards = streams.backwards;
    if is_often(backwards, BACKWARDS_SHARE) && is_often(streams.delay_returns(), RETURNS_SHARE) {
        let says = format!(
            "its capture times go back and forth ({backwards} of {compared} frames were captured before the frame that came \
             before them): two processes use its name, or it sends frames of two workers as they are ready"
        );
        let change = "Two processes need names of their own; of one process it is no fault, for each frame is fused at its own time";
        return Some(one.note(Code::TwoProcesses, says, change));
    }
    let declared_hz = one.around.engine.agents().record(&one.agent)?.description?.rate_hz;
    let rate_hz = one.survey.arrivals.rate_hz()?;
    let is_twice = declared_hz > 0.0 && rate_hz >= HIGH_RATE * declared_hz && is_often(compared, 0.0);
    is_twice.then(|| {
        let says = format!("it declares {declared_hz:.1} frames a second, and {rate_hz:.1} arrive");
        let change = "Is `rate_hz` of its sensor description right? Otherwise two processes use its name";
        one.note(Code::TwoProcesses, says, change)
    })
}

#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
fn gaps(one: &One<'_>) -> Option<Finding> {
    let (missing, sent) = one.survey.arrivals.missing()?;
    let share = missing as f64 / (sent as f64).max(1.0);
    if sent < 2 * MIN_VALUES || share < GAPS.0 {
        return None;
    }
    let says =
        format!("{missing} of {sent} frames are missing by their sequence numbers ({:.0} %)", 100.0 * share);
    let change = "The link loses them, or the agent drops them before it sends";
    Some(if share >= GAPS.1 {
        one.fault(Code::Gaps, says, change)
    } else {
        one.note(Code::Gaps, says, change)
    })
}

fn rate(one: &One<'_>) -> Option<Finding> {
    let record = one.around.engine.agents().record(&one.agent)?;
    let declared_hz = record.description?.rate_hz;
    let rate_hz = one.survey.arrivals.rate_hz()?;
    (declared_hz > 0.0 && rate_hz < LOW_RATE * declared_hz).then(|| {
        let says = format!("it declares {declared_hz:.1} frames a second, and {rate_hz:.1} arrive");
        one.note(
            Code::RateLow,
            says,
            "Its detector is slower than it declares, its link loses frames, or it sends by rules",
        )
    })
}

fn jitter(one: &One<'_>) -> Option<Finding> {
    let arrivals = &one.survey.arrivals;
    let jitter_s = arrivals.jitter_s();
    (jitter_s > JITTER_S && arrivals.frames >= MIN_VALUES).then(|| {
        let of_stamps = match arrivals.scatter_of_stamps_s() {
            Some(_) => ", though its frames arrive evenly: its stamps scatter, or results wait for the next turn to be sent",
            None => "",
        };
        let says = format!(
            "the time from capture to arrival varies by {:.0} ms (standard deviation){of_stamps}",
            1e3 * jitter_s
        );
        let change = "Late frames are fused at their own time; where they are too late, is the link overloaded, or does the \
                      agent stamp frames when it sends them?";
        one.note(Code::Jitter, says, change)
    })
}
