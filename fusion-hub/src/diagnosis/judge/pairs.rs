//! What differs between agents.

use super::super::alignment::change::{Axes, Change, Rigid, Unit, WrongPose};
use super::super::alignment::fit::Fit;
use super::super::finding::{Code, Finding, Severity};
use super::super::window::{Source, Window};
use v2x_common::id::AgentId;

/// The middle of an agent's objects is so far from those of all others, m.
const FAR_AWAY_M: f64 = 20_000.0;

/// A yard in metres, and how near to it a factor is.
const YARD_M: f64 = 0.9144;
const YARD_WITHIN: f64 = 0.015;

/// Tables of settings that are named in one finding.
const MOST_TABLES: usize = 2;

/// What is known of single agents.
pub(super) struct Known {
    /// Whose positions are no metres.
    pub(super) no_metres: Vec<AgentId>,
    /// Whose clocks are off.
    pub(super) clocks: Vec<AgentId>,
    /// Whose headings do not go with the motion of what they see.
    pub(super) headings: Vec<AgentId>,
    /// Where frames come from.
    pub(super) source: Source,
}

pub(super) fn findings(window: &Window, known: &Known) -> Vec<Finding> {
    let mut findings: Vec<_> = far_away(window, &known.no_metres).into_iter().collect();
    // An agent that differs from several others is the one that is wrong.
    let differs = |agent: &AgentId| {
        let of_agent = window.fits.iter().filter(|(pair, _)| pair.contains(agent));
        of_agent.filter(|(_, fit)| matches!(fit, Fit::Changed { .. })).count()
    };
    // Of two that differ, the one that agrees with a third one is right.
    let agrees = |agent: &AgentId| {
        let mut of_agent = window.fits.iter().filter(|(pair, _)| pair.contains(agent));
        usize::from(of_agent.any(|(_, fit)| matches!(fit, Fit::Agree { .. })))
    };
    let votes_of = |agent: &AgentId| 10 * differs(agent) + 1 - agrees(agent);
    let mut reported = Vec::new();
    findings.extend(apart(window, known.source));
    findings.extend(nothing_shared(window));
    for (pair, fit) in &window.fits {
        let Fit::Changed { whose, change, share, is_time_known } = fit else { continue };
        let votes = pair.map(|agent| match change {
            Change::Rigid(_) | Change::Scaled(_) => votes_of(&agent),
            // Mirrored twice is as before: whose headings do not go with the motion has the wrong axes.
            Change::OfMap(_) => 1000 * usize::from(known.headings.contains(&agent)) + votes_of(&agent),
            _ => 0,
        });
        let is_open = matches!(change, Change::Rigid(_) | Change::OfMap(_) | Change::Scaled(_));
        let is_undecided = is_open && votes[0] == votes[1];
        let whose = if is_open { usize::from(votes[0] <= votes[1]) } else { *whose };
        let (agent, other) = (pair[whose], pair[1 - whose]);
        let kind = std::mem::discriminant(change);
        if reported.contains(&(agent, kind)) {
            continue;
        }
        reported.push((agent, kind));
        let one = Pair { agent, other, share: *share, is_time_known: *is_time_known, source: known.source };
        findings.extend(match change {
            // The change is that of the second one.
            Change::Rigid(rigid) => {
                let clock_is_reported = pair.iter().any(|agent| known.clocks.contains(agent));
                // A shift that the clock explains is none.
                let is_explained = clock_is_reported && rigid.or_earlier_s != 0.0;
                let rigid = Rigid {
                    by_m: if is_explained { [0.0; 2] } else { rigid.by_m },
                    earlier_s: if clock_is_reported { 0.0 } else { rigid.earlier_s },
                    ..*rigid
                };
                one.offset(&if whose == 1 { rigid } else { rigid.reversed() }, is_undecided)
            }
            // The factor is that by which those of the second one are to be multiplied.
            Change::Scaled(factor) => {
                Some(one.scale(if whose == 1 { 1.0 / factor } else { *factor }, is_undecided))
            }
            large => Some(one.large(*large, is_undecided)),
        });
    }
    findings
}

