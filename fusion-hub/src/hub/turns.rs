//! Whose turn it is: detection frames, or everything else.

use v2x_common::time::Span;

/// What is done next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turn {
    /// A detection frame.
    Frame,
    /// A description, a change of liveliness, or a query.
    Control,
}

/// Both kinds get the same time where both wait; neither can starve the other.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Turns {
    /// By how much more time control had than frames, since both wait, ns.
    control_ahead: i64,
}

impl Turns {
    /// Whose turn it is; `None` where nothing waits.
    pub(super) fn next(&mut self, frames_wait: bool, control_waits: bool) -> Option<Turn> {
        match (frames_wait, control_waits) {
            (true, true) if self.control_ahead > 0 => Some(Turn::Frame),
            (true, true) => Some(Turn::Control),
            // Whoever does not wait misses nothing, and owes nothing later.
            (frames_wait, control_waits) => {
                self.control_ahead = 0;
                frames_wait.then_some(Turn::Frame).or(control_waits.then_some(Turn::Control))
            }
        }
    }

    /// Notes what a turn took.
    pub(super) fn note(&mut self, turn: Turn, took: Span) {
        let took = took.as_nanos().max(0);
        self.control_ahead = match turn {
            Turn::Control => self.control_ahead.saturating_add(took),
            Turn::Frame => self.control_ahead.saturating_sub(took),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How often each had its turn where it always waits, and a turn takes so long, µs.
    fn counts(frame_us: i64, control_us: i64) -> [u32; 2] {
        let (mut turns, mut counts) = (Turns::default(), [0; 2]);
        for _ in 0..1000 {
            let turn = turns.next(true, true).unwrap();
            let place = usize::from(turn == Turn::Control);
            counts[place] += 1;
            turns.note(turn, Span::from_micros([frame_us, control_us][place]));
        }
        counts
    }

    #[test]
    fn a_flood_of_queries_starves_no_frames_nor_the_reverse() {
        let [frames, control] = counts(300, 3000);
        assert!((9..=11).contains(&(frames / control)), "{frames} {control}");
        let [frames, control] = counts(3000, 300);
        assert!((9..=11).contains(&(control / frames)), "{frames} {control}");
    }

    #[test]
    fn a_description_is_taken_in_before_the_frames_that_came_with_it() {
        let mut turns = Turns::default();
        assert_eq!(turns.next(true, true), Some(Turn::Control));
        assert_eq!(turns.next(false, false), None);
        // What frames took while nobody else waited is not owed to control, nor the reverse.
        (0..100).for_each(|_| turns.note(Turn::Frame, Span::from_millis(1)));
        turns.next(true, false);
        turns.note(Turn::Control, Span::from_millis(1));
        assert_eq!(turns.next(true, true), Some(Turn::Frame));
        for _ in 0..100 {
            assert_eq!(turns.next(false, true), Some(Turn::Control));
            turns.note(Turn::Control, Span::from_millis(1));
        }
        assert_eq!(turns.next(true, true), Some(Turn::Frame), "one turn is owed");
        turns.note(Turn::Frame, Span::from_millis(2));
        assert_eq!(turns.next(true, true), Some(Turn::Control), "and not a hundred");
    }
}
