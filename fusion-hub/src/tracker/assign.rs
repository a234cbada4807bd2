//! Second stage: which detection of a frame is of which predicted track.

use super::config::TrackerConfig;
use super::predict::{FrameView, Predictions};
use super::store::TrackStore;
use crate::association::{AssociationConfig, AssociationCost, Associator, ClassRule, is_confusable};
use crate::filter::Filter;
use crate::particles::{Outcome, Particles, PredictedFrame, Version};
use crate::track::Track;
use crate::values::{ParticleSet, PositionInnovation};
use serde::{Deserialize, Serialize};
use v2x_common::class::Class;
use v2x_common::covariance::Covariance2;

/// The assignment of one frame. Tracks are named by their places in the [`Predictions`].
#[derive(Debug, Default)]
pub(crate) struct Assignment {
    /// For each track the index of its detection.
    detections: Vec<Option<u16>>,
    /// Detections that match no known track.
    initiations: Vec<Initiation>,
    innovations: Innovations,
}

/// A detection that initiates a track.
#[derive(Clone, Copy, Debug)]
pub(super) struct Initiation {
    /// Index of the detection.
    pub(super) index: u16,
    /// The particles in which it matches no known track.
    pub(super) holders: ParticleSet,
}

/// Normalised innovations squared of the positions in one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Innovations {
    /// Their sum; each is χ² with 2 degrees of freedom.
    pub nis_sum: f64,
    /// Their number.
    pub count: u64,
}

impl Assignment {
    /// The index of the detection of the track at a place.
    pub(crate) fn detection(&self, place: usize) -> Option<u16> {
        self.detections[place]
    }

    pub(super) fn initiations(&self) -> &[Initiation] {
        &self.initiations
    }

    /// Innovations of the assigned detections.
    pub(crate) const fn innovations(&self) -> Innovations {
        self.innovations
    }

    pub(super) fn set_detection(&mut self, place: usize, detection: Option<u16>) {
        self.detections[place] = detection;
    }

    pub(super) fn add_version(&mut self, detection: Option<u16>) {
        self.detections.push(detection);
    }
}

/// Assigns detections to tracks: optimally, or by association particles.
#[derive(Debug)]
pub(crate) struct Assigning {
    config: AssociationConfig,
    associator: Associator,
    particles: Option<Particles>,
}

impl Assigning {
    pub(crate) fn new(config: &TrackerConfig) -> Self {
        let particles = Particles::new(config.hypotheses.count());
        let cost = if particles.is_some() { AssociationCost::Likelihood } else { config.association.cost };
        let config = AssociationConfig { cost, ..config.association };
        Self { config, associator: Associator::default(), particles }
    }

    /// Whether there are several hypotheses.
    pub(crate) const fn has_particles(&self) -> bool {
        self.particles.is_some()
    }

    /// Whether objects of two classes are seldom taken for each other, where that counts.
    pub(super) fn distinguishes(&self, a: Class, b: Class) -> bool {
        self.config.classes == ClassRule::Evidence && !is_confusable(a, b)
    }

    /// How many hypotheses there are.
    pub(crate) fn n_hypotheses(&self) -> u32 {
        self.particles.as_ref().map_or(1, Particles::n)
    }

    /// What particles make of each version of a track; none without particles.
    pub(super) fn outcomes(&self) -> &[Outcome] {
        self.particles.as_ref().map_or(&[], Particles::outcomes)
    }

    /// Assigns the detections of a frame to predicted tracks.
    pub(crate) fn assign<F: Filter>(
        &mut self,
        frame: &FrameView<'_>,
        tracks: &TrackStore<F>,
        predictions: &Predictions<F>,
        assignment: &mut Assignment,
    ) {
        let predicted = predictions.measurements();
        let config = AssociationConfig { class_law: frame.stored.model.classes, ..self.config };
        if let Some(particles) = &mut self.particles {
            self.associator.find_candidates(frame.measurements, predicted, &config);
            let version = |index: &usize| {
                let Track { id, holders, disputed_at, .. } = *tracks.get(*index);
                Version { track: id, holders, disputed_at }
            };
            let versions = predictions.tracks().iter().map(version);
            let predicted_frame = PredictedFrame {
                id: &frame.stored.id,
                captured_at: frame.stored.captured_at,
                measurements: frame.measurements,
                expected: predicted,
                config: &config,
            };
            particles.associate(&predicted_frame, versions, &self.associator);
        } else {
            self.associator.associate(frame.measurements, predicted, &config);
        }
        self.list(frame, predictions, assignment);
    }

    /// Lists the detection of each track, and the detections of none.
    fn list<F: Filter>(
        &self,
        frame: &FrameView<'_>,
        predictions: &Predictions<F>,
        assignment: &mut Assignment,
    ) {
        let Assignment { detections, initiations, innovations } = assignment;
        detections.clear();
        detections.resize(predictions.len(), None);
        initiations.clear();
        *innovations = Innovations::default();
        for (index, (z, track)) in (0..).zip(frame.measurements.iter().zip(self.track_of())) {
            let Some(track) = track else {
                if self.particles.is_none() {
                    initiations.push(Initiation { index, holders: ParticleSet::ALL });
                }
                continue;
            };
            let track = *track as usize;
            detections[track] = Some(index);
            let predicted = &predictions.measurements()[track];
            let (p, [x, y]) = (&predicted.position_covariance, predicted.position);
            let s = Covariance2 { xx: p.xx + z.r.xx, xy: p.xy + z.r.xy, yy: p.yy + z.r.yy };
            let difference = [z.position[0] - x, z.position[1] - y];
            innovations.nis_sum += PositionInnovation::new(difference, &s).mahalanobis2;
            innovations.count += 1;
        }
        if let Some(particles) = &self.particles {
            let initiation =
                |(index, holders): &(u16, ParticleSet)| Initiation { index: *index, holders: *holders };
            initiations.extend(particles.initiations().iter().map(initiation));
        }
    }

    /// For each detection the place of its track; where particles differ, by the leading one.
    pub(super) fn track_of(&self) -> &[Option<u32>] {
        self.particles.as_ref().map_or(self.associator.track_of(), Particles::track_of)
    }

    /// Candidates that were found since it was made.
    pub(super) const fn candidates_weighed(&self) -> u64 {
        self.associator.weighed()
    }

    /// How many tracks were predicted, before versions were added.
    pub(super) fn n_predicted(&self) -> usize {
        self.associator.n_expected()
    }

    /// The indices of the detections within the gate of the track at a place, in order.
    pub(super) fn candidates_of(&self, place: usize) -> &[u32] {
        self.associator.candidates_of(place)
    }
}
