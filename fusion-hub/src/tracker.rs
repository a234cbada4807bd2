//! Tracks and frames: which report is of which track, what begins and what ends.

mod instant;
mod reconsider;

use crate::agents::{AgentSlot, Agents};
use crate::association::{AssociationConfig, AssociationCost, Associator, Expected};
use crate::config::EngineConfig;
use crate::duplicates::{Duplicates, Weights};
use crate::filter::{Filter, Measurement, PositionInnovation};
use crate::frames::{FrameSlot, FrameStore, LOOK, Piece, StoredFrame};
use crate::inbox::AgentRecord;
use crate::particles::{ParticleSet, Particles, Version, versions};
use crate::publish::Publisher;
use crate::sensing::{Look, Sensing};
use crate::track::{Former, Records, Retrospection, Track};
use instant::Instant;
use v2x_common::covariance::Covariance2;
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::FusedObject;
use v2x_common::id::TrackId;
use v2x_common::time::{Span, Timestamp};

/// A track that could have more of a frame's reports than this tells nothing about duplicates.
const MAX_RIVALS: usize = 8;
/// Most tracks, published or not.
const MAX_TRACKS: usize = 65_536;
/// How often pairs of tracks that are gone are forgotten; ids never come back, so it only saves memory.
const FORGET_DUPLICATES_EVERY: Span = Span::from_millis(5000);
/// Most dropped tracks of which the memory is kept.
const MAX_SPARE: usize = 4096;
/// No object that a frame could report or miss lies further outside of its region than this, m, with this
/// much more for each second since its state, m/s, and for each metre of its and the reports' standard deviation.
const REGION_MARGIN_M: f64 = 100.0;
const REGION_SPEED_MPS: f64 = 150.0;
const REGION_SIGMAS: f64 = 10.0;

/// All tracks under one kind of filter.
#[derive(Debug)]
pub(crate) struct Tracker<F> {
    config: EngineConfig,
    undescribed: Sensing,
    frames: FrameStore,
    /// By id.
    tracks: Vec<Track<F>>,
    spare: Vec<Track<F>>,
    next_counter: u32,
    duplicates: Duplicates,
    duplicates_forgotten_at: Timestamp,
    /// What can be taken back of the newest frames.
    instant: Instant<F>,
    associator: Associator,
    particles: Option<Particles>,
    /// Tracks at the time of a frame: their places, their states, and what association needs of these.
    places: Vec<usize>,
    predicted: Vec<F>,
    expected: Vec<Expected>,
    /// For each of them the report of it in the frame.
    reports: Vec<Option<u16>>,
    /// The reports of nothing known, and the particles to which they are that.
    births: Vec<(u16, ParticleSet)>,
    measurements: Vec<Measurement>,
    merges_due: Vec<(TrackId, TrackId)>,
    publisher: Publisher,
    retrospection: Retrospection<F>,
    /// With a lag: what was merged, as it was before.
    former: Former<F>,
    /// Without a lag, tracks last measured before are gone: they may be told of, and are of no frame any more.
    gone_before: Timestamp,
    counts: Counts,
}

/// What happened to tracks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Objects that were not tracked for lack of room.
    pub births_refused: u64,
    /// Tracks that were merged into an older one of the same object.
    pub merges: u64,
}

/// Innovations of one frame: sum of the normalised squares, 2 degrees of freedom each, and their number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Innovations {
    pub(crate) nis_sum: f64,
    pub(crate) count: u64,
}

impl<F: Filter> Tracker<F> {
    pub(crate) fn new(config: EngineConfig) -> Self {
        Self {
            config,
            undescribed: Sensing::undescribed(&config.sensing),
            frames: FrameStore::default(),
            tracks: Vec::new(),
            spare: Vec::new(),
            next_counter: 0,
            duplicates: Duplicates::default(),
            duplicates_forgotten_at: Timestamp::MIN,
            instant: Instant::default(),
            associator: Associator::default(),
            particles: Particles::new(config.association_particles),
            places: Vec::new(),
            predicted: Vec::new(),
            expected: Vec::new(),
            reports: Vec::new(),
            births: Vec::new(),
            measurements: Vec::new(),
            merges_due: Vec::new(),
            publisher: Publisher::new(&config),
            retrospection: Retrospection::default(),
            former: Former::default(),
            gone_before: Timestamp::MIN,
            counts: Counts::default(),
        }
    }

