use super::*;
use proptest::prelude::*;

fn at(ms: i64) -> Timestamp {
    Timestamp::EPOCH + Span::from_millis(ms)
}

/// With lists every 100 ms at least.
fn role(lineage: u32, now_ms: i64) -> Role {
    Role::new(lineage, Span::from_millis(100), at(now_ms))
}

/// Asks it every 10 ms within a time; when something changed first.
fn first_change(role: &mut Role, from_ms: i64, to_ms: i64) -> Option<i64> {
    (from_ms..to_ms).step_by(10).find(|ms| role.decide(at(*ms)))
}

/// One that has followed the lineage 1 and has taken over at 2300 ms.
fn leader(lineage: u32) -> Role {
    let mut role = follower(lineage);
    assert_eq!(first_change(&mut role, 2010, 5000), Some(2300));
    role
}

/// One that has heard lists of the lineage 1 every 100 ms until 2000 ms.
fn follower(lineage: u32) -> Role {
    let mut role = role(lineage, 0);
    for ms in (0..=2000).step_by(10) {
        if ms % 100 == 0 {
            assert_eq!(role.hear(1, at(ms)), Heard::Followed);
        }
        assert!(!role.decide(at(ms)));
    }
    role
}

#[test]
fn a_standby_takes_over_after_300_ms_without_a_list_and_not_before() {
    let mut role = follower(2);
    assert_eq!((role.follows(), role.publishes()), (Some(1), false));
    assert_eq!(first_change(&mut role, 2010, 5000), Some(2300));
    assert!(role.publishes());
}

#[test]
fn a_hub_whose_list_takes_long_to_make_goes_on_and_one_that_was_stopped_asks_whether_a_standby_has_replaced_it()
 {
    let mut busy = leader(2);
    busy.decide(at(3000));
    busy.note_busy(Span::from_millis(1400));
    assert!(!busy.decide(at(4500)) && busy.publishes());
    let mut stopped = leader(2);
    stopped.decide(at(3000));
    stopped.note_busy(Span::from_millis(100));
    assert!(stopped.decide(at(4500)) && !stopped.publishes());
}

#[test]
fn a_standby_that_hears_nobody_publishes_after_a_second() {
    assert_eq!(first_change(&mut role(2, 0), 0, 5000), Some(1000));
}

#[test]
fn a_standby_waits_longer_for_a_hub_whose_lists_are_rare() {
    let mut by_settings = Role::new(2, Span::from_millis(1000), at(0));
    by_settings.hear(1, at(0));
    assert_eq!(first_change(&mut by_settings, 0, 9000), Some(3000));
    // A hub that has too much to do: a list every 250 ms.
    let mut learnt = role(2, 0);
    let last = (0..40).map(|i| 250 * i).inspect(|ms| {
        learnt.hear(1, at(*ms));
        learnt.decide(at(*ms));
    });
    let last = last.last().unwrap();
    let after = first_change(&mut learnt, last + 10, last + 9000).unwrap() - last;
    assert!((700..=760).contains(&after), "{after}");
}

#[test]
fn a_standby_that_did_not_run_waits_for_what_was_sent_meanwhile() {
    let mut role = follower(2);
    // It was stopped for 5 s; lists of the hub that it follows arrive when it runs again.
    assert!(!role.decide(at(7000)) && !role.decide(at(7050)));
    role.hear(1, at(7060));
    let after = first_change(&mut role, 7070, 9000).unwrap() - 7060;
    assert!((300..=400).contains(&after), "{after}");
    // Without any it does not wait for ever, though it has no time to be asked often.
    let mut slow = follower(2);
    assert!(!slow.decide(at(2250)));
    assert!(slow.decide(at(2450)));
}

#[test]
fn of_two_active_standby_hubs_the_one_with_the_lower_lineage_yields() {
    let (mut lower, mut higher) = (leader(2), leader(3));
    assert_eq!(higher.hear(2, at(2410)), Heard::Ignored);
    assert!(higher.has_rival(at(2410)) && !higher.has_rival(at(3000)));
    assert_eq!(lower.hear(3, at(2410)), Heard::Yields);
    assert_eq!((lower.follows(), lower.publishes(), higher.publishes()), (Some(3), false, true));
}

