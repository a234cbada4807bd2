//! Whether frames hold what the one before held, to the last digit, and what came under one number.

use super::observation::Observation;
use v2x_common::detection::Detection;
use v2x_common::time::Timestamp;

/// What of an agent's frames is the same as in the frame before.
#[derive(Clone, Debug, Default)]
pub(super) struct Contents {
    before: Option<Seen>,
    /// Times of frames.
    pub(super) times: u64,
    /// Frames with detections that came after another one of another time.
    pub(super) compared: u64,
    /// Those of them with the detections of the one before.
    pub(super) repeated: u64,
    /// Frames with other detections than the one before, and those of them that came between two repetitions.
    changed: u64,
    between_repetitions: u64,
    /// Frames with other detections than the one before, under its number: of its time too, and of another one.
    pub(super) parts: u64,
    pub(super) uncounted: u64,
    /// Frames with other detections than the one before, of its time and under another number.
    pub(super) split: u64,
    /// Frames that the one before is, of its time too, under another number.
    pub(super) again: u64,
}

#[derive(Clone, Copy, Debug)]
struct Seen {
    /// Epoch and sequence number.
    number: (u64, u64),
    captured_at: Timestamp,
    detections: u64,
    is_empty: bool,
    /// Whether it repeated the one before, and whether that one had not repeated the one before it.
    is_repeated: bool,
    changed_after_repetition: bool,
}

impl Contents {
    pub(super) fn note(&mut self, seen: &Observation<'_>) {
        let frame = seen.frame;
        let mut now = Seen {
            number: (frame.id.epoch, frame.id.sequence),
            captured_at: frame.captured_at,
            detections: digest(&frame.detections),
            is_empty: frame.detections.is_empty(),
            is_repeated: false,
            changed_after_repetition: false,
        };
        let Some(before) = self.before else {
            (self.before, self.times) = (Some(now), 1);
            return;
        };
        let is_same = before.detections == now.detections;
        let is_of_one_time = before.captured_at == now.captured_at;
        if before.number == now.number && !is_same {
            self.parts += u64::from(is_of_one_time);
            self.uncounted += u64::from(!is_of_one_time && seen.reported.has_sequence);
        }
        self.split += u64::from(
            before.number.0 == now.number.0 && before.number != now.number && is_of_one_time && !is_same,
        );
        let is_again = is_same && before.number.0 == now.number.0 && before.number != now.number;
        self.again += u64::from(is_of_one_time && is_again && seen.reported.has_sequence && !now.is_empty);
        // The same frame sent twice is no new one.
        if is_of_one_time {
            return;
        }
        self.times += 1;
        if !now.is_empty {
            self.compared += 1;
            now.is_repeated = is_same;
            self.repeated += u64::from(is_same);
            self.changed += u64::from(!is_same);
            now.changed_after_repetition = !is_same && before.is_repeated;
            self.between_repetitions += u64::from(is_same && before.changed_after_repetition);
        }
        self.before = Some(now);
    }

    /// Whether each result comes several times. Exact reports of what stands repeat, too: but where something passes, one frame
    /// after the other changes.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub(super) fn comes_several_times(&self, least: u64) -> bool {
        const BETWEEN_SHARE: f64 = 0.8;
        self.between_repetitions >= least
            && self.repeated >= self.changed
            && self.between_repetitions as f64 >= BETWEEN_SHARE * self.changed as f64
    }

    /// Whether nothing has changed in so many frames.
    pub(super) const fn never_changes(&self, least: u64) -> bool {
        self.compared >= least && self.repeated == self.compared
    }
}

/// Of detections to the last digit (FNV-1a).
fn digest(detections: &[Detection]) -> u64 {
    let words = detections.iter().flat_map(|one| {
        let box_of = [one.bev.x, one.bev.y, one.bev.w, one.bev.d, one.bev.yaw].map(f64::to_bits);
        box_of.into_iter().chain([u64::from(one.class.byte())])
    });
    words.fold(0xcbf2_9ce4_8422_2325, |hash, word| {
        (hash ^ word).wrapping_mul(0x0100_0000_01b3).rotate_left(23)
    })
}
