//! What a hub that stands by while another hub of its name publishes knows of the two.

use super::processor_time::ProcessorTime;
use super::settings::HubSettings;
use crate::engine::PublishMode;
use crate::standby::{Beat, Heard, Role};
use std::collections::VecDeque;
use v2x_common::fused::FusedFrame;
use v2x_common::time::{Span, Timestamp};

/// Lists of this hub that one of another hub of its lineage is compared with.
const COMPARED_LISTS: usize = 64;
/// A hub that has said beside its lists that it publishes is heard by that alone for so long, and not by lists, which can be late.
const BEATS_HOLD: Span = Span::from_millis(1_000);
/// Other settings are reported for so long.
const DIFFERS_FOR: Span = Span::from_millis(5_000);
/// Where the times of two hubs differ by more than this, the hub warns that the clocks differ.
const CLOCKS_ALIKE: Span = Span::from_millis(300);

/// What a hub that stands by knows of the other one.
pub(super) struct Standby {
    pub(super) role: Role,
    /// The newest list of the other hub, and when it came.
    pub(super) newest: Option<(FusedFrame, Timestamp)>,
    /// What the other hub has said last beside its lists, and when that came.
    beat: Option<(Beat, Timestamp)>,
    /// When the hub that it follows has said so last, by the clock of that one.
    pub(super) said_at: Option<Timestamp>,
    /// The lineage of the other hub, and when it was heard last, by a list or beside one.
    pub(super) heard: Option<(u32, Timestamp)>,
    /// A number for the settings that decide lists.
    settings: u64,
    pub(super) processor: ProcessorTime,
    pub(super) compared_at: Timestamp,
    /// Sequence numbers and stamps of the lists that it published last.
    published: VecDeque<(u64, Timestamp)>,
    /// Whether the hub has warned that the other hub's clock differs from its own.
    has_warned_of_clock: bool,
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
            beat: None,
            said_at: None,
            heard: None,
            settings: number_of(settings),
            processor: ProcessorTime::begin(),
            compared_at: Timestamp::MIN,
            published: VecDeque::new(),
            has_warned_of_clock: false,
            takeovers: 0,
            yielded: 0,
        })
    }

    /// The number of its settings.
    pub(super) const fn settings(&self) -> u64 {
        self.settings
    }

    /// Another hub says that it publishes, beside its lists.
    pub(super) fn hear_beat(&mut self, beat: &Beat, at: Timestamp) -> Heard {
        if let Some(sent_at) = beat.sent_at()
            && Some(beat.lineage) == self.role.follows()
        {
            self.compare_clocks(beat.lineage, sent_at - at);
        }
        self.beat = Some((*beat, at));
        self.heard = Some((beat.lineage, at));
        let heard = self.role.hear(beat.lineage, at);
        if matches!(heard, Heard::Followed | Heard::Yields) {
            self.said_at = beat.sent_at();
        }
        heard
    }

    /// Another hub's list was heard, which a hub with such a lag makes.
    pub(super) fn hear_list(&mut self, list: &FusedFrame, at: Timestamp, lag: Span) -> Heard {
        let is_beating =
            self.beat.is_some_and(|(beat, last)| beat.lineage == list.lineage && at - last < BEATS_HOLD);
        if is_beating {
            let is_followed = self.role.follows() == Some(list.lineage);
            return if is_followed { Heard::Followed } else { Heard::Ignored };
        }
        self.heard = Some((list.lineage, at));
        let heard = self.role.hear(list.lineage, at);
        if heard == Heard::Followed {
            self.compare_clocks(list.lineage, list.fused_at + lag - at);
        }
        heard
    }

    fn compare_clocks(&mut self, lineage: u32, differ: Span) {
        if differ.abs() > CLOCKS_ALIKE && !std::mem::replace(&mut self.has_warned_of_clock, true) {
            tracing::warn!(
                "what hub lineage {lineage:08x} says comes with stamps that are {:.0} ms off this hub's clock: set the clocks \
                 (chrony, PTP), or ids are not kept when this hub takes over",
                differ.as_millis_f64()
            );
        }
    }

    /// It stands by from now on.
    pub(super) fn note_yielded(&mut self) {
        self.yielded += 1;
        self.has_warned_of_clock = false;
    }

    /// The lineage of another hub of this name whose lists are made by other settings.
    pub(super) fn differs(&self, now: Timestamp) -> Option<u32> {
        let (beat, _) = self.beat.filter(|(_, at)| now - *at < DIFFERS_FOR)?;
        (beat.settings != self.settings).then_some(beat.lineage)
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

/// The same number for all hubs whose settings give the same lists, in this version.
fn number_of(settings: &HubSettings) -> u64 {
    let mut settings = settings.clone();
    (settings.engine.lineage, settings.standby) = (0, false);
    let words =
        format!("{} {}", env!("CARGO_PKG_VERSION"), serde_json::to_string(&settings).unwrap_or_default());
    // FNV-1a (Fowler, Noll, Vo), which is the same everywhere.
    words
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: i64) -> Timestamp {
        Timestamp::EPOCH + Span::from_millis(ms)
    }

    #[test]
    fn a_standby_whose_other_hub_has_late_lists_and_says_that_it_publishes_does_not_take_over() {
        let settings = HubSettings { standby: true, ..HubSettings::default() };
        let mut standby = Standby::of(&settings, at(0)).unwrap();
        let lineage = settings.engine.lineage.wrapping_sub(7);
        for ms in (0..10_000).step_by(50) {
            let heard = standby.hear_beat(&Beat::new(lineage, 1, 0, at(ms)), at(ms + 1));
            assert_eq!(heard, Heard::Followed);
            assert!(!standby.role.decide(at(ms + 2)), "{ms}");
        }
        assert_eq!(standby.heard, Some((lineage, at(9_951))));
        assert_eq!((9_960..20_000).step_by(10).find(|ms| standby.role.decide(at(*ms))), Some(10_260));
    }

    #[test]
    fn a_standby_with_other_settings_is_noticed_and_lineages_make_no_difference() {
        let like = |lineage: u32, standby: bool| {
            let mut settings = HubSettings { standby, ..HubSettings::default() };
            settings.engine.lineage = lineage;
            settings
        };
        assert_eq!(number_of(&like(1, true)), number_of(&like(2, false)));
        let mut other = like(1, true);
        other.engine.delta_max = Span::from_millis(700);
        assert_ne!(number_of(&other), number_of(&like(1, true)));
        let mut standby = Standby::of(&like(9, true), at(0)).unwrap();
        assert_eq!(standby.differs(at(0)), None);
        standby.hear_beat(&Beat::new(5, standby.settings(), 0, at(0)), at(0));
        assert_eq!(standby.differs(at(1)), None);
        standby.hear_beat(&Beat::new(5, number_of(&other), 0, at(0)), at(50));
        assert_eq!((standby.differs(at(51)), standby.differs(at(6_000))), (Some(5), None));
    }

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
