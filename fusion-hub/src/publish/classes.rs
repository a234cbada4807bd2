//! What is published of an object's class, and the sizes that follow from it.

use super::readings::Readings;
use crate::filter::size_priors::TrackSizePriors;
use crate::filter::{Estimate, Filter, Size};
use crate::track::Track;
use crate::values::{AgentNames, ClassShares};
use v2x_common::class::Class;

/// What is published of an object's class.
#[derive(Clone, Copy)]
pub(super) struct PublishedClasses {
    pub(super) shares: ClassShares,
    /// How much the agents contradict each other.
    pub(super) conflict: f64,
}

impl PublishedClasses {
    /// Of a track: what its agents believe, or the shares of the classes that were reported.
    pub(super) fn of<F: Filter>(track: &Track<F>, agents: &AgentNames, readings: &Readings<'_>) -> Self {
        let latest = track.latest();
        if !readings.combines_beliefs {
            return Self { shares: latest.class_shares(), conflict: 0.0 };
        }
        let law = |agent| readings.class_law(agent);
        match track.classes().undisputed(law) {
            Some(class) => Self { shares: ClassShares::of_one(class), conflict: 0.0 },
            None => {
                let belief = track.classes().belief(agents, law);
                Self { shares: belief.shares(latest.class()), conflict: belief.conflict() }
            }
        }
    }

    /// The estimate of a state: its sizes are a mixture over the classes that the object may be of.
    pub(super) fn estimate<F: Filter>(&self, state: &F, priors: &TrackSizePriors<'_>) -> Estimate {
        state.pose().with_sizes(self.sizes(state, priors))
    }

    /// The sizes of a state: a mixture over the classes that the object may be of.
    pub(super) fn sizes<F: Filter>(&self, state: &F, priors: &TrackSizePriors<'_>) -> [Size; 2] {
        let mut sizes = state.sizes(self.shares.leading(), priors);
        let others = self.shares.listed().iter().skip(1);
        let (mut of_others, mut total) = ([Moments::default(); 2], self.share_of_leading());
        for (class, share) in others.filter(|(class, _)| *class != Class::Unknown) {
            total += share;
            for (of_others, size) in of_others.iter_mut().zip(state.sizes(*class, priors)) {
                of_others.add(*share, size);
            }
        }
        if total > self.share_of_leading() {
            for (moments, size) in of_others.iter_mut().zip(&mut sizes) {
                moments.add(self.share_of_leading(), *size);
                *size = moments.of(total);
            }
        }
        sizes
    }

    fn share_of_leading(&self) -> f64 {
        self.shares.listed().first().map_or(1.0, |(_, share)| *share)
    }
}

/// Sums for the moments of a mixture of sizes.
#[derive(Clone, Copy, Default)]
struct Moments {
    first: f64,
    second: f64,
}

impl Moments {
    fn add(&mut self, share: f64, size: Size) {
        self.first += share * size.mean;
        self.second += share * (size.variance + size.mean * size.mean);
    }

    /// For shares of this sum.
    fn of(&self, total: f64) -> Size {
        let mean = self.first / total;
        Size { mean, variance: (self.second / total - mean * mean).max(f64::MIN_POSITIVE) }
    }
}
