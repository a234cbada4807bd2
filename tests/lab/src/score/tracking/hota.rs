//! HOTA: detection, association and localisation in balance (Luiten et al., IJCV 2021), as TrackEval
//! (`metrics/hota.py`) computes it.
//!
//! TrackEval has no similarity of rotated boxes. For points it has max(0, 1 − distance / zero distance), with 2 m for
//! pedestrians (MOT15-3D). Here this is used for the centres, with [`ZERO_M`] by default, so that α = 0.5 is nuScenes'
//! 2 m. Scenes are combined as in TrackEval's `COMBINED`: counts and weighted sums are added for each α before any ratio,
//! and the mean over α comes last.

use crate::score::tracking::indexed::{Indexed, IndexedInstant};
use crate::score::tracking::sequence::Sequence;
use v2x_fusion_hub::association::assignment::{Assigner, Candidate};

/// The distance of similarity 0, m: twice [`super::GATE_M`].
pub const ZERO_M: f64 = 4.0;

const N_ALPHAS: usize = 19;

/// The similarities from which a pair counts: 0.05, 0.1, … 0.95 (with the bits of `np.arange(0.05, 0.99, 0.05)`).
#[expect(clippy::cast_precision_loss, reason = "below 19")]
fn alpha(place: usize) -> f64 {
    0.05 + 0.05 * place as f64
}

/// Sums over scenes, for each α.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hota {
    objects: u64,
    reported: u64,
    by_alpha: [Sums; N_ALPHAS],
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Sums {
    true_positives: u64,
    similarity: f64,
    /// Sums over true positives of the overlap of their object and track in time: as a share of both, of the object, of the
    /// track.
    association: f64,
    association_recall: f64,
    association_precision: f64,
}

/// Means over the 19 α, each in [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HotaScore {
    /// √(DetA · AssA).
    pub hota: f64,
    /// True positives over true positives, misses and false positives.
    pub det_a: f64,
    /// Share of the true boxes with a pair.
    pub det_re: f64,
    /// Share of the reported boxes with a pair.
    pub det_pr: f64,
    /// Mean over true positives of the overlap of their object and track in time.
    pub ass_a: f64,
    /// The same, as a share of the object.
    pub ass_re: f64,
    /// The same, as a share of the track.
    pub ass_pr: f64,
    /// Mean similarity of true positives; 1 where there are none.
    pub loc_a: f64,
}

impl Hota {
    /// The sums of a scene; boxes at a distance of `zero_m` have similarity 0 ([`ZERO_M`]).
    pub fn of(sequence: &Sequence, zero_m: f64) -> Self {
        let indexed = Indexed::of(sequence, zero_m);
        let lengths = Lengths::of(&indexed);
        let together = matched(&indexed, &lengths, zero_m);
        let mut hota = Self { objects: indexed.n_true(), reported: indexed.n_reported(), ..Self::default() };
        for (place, sums) in hota.by_alpha.iter_mut().enumerate() {
            sums.similarity = together.similarity[place];
            for (&(object, track), together) in indexed.couples.iter().zip(&together.instants) {
                let together = together[place];
                sums.true_positives += u64::from(together);
                let (object, track) = (lengths.objects[object as usize], lengths.tracks[track as usize]);
                let together = f64::from(together);
                sums.association += together * (together / (object + track - together).max(1.0));
                sums.association_recall += together * (together / object.max(1.0));
                sums.association_precision += together * (together / track.max(1.0));
            }
        }
        hota
    }

    /// Adds another scene.
    pub fn merge(&mut self, other: &Self) {
        self.objects += other.objects;
        self.reported += other.reported;
        for (ours, theirs) in self.by_alpha.iter_mut().zip(&other.by_alpha) {
            ours.true_positives += theirs.true_positives;
            ours.similarity += theirs.similarity;
            ours.association += theirs.association;
            ours.association_recall += theirs.association_recall;
            ours.association_precision += theirs.association_precision;
        }
    }

    /// The means over all α.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub fn score(&self) -> HotaScore {
        let (objects, reported) = (self.objects as f64, self.reported as f64);
        let mut score = HotaScore::default();
        for sums in &self.by_alpha {
            let found = sums.true_positives as f64;
            let det_a = found / (objects + reported - found).max(1.0);
            let ass_a = sums.association / found.max(1.0);
            score.hota += libm::sqrt(det_a * ass_a);
            score.det_a += det_a;
            score.det_re += found / objects.max(1.0);
            score.det_pr += found / reported.max(1.0);
            score.ass_a += ass_a;
            score.ass_re += sums.association_recall / found.max(1.0);
            score.ass_pr += sums.association_precision / found.max(1.0);
            score.loc_a += if sums.true_positives > 0 { sums.similarity / found } else { 1.0 };
        }
        score.divided_by(N_ALPHAS as f64)
    }
}

impl HotaScore {
    fn divided_by(self, n: f64) -> Self {
        let Self { hota, det_a, det_re, det_pr, ass_a, ass_re, ass_pr, loc_a } = self;
        Self {
            hota: hota / n,
            det_a: det_a / n,
            det_re: det_re / n,
            det_pr: det_pr / n,
            ass_a: ass_a / n,
            ass_re: ass_re / n,
            ass_pr: ass_pr / n,
            loc_a: loc_a / n,
        }
    }
}

/// Number of instants of each object and track.
struct Lengths {
    objects: Vec<f64>,
    tracks: Vec<f64>,
}

