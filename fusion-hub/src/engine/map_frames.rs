//! Which coordinate frame the positions of a hub are in: the configured one, else the one on which most agents agree.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use v2x_common::id::{AgentId, MapFrame};
use v2x_common::time::{Span, Timestamp};

/// An agent that has named no frame for so long has no vote.
const VOTE_HOLDS: Span = Span::from_millis(3_000);
/// A change of the frame is warned of this often at most: anybody can make many.
const WARNED_EVERY: Span = Span::from_millis(60_000);
/// Agents with a vote; the one that was silent longest makes room.
const MAX_VOTES: usize = 1024;

/// The coordinate frame of all positions, and what agents name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct MapFrames {
    is_configured: bool,
    current: Option<MapFrame>,
    /// When an agent named that last.
    named_at: Timestamp,
    /// What each agent named last, and when.
    votes: BTreeMap<AgentId, (MapFrame, Timestamp)>,
    /// When a change was warned of last, and the changes since.
    warned: Option<(Timestamp, u64)>,
}

impl MapFrames {
    pub(super) const fn new(configured: Option<MapFrame>) -> Self {
        Self {
            is_configured: configured.is_some(),
            current: configured,
            named_at: Timestamp::MIN,
            votes: BTreeMap::new(),
            warned: None,
        }
    }

    pub(super) const fn current(&self) -> Option<MapFrame> {
        self.current
    }

    /// An agent names a frame. The first one that is named holds until more agents name another one: whoever comes first cannot
    /// shut out all others.
    pub(super) fn note(&mut self, agent: AgentId, name: MapFrame, now: Timestamp) {
        if self.is_configured {
            return;
        }
        let current = *self.current.get_or_insert(name);
        self.votes.insert(agent, (name, now));
        if self.votes.len() > MAX_VOTES {
            let silent = self.votes.iter().min_by_key(|(_, (_, at))| *at).map(|(agent, _)| *agent);
            silent.map(|agent| self.votes.remove(&agent));
        }
        if name == current {
            self.named_at = now;
            return;
        }
        self.votes.retain(|_, (_, at)| now - *at <= VOTE_HOLDS);
        let votes_for = |wanted| self.votes.values().filter(|(name, _)| *name == wanted).count();
        let is_agreed = votes_for(name) >= 2 && votes_for(name) > votes_for(current);
        if is_agreed || now - self.named_at > VOTE_HOLDS {
            if let Some(since) = self.changes_to_warn_of(now) {
                tracing::warn!(
                    %name, instead_of = %current, changes_since_the_last_warning = since,
                    "most agents name another map frame: it holds from now on"
                );
            }
            (self.current, self.named_at) = (Some(name), now);
        }
    }

    /// The changes since the last warning, where this one is warned of.
    fn changes_to_warn_of(&mut self, now: Timestamp) -> Option<u64> {
        match &mut self.warned {
            Some((at, since)) if now - *at < WARNED_EVERY => {
                *since += 1;
                None
            }
            warned => Some(warned.replace((now, 0)).map_or(0, |(_, since)| since)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(name: &str) -> MapFrame {
        MapFrame::new(name).unwrap()
    }

    fn noted(frames: &mut MapFrames, agent: &str, name: &str, ms: i64) -> Option<MapFrame> {
        frames.note(AgentId::new(agent).unwrap(), frame(name), Timestamp::EPOCH + Span::from_millis(ms));
        frames.current()
    }

    #[test]
    fn whoever_spoofs_a_map_frame_first_cannot_shut_out_those_who_agree_on_another_one() {
        let mut frames = MapFrames::new(None);
        assert_eq!(noted(&mut frames, "spoof", "nowhere", 0), Some(frame("nowhere")));
        assert_eq!(noted(&mut frames, "ego", "munich", 10), Some(frame("nowhere")), "one against one");
        assert_eq!(noted(&mut frames, "rsu", "munich", 20), Some(frame("munich")));
        assert_eq!(noted(&mut frames, "spoof", "nowhere", 30), Some(frame("munich")));
    }

    #[test]
    fn one_agent_that_spoofs_another_frame_changes_nothing_as_long_as_others_hold_to_theirs() {
        let mut frames = MapFrames::new(None);
        for ms in (0..10_000).step_by(100) {
            assert_eq!(noted(&mut frames, "ego", "munich", ms), Some(frame("munich")));
            assert_eq!(noted(&mut frames, "odd", "berlin", ms + 50), Some(frame("munich")));
        }
    }

    #[test]
    fn after_all_others_have_left_the_frame_of_who_is_left_holds() {
        let mut frames = MapFrames::new(None);
        noted(&mut frames, "old", "munich", 0);
        assert_eq!(noted(&mut frames, "new", "berlin", 1_000), Some(frame("munich")));
        assert_eq!(noted(&mut frames, "new", "berlin", 3_500), Some(frame("berlin")));
    }

    #[test]
    fn a_configured_frame_is_not_voted_on_whoever_spoofs_another_one() {
        let mut frames = MapFrames::new(Some(frame("munich")));
        for agent in ["a", "b", "c"] {
            assert_eq!(noted(&mut frames, agent, "berlin", 0), Some(frame("munich")));
        }
    }

    #[test]
    fn a_flood_of_changes_of_the_map_frame_is_warned_of_once_a_minute_with_their_number() {
        let mut frames = MapFrames::new(None);
        let at = |ms: i64| Timestamp::EPOCH + Span::from_millis(ms);
        let warned: Vec<_> = (0..601).filter_map(|k| frames.changes_to_warn_of(at(100 * k))).collect();
        assert_eq!(warned, [0, 599]);
    }

    #[test]
    fn a_flood_of_votes_is_bounded() {
        let mut frames = MapFrames::new(None);
        for k in 0..3_000 {
            noted(&mut frames, &format!("agent-{k}"), "munich", k);
        }
        assert_eq!(frames.votes.len(), MAX_VOTES);
    }
}
