//! Fused frames against the truth: by identity, as the tables count, and by place as a second opinion.

use crate::data::run_log::ReceivedFused;
use crate::score::gospa::gospa;
use crate::score::keyframes::counting::errors;
use crate::score::matching::{Outcome, match_by_distance};
use crate::score::metrics::half_nees;
use crate::score::run::fused::prediction;
use crate::score::sweep::expected::{Gallery, Moment};
use crate::score::sweep::record::{Errors, Geometric, Record, distribution};
use std::collections::BTreeMap;
use v2x_agent::truth::ObjectId;
use v2x_common::fused::FusedObject;
use v2x_common::id::{AgentId, FrameId};
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::assignment::Assigner;

/// Errors are kept by stretches of this length: what intervals are made of.
pub const BLOCK: Span = Span::from_millis(5000);
/// Of how many fused frames one is matched by place, too.
const GEOMETRIC_EVERY: usize = 5;
/// What is further off is another object, by place, m. Also where GOSPA is cut off.
const MATCH_RADIUS_M: f64 = 4.0;

/// Whose each detection is.
#[derive(Clone, Debug, Default)]
pub struct Whose {
    agents: BTreeMap<AgentId, BTreeMap<(u64, u64), Seen>>,
}

#[derive(Clone, Debug)]
struct Seen {
    captured_at: Timestamp,
    objects: Vec<Option<ObjectId>>,
}

impl Whose {
    /// Takes in the side table of a frame.
    pub fn insert(&mut self, frame: FrameId, captured_at: Timestamp, objects: Vec<Option<ObjectId>>) {
        let FrameId { agent, epoch, sequence } = frame;
        self.agents.entry(agent).or_default().insert((epoch, sequence), Seen { captured_at, objects });
    }

    /// By whom a fused object was seen last, when, and as what.
    fn of<'a>(
        &'a self,
        object: &'a FusedObject,
    ) -> impl Iterator<Item = (AgentId, Timestamp, Option<ObjectId>)> + 'a {
        object.contributors.iter().filter_map(|used| {
            let FrameId { agent, epoch, sequence } = used.frame;
            let seen = self.agents.get(&agent)?.get(&(epoch, sequence))?;
            Some((agent, seen.captured_at, seen.objects.get(usize::from(used.index)).copied().flatten()))
        })
    }
}

/// Whose frames' ways are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Focus {
    /// The agent that the others are compared with.
    pub first: AgentId,
    /// Whether there is nobody else to look at.
    pub is_alone: bool,
}

impl Focus {
    /// Whether this agent's frames are looked at: the first agent's are only where it is alone.
    pub fn is_on(&self, agent: &AgentId) -> bool {
        self.is_alone || *agent != self.first
    }
}

/// Judges the fused frames of one method.
#[derive(Debug)]
pub struct Judge<'a, 'b> {
    gallery: &'a mut Gallery<'b>,
    whose: &'a Whose,
    focus: Focus,
    start: Timestamp,
    end: Timestamp,
    assigner: Assigner,
    record: Record,
    ages_ms: Vec<f64>,
    other_ages_ms: Vec<f64>,
    to_fused_ms: Vec<f64>,
    to_consumed_ms: Vec<f64>,
    n_frames: usize,
}

impl<'a, 'b> Judge<'a, 'b> {
    /// Of what is told between two times.
    pub fn new(
        gallery: &'a mut Gallery<'b>,
        whose: &'a Whose,
        focus: Focus,
        (start, end): (Timestamp, Timestamp),
    ) -> Self {
        Self {
            gallery,
            whose,
            focus,
            start,
            end,
            assigner: Assigner::default(),
            record: Record::default(),
            ages_ms: Vec::new(),
            other_ages_ms: Vec::new(),
            to_fused_ms: Vec::new(),
            to_consumed_ms: Vec::new(),
            n_frames: 0,
        }
    }

    /// Takes in a fused frame.
    pub fn add(&mut self, received: &ReceivedFused) {
        let frame = &received.frame;
        if frame.fused_at < self.start || frame.fused_at > self.end {
            return;
        }
        let moment = self.gallery.at(frame.fused_at);
        self.by_identity(&frame.objects, &moment, frame.fused_at);
        if self.n_frames.is_multiple_of(GEOMETRIC_EVERY) {
            self.by_place(&frame.objects, &moment);
        }
        self.n_frames += 1;
        for included in frame.includes.iter().filter(|included| self.focus.is_on(&included.frame.agent)) {
            self.to_fused_ms.push((frame.fused_at - included.received_at).as_millis_f64());
        }
        self.to_consumed_ms.push((received.received_at - frame.fused_at).as_millis_f64());
    }

