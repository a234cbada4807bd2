//! What several agents believe of an object's class, as belief functions over classes and groups of classes.
//!
//! The frames of one agent err alike (a van is a truck to one detector in every frame), so they are averaged and not
//! multiplied; the average, discounted by how far the agent's classes can be trusted, is the agent's belief (Shafer, A
//! Mathematical Theory of Evidence, 1976, ch. 11; Murphy 2000 on averaging). The beliefs of different agents are combined
//! by Dempster's rule. The sets are the single classes, the groups and everything: intersections stay among them
//! (Gordon & Shortliffe 1985). What contradicts each other is the conflict, which is published and not hidden.

use super::{CLASS_GROUPS, ClassLaw};
use v2x_common::class::{Class, ClassGroup};

/// Classes in play for one object; further ones are not counted.
const MOST_CLASSES: usize = 8;
/// The class so far stays the leading one where another one leads by less.
const HYSTERESIS: f64 = 0.02;

/// A belief function: masses of single classes, of groups, and of everything.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClassBelief {
    classes: [(Class, f64); MOST_CLASSES],
    len: usize,
    groups: [f64; CLASS_GROUPS],
    any: f64,
    /// The share of the combined masses that was not in conflict.
    agreement: f64,
}

/// One agent's reports of one object: weights of classes.
#[derive(Clone, Copy, Debug)]
pub struct AgentClasses<'a> {
    /// Classes with their weights, of any sum.
    pub weights: &'a [(Class, u32)],
    /// How the agent's classes err.
    pub law: ClassLaw,
}

const fn place_of(group: ClassGroup) -> usize {
    group as usize
}

impl Default for ClassBelief {
    /// Nothing is known.
    fn default() -> Self {
        Self {
            classes: [(Class::Unknown, 0.0); MOST_CLASSES],
            len: 0,
            groups: [0.0; CLASS_GROUPS],
            any: 1.0,
            agreement: 1.0,
        }
    }
}

impl ClassBelief {
    /// An agent's belief by its own reports.
    fn of(agent: &AgentClasses<'_>) -> Self {
        let known = || agent.weights.iter().filter(|(class, _)| *class != Class::Unknown);
        let total: f64 = known().map(|(_, weight)| f64::from(*weight)).sum();
        let mut belief = Self::default();
        if total == 0.0 {
            return belief;
        }
        for (class, weight) in known() {
            let share = f64::from(*weight) / total;
            let Some(mass) = belief.mass_of(*class) else { continue };
            *mass += agent.law.right * share;
            belief.groups[place_of(class.group())] += agent.law.within_group * share;
        }
        belief.any = (1.0 - belief.singles() - belief.groups.iter().sum::<f64>()).max(0.0);
        belief
    }

    fn named(&self) -> &[(Class, f64)] {
        &self.classes[..self.len]
    }

    fn singles(&self) -> f64 {
        self.named().iter().map(|(_, mass)| mass).sum()
    }

    fn mass(&self, class: Class) -> f64 {
        self.named().iter().find(|(named, _)| *named == class).map_or(0.0, |(_, mass)| *mass)
    }

    /// The mass of a class, which is named from now on; `None` where there is no room.
    fn mass_of(&mut self, class: Class) -> Option<&mut f64> {
        let place = self.named().iter().position(|(named, _)| *named == class).unwrap_or(self.len);
        let entry = self.classes.get_mut(place)?;
        if place == self.len {
            *entry = (class, 0.0);
            self.len += 1;
        }
        Some(&mut entry.1)
    }

    /// Combines it with another agent's reports by Dempster's rule.
    pub fn combine(&mut self, agent: &AgentClasses<'_>) {
        let own = *self;
        let other = Self::of(agent);
        for (class, _) in other.named() {
            // Without room the class is left to its group.
            let _ = self.mass_of(*class);
        }
        for (class, mass) in &mut self.classes[..self.len] {
            let group = place_of(class.group());
            let (a, b) = (own.mass(*class), other.mass(*class));
            *mass = a * (b + other.groups[group] + other.any) + b * (own.groups[group] + own.any);
        }
        for (group, mass) in self.groups.iter_mut().enumerate() {
            let (a, b) = (own.groups[group], other.groups[group]);
            *mass = a * (b + other.any) + own.any * b;
        }
        self.any = own.any * other.any;
        let agreed = self.singles() + self.groups.iter().sum::<f64>() + self.any;
        if agreed <= f64::MIN_POSITIVE {
            *self = Self { agreement: 0.0, ..own };
            return;
        }
        self.classes[..self.len].iter_mut().for_each(|(_, mass)| *mass /= agreed);
        self.groups.iter_mut().for_each(|mass| *mass /= agreed);
        self.any /= agreed;
        self.agreement = own.agreement * agreed;
    }