/// Agents without a pose whose objects are never where anybody else sees some, one note for all of them.
fn apart(window: &Window, source: Source) -> Option<Finding> {
    let of = |agent: AgentId| window.fits.iter().filter(move |(pair, _)| pair.contains(&agent));
    let lacks_pose = |agent: AgentId| {
        of(agent).any(|(pair, fit)| match fit {
            Fit::Apart { without_pose } => {
                pair.iter().zip(without_pose).any(|(of, lacks)| *of == agent && *lacks)
            }
            _ => false,
        })
    };
    let shares_none =
        |agent: AgentId| of(agent).all(|(_, fit)| matches!(fit, Fit::Apart { .. } | Fit::Unknown));
    let agents = window.agents.keys().copied();
    let alone: Vec<AgentId> = agents.filter(|agent| lacks_pose(*agent) && shares_none(*agent)).collect();
    let agent = match &alone[..] {
        [] => return None,
        [agent] => Some(*agent),
        _ => None,
    };
    let names: Vec<_> = alone.iter().map(AgentId::to_string).collect();
    let says = format!(
        "{} {} no {}, and the objects that it reports are never where another agent reports some, in the same area: \
         whether positions are relative to a sensor cannot be determined",
        names.join(", "),
        if agent.is_some() { "gives" } else { "(each of them) gives" },
        source.words("`sensor_pose`", "sensor_x and sensor_y")
    );
    let mut tables: Vec<_> = alone.iter().take(MOST_TABLES).map(|agent| source.table_of(agent)).collect();
    if alone.len() > MOST_TABLES {
        tables.push("so on".to_owned());
    }
    let change = format!(
        "If they are, write `frame = \"sensor\"` with the sensor's `pose` {}, or {} and write `frame = \"ego\"`. If each sees a \
         place of its own, nothing is wrong",
        tables.join(" and "),
        source.words("send `sensor_pose`", "fill the columns sensor_x, sensor_y and sensor_yaw")
    );
    Some(Finding { code: Code::SensorFrame, severity: Severity::Note, agent, says, change })
}

/// Agents that give poses, whose objects are never where anybody else sees some, though all are in one area: one note of the first.
fn nothing_shared(window: &Window) -> Option<Finding> {
    let is_alone = |agent: &AgentId| {
        let mut of = window.fits.iter().filter(|(pair, _)| pair.contains(agent));
        of.all(|(_, fit)| matches!(fit, Fit::Apart { .. } | Fit::Unknown))
    };
    let mut apart = window.fits.iter().filter(|(pair, fit)| {
        matches!(fit, Fit::Apart { without_pose: [false, false] }) && pair.iter().any(is_alone)
    });
    let ([a, b], _) = apart.next()?;
    let more = match apart.count() {
        0 => String::new(),
        n => format!(", and those of {n} more pairs of agents"),
    };
    Some(Finding {
        code: Code::NothingShared,
        severity: Severity::Note,
        agent: None,
        says: format!(
            "the objects of {a} are never where {b} reports some, and the other way round, though both report them in the same area{more}"
        ),
        change: "Where each sees a place of its own, nothing is wrong. Otherwise one of the poses is, or what positions are relative to: \
                 x is east, y is north, in metres, and yaw counts counter-clockwise from east"
            .to_owned(),
    })
}

/// Two agents that differ, of whom the first one is probably wrong.
pub(super) struct Pair {
    pub(super) agent: AgentId,
    pub(super) other: AgentId,
    /// Share of the objects in common.
    pub(super) share: f64,
    /// A shift of their objects cannot be one of time.
    pub(super) is_time_known: bool,
    pub(super) source: Source,
}

