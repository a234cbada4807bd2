//! Fused frames against the truth: by identity, as the tables count, and by place as a second opinion.

use super::gallery::{Gallery, Moment};
use super::record::{Errors, Geometric, Record, distribution};
use crate::gospa::gospa;
use crate::matching::{Matching, Outcome, match_by_distance, match_by_identity};
use crate::metrics::half_nees;
use crate::protocol::counting::errors;
use crate::run_log::ReceivedFused;
use crate::score::fused::prediction;
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

    /// Whose a fused object is, and when that was seen: its newest detection's, of one instant the first agent's by
    /// name.
    fn of(&self, object: &FusedObject) -> Option<(Timestamp, Option<ObjectId>)> {
        let seen = object.contributors.iter().filter_map(|used| {
            let FrameId { agent, epoch, sequence } = used.frame;
            let seen = self.agents.get(&agent)?.get(&(epoch, sequence))?;
            Some((seen.captured_at, seen.objects.get(usize::from(used.index)).copied().flatten()))
        });
        seen.reduce(|newest, other| if other.0 > newest.0 { other } else { newest })
    }
}

/// Judges the fused frames of one method.
#[derive(Debug)]
pub struct Judge<'a, 'b> {
    gallery: &'a mut Gallery<'b>,
    whose: &'a Whose,
    start: Timestamp,
    end: Timestamp,
    assigner: Assigner,
    record: Record,
    ages_ms: Vec<f64>,
    to_fused_ms: Vec<f64>,
    to_consumed_ms: Vec<f64>,
    n_frames: usize,
}

impl<'a, 'b> Judge<'a, 'b> {
    /// Of what is told between two times.
    pub fn new(gallery: &'a mut Gallery<'b>, whose: &'a Whose, (start, end): (Timestamp, Timestamp)) -> Self {
        Self {
            gallery,
            whose,
            start,
            end,
            assigner: Assigner::default(),
            record: Record::default(),
            ages_ms: Vec::new(),
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
        let matching = self.by_identity(&frame.objects, &moment, frame.fused_at);
        self.count(&frame.objects, &moment, (&matching, frame.fused_at));
        if self.n_frames.is_multiple_of(GEOMETRIC_EVERY) {
            self.by_place(&frame.objects, &moment);
        }
        self.n_frames += 1;
        for included in &frame.includes {
            self.to_fused_ms.push((frame.fused_at - included.received_at).as_millis_f64());
        }
        self.to_consumed_ms.push((received.received_at - frame.fused_at).as_millis_f64());
    }

    fn by_identity(&mut self, told: &[FusedObject], moment: &Moment, at: Timestamp) -> Matching {
        let mut places = Vec::with_capacity(told.len());
        let mut is_of_something = Vec::with_capacity(told.len());
        for object in told {
            let whose = self.whose.of(object);
            let id = whose.and_then(|(_, id)| id);
            let place = id.and_then(|id| moment.objects.binary_search_by_key(&id, |object| object.id).ok());
            if let (Some((captured_at, _)), Some(place)) = (whose, place)
                && moment.counts[place]
            {
                self.ages_ms.push((at - captured_at).as_millis_f64());
            }
            places.push(place);
            is_of_something.push(place.is_some());
        }
        let boxes: Vec<_> = told.iter().map(|object| object.bev).collect();
        let matching = match_by_identity(&boxes, &places, &moment.objects, &moment.counts);
        // What is of nothing counts where both look; a second one of an object that counts, anywhere.
        let is_in_view = |index: usize| self.gallery.is_in_view(moment, boxes[index].x, boxes[index].y);
        matching.restricted_to(|_| true, |index| is_of_something[index] || is_in_view(index))
    }

    fn count(&mut self, told: &[FusedObject], moment: &Moment, (matching, at): (&Matching, Timestamp)) {
        let place = usize::try_from((at - self.start).as_nanos() / BLOCK.as_nanos()).unwrap_or(0);
        if self.record.blocks.len() <= place {
            self.record.blocks.resize(place + 1, [Errors::default(); 4]);
        }
        let block = &mut self.record.blocks[place];
        let mut add = |subsets: [bool; 4], one: Errors| {
            let of_subsets = block.iter_mut().zip(subsets).filter(|(_, is_in)| *is_in);
            of_subsets.for_each(|(sums, _)| sums.add(&one));
        };
        for (object, outcome) in told.iter().zip(&matching.outcomes) {
            match *outcome {
                Outcome::Matched(place) => {
                    let truth = &moment.objects[place];
                    let [ate_m, ade_m, aoe_deg] = errors(&object.bev, &truth.bev);
                    add(
                        moment.subsets[place],
                        Errors { found: 1, ate_m, ade_m, aoe_deg, ..Errors::default() },
                    );
                    if let Some(nees) = half_nees(&prediction(object), &truth.bev) {
                        self.record.nees = (self.record.nees.0 + nees, self.record.nees.1 + 1);
                    }
                }
                // Which subset a false one belongs to nobody knows.
                Outcome::False => add([true, false, false, false], Errors { false_: 1, ..Errors::default() }),
                Outcome::Ignored => {}
            }
        }
        for place in &matching.missed {
            add(moment.subsets[*place], Errors { missed: 1, ..Errors::default() });
        }
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
                    let ate_m = crate::matching::distance_m(bev, &objects[place].bev);
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
        let Self { mut record, ages_ms, to_fused_ms, to_consumed_ms, .. } = self;
        record.age_ms = distribution(ages_ms);
        record.arrive_to_fused_ms = distribution(to_fused_ms);
        record.fused_to_consumed_ms = distribution(to_consumed_ms);
        record
    }
}
