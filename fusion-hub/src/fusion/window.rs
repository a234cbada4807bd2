//! Single-frame rules in a network: the newest frame of every agent, as far as these are of about one instant.

use super::method::{AdmittedFrame, FrameOutcome, FusionMethod, TrackCounts};
use crate::baselines::{Fused, Member, Report, Rule};
use crate::publish::ObjectList;
use crate::track::Horizon;
use crate::values::{AgentNames, Saved, StateError, saved};
use serde::{Deserialize, Serialize};
use v2x_common::fused::FusedObject;
use v2x_common::id::{AgentId, FrameId, MeasurementId, TrackId};
use v2x_common::time::{Span, Timestamp};

/// Most boxes that are fused at once: rules compare all pairs, and their time grows with the square. Where there are
/// more, the longest frames are left out.
pub const MAX_WINDOW_BOXES: usize = 8192;

/// How a single-frame rule is applied to a stream of frames.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WindowConfig {
    /// The rule.
    pub rule: Rule,
    /// Frames captured no longer than this before the newest one are fused with it.
    pub window: Span,
    /// The agent whose detections come first ("ego", "main"); all others by name. Where it is `None`, the first by name.
    pub main_agent: Option<AgentId>,
}

impl WindowConfig {
    /// With the paper's window for CSBA+WLS: 100 ms.
    pub const fn new(rule: Rule) -> Self {
        Self { rule, window: Span::from_millis(100), main_agent: None }
    }
}

/// A [`Rule`] as a method. It has no memory: an agent's older frames are lost, and boxes stay where they were measured.
#[derive(Debug)]
pub struct WindowFusion {
    config: WindowConfig,
    /// Objects are published for this long after the newest frame.
    keep: Span,
    lineage: u32,
    next_counter: u32,
    /// The main agent first, the others by name.
    newest: Vec<Newest>,
    objects: Vec<FusedObject>,
    is_stale: bool,
    boxes_refused: u64,
}

/// An agent's newest frame.
#[derive(Debug, Serialize, Deserialize)]
struct Newest {
    frame: FrameId,
    captured_at: Timestamp,
    /// The capture time, but not later than the arrival: an agent whose clock is ahead must not put all others out of
    /// the window.
    counts_at: Timestamp,
    reports: Vec<Report>,
    /// It was left out for lack of room, and is counted.
    is_left_out: bool,
}

saved!([] WindowFusion, saved { next_counter, newest, objects, is_stale, boxes_refused }, made_anew {
    config, keep, lineage
});

impl Newest {
    fn order(&self) -> (Timestamp, u64, u64) {
        (self.captured_at, self.frame.epoch, self.frame.sequence)
    }
}

impl WindowFusion {
    /// A rule at work; its objects are numbered in the hub's `lineage` and published for `keep` after they were measured.
    pub const fn new(config: WindowConfig, lineage: u32, keep: Span) -> Self {
        Self {
            config,
            keep,
            lineage,
            next_counter: 0,
            newest: Vec::new(),
            objects: Vec::new(),
            is_stale: false,
            boxes_refused: 0,
        }
    }

    /// Orders agents.
    fn rank(&self, agent: AgentId) -> (bool, AgentId) {
        (self.config.main_agent != Some(agent), agent)
    }

    /// When the newest frame of an agent was captured.
    fn captured_at(&self, agent: AgentId) -> Option<Timestamp> {
        let place =
            self.newest.binary_search_by_key(&self.rank(agent), |newest| self.rank(newest.frame.agent));
        place.ok().map(|place| self.newest[place].captured_at)
    }

    fn fuse(&mut self) {
        self.objects.clear();
        let Some(instant) = self.newest.iter().map(|newest| newest.counts_at).max() else { return };
        let is_in = |newest: &&Newest| instant - newest.counts_at <= self.config.window;
        let mut in_window: Vec<&Newest> = self.newest.iter().filter(is_in).collect();
        let left_out = leave_out_longest(&mut in_window);
        // The first place is the main agent's, whether it reports or not.
        let is_main_there = self
            .config
            .main_agent
            .is_none_or(|main| in_window.first().is_some_and(|first| first.frame.agent == main));
        let offset = usize::from(!is_main_there);
        let mut lists: Vec<&[Report]> = vec![&[]; offset];
        lists.extend(in_window.iter().map(|newest| newest.reports.as_slice()));
        let sources = Sources { agents: &in_window, offset };
        for fused in self.config.rule.fuse(&lists) {
            let track = TrackId::new(self.lineage, self.next_counter);
            // At ten thousand objects a second, ids come back after five days.
            self.next_counter = self.next_counter.wrapping_add(1);
            self.objects.push(object(&fused, track, &sources));
        }
        self.count_left_out(&left_out);
    }