impl Pair {
    fn large(&self, change: Change, is_undecided: bool) -> Finding {
        let Self { agent, other, share, source, .. } = self;
        let send = source.words("Send", "Write");
        let as_seen = format!("({:.0} % of the objects in common with {other})", 100.0 * share);
        let (code, says, change) = match change {
            Change::FromSensor(_) | Change::FromPlace | Change::PoseTwice => {
                let (says, change) = self.in_another_frame(change, &as_seen);
                (Code::SensorFrame, says, change)
            }
            Change::AboutSensor(axes) => (
                Code::Axes,
                format!(
                    "its positions are mirrored or turned about its sensor: it works with {} {as_seen}",
                    words(axes)
                ),
                "Before it maps them, x is ahead and y to the left; is the sign of its heading right?"
                    .to_owned(),
            ),
            Change::OfMap(axes) => (
                Code::Axes,
                match is_undecided {
                    false => format!("the axes of its positions are {} {as_seen}", of_map(axes)),
                    true => format!("the axes of {agent} or of {other} are {} {as_seen}", of_map(axes)),
                },
                "x is east and y is north in the map frame".to_owned(),
            ),
            Change::PoseIs(wrong) => (
                Code::SensorPose,
                format!("its sensor's pose is wrong: {} {as_seen}", how_pose_is(wrong)),
                source
                    .words(
                        "Correct `pose` in its settings, or `sensor_pose` in its frames: x east and y north in metres, yaw \
                         counter-clockwise from east",
                        "Correct the columns sensor_x, sensor_y and sensor_yaw: x east and y north in metres, yaw counter-clockwise \
                         from east in radians",
                    )
                    .to_owned(),
            ),
            Change::InUnit(unit) | Change::InUnitAboutSensor(unit) => (
                Code::LengthUnit,
                format!("its positions are in {}, and are read as metres {as_seen}", in_units(unit)),
                format!("{send} metres, also for sizes and standard deviations"),
            ),
            Change::Rigid(_) | Change::Scaled(_) => (Code::Offset, String::new(), String::new()),
        };
        let agent = (!is_undecided).then_some(*agent);
        Finding { code, severity: Severity::Fault, agent, says, change }
    }

    /// What is wrong and what to do where positions are in the frame of the sensor and read as in that of the map, or the other way round.
    fn in_another_frame(&self, change: Change, as_seen: &str) -> (String, String) {
        let Self { agent, source, .. } = self;
        let (send, table) = (source.words("Send", "Write"), source.table_of(agent));
        match change {
            Change::FromSensor(Axes::Ours) => (
                format!(
                    "its positions are relative to its sensor, and are read as in the map frame {as_seen}"
                ),
                format!("{send} them in the map frame, or write `frame = \"ego\"` {table}"),
            ),
            Change::FromSensor(axes) => (
                format!(
                    "its positions are relative to its sensor with {}, and are read as in the map frame {as_seen}",
                    words(axes)
                ),
                format!("x is ahead and y to the left: change that, and write `frame = \"ego\"` {table}"),
            ),
            Change::FromPlace => (
                format!(
                    "its positions are relative to the place of its sensor, along the axes of the map, and are read as in the map frame \
                     {as_seen}"
                ),
                format!(
                    "{send} them in the map frame: add the x and y of its {}",
                    source.words("`sensor_pose`", "sensor_x and sensor_y")
                ),
            ),
            _ => (
                format!(
                    "its sensor's pose is applied twice: its positions are in the map frame already {as_seen}"
                ),
                format!(
                    "Remove `frame` {table}, or {} positions relative to the sensor",
                    source.words("send", "write")
                ),
            ),
        }
    }

    /// The agent's positions are so many times as far apart as the other one's.
    fn scale(&self, times: f64, is_undecided: bool) -> Finding {
        let Self { agent, other, share, source, .. } = self;
        let as_seen = format!("({:.0} % of the objects in common with {other})", 100.0 * share);
        let is_in_yards = |times: f64| (times * YARD_M - 1.0).abs() < YARD_WITHIN;
        // More yards than metres go into a way: whose numbers are the larger ones has them.
        let (agent, says) = if is_in_yards(times) && !is_undecided {
            (Some(agent), format!("its positions are in yards, and are read as metres {as_seen}"))
        } else if is_undecided && (is_in_yards(times) || is_in_yards(1.0 / times)) {
            let [whose, than] = if times > 1.0 { [agent, other] } else { [other, agent] };
            let share = 100.0 * share;
            (
                Some(whose),
                format!(
                    "its positions are in yards, and are read as metres ({share:.0} % of the objects in common with {than})"
                ),
            )
        } else if is_undecided {
            (
                None,
                format!(
                    "the positions of {agent} are {times:.2} times as far apart as those of {other} {as_seen}"
                ),
            )
        } else {
            (
                Some(agent),
                format!("its positions are {times:.2} times as far apart as those of {other} {as_seen}"),
            )
        };
        let send = source.words("Send", "Write");
        let change = match is_in_yards(times) || is_in_yards(1.0 / times) {
            true => format!("{send} metres, also for sizes and standard deviations: a yard is {YARD_M} m"),
            false => format!(
                "{send} metres: is it another unit, the calibration of a camera, or the scale of a map projection? Positions are the middles of \
                 objects, and not the points that are nearest to the sensor"
            ),
        };
        Finding { code: Code::LengthUnit, severity: Severity::Fault, agent: agent.copied(), says, change }
    }
}

