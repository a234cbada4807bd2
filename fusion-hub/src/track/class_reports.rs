//! The classes that agents have reported of a track.

use crate::values::{AgentClasses, AgentNames, AgentSlot, ClassBelief, ClassLaw, ClassShares, ScoreEvidence};
use serde::{Deserialize, Serialize};
use v2x_common::class::Class;

/// Weight of a report whose score is no evidence; that of a certain one is twice as much.
const NEUTRAL_WEIGHT: f64 = 128.0;
/// Agents whose beliefs are combined, the first by name, and classes that are counted of one.
const MOST_AGENTS: usize = 16;
const MOST_CLASSES: usize = 8;
/// Room for sums in a new track.
const AT_FIRST: usize = 4;

/// Weights of reported classes, by agent: sums of integers, so that they are the same in any order of arrival.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ClassReports {
    /// By agent and class.
    sums: Vec<Sum>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Sum {
    agent: AgentSlot,
    class: Class,
    weight: u32,
}

impl Default for ClassReports {
    fn default() -> Self {
        Self { sums: Vec::with_capacity(AT_FIRST) }
    }
}

/// What a report weighs by its score.
fn weight(score: ScoreEvidence) -> u32 {
    let factor = score.factor();
    let share = if factor.is_finite() { factor / (1.0 + factor) } else { 1.0 };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 0 to 256")]
    let weight = libm::round(2.0 * NEUTRAL_WEIGHT * share) as u32;
    weight.max(1)
}

impl ClassReports {
    /// Adds a report.
    #[inline]
    pub(super) fn add(&mut self, agent: AgentSlot, class: Class, score: ScoreEvidence) {
        self.add_weight(agent, class, weight(score));
    }

    /// Adds all of another track.
    pub(super) fn add_all(&mut self, other: &Self) {
        other.sums.iter().for_each(|sum| self.add_weight(sum.agent, sum.class, sum.weight));
    }

    fn add_weight(&mut self, agent: AgentSlot, class: Class, weight: u32) {
        match self.place_of(agent, class) {
            Ok(place) => self.sums[place].weight = self.sums[place].weight.saturating_add(weight),
            Err(place) => self.sums.insert(place, Sum { agent, class, weight }),
        }
    }

    /// Takes a report back.
    pub(super) fn remove(&mut self, agent: AgentSlot, class: Class, score: ScoreEvidence) {
        if let Ok(place) = self.place_of(agent, class) {
            let left = self.sums[place].weight.saturating_sub(weight(score));
            self.sums[place].weight = left;
            if left == 0 {
                self.sums.remove(place);
            }
        }
    }

    fn place_of(&self, agent: AgentSlot, class: Class) -> Result<usize, usize> {
        self.sums.binary_search_by_key(&(agent, class), |sum| (sum.agent, sum.class))
    }

    pub(super) fn clear(&mut self) {
        self.sums.clear();
    }

    /// The class that all agents report, where one of them is hardly ever wrong about the group: then nothing else is worth
    /// listing, and no belief needs to be combined.
    pub fn undisputed(&self, law: impl Fn(AgentSlot) -> ClassLaw) -> Option<Class> {
        let mut known = self.sums.iter().filter(|sum| sum.class != Class::Unknown);
        let class = known.clone().next()?.class;
        let is_sure = |sum: &Sum| law(sum.agent).other() < ClassShares::LEAST;
        (known.clone().all(|sum| sum.class == class) && known.any(is_sure)).then_some(class)
    }