    /// As the paper's tables count: a box is of the object that the first agent's last detection in it is of, else of
    /// its newest one's; of several boxes of one object all errors add up, and all but one are false.
    fn by_identity(&mut self, told: &[FusedObject], moment: &Moment, at: Timestamp) {
        let mut is_found = vec![false; moment.objects.len()];
        let mut sums = [Errors::default(); 4];
        let mut add = |subsets: [bool; 4], one: Errors| {
            let of_subsets = sums.iter_mut().zip(subsets).filter(|(_, is_in)| *is_in);
            of_subsets.for_each(|(sums, _)| sums.add(&one));
        };
        for object in told {
            let place_of = |id: ObjectId| moment.objects.binary_search_by_key(&id, |object| object.id).ok();
            let Some(place) = self.identity(object).and_then(place_of) else {
                // Which subset something that is not there belongs to nobody knows. It counts where both look.
                if self.gallery.is_in_view(moment, object.bev.x, object.bev.y) {
                    add([true, false, false, false], Errors { false_: 1, ..Errors::default() });
                }
                continue;
            };
            if !moment.counts[place] {
                continue;
            }
            let truth = &moment.objects[place].bev;
            let [ate_m, ade_m, aoe_deg] = errors(&object.bev, truth);
            let is_second = std::mem::replace(&mut is_found[place], true);
            let (found, false_) = (u64::from(!is_second), u64::from(is_second));
            add(moment.subsets[place], Errors { found, false_, ate_m, ade_m, aoe_deg, missed: 0 });
            if let Some(nees) = half_nees(&prediction(object), truth) {
                self.record.nees = (self.record.nees.0 + nees, self.record.nees.1 + 1);
            }
            self.note_ages(object, at);
        }
        let missed = (0..moment.objects.len()).filter(|place| moment.counts[*place] && !is_found[*place]);
        missed.for_each(|place| add(moment.subsets[place], Errors { missed: 1, ..Errors::default() }));
        let place = usize::try_from((at - self.start).as_nanos() / BLOCK.as_nanos()).unwrap_or(0);
        if self.record.blocks.len() <= place {
            self.record.blocks.resize(place + 1, [Errors::default(); 4]);
        }
        self.record.blocks[place].iter_mut().zip(&sums).for_each(|(block, sums)| block.add(sums));
    }

    fn identity(&self, object: &FusedObject) -> Option<ObjectId> {
        let seen = || self.whose.of(object);
        let by_first = seen().find(|(agent, ..)| *agent == self.focus.first);
        by_first.or_else(|| seen().max_by_key(|(_, captured_at, _)| *captured_at)).and_then(|(.., id)| id)
    }

    fn note_ages(&mut self, object: &FusedObject, at: Timestamp) {
        let newest = |is_meant: &dyn Fn(&AgentId) -> bool| {
            let times = self.whose.of(object).filter(|(agent, ..)| is_meant(agent));
            times.map(|(_, captured_at, _)| (at - captured_at).as_millis_f64()).reduce(f64::min)
        };
        let (of_all, of_others) = (newest(&|_| true), newest(&|agent| *agent != self.focus.first));
        self.ages_ms.extend(of_all);
        self.other_ages_ms.extend(of_others);
    }

    fn by_place(&mut self, told: &[FusedObject], moment: &Moment) {
        let boxes: Vec<_> = told.iter().map(|object| object.bev).collect();
        let Moment { objects, counts, .. } = moment;
        let matching = match_by_distance(&boxes, objects, counts, MATCH_RADIUS_M, &mut self.assigner);
        let is_in_view = |index: usize| self.gallery.is_in_view(moment, boxes[index].x, boxes[index].y);
        let matching = matching.restricted_to(|_| true, is_in_view);
        let Geometric { errors: sums, gospa_m, frames } = &mut self.record.geometric;
        let mut judged = Vec::new();
        for (bev, outcome) in boxes.iter().zip(&matching.outcomes) {
            match *outcome {
                Outcome::Matched(place) => {
                    let ate_m = crate::score::matching::distance_m(bev, &objects[place].bev);
                    sums.add(&Errors { found: 1, ate_m, ..Errors::default() });
                }
                Outcome::False => sums.false_ += 1,
                Outcome::Ignored => continue,
            }
            judged.push(*bev);
        }
        sums.missed += matching.missed.len() as u64;
        let truth = objects.iter().zip(counts).filter(|(_, counts)| **counts);
        let truth: Vec<_> = truth.map(|(object, _)| object.bev).collect();
        *gospa_m += gospa(&judged, &truth, MATCH_RADIUS_M, &mut self.assigner).distance_m();
        *frames += 1;
    }

    /// What it came to; what is known of frames on their way is still to be filled in.
    pub fn finish(self) -> Record {
        let Self { mut record, ages_ms, other_ages_ms, to_fused_ms, to_consumed_ms, .. } = self;
        record.age_ms = distribution(ages_ms);
        record.other_age_ms = distribution(other_ages_ms);
        record.arrive_to_fused_ms = distribution(to_fused_ms);
        record.fused_to_consumed_ms = distribution(to_consumed_ms);
        record
    }
}
