//! The engine: frames in, one list of objects out. Pure: time is an argument, and the same calls give the
//! same bits.

use crate::association::{Associator, Expected};
use crate::config::EngineConfig;
use crate::duplicates::{Duplicates, Seen};
use crate::filter::{Measurement, State};
use crate::inbox::Inbox;
use crate::publish;
use crate::refusal::{Disposition, Refusal};
use crate::sensing::Sensing;
use crate::track::{Evidence, EvidenceKey, Existence, Look, Sighting, Track};
use std::collections::VecDeque;
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::{FusedFrame, Inclusion};
use v2x_common::id::{AgentId, TrackId};
use v2x_common::sensor::SensorDescription;
use v2x_common::time::{Span, Timestamp};

/// A track less likely than this is dropped as soon as no late data can revive it.
const MIN_EXISTENCE: f64 = 0.01;
/// Beyond a sensor's range by more than this, a look cannot become evidence later, m.
const LOOK_SLACK_M: f64 = 20.0;
/// Time between two rounds of forgetting.
const FORGET_INTERVAL: Span = Span::from_millis(20);
/// Most tracks, published or not.
const MAX_TRACKS: usize = 65_536;
/// Most frames remembered as looks.
const MAX_LOOKS: usize = 65_536;
/// Most frames waiting to be named as included in the next fused frame.
const MAX_PENDING: usize = 65_536;

/// The fusion engine of one hub.
#[derive(Debug)]
pub struct Engine {
    config: EngineConfig,
    inbox: Inbox,
    /// By id.
    tracks: Vec<Track>,
    next_counter: u32,
    births_refused: u64,
    merges: u64,
    /// Frames within Δmax as looks, sorted: a late birth is held against those that came after it.
    looks: VecDeque<(EvidenceKey, Look)>,
    newest_now: Timestamp,
    forgotten_at: Timestamp,
    pending: Vec<Inclusion>,
    sequence: u64,
    /// The newest fused frame; its buffers are used again.
    fused: FusedFrame,
    duplicates: Duplicates,
    associator: Associator,
    sightings: Vec<Sighting>,
    measurements: Vec<Measurement>,
    expected: Vec<Expected>,
}

impl Engine {
    /// An engine that knows nothing yet.
    pub fn new(config: EngineConfig) -> Self {
        Self {
            config,
            inbox: Inbox::new(config.delta_max, config.map_frame),
            tracks: Vec::new(),
            next_counter: 0,
            births_refused: 0,
            merges: 0,
            looks: VecDeque::new(),
            newest_now: Timestamp::MIN,
            forgotten_at: Timestamp::MIN,
            pending: Vec::new(),
            sequence: 0,
            fused: FusedFrame {
                hub: config.hub,
                lineage: config.lineage,
                sequence: 0,
                fused_at: Timestamp::EPOCH,
                map_frame: config.map_frame,
                objects: Vec::new(),
                agents: Vec::new(),
                includes: Vec::new(),
            },
            duplicates: Duplicates::default(),
            associator: Associator::default(),
            sightings: Vec::new(),
            measurements: Vec::new(),
            expected: Vec::new(),
        }
    }

    /// Takes in an agent's sensor description.
    pub fn handle_description(&mut self, agent: AgentId, description: SensorDescription) {
        let sensing = Sensing::described(&description, &self.config.sensing);
        if let Some(record) = self.inbox.record_mut(agent) {
            record.description = Some(description);
            record.sensing = sensing;
        }
    }

    /// Counts a frame that was refused before it was one.
    pub fn note_refusal(&mut self, agent: AgentId, refusal: Refusal) {
        self.inbox.refuse(agent, refusal);
    }

    /// Counts a sensor description that cannot be.
    pub fn note_refused_description(&mut self, agent: AgentId, refusal: Refusal) {
        if let Some(record) = self.inbox.record_mut(agent) {
            record.descriptions_refused += 1;
            record.last_refusal = Some(refusal);
        }
    }

    /// Counts detections whose class name was not known.
    pub fn note_unmapped_classes(&mut self, agent: AgentId, count: u64) {
        if let Some(record) = self.inbox.record_mut(agent) {
            record.unmapped_classes += count;
        }
    }

    /// Takes in a frame, received at `now` by the hub's clock.
    pub fn handle_frame(&mut self, frame: &DetectionFrame, now: Timestamp) -> Disposition {
        // A frame that waited while the hub published is as old as it is now: what it is older than may be
        // folded already.
        self.newest_now = self.newest_now.max(now);
        let out_of_sequence = match self.inbox.admit(frame, self.newest_now) {
            Ok(out_of_sequence) => out_of_sequence,
            Err(refusal) => return Disposition::Refused(refusal),
        };
        self.forget(self.newest_now);
        self.note_pending(frame, now);
        let look = self.look_of(frame);
        self.expect_tracks(frame.captured_at);
        self.measure(frame);
        self.associate(frame, look.as_ref());
        if let Some(look) = look {
            self.merge_duplicates(frame, &look);
            self.remember_look(look_key(frame), look);
        }
        Disposition::Accepted { out_of_sequence }
    }

