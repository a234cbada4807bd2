//! A hub's core under faults: schedules made from a seed, in which agents die, freeze and come back, links lose, delay, repeat
//! and break, clocks step, bytes are damaged, hubs are held up and restored, and after which certain things must hold.

mod agents;
mod dice;
mod fuzzed;
mod invariants;
mod mutation;
mod schedule;
mod simulation;

use simulation::{Report, run, sizes_over};
use std::panic::{AssertUnwindSafe, catch_unwind};
use v2x_common::clock;

/// So many schedules each time; more with `V2X_FAULT_SCHEDULES`, from another seed on with `V2X_FAULT_SEED`. With `--nocapture`
/// it prints how many there are in a minute.
const SCHEDULES: u64 = 1_200;
/// So many rounds of a thousand fuzzed messages.
const FUZZ_ROUNDS: u64 = 60;

fn from_environment(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// Runs so many seeds from the one of `V2X_FAULT_SEED` on; `add` takes in what each of them gives.
fn run_seeds<T: Default + Send>(
    (name, count): (&str, u64),
    run: impl Fn(u64) -> T + Sync,
    add: impl Fn(&mut T, &T) + Sync,
) -> T {
    let first = from_environment("V2X_FAULT_SEED", 1);
    let next = std::sync::atomic::AtomicU64::new(first);
    let work = || {
        let mut all = T::default();
        loop {
            let seed = next.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            if seed >= first + count {
                return all;
            }
            match catch_unwind(AssertUnwindSafe(|| run(seed))) {
                Ok(report) => add(&mut all, &report),
                Err(cause) => {
                    let words = cause.downcast_ref::<String>().map_or("it panicked", String::as_str);
                    panic!("seed {seed}: {words}; again: V2X_FAULT_SEED={seed} {name}=1");
                }
            }
        }
    };
    let mut all = T::default();
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..2).map(|_| scope.spawn(work)).collect();
        for worker in workers {
            match worker.join() {
                Ok(report) => add(&mut all, &report),
                Err(cause) => std::panic::resume_unwind(cause),
            }
        }
    });
    all
}

#[test]
fn after_any_fault_nothing_is_lost_uncounted_and_every_list_is_sound() {
    let count = from_environment("V2X_FAULT_SCHEDULES", SCHEDULES);
    let begun_at = clock::now();
    let all = run_seeds(("V2X_FAULT_SCHEDULES", count), run, Report::add);
    let seconds = (clock::now() - begun_at).as_secs_f64();
    println!(
        "{count} schedules in {seconds:.1} s, {:.0} a minute: {all:?}",
        60.0 * f64::from(u32::try_from(count).unwrap_or(u32::MAX)) / seconds
    );
    // A simulation in which nothing happens would find nothing.
    if count >= SCHEDULES {
        assert!(2 * all.accepted > all.frames && all.refused > 10_000 && all.objects > all.lists, "{all:?}");
        assert!(all.reasons.len() >= 8, "most kinds of refusals occur: {all:?}");
        let refused = all.descriptions_refused;
        assert!(refused > 0 && refused < all.descriptions, "descriptions of both kinds: {all:?}");
    }
}

/// Prints how many there were: more with `V2X_FUZZ_ROUNDS`, from another seed on with `V2X_FAULT_SEED`.
#[test]
fn fuzzed_frames_descriptions_and_lists_are_a_fault_that_costs_a_good_agent_nothing() {
    let rounds = from_environment("V2X_FUZZ_ROUNDS", FUZZ_ROUNDS);
    let all = run_seeds(("V2X_FUZZ_ROUNDS", rounds), fuzzed::run, fuzzed::Fuzzed::add);
    println!("{} fuzzed messages, 0 panics: {all:?}", all.total());
    // What is right after a change says nothing, and what nobody reads to its end says little.
    if rounds >= FUZZ_ROUNDS {
        assert!(all.refused > all.accepted && 30 * all.accepted > all.refused, "{all:?}");
        assert!(all.reasons.len() >= 4 && all.total() >= rounds * fuzzed::OF_ROUND, "{all:?}");
    }
}

#[test]
fn a_fault_schedule_of_one_seed_gives_the_same_lists_again() {
    for seed in 1..=20 {
        assert_eq!(run(seed), run(seed), "seed {seed}");
    }
}

/// Agents come, die, and come again under the same names. A single frame of many boxes makes buffers that are used again.
#[test]
fn a_hub_that_lives_through_faults_for_minutes_does_not_grow() {
    for seed in 1..=2 {
        let sizes = sizes_over(seed, 45);
        let median = |sizes: &[usize]| {
            let mut sizes = sizes.to_vec();
            sizes.sort_unstable();
            sizes[sizes.len() / 2]
        };
        let [_, before, after] = [0, 15, 30].map(|from| median(&sizes[from..from + 15]));
        assert!(2 * after < 3 * before, "seed {seed}: {sizes:?} bytes");
    }
}
