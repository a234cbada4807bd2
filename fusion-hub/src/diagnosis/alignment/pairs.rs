//! Which pairs of agents are compared: a bounded number of which every agent has its share.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use v2x_common::id::AgentId;

/// Pairs of agents that are compared in one window: each costs some milliseconds.
const MAX_PAIRS: usize = 20;
/// Partners of an agent among them, as far as others need them.
const MAX_PARTNERS: usize = 5;
/// Agents see something together where they, or their objects, are this near, m; those who were compared before, farther.
const NEAR_M: f64 = 150.0;
const STILL_NEAR_M: f64 = 300.0;

/// An agent in the map.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) agent: AgentId,
    /// Its sensor, m; `None` where it gives no pose.
    pub(super) sensor: Option<[f64; 2]>,
    /// The middle of the objects that it reports, m.
    pub(super) objects: [f64; 2],
}

/// Two agents, by their places in the list.
#[derive(Clone, Copy, Debug)]
struct Edge {
    ends: [usize; 2],
    apart_m: f64,
    /// Its place among the pairs of the last window.
    before: Option<usize>,
}

/// The pairs to compare. Agents without a partner come first, then those with one, and so on; the nearest to each other are
/// compared. Whoever was compared in the last window is again, so that what is found does not change with the choice.
///
/// Agents are sorted by name.
pub(super) fn choose(places: &[Place], before: &[[AgentId; 2]]) -> Vec<[AgentId; 2]> {
    let mut choice = Choice { partners: vec![0; places.len()], chosen: Vec::new() };
    let edges = edges(places, before);
    for n_partners in 0..MAX_PARTNERS {
        let is_open = |choice: &Choice, end: usize| choice.partners[end] <= n_partners;
        // Two at once, where they may see something together.
        choice
            .take(&edges, |choice, edge| edge.is_near() && edge.ends.iter().all(|end| is_open(choice, *end)));
        // Two at once in any case, as long as there are not pairs enough for one each.
        choice.take(&edges, |choice, edge| {
            let n_open = (0..places.len()).filter(|end| is_open(choice, *end)).count();
            n_open > choice.room() && edge.ends.iter().all(|end| is_open(choice, *end))
        });
        choice.take(&edges, |choice, edge| {
            edge.ends.iter().any(|end| is_open(choice, *end))
                && edge.ends.iter().all(|end| choice.partners[*end] < MAX_PARTNERS)
        });
    }
    choice.chosen.iter().map(|ends| ends.map(|end| places[end].agent)).collect()
}

struct Choice {
    /// Of each agent, how many.
    partners: Vec<usize>,
    chosen: Vec<[usize; 2]>,
}

impl Choice {
    fn room(&self) -> usize {
        MAX_PAIRS - self.chosen.len()
    }

    /// Takes those for which it holds, one after the other.
    fn take(&mut self, edges: &[Edge], is_wanted: impl Fn(&Self, &Edge) -> bool) {
        for edge in edges {
            if self.room() == 0 {
                return;
            }
            if is_wanted(self, edge) && !self.chosen.contains(&edge.ends) {
                self.chosen.push(edge.ends);
                edge.ends.iter().for_each(|end| self.partners[*end] += 1);
            }
        }
    }
}

impl Edge {
    fn is_near(&self) -> bool {
        self.apart_m <= if self.before.is_some() { STILL_NEAR_M } else { NEAR_M }
    }

    /// In the order in which they are taken.
    fn order(&self, other: &Self) -> Ordering {
        let rank = |edge: &Self| edge.before.unwrap_or(usize::MAX);
        rank(self).cmp(&rank(other)).then(self.apart_m.total_cmp(&other.apart_m))
    }
}

/// All pairs, those of the last window first, then by distance.
fn edges(places: &[Place], before: &[[AgentId; 2]]) -> Vec<Edge> {
    let before: BTreeMap<_, _> = before.iter().enumerate().map(|(n, pair)| (*pair, n)).collect();
    let mut edges = Vec::new();
    for (k, b) in places.iter().enumerate() {
        for (j, a) in places[..k].iter().enumerate() {
            let before = before.get(&[a.agent, b.agent]).copied();
            edges.push(Edge { ends: [j, k], apart_m: apart_m(a, b), before });
        }
    }
    edges.sort_by(Edge::order);
    edges
}