    fn note_pending(&mut self, frame: &DetectionFrame, now: Timestamp) {
        if self.pending.len() < MAX_PENDING {
            self.pending.push(Inclusion {
                frame: frame.id,
                captured_at: frame.captured_at,
                received_at: now,
            });
        }
    }

    fn look_of(&self, frame: &DetectionFrame) -> Option<Look> {
        let record = self.inbox.record(&frame.id.agent)?;
        let description = record.description.as_ref()?;
        Some(record.sensing.look(description, frame.sensor_pose?))
    }

    fn remember_look(&mut self, key: EvidenceKey, look: Look) {
        let place = self.looks.partition_point(|(other, _)| *other < key);
        self.looks.insert(place, (key, look));
        if self.looks.len() > MAX_LOOKS {
            self.looks.pop_front();
        }
    }

    /// The tracks that were there at the time, as they stood then.
    fn expect_tracks(&mut self, at: Timestamp) {
        self.expected.clear();
        for (place, track) in self.tracks.iter_mut().enumerate() {
            let known = track.known_at(at);
            // Existence does not matter here: a track that seems dead may only be waiting for late data.
            if (at - known.state.at).abs() > self.config.coast {
                continue;
            }
            self.expected.push(Expected {
                track: place,
                class: known.class(),
                state: known.state_at(at),
                born_at: known.born_at,
            });
        }
    }

    fn measure(&mut self, frame: &DetectionFrame) {
        let undescribed = Sensing::undescribed(&self.config.sensing);
        let record = self.inbox.record(&frame.id.agent).filter(|record| record.description.is_some());
        let sensing = record.map_or(undescribed, |record| record.sensing);
        self.sightings.clear();
        self.sightings.extend(frame.detections.iter().map(|detection| sensing.sighting(detection)));
        self.measurements.clear();
        self.measurements.extend(self.sightings.iter().map(|sighting| sighting.z));
    }

    fn associate(&mut self, frame: &DetectionFrame, look: Option<&Look>) {
        let Self { associator, measurements, expected, sightings, tracks, looks, config, .. } = self;
        let matches = associator.associate(measurements, expected, (config.association, config.gate));
        let mut births = Vec::new();
        let (mut nis_sum, mut nis_count) = (0.0, 0);
        for (index, (sighting, found)) in sightings.iter().zip(matches).enumerate() {
            let key = sighting_key(frame, index);
            let Some(found) = found else {
                births.push((key, *sighting));
                continue;
            };
            let expected = &expected[*found as usize];
            nis_sum += expected.state.kinematic.innovation(sighting.z.position, &sighting.z.r).mahalanobis2;
            nis_count += 1;
            let track = &mut tracks[expected.track];
            let may_move_birth = track.oldest_key().is_some_and(|oldest| key < oldest);
            track.insert(key, Evidence::Sighting(*sighting));
            if may_move_birth {
                hold_against(looks, track, &key);
            }
        }
        if let Some(record) = self.inbox.record_mut(frame.id.agent) {
            record.nis_sum += nis_sum;
            record.nis_count += nis_count;
        }
        if let Some(look) = look {
            let key = look_key(frame);
            // Tracks that were not expected then have not been sighted for so long that nothing counts any more.
            for expected in expected.iter() {
                let track = &mut tracks[expected.track];
                if expected.born_at <= key.captured_at
                    && is_in_range(look, &expected.state)
                    && !track.has_evidence_of(key.captured_at, &key.frame)
                {
                    track.insert(key, Evidence::Look(*look));
                }
            }
        }
        for (key, sighting) in births {
            self.give_birth(key, sighting);
        }
    }

    /// Makes tracks one that frames have shown to be of one object.
    fn merge_duplicates(&mut self, frame: &DetectionFrame, look: &Look) {
        let seen = self.expected.iter().filter_map(|expected| {
            let track = &self.tracks[expected.track];
            let [x, y] = expected.state.kinematic.position;
            let report = track.sighting_in(frame.captured_at, &frame.id);
            let in_view = report.is_some() || look.covers(x, y, 0.0);
            in_view.then_some(Seen { id: track.id, expected, report })
        });
        let detection_probability = 1.0 - look.miss_probability;
        let sensor = (frame.id.agent, detection_probability);
        let merges = self.duplicates.note_frame(&mut seen.collect::<Vec<_>>(), sensor, self.config.gate);
        for (older, younger) in merges {
            let places = [older, younger].map(|id| self.tracks.binary_search_by_key(&id, |track| track.id));
            if let [Ok(older), Ok(younger)] = places {
                let absorbed = self.tracks.remove(younger);
                self.tracks[older].absorb(absorbed);
                self.merges += 1;
            }
        }
    }

