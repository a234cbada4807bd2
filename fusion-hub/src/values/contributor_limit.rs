//! How many contributors a fused object names.

use serde::de::{Error, Unexpected, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

/// Most contributors that can be asked for: a hub has no more agents.
const MOST: u32 = 1024;

/// How many contributors an object of a fused frame names: in a file `"all"`, `"none"` or a number up to 1024.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ContributorLimit {
    /// Every agent's last measurement.
    #[default]
    All,
    /// The newest so many.
    Newest(u32),
}

impl ContributorLimit {
    /// None at all.
    pub const NONE: Self = Self::Newest(0);

    /// Leaves the newest in place, which stay in their order; of several captured at the same time the first.
    pub(crate) fn apply<T, K: Ord + Copy>(self, contributors: &mut Vec<T>, captured_at: impl Fn(&T) -> K) {
        let Self::Newest(limit) = self else { return };
        let limit = limit as usize;
        if contributors.len() <= limit {
            return;
        }
        let mut times: Vec<K> = contributors.iter().map(&captured_at).collect();
        times.sort_unstable_by(|a, b| b.cmp(a));
        let Some(&oldest) = limit.checked_sub(1).and_then(|last| times.get(last)) else {
            contributors.clear();
            return;
        };
        let n_newer = times.partition_point(|at| *at > oldest);
        let mut room_for_oldest = limit - n_newer;
        contributors.retain(|one| {
            let at = captured_at(one);
            let fits = at > oldest || (at == oldest && room_for_oldest > 0);
            room_for_oldest -= usize::from(fits && at == oldest);
            fits
        });
    }
}

impl Serialize for ContributorLimit {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::All => serializer.serialize_str("all"),
            Self::Newest(limit) => serializer.serialize_u32(*limit),
        }
    }
}

impl<'de> Deserialize<'de> for ContributorLimit {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Typed;
        impl Visitor<'_> for Typed {
            type Value = ContributorLimit;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "\"all\", \"none\" or a number from 0 to {MOST}")
            }
            fn visit_str<E: Error>(self, text: &str) -> Result<Self::Value, E> {
                match text {
                    "all" => Ok(ContributorLimit::All),
                    "none" => Ok(ContributorLimit::NONE),
                    _ => Err(E::invalid_value(Unexpected::Str(text), &self)),
                }
            }
            fn visit_i64<E: Error>(self, number: i64) -> Result<Self::Value, E> {
                let limit = u32::try_from(number).ok().filter(|limit| *limit <= MOST);
                let limit = limit.ok_or_else(|| E::invalid_value(Unexpected::Signed(number), &self))?;
                Ok(ContributorLimit::Newest(limit))
            }
        }
        deserializer.deserialize_any(Typed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_are_kept_in_their_order_and_of_simultaneous_ones_the_first() {
        let kept = |limit| {
            let mut contributors = vec![("a", 3), ("b", 5), ("c", 3), ("d", 1), ("e", 5)];
            ContributorLimit::apply(limit, &mut contributors, |one| one.1);
            contributors.into_iter().map(|one| one.0).collect::<String>()
        };
        let limits = [0, 1, 2, 3, 4, 5, 6].map(ContributorLimit::Newest);
        assert_eq!(limits.map(kept), ["", "b", "be", "abe", "abce", "abcde", "abcde"]);
        assert_eq!(kept(ContributorLimit::All), "abcde");
    }
}