/// Lineages count tenths of a second: 60 s after 0 those of 1, 2 and 3 are of hubs that have run for long.
#[test]
fn a_standby_that_has_just_started_yields_to_one_that_has_run_for_long_whatever_their_lineages() {
    let now_ms = 100_000;
    let mut old = leader(2);
    let mut ms = 2310;
    while ms < now_ms {
        old.decide(at(ms));
        ms += 50;
    }
    // Its link was late: it heard nobody and published.
    let young_lineage = lineage_at(at(now_ms - 3000));
    let mut young = role(young_lineage, now_ms - 3000);
    assert!(first_change(&mut young, now_ms - 3000, now_ms).is_some() && young.publishes());
    assert_eq!(old.hear(young_lineage, at(now_ms)), Heard::Ignored);
    assert_eq!(young.hear(2, at(now_ms)), Heard::Yields);
    assert!(old.publishes() && !young.publishes());
}

#[test]
fn two_standby_hubs_do_not_change_roles_for_ever_where_lists_are_rarer_than_their_patience() {
    // The other one has a higher lineage, publishes, and has too much to do: a list every 400 ms.
    let mut role = leader(2);
    assert_eq!(role.hear(3, at(2410)), Heard::Yields);
    let mut changes = 0;
    for ms in (2420..40_000).step_by(10) {
        if ms % 400 == 10 {
            role.hear(3, at(ms));
        }
        changes += i32::from(role.decide(at(ms)));
    }
    assert!(changes <= 2 && !role.publishes(), "{changes}");
}

#[test]
fn a_standby_whose_session_was_opened_anew_listens_before_it_publishes() {
    let mut standby = follower(2);
    standby.listens_from(at(2800));
    assert_eq!(first_change(&mut standby, 2810, 5000), Some(3800));
    let mut leading = leader(2);
    leading.listens_from(at(2350));
    assert!(leading.publishes(), "nobody has missed it");
    leading.listens_from(at(2900));
    assert!(!leading.publishes());
    assert_eq!(leading.hear(1, at(3100)), Heard::Followed);
}

#[test]
fn a_standby_that_gives_way_to_one_of_its_own_lineage_follows_it() {
    let mut role = leader(2);
    role.give_way(at(2400));
    assert_eq!((role.publishes(), role.hear(2, at(2410))), (false, Heard::Followed));
    assert_eq!(first_change(&mut role, 2420, 5000), Some(2710), "it takes over from it as from any other");
}

#[test]
fn an_active_standby_yields_to_a_hub_that_publishes_on_by_no_rule() {
    let mut role = leader(3);
    let yields = (2500..9000).step_by(100).find(|ms| role.hear(1, at(*ms)) == Heard::Yields);
    assert_eq!(yields, Some(4500));
}

#[test]
fn a_standby_that_was_stopped_while_it_published_checks_whether_it_was_replaced() {
    let mut alone = leader(2);
    assert!(alone.decide(at(7400)) && !alone.publishes());
    assert_eq!(first_change(&mut alone, 7410, 9000), Some(7700), "it was not");
    let mut replaced = leader(2);
    replaced.decide(at(7400));
    assert_eq!(replaced.hear(1, at(7410)), Heard::Followed);
    assert_eq!(replaced.follows(), Some(1));
}

#[test]
fn a_standby_with_the_lineage_of_the_active_hub_is_an_error() {
    assert_eq!(role(2, 0).hear(2, at(5)), Heard::SameLineage);
    // Once it has heard another hub, it is somebody who wants to end it.
    assert_eq!(follower(2).hear(2, at(2010)), Heard::Ignored);
    let mut leader = leader(2);
    assert!((2400..9000).step_by(100).all(|ms| leader.hear(2, at(ms)) == Heard::Ignored));
    assert!(leader.has_rival(at(9000)), "it reports the rival");
}

/// What happens to two hubs, for so many steps of 10 ms.
#[derive(Clone, Copy, Debug)]
enum Event {
    Runs(u16),
    FirstStops(u16),
    SecondStops(u16),
    LinkLost(u16),
    OneWay(u16),
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        (1_u16..200).prop_map(Event::Runs),
        (1_u16..300).prop_map(Event::FirstStops),
        (1_u16..300).prop_map(Event::SecondStops),
        (1_u16..300).prop_map(Event::LinkLost),
        (1_u16..300).prop_map(Event::OneWay),
    ]
}

/// Two hubs and the lists on their way to each, which arrive 20 ms after they were sent, or when it runs again.
struct Pair {
    roles: [Role; 2],
    on_the_way: [Vec<(i64, u32)>; 2],
    now_ms: i64,
    /// Time between two lists.
    period_ms: i64,
}

impl Pair {
    fn new() -> Self {
        Self {
            period_ms: 50,
            roles: [role(7, 0), role(8, 0)],
            on_the_way: [Vec::new(), Vec::new()],
            now_ms: 0,
        }
    }

