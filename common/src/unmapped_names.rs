//! Names of classes that no table knows, with counts: so that whoever sends them can be helped.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Most names that are kept.
pub const MAX_UNMAPPED_NAMES: usize = 32;
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

    /// The names that are kept, in alphabetical order, each with the number of its detections.
    pub fn names(&self) -> impl Iterator<Item = (&str, u64)> {
        self.names.iter().map(|(name, count)| (name.as_str(), *count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
