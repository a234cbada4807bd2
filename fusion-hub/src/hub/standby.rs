//! What a hub that stands by while another hub of its name publishes knows of the two.

use super::settings::HubSettings;
use crate::engine::PublishMode;
use crate::standby::Role;
use std::collections::VecDeque;
use v2x_common::fused::FusedFrame;
use v2x_common::time::Timestamp;

/// Lists of this hub that one of another hub of its lineage is compared with.
const COMPARED_LISTS: usize = 64;

/// What a hub that stands by knows of the other one.
pub(super) struct Standby {
    pub(super) role: Role,
    /// The newest list of the other hub, and when it came.
    pub(super) newest: Option<(FusedFrame, Timestamp)>,
    pub(super) compared_at: Timestamp,
    /// Sequence numbers and stamps of the lists that it published last.
    published: VecDeque<(u64, Timestamp)>,
    /// Whether the hub has warned that the other hub's clock differs from its own.
    pub(super) has_warned_of_clock: bool,
    pub(super) takeovers: u64,
    pub(super) yielded: u64,
}

impl Standby {
    /// Of a hub that starts, where its settings say that it stands by.
    pub(super) fn of(settings: &HubSettings, now: Timestamp) -> Option<Self> {
        let interval = match settings.publish {
            PublishMode::OnUpdate { tick, .. } => tick,
            PublishMode::Fixed { interval } => interval,
        };
        settings.standby.then(|| Self {
            role: Role::new(settings.engine.lineage, interval, now),
            newest: None,
            compared_at: Timestamp::MIN,
            published: VecDeque::new(),
            has_warned_of_clock: false,
            takeovers: 0,
            yielded: 0,
        })
    }

    /// It has published this list.
    pub(super) fn note_published(&mut self, list: &FusedFrame) {
        if self.published.len() == COMPARED_LISTS {
            self.published.pop_front();
        }
        self.published.push_back((list.sequence, list.fused_at));
    }

    /// The stamp of its newest list.
    pub(super) fn stamped_at(&self) -> Option<Timestamp> {
        self.published.back().map(|(_, at)| *at)
    }

    /// Of two hubs that began in the same tenth of a second, and so have one lineage, the one whose list of a number was made
    /// earlier gives way: both compare the same two lists. Whether it is this one.
    pub(super) fn is_behind(&self, list: &FusedFrame) -> bool {
        let (Some((oldest, _)), Some((newest, _))) = (self.published.front(), self.published.back()) else {
            return true;
        };
        match self.published.iter().find(|(sequence, _)| *sequence == list.sequence) {
            Some((_, at)) => *at < list.fused_at,
            None => list.sequence > *newest + COMPARED_LISTS as u64 && list.sequence > *oldest,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::time::Span;

    #[test]
    fn of_two_standby_hubs_of_one_lineage_exactly_one_gives_way_by_any_list_of_a_number_that_both_have_made()
    {
        let list = |sequence, us| FusedFrame {
            hub: v2x_common::id::HubId::new("hub").unwrap(),
            lineage: 7,
            sequence,
            fused_at: Timestamp::EPOCH + Span::from_micros(us),
            map_frame: None,
            objects: Vec::new(),
            agents: Vec::new(),
            includes: Vec::new(),
        };
        let settings = HubSettings { standby: true, ..HubSettings::default() };
        let new = || Standby::of(&settings, Timestamp::EPOCH).unwrap();
        let (mut one, mut other) = (new(), new());
        assert!(one.is_behind(&list(1, 0)), "it has published nothing");
        for n in 1_u64..=200 {
            one.note_published(&list(n, 1000 * n as i64));
            other.note_published(&list(n, 1000 * n as i64 + 300));
        }
        for n in 140_u64..=200 {
            assert!(
                one.is_behind(&list(n, 1000 * n as i64 + 300)) && !other.is_behind(&list(n, 1000 * n as i64))
            );
        }
        // Far apart the one with more lists goes on.
        assert!(one.is_behind(&list(900, 0)) && !one.is_behind(&list(3, 0)));
    }
}
