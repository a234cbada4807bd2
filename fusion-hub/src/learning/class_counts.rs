//! How an agent's classes err, from what the other agents report of the same objects.

use crate::values::ClassLaw;
use serde::{Deserialize, Serialize};
use v2x_common::class::Class;

/// What is assumed in advance has the weight of so many comparisons.
const PRIOR: f64 = 10.0;
/// The n-th comparison of one object weighs one over n and this: those that follow say less and less.
const LATER: u32 = 9;
/// Half of the unit of sums: whole numbers add up to the same in any order.
const HALF_UNIT: u32 = 2048;
const UNITS: f64 = (2 * HALF_UNIT) as f64;
/// Probabilities of a class of the group, and of another group, are at least and at most this.
const WITHIN_GROUP: [f64; 2] = [0.01, 0.5];
const OTHER: [f64; 2] = [0.002, 0.3];
/// Classes of other agents that one is compared with.
const MOST_OTHERS: usize = 8;

/// Comparisons of one agent's classes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct ClassCounts {
    all: f64,
    within_group: f64,
    other: f64,
}

/// What each agent reported last of one object, by its place among the object's agents, and how often that was compared.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct LastClasses(Vec<LastClass>);

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct LastClass {
    class: Class,
    comparisons: u32,
}

impl LastClasses {
    /// Notes a report, and compares it with the last ones of the other agents. The class of most agents is taken for the right
    /// one; of as many for as against, either may be. An agent errs about one object alike for long: later
    /// comparisons weigh less.
    pub(super) fn compare(&mut self, place: usize, class: Class) -> Option<Comparison> {
        if self.0.len() <= place {
            self.0.resize(place + 1, LastClass { class: Class::Unknown, comparisons: 0 });
        }
        if class == Class::Unknown {
            return None;
        }
        self.0[place].class = class;
        let half_weight = HALF_UNIT / self.0[place].comparisons.saturating_add(1 + LATER);
        if half_weight == 0 {
            return None;
        }
        let of_others = || {
            let others = self.0.iter().enumerate().filter(|(other, _)| *other != place).take(MOST_OTHERS);
            others.map(|(_, other)| other.class).filter(|reported| *reported != Class::Unknown)
        };
        of_others().next()?;
        let is_undisputed = of_others().all(|reported| reported == class);
        let (wrong_halves, is_within_group) =
            if is_undisputed { (0, true) } else { disputed(class, of_others) };
        self.0[place].comparisons += 1;
        Some(Comparison { weight: 2 * half_weight, wrong: wrong_halves * half_weight, is_within_group })
    }
}

/// By how many halves a class is probably wrong that others dispute, and whether they agree about its group.
#[cold]
fn disputed<I: Iterator<Item = Class>>(class: Class, of_others: impl Fn() -> I) -> (u32, bool) {
    let votes = |class: Class| of_others().filter(|reported| *reported == class).count();
    let rivals = of_others().filter(|reported| *reported != class);
    let Some(rival) = rivals.max_by_key(|reported| (votes(*reported), *reported)) else { return (0, true) };
    let wrong_halves = match (1 + votes(class)).cmp(&votes(rival)) {
        std::cmp::Ordering::Less => 2,
        std::cmp::Ordering::Equal => 1,
        std::cmp::Ordering::Greater => 0,
    };
    (wrong_halves, rival.group() == class.group())
}

/// A comparison of an agent's class with those of others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Comparison {
    weight: u32,
    /// Part of the weight by which it is probably wrong.
    wrong: u32,
    is_within_group: bool,
}

impl ClassCounts {
    /// Adds a comparison.
    pub(super) fn add(&mut self, comparison: &Comparison) {
        self.all += f64::from(comparison.weight);
        let counted = if comparison.is_within_group { &mut self.within_group } else { &mut self.other };
        *counted += f64::from(comparison.wrong);
    }

    /// Lets what was counted fade.
    pub(super) fn scale(&mut self, factor: f64) {
        self.all *= factor;
        self.within_group *= factor;
        self.other *= factor;
    }

    /// How the classes err.
    pub(super) fn law(&self) -> ClassLaw {
        let prior = ClassLaw::UNKNOWN;
        let share = |counted: f64, prior: f64, [least, most]: [f64; 2]| {
            ((counted / UNITS + PRIOR * prior) / (self.all / UNITS + PRIOR)).clamp(least, most)
        };
        let within_group = share(self.within_group, prior.within_group, WITHIN_GROUP);
        let other = share(self.other, prior.other(), OTHER);
        ClassLaw { right: 1.0 - within_group - other, within_group }
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    vec![(
        "learning.classes",
        format!(
            "prior {PRIOR}, the nth of an object 1/(n + {LATER}), within a group {WITHIN_GROUP:?}, others {OTHER:?}, {MOST_OTHERS} others"
        ),
    )]
}

#[cfg(test)]
mod tests {
    use super::*;
    /// What is learnt of agents that report these classes of each of so many objects, time and again.
    fn learnt_of(objects: usize, classes: &[Class]) -> Vec<ClassLaw> {
        let mut counts = [ClassCounts::default(); 3];
        let mut last = vec![LastClasses::default(); objects];
        for report in 0..100 * objects {
            let last = &mut last[report % objects];
            for (place, (class, counts)) in classes.iter().zip(&mut counts).enumerate() {
                if let Some(comparison) = last.compare(place, *class) {
                    counts.add(&comparison);
                }
            }
        }
        counts[..classes.len()].iter().map(ClassCounts::law).collect()
    }

    fn learnt(classes: &[Class]) -> Vec<ClassLaw> {
        learnt_of(100, classes)
    }

    #[test]
    fn one_object_that_agents_disagree_about_for_long_counts_as_a_few() {
        let of_one = learnt_of(1, &[Class::Truck, Class::Car]);
        assert!((0.08..0.2).contains(&of_one[0].within_group), "{of_one:?}");
        let of_ten = learnt_of(10, &[Class::Truck, Class::Car]);
        assert!((0.3..0.45).contains(&of_ten[0].within_group), "{of_ten:?}");
    }

    #[test]
    fn the_one_that_differs_from_two_others_is_found_out() {
        let laws = learnt(&[Class::Truck, Class::Car, Class::Car]);
        assert!(laws[0].within_group > 0.45, "{laws:?}");
        assert!(laws[1].right > 0.97 && laws[2].right > 0.97, "{laws:?}");
    }

    #[test]
    fn of_two_that_differ_either_may_be_wrong() {
        let laws = learnt(&[Class::Truck, Class::Car]);
        assert!(laws.iter().all(|law| (0.4..0.5).contains(&law.within_group)), "{laws:?}");
        let rider = learnt(&[Class::Bicycle, Class::Adult]);
        assert!(rider.iter().all(|law| law.within_group < 0.05 && law.other() > 0.2), "{rider:?}");
    }

    #[test]
    fn a_lone_agent_and_reports_without_a_class_teach_nothing() {
        let laws = learnt(&[Class::Truck]);
        assert!((laws[0].right - ClassLaw::UNKNOWN.right).abs() < 1e-12);
        let laws = learnt(&[Class::Unknown, Class::Car]);
        assert!((laws[1].right - ClassLaw::UNKNOWN.right).abs() < 1e-12);
    }
}
