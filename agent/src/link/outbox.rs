//! Frames in transit: a bounded queue ordered by the time at which each is due.

use std::collections::BTreeMap;

use v2x_common::time::Timestamp;

/// Holds each item until it is due. When full, the item that was pushed first is dropped and counted: newer sensor
/// data is worth more.
#[derive(Debug)]
pub struct Outbox<T> {
    capacity: usize,
    reorder: bool,
    latest_due: Timestamp,
    n_pushed: u64,
    n_dropped: u64,
    /// By due time, then by order of pushing.
    items: BTreeMap<(Timestamp, u64), T>,
}

impl<T> Outbox<T> {
    /// An empty outbox for at most `capacity` items (at least one). With `reorder` false no item
    /// overtakes another: its due time is raised to the latest one before it.
    pub const fn new(capacity: usize, reorder: bool) -> Self {
        let capacity = if capacity == 0 { 1 } else { capacity };
        Self {
            capacity,
            reorder,
            latest_due: Timestamp::MIN,
            n_pushed: 0,
            n_dropped: 0,
            items: BTreeMap::new(),
        }
    }

    /// Adds an item that is due at `due`. Returns the item that was dropped for it, if any.
    pub fn push(&mut self, due: Timestamp, item: T) -> Option<T> {
        let due = if self.reorder { due } else { due.max(self.latest_due) };
        let dropped = if self.items.len() == self.capacity { self.drop_oldest() } else { None };
        self.items.insert((due, self.n_pushed), item);
        self.n_pushed += 1;
        self.latest_due = self.latest_due.max(due);
        dropped
    }

    /// The next item that is due at `now`, with its due time; earliest first, equal ones in the order of pushing.
    pub fn pop_due(&mut self, now: Timestamp) -> Option<(Timestamp, T)> {
        if self.next_due()? > now {
            return None;
        }
        self.items.pop_first().map(|((due, _), item)| (due, item))
    }

    /// When the next item is due.
    pub fn next_due(&self) -> Option<Timestamp> {
        self.items.first_key_value().map(|((due, _), _)| *due)
    }

    /// Number of items.
    pub fn len(&self) -> usize {
        self.items.len()
    }

    /// Whether there is no item.
    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// How many items were dropped because the outbox was full.
    pub const fn dropped(&self) -> u64 {
        self.n_dropped
    }

    fn drop_oldest(&mut self) -> Option<T> {
        let oldest = *self.items.keys().min_by_key(|(_, number)| *number)?;
        self.n_dropped += 1;
        self.items.remove(&oldest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at(millis: i64) -> Timestamp {
        Timestamp::from_nanos(millis * 1_000_000)
    }

    fn drain(outbox: &mut Outbox<u32>) -> Vec<u32> {
        std::iter::from_fn(|| outbox.pop_due(Timestamp::MAX)).map(|(_, item)| item).collect()
    }

    #[test]
    fn items_are_given_when_they_are_due() {
        let mut outbox = Outbox::new(4, true);
        outbox.push(at(20), 1);
        outbox.push(at(10), 2);
        assert_eq!(outbox.next_due(), Some(at(10)));
        assert_eq!(outbox.pop_due(at(9)), None);
        assert_eq!(outbox.pop_due(at(15)), Some((at(10), 2)));
        assert_eq!(outbox.pop_due(at(15)), None);
        assert_eq!(outbox.pop_due(at(20)), Some((at(20), 1)));
        assert_eq!(outbox.next_due(), None);
    }

    #[test]
    fn without_reordering_a_frame_is_due_no_earlier_than_those_before_it() {
        let mut outbox = Outbox::new(4, false);
        outbox.push(at(20), 1);
        outbox.push(at(10), 2);
        assert_eq!(outbox.pop_due(at(15)), None);
        assert_eq!(outbox.pop_due(at(20)), Some((at(20), 1)));
        assert_eq!(outbox.pop_due(at(20)), Some((at(20), 2)));
    }

    #[test]
    fn a_full_outbox_drops_the_item_that_was_pushed_first_and_counts_it() {
        let mut outbox = Outbox::new(2, true);
        assert_eq!(outbox.push(at(30), 1), None);
        assert_eq!(outbox.push(at(20), 2), None);
        assert_eq!(outbox.push(at(10), 3), Some(1));
        assert_eq!((outbox.len(), outbox.dropped()), (2, 1));
        assert_eq!(drain(&mut outbox), [3, 2]);
    }

    proptest! {
        #[test]
        fn without_reordering_items_are_given_in_the_order_of_pushing(dues in prop::collection::vec(0..1000i64, 0..30)) {
            let mut outbox = Outbox::new(30, false);
            for (number, due) in (0..).zip(&dues) {
                outbox.push(at(*due), number);
            }
            prop_assert!(drain(&mut outbox).is_sorted());
        }
    }
}