    fn give_birth(&mut self, key: EvidenceKey, sighting: Sighting) {
        if self.tracks.len() >= MAX_TRACKS || self.next_counter == u32::MAX {
            self.births_refused += 1;
            return;
        }
        let id = TrackId::new(self.config.lineage, self.next_counter);
        self.next_counter += 1;
        let mut track = Track::new(id, key, Evidence::Sighting(sighting));
        hold_against(&self.looks, &mut track, &key);
        self.tracks.push(track);
    }

    /// Forgets what can no longer matter: nothing older than Δmax is let in any more.
    fn forget(&mut self, now: Timestamp) {
        if now - self.forgotten_at < FORGET_INTERVAL {
            return;
        }
        self.forgotten_at = now;
        let horizon = now - self.config.delta_max;
        let gone = horizon - self.config.coast;
        let floor = Existence::from_probability(MIN_EXISTENCE);
        while self.looks.front().is_some_and(|(key, _)| key.captured_at < horizon) {
            self.looks.pop_front();
        }
        self.tracks.retain_mut(|track| {
            track.fold(horizon);
            let last_measured_at = track.last_measured_at();
            track.forget_contributors(gone);
            let revivable = last_measured_at >= horizon || track.latest().existence >= floor;
            revivable && last_measured_at >= gone
        });
        let tracks = &self.tracks;
        self.duplicates.retain(|id| tracks.binary_search_by_key(&id, |track| track.id).is_ok());
    }

    /// The list of objects as of `now`, and what is new in it since the last call.
    pub fn fused(&mut self, now: Timestamp) -> &FusedFrame {
        self.newest_now = self.newest_now.max(now);
        self.inbox.tell_time(now);
        self.forget(now);
        let Self { config, fused, pending, inbox, tracks, .. } = self;
        fused.sequence = self.sequence;
        self.sequence += 1;
        fused.fused_at = now;
        fused.map_frame = inbox.map_frame();
        fused.agents.clear();
        fused.agents.extend(inbox.agents().map(|(agent, record)| record.health(*agent)));
        fused.includes.clear();
        fused.includes.append(pending);
        publish::fill(&mut fused.objects, tracks, now, config);
        fused
    }

    /// The books on every agent.
    pub fn inbox(&self) -> &Inbox {
        &self.inbox
    }

    /// Number of tracks, published or not.
    pub fn n_tracks(&self) -> usize {
        self.tracks.len()
    }

    /// Tracks that were merged into an older one of the same object.
    pub fn merges(&self) -> u64 {
        self.merges
    }

    /// Objects that were not tracked for lack of room.
    pub fn births_refused(&self) -> u64 {
        self.births_refused
    }
}

fn sighting_key(frame: &DetectionFrame, index: usize) -> EvidenceKey {
    let index = u16::try_from(index).expect("validated frames hold at most 4096 detections");
    EvidenceKey { captured_at: frame.captured_at, frame: frame.id, index }
}

fn look_key(frame: &DetectionFrame) -> EvidenceKey {
    EvidenceKey { captured_at: frame.captured_at, frame: frame.id, index: u16::MAX }
}

/// Holds against a track, which now begins at `birth`, every look from then on that it does not know of.
fn hold_against(looks: &VecDeque<(EvidenceKey, Look)>, track: &mut Track, birth: &EvidenceKey) {
    let start = looks.partition_point(|(key, _)| key.captured_at < birth.captured_at);
    for (key, look) in looks.iter().skip(start) {
        let known = track.has_evidence_of(key.captured_at, &key.frame);
        if !known && key.frame != birth.frame && may_concern(look, track, key.captured_at) {
            track.insert(*key, Evidence::Look(*look));
        }
    }
}

/// Whether a look can be evidence on a track at all, now or after late data has moved it. A look before the
/// birth is none; should the birth move, it is held against the track then.
fn may_concern(look: &Look, track: &mut Track, at: Timestamp) -> bool {
    if at < track.latest().born_at {
        return false;
    }
    is_in_range(look, &track.known_at(at).state_at(at))
}

fn is_in_range(look: &Look, state: &State) -> bool {
    let [x, y] = state.kinematic.position;
    look.pose.distance_to(x, y) <= look.field_of_view.range_max_m + LOOK_SLACK_M
}