impl Rigid {
    /// What undoes it, as long as it is small.
    fn reversed(&self) -> Self {
        let Self { by_m: [x, y], turn_rad, earlier_s, or_earlier_s } = *self;
        Self { by_m: [-x, -y], turn_rad: -turn_rad, earlier_s: -earlier_s, or_earlier_s: -or_earlier_s }
    }
}

const fn words(axes: Axes) -> &'static str {
    match axes {
        Axes::Ours => "x ahead and y to the left",
        Axes::SecondReversed => "x ahead and y to the right",
        Axes::FirstReversed => "x backwards and y to the left",
        Axes::BothReversed => "x backwards and y to the right",
        Axes::Swapped => "x to the left and y ahead",
        Axes::RightAhead => "x to the right and y ahead",
    }
}

const fn how_pose_is(wrong: WrongPose) -> &'static str {
    match wrong {
        WrongPose::Exchanged => "its x and y are the wrong way round",
        WrongPose::Opposite => "its x and y have the wrong sign",
        WrongPose::XOpposite => "its x has the wrong sign",
        WrongPose::YOpposite => "its y has the wrong sign",
        WrongPose::YawOpposite => "its yaw has the wrong sign",
        WrongPose::YawBack => "its yaw points backwards",
        WrongPose::YawFromNorth => "its yaw counts from north instead of east",
        WrongPose::YawOfCompass => "its yaw counts clockwise from north, as a compass does",
    }
}

const fn in_units(unit: Unit) -> &'static str {
    match unit {
        Unit::Centimetre => "centimetres",
        Unit::Millimetre => "millimetres",
        Unit::Decimetre => "decimetres",
        Unit::Foot => "feet",
    }
}

const fn of_map(axes: Axes) -> &'static str {
    match axes {
        Axes::Swapped => "the wrong way round: x is north and y is east",
        Axes::SecondReversed => "mirrored: y points south",
        Axes::FirstReversed => "mirrored: x points west",
        _ => "turned by half a turn: x points west and y south",
    }
}

/// An agent whose objects are far from those of the others.
fn far_away(window: &Window, no_metres: &[AgentId]) -> Option<Finding> {
    let agents = window.agents.iter().filter(|(agent, _)| !no_metres.contains(agent));
    let middles: Vec<_> =
        agents.filter_map(|(agent, survey)| Some((*agent, survey.writing.middle()?))).collect();
    let distance = |a: [f64; 2], b: [f64; 2]| libm::hypot(a[0] - b[0], a[1] - b[1]);
    let nearest = |agent: &AgentId, at: [f64; 2]| {
        let others = middles.iter().filter(|(other, _)| other != agent);
        others.map(|(other, middle)| (distance(at, *middle), *other)).min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let far = middles.iter().filter_map(|(agent, at)| Some((nearest(agent, *at)?, *agent, *at)));
    let far: Vec<_> = far.filter(|((by_m, _), ..)| *by_m > FAR_AWAY_M).collect();
    // The one that is farthest from the origin has the larger numbers: projected coordinates.
    let ((by_m, other), agent, at) =
        far.into_iter().max_by(|a, b| distance(a.2, [0.0; 2]).total_cmp(&distance(b.2, [0.0; 2])))?;
    let says = format!(
        "its objects lie around x {:.0}, y {:.0}, {:.0} km from those of {other}",
        at[0],
        at[1],
        by_m * 1e-3
    );
    let change = "All agents use one map frame in metres. Projected coordinates (UTM) need the same origin taken away for all";
    Some(Finding::fault(Code::FarAway, agent, says, change))
}
