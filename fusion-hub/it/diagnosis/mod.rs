//! An agent with one fault has the finding that names it, and sound agents have none.

mod arrivals;
mod clocks;
mod contents;
pub(crate) mod crossing;
mod headings;
mod near_misses;
mod pairs;
mod positions;
mod predictions;
mod repetition;
mod units;
mod velocities;

#[test]
fn sound_agents_have_no_finding() {
    assert_eq!(crossing::found(|_| {}), []);
}