    /// Takes in an accepted frame.
    pub(crate) fn handle(
        &mut self,
        frame: &DetectionFrame,
        (agent, record): (AgentSlot, &AgentRecord),
        agents: &Agents,
    ) -> Innovations {
        let look = record.look(frame);
        let sensing = if record.description.is_some() { &record.sensing } else { &self.undescribed };
        let slot = self.frames.insert(frame, agent, sensing, look);
        self.begin_instant(slot);
        self.merges_due.clear();
        let innovations = self.take_in(slot, agents);
        let again = self.blurred_before(slot);
        if again.is_empty() {
            self.find_duplicates(slot);
            self.order();
        } else {
            self.reconsider((slot, again), agents);
        }
        self.spare.truncate(MAX_SPARE);
        self.merge(slot, agents);
        innovations
    }

    /// Finds out what a stored frame's reports are of.
    fn take_in(&mut self, slot: FrameSlot, agents: &Agents) -> Innovations {
        self.measurements.clear();
        self.measurements.extend(self.frames.measurements(slot));
        self.expect_tracks(slot, agents);
        let innovations = self.associate(slot);
        self.add_evidence(slot, agents);
        self.give_births(slot, agents);
        innovations
    }

    /// With particles: drops versions that nobody holds, and puts the others in order.
    fn order(&mut self) {
        if self.particles.is_some() {
            versions::order(&mut self.tracks, &mut self.spare);
        }
    }

    fn records<'a>(config: &EngineConfig, frames: &'a FrameStore, agents: &'a Agents) -> Records<'a> {
        let EngineConfig { filter_synchronous: synchronous, late_data, lag, class_priors, .. } = *config;
        let remembers_folded = lag > Span::ZERO;
        Records { frames, agents, synchronous, late_data, remembers_folded, class_moves: class_priors }
    }

    /// The tracks that the frame can concern, as they stood at its time.
    fn expect_tracks(&mut self, slot: FrameSlot, agents: &Agents) {
        self.places.clear();
        self.predicted.clear();
        self.expected.clear();
        let records = Self::records(&self.config, &self.frames, agents);
        let frame = self.frames.get(slot);
        let at = frame.captured_at;
        let Some(region) = Region::of(&self.measurements, frame.look.as_ref()) else { return };
        // As long as a track is kept, so that a gap may be bridged by data that is still to come.
        let memory = self.config.coast + self.config.delta_max;
        let has_lag = self.config.lag > Span::ZERO;
        let away_from = |track: &Track<F>| (at - track.latest().state.at()).abs();
        for (place, track) in self.tracks.iter().enumerate() {
            let is_near = region.may_hold(&track.latest().state, away_from(track).as_secs_f64());
            if !is_near && track.holders.is_all() {
                continue;
            }
            // Association stays what it is without a lag.
            if has_lag && track.last_measured_at() < self.gone_before {
                continue;
            }
            let past;
            let known = if track.is_newest(at) {
                track.latest()
            } else {
                past = track.known_at(at, &records);
                &past
            };
            // A track that seems dead may only be waiting for late data: it is expected too, but yields to others.
            let away = (at - known.state.at()).abs();
            // The versions of a track stay in step: particles are drawn with all of theirs.
            if away > memory && track.holders.is_all() {
                continue;
            }
            self.places.push(place);
            // Predicted in its place: states are large, and copies cost as much as the prediction.
            self.predicted.push(known.state);
            if let Some(state) = self.predicted.last_mut() {
                if away > records.synchronous {
                    state.predict(at, known.moves_as());
                }
                let mut expected = state.expected(known.class());
                if let Some(look) = &frame.look
                    && look.covers(expected.position, 0.0)
                {
                    let reported = known.existence_at(at) * (1.0 - look.miss_probability);
                    expected.report_probability = reported;
                }
                self.expected.push(expected);
            }
        }
    }