/// How far two agents are apart: where the objects of one are at a wrong place, the sensors may be right.
fn apart_m(a: &Place, b: &Place) -> f64 {
    let distance = |[ax, ay]: [f64; 2], [bx, by]: [f64; 2]| libm::hypot(ax - bx, ay - by);
    let objects = distance(a.objects, b.objects);
    a.sensor.zip(b.sensor).map_or(objects, |(a, b)| objects.min(distance(a, b)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn agent(n: usize) -> AgentId {
        AgentId::new(&format!("a{n:03}")).unwrap()
    }

    /// So many agents at crossings 500 m apart, so many at each.
    fn places(n: usize, at_each: usize, moved_m: f64) -> Vec<Place> {
        let place = |n: usize| {
            let at = [500.0 * (n / at_each) as f64 + 30.0 * (n % 3) as f64, 20.0 * (n % 5) as f64 + moved_m];
            Place { agent: agent(n), sensor: Some(at), objects: [at[0] + 10.0, at[1]] }
        };
        (0..n).map(place).collect()
    }

    fn partners(pairs: &[[AgentId; 2]], agent: AgentId) -> usize {
        pairs.iter().filter(|pair| pair.contains(&agent)).count()
    }

    #[test]
    fn every_agent_has_a_partner_within_the_bound_and_one_that_is_near() {
        for (n, at_each) in [(2, 2), (3, 3), (7, 7), (10, 10), (20, 20), (20, 4), (30, 30), (30, 5), (40, 2)]
        {
            let places = places(n, at_each, 0.0);
            let pairs = choose(&places, &[]);
            assert!(pairs.len() <= MAX_PAIRS);
            let least = (0..n).map(|k| partners(&pairs, agent(k))).min().unwrap();
            assert!(least >= if n <= 10 { 3.min(n - 1) } else { 1 }, "{n} agents: {least}");
            // Most of them have as many as there are for each.
            let share = (2 * MAX_PAIRS / n).min(n - 1).min(MAX_PARTNERS);
            let fewer = (0..n).filter(|k| partners(&pairs, agent(*k)) < share).count();
            assert!(fewer <= 2, "{n} agents: {fewer} have fewer than {share}: {pairs:?}");
            let crossing = |agent: &AgentId| agent.as_str()[1..].parse::<usize>().unwrap() / at_each;
            let together = |k: usize| {
                let mut of = pairs.iter().filter(|pair| pair.contains(&agent(k)));
                of.any(|[a, b]| crossing(a) == crossing(b))
            };
            assert!((0..n).all(together), "{n} agents, {at_each} at each crossing: {pairs:?}");
        }
        assert!(choose(&places(1, 1, 0.0), &[]).is_empty() && choose(&[], &[]).is_empty());
        assert_eq!(choose(&places(256, 8, 0.0), &[]).len(), MAX_PAIRS);
    }

    #[test]
    fn agents_who_move_are_compared_with_the_same_ones_again() {
        for n in [10, 20, 30] {
            let first = choose(&places(n, n, 0.0), &[]);
            let mut moved = places(n, n, 0.0);
            for (k, place) in moved.iter_mut().enumerate() {
                place.objects[0] += 7.0 * (k % 4) as f64;
                place.sensor = place.sensor.map(|[x, y]| [x + 11.0 * (k % 7) as f64, y]);
            }
            assert_eq!(choose(&moved, &first), first, "{n} agents");
        }
    }

    #[test]
    fn somebody_whose_objects_are_far_away_has_a_partner_by_the_sensor_or_the_nearest_one() {
        let mut places = places(20, 20, 0.0);
        places[4].objects = [1e6, 1e6];
        places[5].objects = [1e6, 0.0];
        places[5].sensor = None;
        let pairs = choose(&places, &[]);
        let with_both: BTreeSet<_> = (0..20).filter(|k| partners(&pairs, agent(*k)) == 0).collect();
        assert!(with_both.is_empty(), "{with_both:?} have none");
    }
}
