//! Methods without memory in a network: the newest frame of every agent, as far as these are of about one instant.

use super::FusionMethod;
use crate::baselines::{Fused, Report, Rule};
use crate::sensing::Sensing;
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::FusedObject;
use v2x_common::id::{AgentId, FrameId, MeasurementId, TrackId};
use v2x_common::time::{Span, Timestamp};

/// How a rule without memory is applied to a stream of frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowConfig {
    /// The rule.
    pub rule: Rule,
    /// Frames captured no longer than this before the newest one are fused with it.
    pub window: Span,
    /// Whose detections come first ("ego", "main"); all others, by name. Where it is `None`, the first by name.
    pub main_agent: Option<AgentId>,
}

impl WindowConfig {
    /// With the paper's window for CSBA+WLS: 100 ms.
    pub const fn new(rule: Rule) -> Self {
        Self { rule, window: Span::from_millis(100), main_agent: None }
    }
}

/// A [`Rule`] as a method. Whatever is older than an agent's newest frame is lost to it, and boxes stay where they
/// were measured.
#[derive(Debug)]
pub struct WindowFusion {
    config: WindowConfig,
    /// The list is told for this long after its newest frame.
    keep: Span,
    lineage: u32,
    next_counter: u32,
    /// The main agent first, the others by name.
    newest: Vec<Newest>,
    objects: Vec<FusedObject>,
    is_stale: bool,
}

/// An agent's newest frame.
#[derive(Debug)]
struct Newest {
    frame: FrameId,
    captured_at: Timestamp,
    reports: Vec<Report>,
}

impl WindowFusion {
    /// A rule at work; its objects are numbered in the hub's `lineage` and told for `keep` after they were measured.
    pub const fn new(config: WindowConfig, lineage: u32, keep: Span) -> Self {
        Self {
            config,
            keep,
            lineage,
            next_counter: 0,
            newest: Vec::new(),
            objects: Vec::new(),
            is_stale: false,
        }
    }

    /// Orders agents.
    fn rank(&self, agent: AgentId) -> (bool, AgentId) {
        (self.config.main_agent != Some(agent), agent)
    }

    fn newest_captured_at(&self) -> Option<Timestamp> {
        self.newest.iter().map(|newest| newest.captured_at).max()
    }

    fn fuse(&mut self) {
        self.objects.clear();
        let Some(instant) = self.newest_captured_at() else { return };
        let is_in = |newest: &&Newest| instant - newest.captured_at <= self.config.window;
        let in_window: Vec<&Newest> = self.newest.iter().filter(is_in).collect();
        // The first place is the main agent's, whether it reports or not.
        let is_main_there = self
            .config
            .main_agent
            .is_none_or(|main| in_window.first().is_some_and(|first| first.frame.agent == main));
        let offset = usize::from(!is_main_there);
        let mut lists: Vec<&[Report]> = vec![&[]; offset];
        lists.extend(in_window.iter().map(|newest| newest.reports.as_slice()));
        for fused in self.config.rule.fuse(&lists) {
            let track = TrackId::new(self.lineage, self.next_counter);
            // At ten thousand objects a second, ids come back after five days.
            self.next_counter = self.next_counter.wrapping_add(1);
            self.objects.push(object(&fused, track, (&in_window, offset)));
        }
    }
}

impl FusionMethod for WindowFusion {
    fn handle_frame(&mut self, frame: &DetectionFrame, sensing: &Sensing) {
        let report = |one| Report { z: sensing.measurement(one), score: one.score };
        let reports = frame.detections.iter().map(report);
        let DetectionFrame { id, captured_at, .. } = *frame;
        let order = |newest: &Newest| (newest.captured_at, newest.frame.epoch, newest.frame.sequence);
        let rank = self.rank(id.agent);
        match self.newest.binary_search_by_key(&rank, |newest| self.rank(newest.frame.agent)) {
            Ok(place) if order(&self.newest[place]) > (captured_at, id.epoch, id.sequence) => return,
            Ok(place) => {
                let newest = &mut self.newest[place];
                (newest.frame, newest.captured_at) = (id, captured_at);
                newest.reports.clear();
                newest.reports.extend(reports);
            }
            Err(place) => {
                self.newest.insert(place, Newest { frame: id, captured_at, reports: reports.collect() });
            }
        }
        self.is_stale = true;
    }

    fn tell(&mut self, now: Timestamp, objects: &mut Vec<FusedObject>) {
        self.newest.retain(|newest| now - newest.captured_at <= self.keep);
        if self.newest.is_empty() {
            self.objects.clear();
        } else if std::mem::take(&mut self.is_stale) {
            self.fuse();
        }
        objects.extend(self.objects.iter().cloned());
        for object in objects {
            object.age = now - object.last_measured_at;
        }
    }
}

/// A fused box as an object; `offset` places of the rule's lists stand before those of `agents`.
fn object(fused: &Fused, track: TrackId, (agents, offset): (&[&Newest], usize)) -> FusedObject {
    let mut members = fused.members.clone();
    members.sort_unstable();
    // One report of each agent is named, its first.
    members.dedup_by_key(|member| member.agent);
    let of = |agent: usize| agents[agent - offset];
    let mut object = FusedObject::from_box(track, fused.z.class, fused.bev());
    let covariance = fused.covariance();
    object.kinematic_covariance[0] = covariance.position.xx;
    object.kinematic_covariance[1] = covariance.position.xy;
    object.kinematic_covariance[4] = covariance.position.yy;
    (object.ww, object.dd, object.yaw_variance) = (covariance.ww, covariance.dd, covariance.yaw);
    object.existence = fused.score;
    let captured = members.iter().map(|member| of(member.agent).captured_at);
    object.last_measured_at = captured.max().unwrap_or(Timestamp::EPOCH);
    let measurement = |member: &crate::baselines::Member| {
        let index = u16::try_from(member.index).ok()?;
        Some(MeasurementId { frame: of(member.agent).frame, index })
    };
    object.contributors = members.iter().filter_map(measurement).collect();
    object.contributors.sort_unstable_by_key(|one| one.frame.agent);
    object
}