    /// Counts the boxes of frames that were left out, once for each frame.
    fn count_left_out(&mut self, left_out: &[FrameId]) {
        for newest in self.newest.iter_mut().filter(|newest| left_out.contains(&newest.frame)) {
            if !std::mem::replace(&mut newest.is_left_out, true) {
                self.boxes_refused += newest.reports.len() as u64;
            }
        }
    }
}

/// Leaves out the longest frames until the rest has at most [`MAX_WINDOW_BOXES`]; the frames that are left out.
fn leave_out_longest(frames: &mut Vec<&Newest>) -> Vec<FrameId> {
    let mut left_out = Vec::new();
    while frames.iter().map(|newest| newest.reports.len()).sum::<usize>() > MAX_WINDOW_BOXES {
        let longest = frames.iter().enumerate().max_by_key(|(_, newest)| newest.reports.len());
        let Some((place, _)) = longest else { break };
        left_out.push(frames.remove(place).frame);
    }
    left_out
}

impl FusionMethod for WindowFusion {
    fn handle_frame(&mut self, admitted: &AdmittedFrame<'_>) -> FrameOutcome<'_> {
        let AdmittedFrame { frame, sensor, received_at, .. } = *admitted;
        let newest = Newest {
            frame: frame.id,
            captured_at: frame.captured_at,
            counts_at: frame.captured_at.min(received_at),
            reports: Vec::new(),
            is_left_out: false,
        };
        let rank = self.rank(frame.id.agent);
        let place = match self.newest.binary_search_by_key(&rank, |newest| self.rank(newest.frame.agent)) {
            Ok(place) if self.newest[place].order() > newest.order() => return FrameOutcome::default(),
            Ok(place) => {
                let reports = std::mem::take(&mut self.newest[place].reports);
                self.newest[place] = Newest { reports, ..newest };
                place
            }
            Err(place) => {
                self.newest.insert(place, newest);
                place
            }
        };
        let reports = &mut self.newest[place].reports;
        reports.clear();
        reports.extend(
            frame.detections.iter().map(|one| Report { z: sensor.measurement(one), score: one.score }),
        );
        self.is_stale = true;
        FrameOutcome::default()
    }

    fn write_objects(&mut self, now: Timestamp, agents: &AgentNames, objects: &mut ObjectList<'_>) {
        self.maintain(now, &Horizon { at: now, slack: Span::ZERO }, agents);
        if self.newest.is_empty() {
            self.objects.clear();
        } else if std::mem::take(&mut self.is_stale) {
            self.fuse();
        }
        let limit = objects.contributor_limit();
        for object in &self.objects {
            let mut object = FusedObject { age: now - object.last_measured_at, ..object.clone() };
            limit.apply(&mut object.contributors, |one| self.captured_at(one.frame.agent));
            objects.push(object);
        }
    }

    fn maintain(&mut self, now: Timestamp, _: &Horizon, _: &AgentNames) {
        self.newest.retain(|newest| now - newest.captured_at <= self.keep);
    }

    fn save(&self, out: &mut Vec<u8>) -> Result<(), StateError> {
        Saved::save(self, out)
    }

    fn load(&mut self, bytes: &mut &[u8]) -> Result<(), StateError> {
        Saved::load(self, bytes)
    }

    fn counts(&self) -> TrackCounts {
        TrackCounts {
            tracks: self.objects.len(),
            births_refused: self.boxes_refused,
            ..TrackCounts::default()
        }
    }
}

/// The agents of a rule's lists: `offset` empty lists come before theirs.
struct Sources<'a> {
    agents: &'a [&'a Newest],
    offset: usize,
}

impl Sources<'_> {
    fn of(&self, member: &Member) -> &Newest {
        self.agents[member.agent - self.offset]
    }
}

/// A fused box as an object.
fn object(fused: &Fused, track: TrackId, sources: &Sources<'_>) -> FusedObject {
    let mut members = fused.members.clone();
    members.sort_unstable();
    // One detection of each agent is named, its first.
    members.dedup_by_key(|member| member.agent);
    let mut object = FusedObject::from_box(track, fused.z.class, fused.bev());
    let covariance = fused.covariance();
    object.kinematic_covariance[0] = covariance.position.xx;
    object.kinematic_covariance[1] = covariance.position.xy;
    object.kinematic_covariance[4] = covariance.position.yy;
    (object.ww, object.dd, object.yaw_variance) = (covariance.ww, covariance.dd, covariance.yaw);
    object.existence = fused.score;
    let captured = members.iter().map(|member| sources.of(member).captured_at);
    object.last_measured_at = captured.max().unwrap_or(Timestamp::EPOCH);
    let measurement = |member: &Member| {
        let index = u16::try_from(member.index).ok()?;
        Some(MeasurementId { frame: sources.of(member).frame, index })
    };
    object.contributors = members.iter().filter_map(measurement).collect();
    object.contributors.sort_unstable_by_key(|one| one.frame.agent);
    object
}