    /// How much the agents contradict each other, in [0, 1].
    pub fn conflict(&self) -> f64 {
        (1.0 - self.agreement).clamp(0.0, 1.0)
    }

    /// The probabilities of the classes: a group's mass counts for those of its classes that are named, by their own masses
    /// (in equal parts, as Smets & Kennes 1994 have it, a class that was named once by mistake has too much of it), and what
    /// can be anything is `unknown`. `so_far` stays the leading class unless another one is clearly more probable.
    pub fn shares(&self, so_far: Class) -> ClassShares {
        let mut shares = ClassShares::default();
        for (class, mass) in self.named() {
            let of_group =
                |(other, mass): &(Class, f64)| if other.group() == class.group() { *mass } else { 0.0 };
            let all: f64 = self.named().iter().map(of_group).sum();
            let of_group = if all > 0.0 { self.groups[place_of(class.group())] * mass / all } else { 0.0 };
            shares.push(*class, mass + of_group);
        }
        shares.push(Class::Unknown, self.any);
        shares.normalise();
        let rank = |(class, share): &(Class, f64)| {
            let bonus = if *class == so_far { HYSTERESIS } else { 0.0 };
            (*class != Class::Unknown, *share + bonus)
        };
        shares.listed_mut().sort_unstable_by(|a, b| {
            let ((a_known, a_rank), (b_known, b_rank)) = (rank(a), rank(b));
            b_known.cmp(&a_known).then(b_rank.total_cmp(&a_rank)).then(a.0.cmp(&b.0))
        });
        shares
    }
}

/// Classes with their probabilities, the leading one first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClassShares {
    shares: [(Class, f64); MOST_CLASSES + 1],
    len: usize,
}

impl Default for ClassShares {
    /// None.
    fn default() -> Self {
        Self { shares: [(Class::Unknown, 0.0); MOST_CLASSES + 1], len: 0 }
    }
}

impl ClassShares {
    /// Classes with a smaller share are not listed.
    pub const LEAST: f64 = 0.01;

    /// One class for certain.
    pub fn of_one(class: Class) -> Self {
        let mut shares = Self::default();
        shares.push(class, 1.0);
        shares
    }

    /// Adds a class, unless its share is not worth listing.
    pub fn push(&mut self, class: Class, share: f64) {
        if share >= Self::LEAST
            && let Some(place) = self.shares.get_mut(self.len)
        {
            *place = (class, share);
            self.len += 1;
        }
    }

    /// Makes the shares add up to 1.
    pub fn normalise(&mut self) {
        let total: f64 = self.listed().iter().map(|(_, share)| share).sum();
        self.listed_mut().iter_mut().for_each(|(_, share)| *share /= total);
    }

    /// All of them.
    pub fn listed(&self) -> &[(Class, f64)] {
        &self.shares[..self.len]
    }

    fn listed_mut(&mut self) -> &mut [(Class, f64)] {
        &mut self.shares[..self.len]
    }