    /// Finds the reports of the expected tracks, and how far off these lay.
    fn associate(&mut self, slot: FrameSlot) -> Innovations {
        let (measurements, config) = (&self.measurements, &self.config.association);
        self.births.clear();
        if let Some(particles) = &mut self.particles {
            let config = AssociationConfig { cost: AssociationCost::Likelihood, ..*config };
            self.associator.find_candidates(measurements, &self.expected, &config);
            let version = |place: &usize| {
                let Track { id, holders, disputed_at, .. } = self.tracks[*place];
                Version { track: id, holders, disputed_at }
            };
            let versions = self.places.iter().map(version);
            let StoredFrame { id, captured_at, .. } = self.frames.get(slot);
            let pairs = (measurements.as_slice(), self.expected.as_slice());
            particles.associate((id, *captured_at), versions, pairs, &self.associator);
            self.births.extend(particles.births());
        } else {
            self.associator.associate(measurements, &self.expected, config);
        }
        self.reports.clear();
        self.reports.resize(self.expected.len(), None);
        let mut innovations = Innovations::default();
        let track_of = track_of(&self.associator, self.particles.as_ref());
        for (index, (z, found)) in (0..).zip(measurements.iter().zip(track_of)) {
            let Some(found) = found else {
                if self.particles.is_none() {
                    self.births.push((index, ParticleSet::ALL));
                }
                continue;
            };
            self.reports[*found as usize] = Some(index);
            let Expected { position: [x, y], position_covariance: p, .. } = self.expected[*found as usize];
            let s = Covariance2 { xx: p.xx + z.r.xx, xy: p.xy + z.r.xy, yy: p.yy + z.r.yy };
            let difference = [z.position[0] - x, z.position[1] - y];
            innovations.nis_sum += PositionInnovation::new(difference, &s).mahalanobis2;
            innovations.count += 1;
        }
        self.split_versions();
        innovations
    }

    /// Makes as many versions of each expected track as particles take reports to be of it.
    fn split_versions(&mut self) {
        let Some(particles) = &self.particles else { return };
        self.instant.keep((&self.tracks, &self.places), particles.outcomes(), &mut self.spare);
        for place in &self.places {
            self.tracks[*place].holders = ParticleSet::NONE;
        }
        for outcome in particles.outcomes() {
            let col = outcome.col as usize;
            let track = &mut self.tracks[self.places[col]];
            if track.holders.is_empty() {
                track.holders = outcome.holders;
                track.disputed_at = outcome.disputed_at;
                self.reports[col] = outcome.report;
                continue;
            }
            if self.tracks.len() >= MAX_TRACKS {
                // No room for doubt.
                self.tracks[self.places[col]].holders.join(outcome.holders);
                continue;
            }
            let mut copy = self.tracks[self.places[col]].copied(outcome.holders, self.spare.pop());
            copy.disputed_at = outcome.disputed_at;
            self.places.push(self.tracks.len());
            self.tracks.push(copy);
            self.predicted.push(self.predicted[col]);
            self.expected.push(self.expected[col]);
            self.reports.push(outcome.report);
        }
    }

    /// Gives every expected track its report, or the look that it was not reported in.
    fn add_evidence(&mut self, slot: FrameSlot, agents: &Agents) {
        let records = Self::records(&self.config, &self.frames, agents);
        let frame = self.frames.get(slot);
        let captured_at = frame.captured_at;
        for (col, place) in self.places.iter().enumerate() {
            let track = &mut self.tracks[*place];
            let predicted = &self.predicted[col];
            if let Some(index) = self.reports[col] {
                let piece = Piece { captured_at, frame: slot, index };
                let may_move_birth =
                    track.oldest().is_some_and(|oldest| records.frames.is_before(&piece, oldest));
                track.insert(piece, Some(predicted), &records);
                if may_move_birth {
                    hold_against(track, &piece, self.instant.taken_back(), &records);
                }
            } else if let Some(look) = &frame.look
                && look.may_cover(self.expected[col].position)
                && track.born_at() <= captured_at
            {
                track.insert(Piece { captured_at, frame: slot, index: LOOK }, Some(predicted), &records);
            }
        }
    }

    fn give_births(&mut self, slot: FrameSlot, agents: &Agents) {
        let records = Self::records(&self.config, &self.frames, agents);
        let captured_at = self.frames.get(slot).captured_at;
        for (index, holders) in &self.births {
            if self.tracks.len() >= MAX_TRACKS || self.next_counter == u32::MAX {
                self.counts.births_refused += 1;
                continue;
            }
            let birth = Piece { captured_at, frame: slot, index: *index };
            let id = self.instant.take_name(&birth).unwrap_or_else(|| {
                self.next_counter += 1;
                TrackId::new(self.config.lineage, self.next_counter - 1)
            });
            let mut track = Track::new(id, birth, self.spare.pop(), &records);
            track.holders = *holders;
            hold_against(&mut track, &birth, self.instant.taken_back(), &records);
            self.tracks.push(track);
        }
    }

