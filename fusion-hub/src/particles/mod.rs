//! Association particles: several hypotheses of which report is of which track, where that is ambiguous.
//!
//! A particle is one hypothesis of all objects: for each object one track with evidence of its own. Where particles
//! agree on an object they share one track, so that hypotheses exist, and cost, only where there is ambiguity. Where
//! they do not, an object has several *versions*: tracks with the same id, next to each other in the list, each with
//! the set of particles that hold it. All particles have equal weight, always.
//!
//! For each frame, tracks and reports that can be pairs form connected components. In each, apart:
//!
//! 1. A particle weighs exp(−C/2), C the cost of its optimal assignment ([`likelihood`], less
//!    [`COST_ALONE`] a pair). Particles are drawn again by these weights (systematic resampling; survivors keep
//!    their places, so that components which meet again still fit together).
//! 2. Each draws its assignment: the optimum after every cost was perturbed by a Gumbel variable (perturb and
//!    MAP; Papandreou & Yuille 2011). Particles that drew the same for the same version go on sharing it.
//!    The leading particle takes the optimum itself: ids then change on evidence, not at random.
//! 3. The particle that agrees most with the others about this frame's assignments takes place 0. It *leads*: ids,
//!    contributors and initiations are those of it.
//!
//! An object of one track and one report that compete with no others takes no part in this; its track is
//! updated once. Hypotheses end where resampling leaves one, and where nothing has decided between them for
//! two seconds: then the leading one stays.
//!
//! Resampling is done in each component apart: over all of a crowd's components at once the weights multiply, and a
//! few particles would be left for all of them. It is done every frame: waiting until the effective number
//! falls below half, without carrying weights along, loses weak evidence.
//!
//! **Late data.** Every version has its own evidence, so a late frame is treated in each particle as it is without
//! particles: associated with the states at its own time, replayed there, and not reopened. Particles are drawn
//! again by its likelihood given their states at that time. Where nothing competes, particles change no bit, and any
//! order of arrival gives the same; where something does, association depends on the order as it does without.
//!
//! **Chance** is drawn from (agent, epoch, sequence, component) alone.
//!
//! [`COST_ALONE`]: crate::association::likelihood::COST_ALONE
//! [`likelihood`]: crate::association::likelihood

mod ancestors;
mod chance;
mod competition;
mod component;
mod hypothesis;
mod places;

pub(crate) use hypothesis::{Outcome, Version};

use crate::association::{AssociationConfig, Associator, likelihood};
use crate::values::{MAX_PARTICLES, Measurement, ParticleSet, PredictedMeasurement};
use chance::Chance;
use competition::{Competition, Edge};
use component::Component;
use places::{as_index, as_u32};
use v2x_common::id::FrameId;
use v2x_common::time::Timestamp;

/// A frame and what the tracks predict of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PredictedFrame<'a> {
    /// Id of the frame: it seeds the random numbers.
    pub(crate) id: &'a FrameId,
    /// Capture time of the frame.
    pub(crate) captured_at: Timestamp,
    /// The frame's detections.
    pub(crate) measurements: &'a [Measurement],
    /// The predicted measurement of each version.
    pub(crate) expected: &'a [PredictedMeasurement],
    /// How pairs are made.
    pub(crate) config: &'a AssociationConfig,
}

/// Associates frames in all particles; holds the buffers.
#[derive(Debug)]
pub(crate) struct Particles {
    n: u32,
    versions: Vec<Version>,
    competition: Competition,
    component: Component,
    outcomes: Vec<Outcome>,
    initiations: Vec<(u16, ParticleSet)>,
    /// For each measurement the version that the leading particle assigns it to.
    track_of: Vec<Option<u32>>,
}

impl Particles {
    /// With `n` particles; `None` where there is only one hypothesis.
    pub(crate) fn new(n: u32) -> Option<Self> {
        (n > 1).then(|| Self {
            n: n.min(MAX_PARTICLES),
            versions: Vec::new(),
            competition: Competition::default(),
            component: Component::new(n.min(MAX_PARTICLES)),
            outcomes: Vec::new(),
            initiations: Vec::new(),
            track_of: Vec::new(),
        })
    }

