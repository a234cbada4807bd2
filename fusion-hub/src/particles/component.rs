//! The hypotheses of each particle in one connected component of tracks and reports.

use super::ancestors::Ancestors;
use super::chance::Chance;
use super::competition::{Competition, Edge, Row};
use super::hypothesis::{Outcome, Version};
use super::places::{NONE, as_index, as_u32};
use crate::association::assignment::Assigner;
use crate::values::ParticleSet;
use v2x_common::time::{Span, Timestamp};

/// How far a draw strays from the optimum: the scale of a Gumbel variable in −ln p (deploy/docs/methods.md).
const TEMPERATURE: f64 = 0.8;

/// Time without evidence between hypotheses after which only the leading one is kept: reports do not show their
/// difference.
const PATIENCE: Span = Span::from_millis(2000);

/// The component and its buffers. Tables have a line for each particle and a column for each row.
#[derive(Debug)]
pub(super) struct Component {
    n: u32,
    n_rows: usize,
    /// The version that the particle holds before the frame, or [`NONE`].
    held: Vec<u32>,
    /// The report that it assigns to that version, or [`NONE`].
    drawn: Vec<u32>,
    /// All edges of the component's versions, these versions, and where the edges of each end.
    edges: Vec<Edge>,
    versions: Vec<u32>,
    edge_ends: Vec<u32>,
    weights: Vec<f64>,
    /// The ancestor of each particle.
    ancestors: Ancestors,
    disputed_at: Timestamp,
    assigner: Assigner,
}

impl Component {
    pub(super) fn new(n: u32) -> Self {
        Self {
            n,
            n_rows: 0,
            held: Vec::new(),
            drawn: Vec::new(),
            edges: Vec::new(),
            versions: Vec::new(),
            edge_ends: Vec::new(),
            weights: Vec::new(),
            ancestors: Ancestors::default(),
            disputed_at: Timestamp::MIN,
            assigner: Assigner::default(),
        }
    }

    /// Takes in the component's rows. Versions are renumbered in `held`.
    pub(super) fn begin(
        &mut self,
        rows: impl ExactSizeIterator<Item = Row>,
        versions: &[Version],
        competition: &Competition,
    ) {
        self.n_rows = rows.len();
        self.held.clear();
        self.held.resize(self.n as usize * self.n_rows, NONE);
        self.edges.clear();
        self.versions.clear();
        self.edge_ends.clear();
        self.disputed_at = Timestamp::MIN;
        for (row, Row { start, end }) in rows.enumerate() {
            for version in start..end {
                let local = as_u32(self.versions.len());
                self.edges.extend(competition.edges_of(version));
                self.edge_ends.push(as_u32(self.edges.len()));
                self.versions.push(version);
                self.disputed_at = self.disputed_at.max(versions[version as usize].disputed_at);
                for particle in 0..self.n {
                    if versions[version as usize].holders.holds(particle) {
                        self.held[particle as usize * self.n_rows + row] = local;
                    }
                }
            }
        }
    }

    /// Resamples particles by their weights, then draws an assignment for each; the one that agrees most with
    /// the others comes first.
    pub(super) fn decide(&mut self, chance: Chance, captured_at: Timestamp, n_measurements: usize) {
        let mut chance = chance;
        self.weigh(n_measurements);
        self.ancestors.draw(&self.weights, chance.uniform());
        self.drawn.clear();
        for particle in 0..self.n as usize {
            let ancestor = self.ancestors.of(particle);
            // The leading particle takes the optimum itself: ids then change on evidence, not at random.
            let temperature = if particle == 0 && ancestor == 0 { 0.0 } else { TEMPERATURE };
            self.draw(ancestor, temperature, &mut chance, n_measurements);
        }
        let first = self.most_agreeing();
        self.ancestors.swap(0, first);
        for row in 0..self.n_rows {
            self.drawn.swap(row, first * self.n_rows + row);
        }
        self.settle(captured_at);
    }

    /// Notes whether the frame separated hypotheses; after a long time without, all follow the first.
    fn settle(&mut self, captured_at: Timestamp) {
        if self.edges.is_empty() {
            return;
        }
        let goes_on = |particle: usize| self.held_by(particle) == self.held_by(self.ancestors.of(particle));
        let is_replaced = !(0..self.n as usize).all(goes_on);
        if is_replaced || self.is_split() {
            self.disputed_at = self.disputed_at.max(captured_at);
        } else if captured_at - self.disputed_at > PATIENCE {
            let n_rows = self.n_rows;
            self.ancestors.follow_first();
            (1..self.n as usize).for_each(|particle| self.drawn.copy_within(..n_rows, particle * n_rows));
        }
    }

    /// Whether particles assign different reports to one version.
    fn is_split(&self) -> bool {
        (0..self.n_rows).any(|row| {
            let after = |particle: usize| {
                let version = self.held[self.ancestors.of(particle) * self.n_rows + row];
                (version, self.drawn[particle * self.n_rows + row])
            };
            let differs = |a: (u32, u32), b: (u32, u32)| a.0 == b.0 && a.1 != b.1;
            (1..self.n as usize)
                .any(|particle| (0..particle).any(|other| differs(after(other), after(particle))))
        })
    }