    /// The leading class.
    pub fn leading(&self) -> Class {
        self.listed().first().map_or(Class::Unknown, |(class, _)| *class)
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    vec![
        ("classes.law", format!("{:?}", ClassLaw::UNKNOWN)),
        ("classes.belief", format!("listed from {}, leading by {HYSTERESIS}", ClassShares::LEAST)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn combined(agents: &[&[(Class, u32)]]) -> ClassBelief {
        let mut belief = ClassBelief::default();
        agents.iter().for_each(|weights| {
            belief.combine(&AgentClasses { weights, law: ClassLaw::UNKNOWN });
        });
        belief
    }

    fn probabilities(belief: &ClassBelief, so_far: Class) -> Vec<(Class, f64)> {
        belief.shares(so_far).listed().to_vec()
    }

    fn of(class: Class, probabilities: &[(Class, f64)]) -> f64 {
        probabilities.iter().find(|(listed, _)| *listed == class).map_or(0.0, |(_, probability)| *probability)
    }

    #[test]
    fn agents_that_agree_are_certain_and_in_no_conflict() {
        let one = combined(&[&[(Class::Car, 256)]]);
        assert_eq!(probabilities(&one, Class::Car), [(Class::Car, 1.0)]);
        assert!(one.conflict().abs() < 1e-12);
        let two = combined(&[&[(Class::Car, 256)], &[(Class::Car, 12)]]);
        assert!(two.conflict() < 1e-12 && two.mass(Class::Car) > one.mass(Class::Car));
    }

    #[test]
    fn two_agents_that_disagree_share_the_probability_and_the_conflict_is_known() {
        let belief = combined(&[&[(Class::Truck, 9999)], &[(Class::Car, 300)]]);
        let listed = probabilities(&belief, Class::Car);
        assert_eq!(listed[0].0, Class::Car, "what it was so far leads among equals");
        assert!(
            (of(Class::Car, &listed) - 0.5).abs() < 0.02 && (of(Class::Truck, &listed) - 0.5).abs() < 0.02
        );
        assert!((0.85..0.95).contains(&belief.conflict()), "{}", belief.conflict());
        let third = combined(&[&[(Class::Truck, 1)], &[(Class::Car, 1)], &[(Class::Truck, 1)]]);
        assert!(of(Class::Truck, &probabilities(&third, Class::Car)) > 0.9);
    }

    #[test]
    fn an_agent_that_changes_its_mind_is_undecided_and_in_no_conflict_with_itself() {
        let belief = combined(&[&[(Class::Car, 500), (Class::Truck, 500)]]);
        let listed = probabilities(&belief, Class::Truck);
        assert!((of(Class::Car, &listed) - 0.5).abs() < 0.01 && listed[0].0 == Class::Truck);
        assert!(belief.conflict() < 1e-12);
    }

    #[test]
    fn an_unreliable_agent_weighs_less_than_a_reliable_one() {
        let mut belief = ClassBelief::default();
        let poor = ClassLaw { right: 0.6, within_group: 0.3 };
        belief.combine(&AgentClasses { weights: &[(Class::Truck, 1)], law: poor });
        let alone = probabilities(&belief, Class::Truck);
        assert!(
            (of(Class::Unknown, &alone) - 0.1).abs() < 1e-9,
            "what it can be but for its group is unknown"
        );
        belief.combine(&AgentClasses { weights: &[(Class::Car, 1)], law: ClassLaw::UNKNOWN });
        assert!(of(Class::Car, &probabilities(&belief, Class::Truck)) > 0.8);
    }

    #[test]
    fn nothing_is_learnt_of_reports_without_a_class() {
        let belief = combined(&[&[(Class::Unknown, 77)], &[]]);
        assert_eq!(belief, ClassBelief::default());
        assert_eq!(probabilities(&belief, Class::Unknown), [(Class::Unknown, 1.0)]);
    }

    proptest! {
        #[test]
        fn masses_add_up_to_one_and_the_order_of_agents_does_not_matter(
            agents in prop::collection::vec(prop::collection::vec((0..24_u8, 0..1000_u32), 0..5), 1..6),
            laws in prop::collection::vec((0.3..0.9_f64, 0.0..0.1_f64), 6),
        ) {
            let agents: Vec<Vec<_>> = agents
                .iter()
                .map(|weights| weights.iter().map(|(byte, weight)| (Class::ALL[usize::from(byte % 6) + 14], *weight)).collect())
                .collect();
            let law = |k: usize| ClassLaw { right: laws[k].0, within_group: laws[k].1 };
            let combined = |order: &mut dyn Iterator<Item = usize>| {
                let mut belief = ClassBelief::default();
                order.for_each(|k| belief.combine(&AgentClasses { weights: &agents[k], law: law(k) }));
                belief
            };
            let (forward, back) = (combined(&mut (0..agents.len())), combined(&mut (0..agents.len()).rev()));
            let total = forward.singles() + forward.groups.iter().sum::<f64>() + forward.any;
            prop_assert!((total - 1.0).abs() < 1e-9);
            prop_assert!((forward.conflict() - back.conflict()).abs() < 1e-9);
            for class in Class::ALL {
                prop_assert!((forward.mass(class) - back.mass(class)).abs() < 1e-9);
            }
        }
    }
}