    /// How many there are.
    pub(crate) fn n(&self) -> u32 {
        self.n
    }

    /// Finds the assignment of a frame's reports in each particle. `associator` holds the candidates.
    pub(crate) fn associate(
        &mut self,
        frame: &PredictedFrame<'_>,
        versions: impl Iterator<Item = Version>,
        associator: &Associator,
    ) {
        self.versions.clear();
        self.versions.extend(versions);
        self.outcomes.clear();
        self.initiations.clear();
        self.track_of.clear();
        self.track_of.resize(frame.measurements.len(), None);
        self.list_competition(frame, associator);
        self.decide(&Chance::of(frame.id), frame.captured_at);
        for (index, found) in (0..).zip(&self.track_of) {
            // Reports in a component were assigned there.
            if found.is_none() && !self.competition.is_about(index) {
                self.initiations.push((index, ParticleSet::ALL));
            }
        }
    }

    /// Makes pairs that compete with no others; lists what does compete.
    fn list_competition(&mut self, frame: &PredictedFrame<'_>, associator: &Associator) {
        let PredictedFrame { measurements, expected, config, .. } = *frame;
        let cost = |col: usize, place: u32| {
            let z = &measurements[place as usize];
            likelihood::pair_cost(z, &expected[col], config) - likelihood::COST_ALONE
        };
        let Self { versions, competition, outcomes, track_of, .. } = self;
        competition.begin(measurements.len());
        let mut start = 0;
        for row in versions.chunk_by(|a, b| a.track == b.track) {
            let cols = start..start + row.len();
            start = cols.end;
            let Version { holders, disputed_at, .. } = row[0];
            let col = cols.start;
            if holders.is_all()
                && let Some(place) = uncontested(associator, col, |place| cost(col, place) <= 0.0)
            {
                if let Some(place) = place {
                    track_of[place as usize] = Some(as_u32(col));
                }
                let report = place.map(as_index);
                outcomes.push(Outcome { col: as_u32(col), report, holders, disputed_at });
                competition.skip_version();
                continue;
            }
            for col in cols {
                let report_cost = likelihood::report_cost(expected[col].report_probability);
                let places = associator.candidates_of(col).iter();
                competition.version(
                    places.map(|place| Edge { place: *place, cost: cost(col, *place) + report_cost }),
                );
            }
            competition.row(row.len());
        }
        competition.finish();
    }

    fn decide(&mut self, chance: &Chance, captured_at: Timestamp) {
        let Self { competition, component, versions, outcomes, initiations, track_of, .. } = self;
        for (part, rows) in (0..).zip(competition.components()) {
            component.begin(rows, versions, competition);
            component.decide(chance.about(part), captured_at, track_of.len());
            component.list_outcomes(outcomes, initiations, track_of);
        }
        outcomes.sort_by_key(|outcome| (outcome.col, !outcome.holders.leads()));
    }

    /// The outcomes of all versions, by their places; of several outcomes of one version the leading particle's is the
    /// first. No particle holds a version without outcome.
    pub(crate) fn outcomes(&self) -> &[Outcome] {
        &self.outcomes
    }

    /// The reports that initiate a track, and the particles in which they do.
    pub(crate) fn initiations(&self) -> &[(u16, ParticleSet)] {
        &self.initiations
    }

    /// For each measurement the place of the version that the leading particle assigns it to.
    pub(crate) fn track_of(&self) -> &[Option<u32>] {
        &self.track_of
    }
}

/// The report of a version that competes with no other for it; `None` where it does.
fn uncontested(associator: &Associator, col: usize, is_pair: impl Fn(u32) -> bool) -> Option<Option<u32>> {
    match associator.candidates_of(col) {
        [] => Some(None),
        [only] if associator.rivals(*only) == 1 => Some(is_pair(*only).then_some(*only)),
        _ => None,
    }
}
