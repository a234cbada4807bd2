//! A sequence prepared for counting: ids numbered from 0, and the pairs within a radius.

use crate::data::scene::TrueBox;
use crate::score::tracking::sequence::{Instant, ReportedBox, Sequence};
use std::collections::BTreeMap;

/// The parts of a box that matching needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    /// The object or track.
    pub id: u64,
    /// Position, m.
    pub at: [f64; 2],
    /// Score of a reported box; 0 for a true one.
    pub score: f64,
}

impl Spot {
    pub(super) fn of_true(one: &TrueBox) -> Self {
        Self { id: one.id.0.into(), at: [one.bev.x, one.bev.y], score: 0.0 }
    }

    pub(super) const fn of_reported(one: &ReportedBox) -> Self {
        Self { id: one.track, at: [one.bev.x, one.bev.y], score: one.score }
    }
}

/// A reported box, by the number of its track.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reported {
    pub track: u32,
    pub score: f64,
}

/// A true and a reported box of one instant that are near each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    /// Places in the instant's lists.
    pub object: u32,
    pub reported: u32,
    pub distance_m: f64,
    /// The object and track: a place in [`Indexed::couples`].
    pub couple: u32,
}

impl Pair {
    fn couple_of(&self, objects: &[u32], reported: &[Reported]) -> (u32, u32) {
        (objects[self.object as usize], reported[self.reported as usize].track)
    }
}

/// One instant.
#[derive(Clone, Debug)]
pub(super) struct IndexedInstant {
    /// Number of the instant in the sequence.
    pub number: usize,
    /// Numbers of the objects.
    pub objects: Vec<u32>,
    pub reported: Vec<Reported>,
    /// By place of the object, then of the reported box.
    pub pairs: Vec<Pair>,
}

/// An indexed sequence.
#[derive(Clone, Debug, Default)]
pub(super) struct Indexed {
    pub n_objects: usize,
    pub n_tracks: usize,
    /// The instants with any box.
    pub instants: Vec<IndexedInstant>,
    /// Objects and tracks that are a pair at some time, sorted.
    pub couples: Vec<(u32, u32)>,
}

/// Numbers ids in order of appearance.
#[derive(Default)]
struct Numbers(BTreeMap<u64, u32>);

impl Numbers {
    fn of(&mut self, id: u64) -> u32 {
        let next = u32::try_from(self.0.len()).expect("ids are numbered in 32 bits");
        *self.0.entry(id).or_insert(next)
    }
}

impl Indexed {
    /// With the pairs nearer than `radius_m`.
    pub(super) fn of(sequence: &Sequence, radius_m: f64) -> Self {
        let spots = |Instant { truth, reported }: &Instant| {
            (truth.iter().map(Spot::of_true).collect(), reported.iter().map(Spot::of_reported).collect())
        };
        Self::of_spots(sequence.instants().iter().map(spots), radius_m)
    }

    /// From true and reported boxes, instant by instant.
    pub(super) fn of_spots(instants: impl Iterator<Item = (Vec<Spot>, Vec<Spot>)>, radius_m: f64) -> Self {
        let (mut objects, mut tracks) = (Numbers::default(), Numbers::default());
        let mut indexed = Self::default();
        for (number, (truth, reported)) in instants.enumerate() {
            if truth.is_empty() && reported.is_empty() {
                continue;
            }
            indexed.instants.push(IndexedInstant {
                number,
                pairs: pairs_within(&truth, &reported, radius_m),
                objects: truth.iter().map(|spot| objects.of(spot.id)).collect(),
                reported: reported
                    .iter()
                    .map(|spot| Reported { track: tracks.of(spot.id), score: spot.score })
                    .collect(),
            });
        }
        indexed.n_objects = objects.0.len();
        indexed.n_tracks = tracks.0.len();
        indexed.find_couples();
        indexed
    }

    fn find_couples(&mut self) {
        let Self { instants, couples, .. } = self;
        for IndexedInstant { objects, reported, pairs, .. } in &*instants {
            couples.extend(pairs.iter().map(|pair| pair.couple_of(objects, reported)));
        }
        couples.sort_unstable();
        couples.dedup();
        for IndexedInstant { objects, reported, pairs, .. } in instants {
            for pair in pairs {
                let couple = pair.couple_of(objects, reported);
                let place = couples.partition_point(|one| *one < couple);
                pair.couple = u32::try_from(place).expect("couples are numbered in 32 bits");
            }
        }
    }

    /// Number of true boxes.
    pub(super) fn n_true(&self) -> u64 {
        self.instants.iter().map(|instant| instant.objects.len() as u64).sum()
    }

    /// Number of reported boxes.
    pub(super) fn n_reported(&self) -> u64 {
        self.instants.iter().map(|instant| instant.reported.len() as u64).sum()
    }
}

fn pairs_within(truth: &[Spot], reported: &[Spot], radius_m: f64) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for (object, is) in (0u32..).zip(truth) {
        for (place, spot) in (0u32..).zip(reported) {
            let (dx, dy) = (spot.at[0] - is.at[0], spot.at[1] - is.at[1]);
            if dx.abs() >= radius_m || dy.abs() >= radius_m {
                continue;
            }
            let distance_m = libm::sqrt(dx * dx + dy * dy);
            if distance_m < radius_m {
                pairs.push(Pair { object, reported: place, distance_m, couple: 0 });
            }
        }
    }
    pairs
}
