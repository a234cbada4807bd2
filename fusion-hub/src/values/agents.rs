//! Agents by number: names are compared once, when a frame arrives.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use v2x_common::id::AgentId;

/// An agent's place in the hub's registry.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct AgentSlot(u16);

impl AgentSlot {
    /// As an index.
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// Names and their slots.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct AgentNames {
    by_name: BTreeMap<AgentId, AgentSlot>,
    names: Vec<AgentId>,
    /// For each slot its place among all names in order.
    ranks: Vec<u16>,
    free: Vec<AgentSlot>,
}

impl AgentNames {
    /// The slot of a name.
    pub fn slot(&self, name: &AgentId) -> Option<AgentSlot> {
        self.by_name.get(name).copied()
    }

    /// The slot of a name, given to it now where it has none.
    ///
    /// # Panics
    /// Beyond 65 536 names.
    pub fn slot_for(&mut self, name: AgentId) -> AgentSlot {
        if let Some(slot) = self.slot(&name) {
            return slot;
        }
        let slot = self.free.pop().unwrap_or_else(|| {
            self.names.push(name);
            AgentSlot(u16::try_from(self.names.len() - 1).expect("bounded by the inbox"))
        });
        self.names[slot.index()] = name;
        self.by_name.insert(name, slot);
        self.rank();
        slot
    }

    /// Frees a name's slot.
    pub fn remove(&mut self, name: &AgentId) -> Option<AgentSlot> {
        let slot = self.by_name.remove(name)?;
        self.free.push(slot);
        self.rank();
        Some(slot)
    }

    fn rank(&mut self) {
        self.ranks.resize(self.names.len(), u16::MAX);
        for (rank, slot) in (0..).zip(self.by_name.values()) {
            self.ranks[slot.index()] = rank;
        }
    }

    /// The name in a slot.
    pub fn name(&self, slot: AgentSlot) -> AgentId {
        self.names[slot.index()]
    }

    /// Orders slots by name: of two slots in use, the order of ranks never changes.
    pub fn rank_of(&self, slot: AgentSlot) -> u16 {
        self.ranks[slot.index()]
    }

    /// How many names there are.
    pub fn len(&self) -> usize {
        self.by_name.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.by_name.is_empty()
    }

    /// Names and slots, by name.
    pub fn iter(&self) -> impl Iterator<Item = (&AgentId, AgentSlot)> {
        self.by_name.iter().map(|(name, slot)| (name, *slot))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(text: &str) -> AgentId {
        AgentId::new(text).unwrap()
    }

    #[test]
    fn slots_are_used_again_and_ranks_follow_the_names() {
        let mut agents = AgentNames::default();
        let c = agents.slot_for(name("c"));
        let a = agents.slot_for(name("a"));
        assert!(agents.rank_of(a) < agents.rank_of(c));
        assert_eq!(agents.slot_for(name("c")), c);
        assert_eq!(agents.remove(&name("c")), Some(c));
        let b = agents.slot_for(name("b"));
        assert_eq!((b, agents.name(b)), (c, name("b")));
        assert!(agents.rank_of(a) < agents.rank_of(b));
        assert_eq!(agents.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["a", "b"]);
    }
}