    /// With lists this often.
    fn with_period(period_ms: i64) -> Self {
        let role = |lineage| Role::new(lineage, Span::from_millis(period_ms), at(0));
        Self { period_ms, roles: [role(7), role(8)], ..Self::new() }
    }

    fn step(&mut self, runs: [bool; 2], carries: [bool; 2]) {
        self.now_ms += 10;
        let now_ms = self.now_ms;
        for i in 0..2 {
            if !runs[i] {
                continue;
            }
            for (_, lineage) in self.on_the_way[i].extract_if(.., |(sent_ms, _)| now_ms - *sent_ms >= 20) {
                self.roles[i].hear(lineage, at(now_ms));
            }
            self.roles[i].decide(at(now_ms));
            if self.roles[i].publishes() && now_ms % self.period_ms == 0 && carries[i] {
                self.on_the_way[1 - i].push((now_ms, self.roles[i].lineage));
            }
        }
    }

    fn take(&mut self, event: Event) {
        let (steps, runs, carries) = match event {
            Event::Runs(steps) => (steps, [true; 2], [true; 2]),
            Event::FirstStops(steps) => (steps, [false, true], [true; 2]),
            Event::SecondStops(steps) => (steps, [true, false], [true; 2]),
            Event::LinkLost(steps) => (steps, [true; 2], [false; 2]),
            Event::OneWay(steps) => (steps, [true; 2], [true, false]),
        };
        (0..steps).for_each(|_| self.step(runs, carries));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    /// Whatever stopped and whichever links were lost.
    #[test]
    fn when_all_is_well_again_exactly_one_of_two_standby_hubs_publishes(events in prop::collection::vec(event(), 0..20)) {
        let mut pair = Pair::new();
        events.into_iter().for_each(|event| pair.take(event));
        pair.take(Event::Runs(600));
        // And that does not change any more.
        let publishes = [pair.roles[0].publishes(), pair.roles[1].publishes()];
        prop_assert!(publishes[0] != publishes[1], "{publishes:?}");
        for _ in 0..300 {
            pair.step([true; 2], [true; 2]);
            prop_assert_eq!(publishes, [pair.roles[0].publishes(), pair.roles[1].publishes()]);
        }
    }

    /// One hears the other and is not heard: whichever that is, however often lists come, and whoever has lost some of them.
    #[test]
    fn of_two_standby_hubs_of_which_one_link_carries_nothing_exactly_one_goes_on_to_publish(
        period_ms in prop::sample::select(vec![50_i64, 100, 500, 1000, 2000]),
        (first_hears, lost) in (any::<bool>(), prop::collection::vec(any::<bool>(), 64))
    ) {
        let mut pair = Pair::with_period(period_ms);
        let steps = |periods: i64| (20 * periods * period_ms.max(100)) / 200;
        (0..steps(10)).for_each(|_| pair.step([true; 2], [false; 2]));
        prop_assert!(pair.roles.iter().all(Role::publishes), "nobody hears anybody");
        let carries = |now_ms: i64| {
            // No two lists one after the other are lost.
            let place = usize::try_from(now_ms / period_ms).unwrap();
            let is_lost = lost[place % 64] && !lost[(place + 63) % 64];
            [!first_hears && !is_lost, first_hears && !is_lost]
        };
        for _ in 0..steps(30) {
            let carried = carries(pair.now_ms + 10);
            pair.step([true; 2], carried);
        }
        for _ in 0..steps(60) {
            let carried = carries(pair.now_ms + 10);
            pair.step([true; 2], carried);
            let publishes = [pair.roles[0].publishes(), pair.roles[1].publishes()];
            prop_assert_eq!(publishes, [!first_hears, first_hears], "the one that hears the other stands by");
        }
    }

    /// The next time to be asked is no later than what it then decides.
    #[test]
    fn a_standby_that_is_asked_when_it_asks_for_it_takes_over_as_soon_as_one_that_is_asked_always(
        lists in prop::collection::vec(1_i64..250, 1..30)
    ) {
        let (mut eager, mut lazy) = (role(2, 0), role(2, 0));
        let mut now_ms = 0;
        for pause in lists {
            now_ms += pause;
            for one in [&mut eager, &mut lazy] {
                prop_assert_eq!(one.hear(1, at(now_ms)), Heard::Followed);
                one.decide(at(now_ms));
            }
        }
        let eager_at = (now_ms + 1..).find(|ms| eager.decide(at(*ms))).unwrap();
        let lazy_at = loop {
            let deadline = lazy.next_deadline();
            if lazy.decide(deadline) {
                break deadline;
            }
        };
        prop_assert!(lazy_at <= at(eager_at) && at(eager_at) - lazy_at <= Span::from_millis(1));
    }
}