    /// exp(−C/2) of every particle, relative to the largest.
    fn weigh(&mut self, n_measurements: usize) {
        self.weights.clear();
        for particle in 0..self.n as usize {
            let known = (0..particle).find(|other| self.held_by(*other) == self.held_by(particle));
            let cost = match known {
                Some(other) => self.weights[other],
                None => self.least_cost(particle, n_measurements),
            };
            self.weights.push(cost);
        }
        let least = self.weights.iter().copied().fold(f64::INFINITY, f64::min);
        for weight in &mut self.weights {
            *weight = libm::exp((least - *weight) / 2.0);
        }
    }

    fn held_by(&self, particle: usize) -> &[u32] {
        &self.held[particle * self.n_rows..(particle + 1) * self.n_rows]
    }

    fn least_cost(&mut self, particle: usize, n_measurements: usize) -> f64 {
        self.assigner.begin(n_measurements, 0.0);
        let held = particle * self.n_rows..(particle + 1) * self.n_rows;
        for &version in &self.held[held.clone()] {
            for edge in edges_of(version, &self.edges, &self.edge_ends) {
                self.assigner.edge(edge.place, edge.cost);
            }
            self.assigner.end_row();
        }
        let found = self.assigner.finish();
        let pairs = self.held[held].iter().zip(found);
        pairs
            .filter_map(|(version, place)| {
                let edges = edges_of(*version, &self.edges, &self.edge_ends);
                edges.iter().find(|edge| Some(edge.place) == *place).map(|edge| edge.cost)
            })
            .sum()
    }

    fn draw(&mut self, ancestor: usize, temperature: f64, chance: &mut Chance, n_measurements: usize) {
        self.assigner.begin(n_measurements, 0.0);
        for &version in &self.held[ancestor * self.n_rows..(ancestor + 1) * self.n_rows] {
            for edge in edges_of(version, &self.edges, &self.edge_ends) {
                self.assigner.edge(edge.place, edge.cost - 2.0 * temperature * chance.gumbel());
            }
            self.assigner.end_row();
        }
        self.drawn.extend(self.assigner.finish().iter().map(|place| place.unwrap_or(NONE)));
    }

    /// The particle whose pairs most particles have.
    fn most_agreeing(&self) -> usize {
        let agreeing = |particle: usize| -> usize {
            let lines = || self.drawn.chunks(self.n_rows);
            let own = &self.drawn[particle * self.n_rows..(particle + 1) * self.n_rows];
            lines().map(|line| line.iter().zip(own).filter(|(a, b)| a == b).count()).sum()
        };
        let n = self.n as usize;
        let best = (0..n).map(|particle| (agreeing(particle), n - particle)).max();
        best.map_or(0, |(_, back)| n - back)
    }

    /// Appends the outcome of every version and report of the component.
    pub(super) fn list_outcomes(
        &self,
        outcomes: &mut Vec<Outcome>,
        initiations: &mut Vec<(u16, ParticleSet)>,
        track_of: &mut [Option<u32>],
    ) {
        let n_rows = self.n_rows;
        for row in 0..n_rows {
            let begin = outcomes.len();
            for particle in 0..self.n {
                let version = self.held[self.ancestors.of(particle as usize) * n_rows + row];
                if version == NONE {
                    continue;
                }
                let place = self.drawn[particle as usize * n_rows + row];
                let report = (place != NONE).then(|| as_index(place));
                let col = self.versions[version as usize];
                let same = |outcome: &&mut Outcome| outcome.col == col && outcome.report == report;
                if let Some(known) = outcomes[begin..].iter_mut().find(same) {
                    known.holders.insert(particle);
                } else {
                    let mut holders = ParticleSet::NONE;
                    holders.insert(particle);
                    outcomes.push(Outcome { col, report, holders, disputed_at: self.disputed_at });
                }
                if particle == 0 && place != NONE {
                    track_of[place as usize] = Some(col);
                }
            }
            for outcome in &mut outcomes[begin..] {
                outcome.holders = outcome.holders.of(self.n);
            }
        }
        self.list_initiations(initiations);
    }

    fn list_initiations(&self, initiations: &mut Vec<(u16, ParticleSet)>) {
        let begin = initiations.len();
        initiations.extend(self.edges.iter().map(|edge| (as_index(edge.place), ParticleSet::ALL)));
        initiations[begin..].sort_unstable_by_key(|(index, _)| *index);
        initiations.dedup_by_key(|(index, _)| *index);
        for (particle, line) in (0..self.n).zip(self.drawn.chunks(self.n_rows)) {
            for place in line.iter().filter(|place| **place != NONE) {
                let found = initiations[begin..].binary_search_by_key(place, |(index, _)| u32::from(*index));
                if let Ok(found) = found {
                    initiations[begin + found].1.remove(particle);
                }
            }
        }
        let mut place = begin;
        while place < initiations.len() {
            initiations[place].1 = initiations[place].1.of(self.n);
            if initiations[place].1.is_empty() {
                initiations.swap_remove(place);
            } else {
                place += 1;
            }
        }
        initiations[begin..].sort_unstable_by_key(|(index, _)| *index);
    }
}

fn edges_of<'a>(version: u32, edges: &'a [Edge], ends: &[u32]) -> &'a [Edge] {
    if version == NONE {
        return &[];
    }
    let start = version.checked_sub(1).map_or(0, |before| ends[before as usize]);
    &edges[start as usize..ends[version as usize] as usize]
}