impl Lengths {
    fn of(indexed: &Indexed) -> Self {
        let mut lengths = Self { objects: vec![0.0; indexed.n_objects], tracks: vec![0.0; indexed.n_tracks] };
        for instant in &indexed.instants {
            instant.objects.iter().for_each(|object| lengths.objects[*object as usize] += 1.0);
            instant.reported.iter().for_each(|reported| lengths.tracks[reported.track as usize] += 1.0);
        }
        lengths
    }
}

/// The pairs.
struct Together {
    /// By couple and α, in instants.
    instants: Vec<[u32; N_ALPHAS]>,
    /// By α, the sum over all pairs.
    similarity: [f64; N_ALPHAS],
}

/// Matches each instant by similarity times alignment of the whole tracks. The pairs are the same for all α.
fn matched(indexed: &Indexed, lengths: &Lengths, zero_m: f64) -> Together {
    let alignment = alignment(indexed, lengths, zero_m);
    let mut together =
        Together { instants: vec![[0; N_ALPHAS]; indexed.couples.len()], similarity: [0.0; N_ALPHAS] };
    let (mut assigner, mut candidates) = (Assigner::default(), vec![]);
    for instant in &indexed.instants {
        candidates.clear();
        candidates.extend(instant.pairs.iter().map(|pair| Candidate {
            row: pair.object,
            col: pair.reported,
            cost: -alignment[pair.couple as usize] * similarity(pair.distance_m, zero_m),
        }));
        let columns = assigner.solve(instant.objects.len(), instant.reported.len(), &candidates, 0.0);
        for pair in instant.pairs.iter().filter(|pair| columns[pair.object as usize] == Some(pair.reported)) {
            let similarity = similarity(pair.distance_m, zero_m);
            for place in (0..N_ALPHAS).take_while(|place| similarity >= alpha(*place) - f64::EPSILON) {
                together.instants[pair.couple as usize][place] += 1;
                together.similarity[place] += similarity;
            }
        }
    }
    together
}

/// For each couple the alignment of object and track before matching: a Jaccard index of instants, each weighed by the
/// couple's similarity relative to all similarities of both.
fn alignment(indexed: &Indexed, lengths: &Lengths, zero_m: f64) -> Vec<f64> {
    let mut potential = vec![0.0; indexed.couples.len()];
    let (mut of_objects, mut of_reported) = (vec![], vec![]);
    for IndexedInstant { objects, reported, pairs, .. } in &indexed.instants {
        of_objects.clear();
        of_objects.resize(objects.len(), 0.0);
        of_reported.clear();
        of_reported.resize(reported.len(), 0.0);
        for pair in pairs {
            of_objects[pair.object as usize] += similarity(pair.distance_m, zero_m);
            of_reported[pair.reported as usize] += similarity(pair.distance_m, zero_m);
        }
        for pair in pairs {
            let shared = similarity(pair.distance_m, zero_m);
            let all = of_objects[pair.object as usize] + of_reported[pair.reported as usize] - shared;
            if all > f64::EPSILON {
                potential[pair.couple as usize] += shared / all;
            }
        }
    }
    for (potential, &(object, track)) in potential.iter_mut().zip(&indexed.couples) {
        let (object, track) = (lengths.objects[object as usize], lengths.tracks[track as usize]);
        *potential /= object + track - *potential;
    }
    potential
}

fn similarity(distance_m: f64, zero_m: f64) -> f64 {
    1.0 - distance_m / zero_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::tracking::testing::{Xs, sequence};

    fn of(instants: &[Xs]) -> HotaScore {
        Hota::of(&sequence(instants), ZERO_M).score()
    }

    #[test]
    fn estimates_equal_to_the_truth_score_1_in_every_part() {
        let score = of(&[(&[(0, 0.0), (1, 9.0)], &[(7, 9.0), (8, 0.0)]), (&[(0, 1.0)], &[(8, 1.0)])]);
        let HotaScore { hota, det_a, ass_a, loc_a, .. } = score;
        for figure in [hota, det_a, ass_a, loc_a] {
            assert!((figure - 1.0).abs() < 1e-12, "{score:?}");
        }
    }

    #[test]
    fn a_distance_of_half_the_zero_distance_counts_for_half_the_alphas() {
        let score = of(&[(&[(0, 0.0)], &[(7, 2.0)])]);
        assert!((score.det_a - 10.0 / 19.0).abs() < 1e-12, "α = 0.05 … 0.5: {score:?}");
    }

    #[test]
    fn a_track_in_two_halves_is_detected_but_half_associated() {
        let score = of(&[(&[(0, 0.0)], &[(7, 0.0)]), (&[(0, 0.0)], &[(8, 0.0)])]);
        assert_eq!((score.det_a, score.ass_a), (1.0, 0.5));
        assert!((score.hota - libm::sqrt(0.5)).abs() < 1e-12);
        assert_eq!((score.ass_re, score.ass_pr), (0.5, 1.0));
    }

    #[test]
    fn whole_tracks_decide_an_ambiguous_instant() {
        // Track 7 follows object 0; once, track 8 of object 1 is nearer to object 0 than track 7 is.
        let apart: Xs = (&[(0, 0.0), (1, 3.0)], &[(7, 0.0), (8, 3.0)]);
        let close: Xs = (&[(0, 0.0)], &[(7, 0.15), (8, 0.1)]);
        let score = of(&[apart, apart, apart, close]);
        assert!((score.ass_re - 1.0).abs() < 1e-12, "{score:?}");
    }

    #[test]
    fn without_objects_and_estimates_localisation_is_1_and_all_else_is_0() {
        for score in [of(&[]), of(&[(&[(0, 0.0)], &[])]), of(&[(&[], &[(7, 0.0)])])] {
            assert_eq!(score, HotaScore { loc_a: 1.0, ..HotaScore::default() });
        }
    }
}
