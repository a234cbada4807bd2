//! Ids that are not to be given again.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use v2x_common::id::TrackId;

/// With more of them those that were not heard of for longest are given up.
const MAX_SPENT: usize = 65_536;

/// Own ids that another hub has given to something else.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Spent {
    /// By when they were heard of last: a number that counts up.
    heard: BTreeMap<TrackId, u64>,
    by_age: BTreeMap<u64, TrackId>,
    next: u64,
}

impl Spent {
    pub(super) fn is_empty(&self) -> bool {
        self.heard.is_empty()
    }

    pub(super) fn contains(&self, id: TrackId) -> bool {
        self.heard.contains_key(&id)
    }

    /// The other hub lists it.
    pub(super) fn note(&mut self, id: TrackId) {
        if let Some(before) = self.heard.insert(id, self.next) {
            self.by_age.remove(&before);
        }
        self.by_age.insert(self.next, id);
        self.next += 1;
        while self.heard.len() > MAX_SPENT {
            let Some((_, oldest)) = self.by_age.pop_first() else { return };
            self.heard.remove(&oldest);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_too_many_spent_ids_a_standby_gives_up_the_one_that_it_has_not_heard_of_for_longest() {
        let id = |number: usize| TrackId::new(2, u32::try_from(number).unwrap());
        let mut spent = Spent::default();
        // Counted down, as ids in place of spent ones are: the smallest is the newest.
        (1..=MAX_SPENT).rev().for_each(|number| spent.note(id(number)));
        // The other hub still lists the first one.
        spent.note(id(MAX_SPENT));
        spent.note(id(0));
        let is_spent = [0, 1, MAX_SPENT, MAX_SPENT - 1].map(|number| spent.contains(id(number)));
        assert_eq!(is_spent, [true, true, true, false]);
        assert_eq!((spent.heard.len(), spent.by_age.len()), (MAX_SPENT, MAX_SPENT));
    }
}
