//! Names of classes that no table knows, with counts: so that whoever sends them can be helped.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Most names that are kept.
pub const MAX_UNMAPPED_NAMES: usize = 32;
/// Most names in a text.
const MOST_LISTED: usize = 8;
/// What a name can be taken for, in words: there are more (`vehicle.bus.bendy`).
pub const USUAL_CLASSES: &str = "car, truck, bus, trailer, motorcycle, bicycle, pedestrian, child, animal, traffic_cone, barrier or debris";
/// Most characters of a name that are kept.
const MAX_CHARACTERS: usize = 64;

/// Detections with an unknown class name: all of them, and by name. Names come from outside, so their number and their
/// length are bounded; the names first met are kept.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct UnmappedNames {
    total: u64,
    names: BTreeMap<String, u64>,
}

impl UnmappedNames {
    /// Counts a detection.
    pub fn add(&mut self, name: &str) {
        self.total += 1;
        self.count(name, 1);
    }

    /// Counts the detections of another.
    pub fn merge(&mut self, other: &Self) {
        self.total += other.total;
        other.names.iter().for_each(|(name, count)| self.count(name, *count));
    }

    fn count(&mut self, name: &str, count: u64) {
        let end = name.char_indices().nth(MAX_CHARACTERS).map_or(name.len(), |(place, _)| place);
        let name = &name[..end];
        if let Some(of_name) = self.names.get_mut(name) {
            *of_name += count;
        } else if self.names.len() < MAX_UNMAPPED_NAMES {
            self.names.insert(name.to_owned(), count);
        }
    }

    /// Number of detections, those whose names are not kept included.
    pub const fn total(&self) -> u64 {
        self.total
    }

    /// What was counted since then.
    #[must_use]
    pub fn since(&self, before: &Self) -> Self {
        let count = |name: &str| before.names.get(name).copied().unwrap_or(0);
        let since = self.names.iter().map(|(name, all)| (name, all.saturating_sub(count(name))));
        Self {
            total: self.total.saturating_sub(before.total),
            names: since.filter(|(_, n)| *n > 0).map(|(name, n)| (name.clone(), n)).collect(),
        }
    }

    /// The most frequent ones with their numbers, as words.
    pub fn in_words(&self) -> String {
        let names: Vec<_> = self.by_number().map(|(name, count)| format!("{name:?} {count}")).collect();
        names.join(", ") + if self.names.len() > MOST_LISTED { ", …" } else { "" }
    }

    /// The setting of an agent that says what they are, to be completed, and what that can be.
    pub fn setting(&self) -> (String, String) {
        let names: Vec<_> = self.by_number().map(|(name, _)| format!("{name:?} = \"CLASS\"")).collect();
        let which = if names.len() == 1 { "the class that it is" } else { "the class that each is" };
        (format!("classes = {{ {} }}", names.join(", ")), format!("{which}: {USUAL_CLASSES}"))
    }

    /// Whether most of them end in a number, as where a label has its score with it.
    pub fn have_scores(&self) -> bool {
        let has_score = |name: &str| {
            let last = name.rsplit([' ', ':', '=', '(']).next().filter(|last| last.len() < name.len());
            let number = last.map(|last| last.trim_end_matches(['%', ')']));
            number.is_some_and(|number| number.parse::<f64>().is_ok())
        };
        let n_scores = self.names.keys().filter(|name| has_score(name)).count();
        self.names.len() > 2 && 2 * n_scores > self.names.len()
    }

    fn by_number(&self) -> impl Iterator<Item = (&str, u64)> {
        let mut names: Vec<_> = self.names().collect();
        names.sort_by(|a, b| b.1.cmp(&a.1).then_with(|| a.0.cmp(b.0)));
        names.into_iter().take(MOST_LISTED)
    }

    /// The names that are kept, in alphabetical order, each with the number of its detections.
    pub fn names(&self) -> impl Iterator<Item = (&str, u64)> {
        self.names.iter().map(|(name, count)| (name.as_str(), *count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_names_are_in_one_line_the_most_frequent_first_with_the_setting_of_all() {
        let mut names = UnmappedNames::default();
        ["Kfz", "Rad", "Rad"].iter().for_each(|name| names.add(name));
        assert_eq!(names.in_words(), "\"Rad\" 2, \"Kfz\" 1");
        assert_eq!(names.setting().0, "classes = { \"Rad\" = \"CLASS\", \"Kfz\" = \"CLASS\" }");
        (0..20).for_each(|k| names.add(&format!("{k:04}")));
        assert!(
            names.in_words().ends_with(", …")
                && names.setting().0.matches(" = \"CLASS\"").count() == MOST_LISTED
        );
    }

    #[test]
    fn labels_with_their_scores_are_told_from_names_of_classes() {
        let of = |names: &[&str]| {
            let mut all = UnmappedNames::default();
            names.iter().for_each(|name| all.add(name));
            all.have_scores()
        };
        assert!(of(&["car 0.76", "car 0.61", "truck 0.9"]) && of(&["car: 87%", "car: 61%", "bus: 7%"]));
        assert!(!of(&["Kfz", "Rad", "Person 1"]) && !of(&["0", "1", "2", "7"]) && !of(&["type 3"]));
    }

    #[test]
    fn what_a_name_can_be_taken_for_is_a_class() {
        let usual = USUAL_CLASSES.split(", ").flat_map(|some| some.split(" or "));
        usual.for_each(|name| assert!(crate::class::Class::from_name(name).is_some(), "{name}"));
    }

    #[test]
    fn names_are_counted_and_their_number_and_length_are_bounded() {
        let mut names = UnmappedNames::default();
        names.add("spaceship");
        (0..2 * MAX_UNMAPPED_NAMES).for_each(|k| names.add(&format!("{k:04}")));
        let mut more = UnmappedNames::default();
        more.add("spaceship");
        more.add(&"ü".repeat(1000));
        names.merge(&more);
        assert_eq!(names.total(), 3 + 2 * MAX_UNMAPPED_NAMES as u64);
        assert_eq!(names.names().count(), MAX_UNMAPPED_NAMES);
        assert!(names.names().any(|one| one == ("spaceship", 2)));
        let before = names.clone();
        names.add("spaceship");
        assert_eq!(names.since(&before).total(), 1);
        assert!(names.since(&before).names().eq([("spaceship", 1)]));
        assert_eq!(more.names().map(|(name, _)| name.chars().count()).max(), Some(MAX_CHARACTERS));
    }
}