    /// Finds tracks that frames have shown to be of one object.
    ///
    /// Two tracks compete where a report of one could have been of the other. How far they are apart does not
    /// matter: two tracks that share one object's reports, each taking the nearer ones, push each other away
    /// further than their own covariances would allow.
    fn find_duplicates(&mut self, slot: FrameSlot) {
        let frame = self.frames.get(slot);
        let Some(look) = frame.look.as_ref().filter(|_| self.config.resolve_duplicates) else { return };
        let (associator, places) = (&self.associator, &self.places);
        let id_of = |col: usize| self.tracks[places[col]].id;
        let track_of = track_of(associator, self.particles.as_ref());
        for (col, own) in self.reports.iter().take(associator.n_expected()).enumerate() {
            let candidates = associator.candidates_of(col);
            if candidates.len() > MAX_RIVALS || !self.tracks[places[col]].holders.leads() {
                continue;
            }
            for report in candidates {
                let Some(rival) = track_of[*report as usize] else { continue };
                let rival = rival as usize;
                // Where each could have had the other's report, the pair is met twice.
                let is_mutual =
                    || own.is_some_and(|own| associator.candidates_of(rival).contains(&u32::from(own)));
                if rival == col || (rival < col && is_mutual()) {
                    continue;
                }
                if own.is_none() && !look.covers(self.expected[col].position, 0.0) {
                    continue;
                }
                let weights = Weights::of([col, rival].map(|col| self.expected[col].report_probability));
                let (pair, witness) = ((id_of(col), id_of(rival)), (frame.agent, &weights));
                let merge = self.duplicates.note(pair, own.is_some(), witness, (slot, frame.captured_at));
                self.merges_due.extend(merge);
            }
        }
    }

    fn merge(&mut self, slot: FrameSlot, agents: &Agents) {
        let records = Self::records(&self.config, &self.frames, agents);
        for (older, younger) in &self.merges_due {
            self.instant.forget([*older, *younger]);
            if self.particles.is_some() {
                versions::keep_leading(&mut self.tracks, *older);
                versions::keep_leading(&mut self.tracks, *younger);
            }
            let places = [older, younger].map(|id| self.tracks.binary_search_by_key(id, |track| track.id));
            if let [Ok(older), Ok(younger)] = places {
                let absorbed = self.tracks.remove(younger);
                if records.remembers_folded {
                    let merged_at = self.frames.get(slot).captured_at;
                    self.former.note(&self.tracks[older], &absorbed, merged_at);
                }
                self.tracks[older].absorb(&absorbed, &records);
                self.counts.merges += 1;
                if self.spare.len() < MAX_SPARE {
                    self.spare.push(absorbed);
                }
            }
        }
    }

    /// Replays late data and forgets what can no longer matter: nothing older than the horizon is let in.
    ///
    /// Frames are kept for `slack` longer, so that tracks can be folded where it costs nothing.
    pub(crate) fn settle(&mut self, now: Timestamp, (horizon, slack): (Timestamp, Span), agents: &Agents) {
        let records = Self::records(&self.config, &self.frames, agents);
        let gone = horizon - self.config.coast;
        self.gone_before = horizon.max(now - self.config.delta_max) - self.config.coast;
        let before = self.tracks.len();
        let mut kept = 0;
        for place in 0..before {
            let track = &mut self.tracks[place];
            track.replay(&records);
            track.fold(horizon, slack, &records);
            let last_measured_at = track.last_measured_at();
            track.forget_contributors(gone);
            // However dead it seems: late data can still be its own, and how often the hub publishes must not show.
            if last_measured_at >= gone {
                if kept < place {
                    self.tracks.swap(kept, place);
                }
                kept += 1;
            }
        }
        for dropped in self.tracks.drain(kept..) {
            if dropped.holders.leads() {
                self.publisher.note_gone(&dropped);
            }
            if self.spare.len() < MAX_SPARE {
                self.spare.push(dropped);
            }
        }
        self.instant.settle(gone, (horizon, slack), &records);
        self.former.settle(horizon, slack, &records);
        self.frames.forget_before(horizon - slack);
        if now - self.duplicates_forgotten_at > FORGET_DUPLICATES_EVERY {
            self.duplicates_forgotten_at = now;
            let tracks = &self.tracks;
            let lives = |id| tracks.binary_search_by_key(&id, |track| track.id).is_ok();
            self.duplicates.forget(now, lives);
        }
    }

