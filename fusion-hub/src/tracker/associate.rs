//! Which report of a frame is of which track.

use super::{Innovations, MAX_TRACKS, Tracker};
use crate::association::{AssociationConfig, AssociationCost, Associator, Expected};
use crate::filter::{Filter, PositionInnovation};
use crate::frames::{FrameSlot, StoredFrame};
use crate::particles::{ParticleSet, Particles, Version};
use crate::track::Track;
use v2x_common::covariance::Covariance2;

impl<F: Filter> Tracker<F> {
    /// Finds the reports of the expected tracks, and how far off these lay.
    pub(super) fn associate(&mut self, slot: FrameSlot) -> Innovations {
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
}

/// For each measurement the place of its track among the expected ones; where particles differ, by the leading one.
pub(super) fn track_of<'a>(
    associator: &'a Associator,
    particles: Option<&'a Particles>,
) -> &'a [Option<u32>] {
    particles.map_or(associator.track_of(), Particles::track_of)
}
