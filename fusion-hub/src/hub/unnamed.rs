//! Agents whose names are not valid: listed with the reason, so that whoever named them can see why nothing is fused.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};
use v2x_common::keys::InvalidAgent;

/// Most names that are kept: they come from outside.
const MAX_NAMES: usize = 32;
/// Most characters of a name that are kept.
const MAX_CHARACTERS: usize = 64;

/// An agent whose name is not valid.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct InvalidName {
    /// The name, cut to 64 characters.
    pub name: String,
    /// Why it is not valid.
    pub reason: String,
    /// Samples under it: frames, descriptions and liveliness tokens.
    pub samples: u64,
}

/// Samples of agents with an invalid name. Zenoh's threads count, the hub reads.
#[derive(Debug, Default)]
pub(super) struct Unnamed(Mutex<Counts>);

#[derive(Debug, Default)]
struct Counts {
    samples: u64,
    by_name: BTreeMap<String, InvalidName>,
}

impl Unnamed {
    /// Counts a sample. Tokens of liveliness are listed, but are no refused samples.
    pub(super) fn note(&self, invalid: &InvalidAgent, is_token: bool) {
        let name: String = invalid.name.chars().take(MAX_CHARACTERS).collect();
        let mut counts = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        counts.samples += u64::from(!is_token);
        if let Some(known) = counts.by_name.get_mut(&name) {
            known.samples += 1;
        } else if counts.by_name.len() < MAX_NAMES {
            tracing::warn!(name, reason = %invalid, "an agent's name is not valid: nothing of it is used");
            let reason = invalid.to_string();
            counts.by_name.insert(name.clone(), InvalidName { name, reason, samples: 1 });
        }
    }

    /// Samples so far, liveliness tokens left out.
    pub(super) fn samples(&self) -> u64 {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).samples
    }

    /// The names, in alphabetical order.
    pub(super) fn names(&self) -> Vec<InvalidName> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).by_name.values().cloned().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::keys::agent_of;

    #[test]
    fn a_flood_of_names_is_listed_with_the_reason_and_bounded_in_number_and_length() {
        let unnamed = Unnamed::default();
        let invalid = |name: &str| agent_of(&format!("v2x/n/agent/{name}/alive")).unwrap_err();
        unnamed.note(&invalid("cam/north"), false);
        unnamed.note(&invalid("cam/north"), true);
        unnamed.note(&invalid(&"ü".repeat(1000)), false);
        (0..2 * MAX_NAMES).for_each(|k| unnamed.note(&invalid(&format!("x y{k}")), false));
        let names = unnamed.names();
        assert_eq!((names.len(), unnamed.samples()), (MAX_NAMES, 2 + 2 * MAX_NAMES as u64));
        assert_eq!((names[0].name.as_str(), names[0].samples), ("cam/north", 2));
        assert!(names[0].reason.contains("holds '/'"), "{}", names[0].reason);
        assert!(names.iter().all(|one| one.name.chars().count() <= MAX_CHARACTERS));
    }
}