    /// Whether there is no room for a frame with so many measurements.
    pub(crate) fn is_full_for(&self, n_measurements: usize) -> bool {
        self.frames.is_full_for(n_measurements)
    }

    /// The time before which the oldest quarter of history ends.
    pub(crate) fn first_quarter(&self) -> Option<Timestamp> {
        self.frames.first_quarter()
    }

    /// Measurements of an agent that are held.
    pub(crate) fn n_measurements_of(&self, agent: AgentSlot) -> usize {
        self.frames.n_measurements_of(agent)
    }

    /// Writes down the objects as of `now`; what the list held is overwritten.
    pub(crate) fn tell(&mut self, objects: &mut Vec<FusedObject>, now: Timestamp, agents: &Agents) {
        let n_particles = self.particles.as_ref().map_or(1, Particles::n);
        self.publisher.fill(objects, (&self.tracks, n_particles), (now, agents), &self.config);
    }

    /// Writes down the objects as of `at`, by all that is known by now; history must reach back so far.
    pub(crate) fn tell_as_of(&mut self, objects: &mut Vec<FusedObject>, at: Timestamp, agents: &Agents) {
        let records = Self::records(&self.config, &self.frames, agents);
        let tracks = self.former.with_present(&self.tracks, at);
        let tracks = (tracks.as_slice(), &mut self.retrospection);
        self.publisher.fill_as_of(objects, tracks, (at, &records), &self.config);
    }

    pub(crate) fn n_tracks(&self) -> usize {
        self.tracks.iter().filter(|track| track.holders.leads()).count()
    }

    pub(crate) fn counts(&self) -> Counts {
        self.counts
    }
}

/// For each measurement the place of its track among the expected ones; where particles differ, by the leading one.
fn track_of<'a>(associator: &'a Associator, particles: Option<&'a Particles>) -> &'a [Option<u32>] {
    particles.map_or(associator.track_of(), Particles::track_of)
}

/// Where a frame's reports lie and its sensor looked: a circle.
struct Region {
    centre: [f64; 2],
    radius_m: f64,
}

impl Region {
    /// `None` for a frame that neither reports nor looks.
    fn of(measurements: &[Measurement], look: Option<&Look>) -> Option<Self> {
        let positions = || measurements.iter().map(|z| z.position);
        let centre = match look {
            Some(look) => [look.pose.x, look.pose.y],
            None => positions().next()?,
        };
        let farthest = positions().map(|position| squared_distance(position, centre)).fold(0.0, f64::max);
        let range = look.map_or(0.0, |look| look.field_of_view.range_max_m);
        let variance = measurements.iter().map(|z| z.r.xx.max(z.r.yy)).fold(0.0, f64::max);
        let margin = REGION_MARGIN_M + REGION_SIGMAS * libm::sqrt(variance);
        Some(Self { centre, radius_m: libm::sqrt(farthest).max(range) + margin })
    }

    /// Whether a track with this state so many seconds before or after can be concerned.
    fn may_hold<F: Filter>(&self, state: &F, away_s: f64) -> bool {
        let (position, sigma_m) = state.neighbourhood();
        let reach = self.radius_m + REGION_SPEED_MPS * away_s + REGION_SIGMAS * sigma_m;
        squared_distance(position, self.centre) <= reach * reach
    }
}

fn squared_distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    let (dx, dy) = (a[0] - b[0], a[1] - b[1]);
    dx * dx + dy * dy
}

/// Holds against a track, which now begins at `birth`, every look from then on that it does not know of. A look
/// before the birth is no evidence; should the birth move, it is held against the track then. Nor is a frame that is
/// still to be associated again.
fn hold_against<F: Filter>(
    track: &mut Track<F>,
    birth: &Piece,
    taken_back: &[FrameSlot],
    records: &Records<'_>,
) {
    for (slot, frame) in records.frames.since(birth.captured_at) {
        let Some(look) = &frame.look else { continue };
        if slot == birth.frame || taken_back.contains(&slot) || track.has_evidence_of(frame.captured_at, slot)
        {
            continue;
        }
        // Roughly is enough: whether it was in view is decided when the evidence is evaluated.
        if look.may_cover(track.latest().state.neighbourhood().0) {
            let piece = Piece { captured_at: frame.captured_at, frame: slot, index: LOOK };
            track.insert(piece, None, records);
        }
    }
}
