//! The mixture of what association particles hold of an object.

use crate::filter::{Estimate, Filter, Heading, Size};
use crate::track::{Contributor, Track};
use v2x_common::fused::KINEMATIC_INDEX;
use v2x_common::geometry::{angle_difference, wrap_angle};

/// The tracks that not all particles hold, by their newest detection.
///
/// Particles differ about which track an object is, rather than about where objects are: whatever a detection was
/// assigned to, an object was there. So an object is published as the mixture of all versions of all tracks whose newest
/// detection is the same, under the id that the leading particle gives it (compare set JPDA, Svensson et al. 2011). A
/// mean over the versions of one id would lie between two objects.
pub(super) struct HypothesisMixtures<'a, F> {
    n_hypotheses: u32,
    versions: Vec<(&'a Contributor, &'a Track<F>)>,
}

impl<'a, F: Filter> HypothesisMixtures<'a, F> {
    /// Of all tracks, of this many hypotheses.
    pub(super) fn of(tracks: &'a [Track<F>], n_hypotheses: u32) -> Self {
        let differing = tracks.iter().filter(|track| !track.holders.is_all());
        let mut versions: Vec<_> =
            differing.filter_map(|track| Some((track.contributors().newest()?, track))).collect();
        versions.sort_by_key(|(newest, _)| *newest);
        Self { n_hypotheses, versions }
    }

    /// The versions of an object with their shares of the particles; that of the leading particle first.
    pub(super) fn of_track<'b>(&'b self, track: &'b Track<F>) -> impl Iterator<Item = (f64, &'b Track<F>)> {
        let share = |track: &Track<F>| {
            f64::from(track.holders.count(self.n_hypotheses)) / f64::from(self.n_hypotheses)
        };
        let newest = (!track.holders.is_all()).then(|| track.contributors().newest()).flatten();
        let same: &[_] = match newest {
            Some(newest) => {
                let start = self.versions.partition_point(|(other, _)| *other < newest);
                let rest = &self.versions[start..];
                &rest[..rest.partition_point(|(other, _)| *other == newest)]
            }
            None => &[],
        };
        let others = same.iter().map(|(_, version)| *version).filter(|version| !version.holders.leads());
        std::iter::once(track).chain(others).map(move |version| (share(version), version))
    }
}

/// Mean and covariance of a mixture; shares need not sum to 1.
pub(super) fn mixture_moments(parts: impl Iterator<Item = (f64, Estimate)>) -> Estimate {
    let parts: Vec<_> = parts.collect();
    let total: f64 = parts.iter().map(|(share, _)| share).sum();
    let Estimate { heading: Heading { mean: reference, .. }, .. } = parts[0].1;
    let mean = |of: &dyn Fn(&Estimate) -> f64| -> f64 {
        parts.iter().map(|(share, part)| share * of(part)).sum::<f64>() / total
    };
    let variance = |mean_of: f64, of: &dyn Fn(&Estimate) -> (f64, f64)| {
        mean(&|part| {
            let (value, variance) = of(part);
            variance + (value - mean_of) * (value - mean_of)
        })
    };
    let kinematic =
        |part: &Estimate| [part.position[0], part.position[1], part.velocity[0], part.velocity[1]];
    let centre: [f64; 4] = std::array::from_fn(|axis| mean(&|part| kinematic(part)[axis]));
    let covariance = std::array::from_fn(|entry| {
        let (row, col) = KINEMATIC_INDEX[entry];
        mean(&|part| {
            let at = kinematic(part);
            part.covariance[entry] + (at[row] - centre[row]) * (at[col] - centre[col])
        })
    });
    let size = |of: &dyn Fn(&Estimate) -> Size| {
        let mean = mean(&|part| of(part).mean);
        Size { mean, variance: variance(mean, &|part| (of(part).mean, of(part).variance)) }
    };
    let turn = |part: &Estimate| angle_difference(part.heading.mean, reference);
    let turned = mean(&turn);
    Estimate {
        position: [centre[0], centre[1]],
        velocity: [centre[2], centre[3]],
        covariance,
        width: size(&|part| part.width),
        depth: size(&|part| part.depth),
        heading: Heading {
            mean: wrap_angle(reference + turned),
            variance: variance(turned, &|part| (turn(part), part.heading.variance)),
        },
    }
}