    /// What the agents believe, with how the classes of each err.
    pub fn belief(&self, agents: &AgentNames, law: impl Fn(AgentSlot) -> ClassLaw) -> ClassBelief {
        let mut sources = [AgentSlot::default(); MOST_AGENTS];
        let mut len = 0;
        let rank = |slot: &AgentSlot| agents.rank_of(*slot);
        for sum in &self.sums {
            let Err(place) = sources[..len].binary_search_by_key(&rank(&sum.agent), rank) else { continue };
            if place < MOST_AGENTS {
                len = (len + 1).min(MOST_AGENTS);
                sources[place..len].rotate_right(1);
                sources[place] = sum.agent;
            }
        }
        let mut belief = ClassBelief::default();
        for agent in &sources[..len] {
            let mut weights = [(Class::Unknown, 0); MOST_CLASSES];
            let own = self.sums.iter().filter(|sum| sum.agent == *agent);
            for (place, sum) in weights.iter_mut().zip(own) {
                *place = (sum.class, sum.weight);
            }
            weights.sort_unstable_by_key(|(class, _)| *class);
            belief.combine(&AgentClasses { weights: &weights, law: law(*agent) });
        }
        belief
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::values::ScoreModel;
    use v2x_common::id::AgentId;

    fn three() -> (AgentNames, [AgentSlot; 3]) {
        let mut names = AgentNames::default();
        let slots = ["c", "a", "b"].map(|name| names.slot_for(AgentId::new(name).unwrap()));
        (names, slots)
    }

    fn probabilities(reports: &ClassReports, agents: &AgentNames) -> Vec<(Class, f64)> {
        reports.belief(agents, |_| ClassLaw::UNKNOWN).shares(Class::Unknown).listed().to_vec()
    }

    #[test]
    fn the_order_of_reports_changes_nothing_and_what_is_taken_back_leaves_no_trace() {
        let (names, [c, a, b]) = three();
        let all = [(c, Class::Car), (a, Class::Truck), (b, Class::Car), (a, Class::Truck), (c, Class::Truck)];
        let (mut forward, mut back) = (ClassReports::default(), ClassReports::default());
        all.iter().for_each(|(agent, class)| forward.add(*agent, *class, ScoreEvidence::NONE));
        all.iter().rev().for_each(|(agent, class)| back.add(*agent, *class, ScoreEvidence::NONE));
        assert_eq!(probabilities(&forward, &names), probabilities(&back, &names));
        let before = probabilities(&forward, &names);
        forward.add(b, Class::Bicycle, ScoreEvidence::NONE);
        assert_ne!(probabilities(&forward, &names), before);
        forward.remove(b, Class::Bicycle, ScoreEvidence::NONE);
        assert_eq!(probabilities(&forward, &names), before);
    }

    #[test]
    fn an_undisputed_class_has_the_shares_of_the_whole_belief() {
        let (names, [c, a, b]) = three();
        let mut reports = ClassReports::default();
        let unknown = |_| ClassLaw::UNKNOWN;
        assert_eq!(reports.undisputed(unknown), None);
        [c, a].into_iter().for_each(|agent| reports.add(agent, Class::Truck, ScoreEvidence::NONE));
        reports.add(b, Class::Unknown, ScoreEvidence::NONE);
        assert_eq!(reports.undisputed(unknown), Some(Class::Truck));
        let belief = reports.belief(&names, unknown);
        assert_eq!(belief.shares(Class::Unknown), ClassShares::of_one(Class::Truck));
        assert!(belief.conflict().abs() < 1e-12);
        let poor = |_| ClassLaw { right: 0.8, within_group: 0.1 };
        assert_eq!(reports.undisputed(poor), None, "what nobody is sure of has a share for unknown");
        reports.add(b, Class::Car, ScoreEvidence::NONE);
        assert_eq!(reports.undisputed(unknown), None);
    }

    #[test]
    fn a_thousand_reports_of_one_agent_do_not_outvote_two_agents() {
        let (names, [c, a, b]) = three();
        let mut reports = ClassReports::default();
        (0..1000).for_each(|_| reports.add(a, Class::Truck, ScoreEvidence::NONE));
        reports.add(b, Class::Car, ScoreEvidence::NONE);
        reports.add(c, Class::Car, ScoreEvidence::NONE);
        assert_eq!(probabilities(&reports, &names)[0].0, Class::Car);
    }

    #[test]
    fn reports_with_low_scores_weigh_less() {
        let (names, [c, ..]) = three();
        let scores = ScoreModel::logistic(-0.85, 2.0);
        let mut reports = ClassReports::default();
        for _ in 0..10 {
            reports.add(c, Class::Truck, scores.evidence(0.1));
            reports.add(c, Class::Car, scores.evidence(0.9));
        }
        let listed = probabilities(&reports, &names);
        assert!(listed[0].0 == Class::Car && listed[0].1 > 0.8, "{listed:?}");
    }
}
