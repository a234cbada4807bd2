//! The second step of every score: the errors of the pairs of one frame, and their sums.

use crate::score::errors::{BoxError, SizeNorm};
use crate::score::matching::{Frame, Matching, Outcome};

/// The errors of one frame: translation (m), dimension (m), orientation (degrees).
#[derive(Clone, Debug)]
pub(crate) struct FrameErrors<'a> {
    matching: &'a Matching,
    /// By estimate; `None` where it is of no object that counts.
    errors: Vec<Option<[f64; 3]>>,
}

/// Sums over one or more frames, or over a part of their objects.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ErrorSums {
    /// Of all estimates of an object, repeated ones included.
    pub all: [f64; 3],
    /// Of the matched ones only.
    pub matched: [f64; 3],
    /// Matched estimates.
    pub true_positives: u64,
    /// Estimates of no object, and repeated ones.
    pub false_positives: u64,
    /// Objects without an estimate.
    pub missed: u64,
}

impl<'a> FrameErrors<'a> {
    /// The errors of a matched frame.
    pub(crate) fn of(frame: &Frame<'_>, matching: &'a Matching, size_norm: SizeNorm) -> Self {
        let pairs = frame.estimates.iter().zip(&matching.outcomes);
        let errors = pairs.map(|(estimate, outcome)| {
            let truth = &frame.truth[outcome.place()?];
            Some(BoxError::between(&estimate.bev, &truth.bev).lengths(size_norm))
        });
        Self { matching, errors: errors.collect() }
    }

    /// Sums over the objects that count. `counts` gets an object's place in the truth, or `None` for an estimate of no
    /// object.
    pub(crate) fn sums(&self, counts: impl Fn(Option<usize>) -> bool) -> ErrorSums {
        let mut sums = ErrorSums::default();
        self.add_to(&mut sums, counts);
        sums
    }

    /// Adds to sums over several frames, error by error: sums of sums can differ in their last digits.
    pub(crate) fn add_to(&self, sums: &mut ErrorSums, counts: impl Fn(Option<usize>) -> bool) {
        for (outcome, errors) in self.matching.outcomes.iter().zip(&self.errors) {
            if *outcome == Outcome::Ignored || !counts(outcome.place()) {
                continue;
            }
            let errors = errors.unwrap_or_default();
            add(&mut sums.all, errors);
            if let Outcome::Matched(_) = outcome {
                sums.true_positives += 1;
                add(&mut sums.matched, errors);
            } else {
                sums.false_positives += 1;
            }
        }
        sums.missed += self.matching.missed.iter().filter(|place| counts(Some(**place))).count() as u64;
    }
}

fn add(sums: &mut [f64; 3], errors: [f64; 3]) {
    sums.iter_mut().zip(errors).for_each(|(sum, error)| *sum += error);
}

impl ErrorSums {
    /// Number of estimates that count.
    pub(crate) const fn estimates(&self) -> u64 {
        self.true_positives + self.false_positives
    }

    /// Number of objects that count.
    pub(crate) const fn objects(&self) -> u64 {
        self.true_positives + self.missed
    }

    /// Mean errors of the matched estimates; `None` without any.
    pub(crate) fn mean_of_matched(&self) -> Option<[f64; 3]> {
        mean(self.matched, self.true_positives)
    }

    /// Share of the estimates that are right; `None` without estimates.
    pub(crate) fn precision(&self) -> Option<f64> {
        share(self.true_positives, self.estimates())
    }

    /// Share of the objects that are found; `None` without objects.
    pub(crate) fn recall(&self) -> Option<f64> {
        share(self.true_positives, self.objects())
    }
}

/// Sums divided by their number; `None` for 0.
#[expect(clippy::cast_precision_loss, reason = "counts of objects")]
pub(crate) fn mean(sums: [f64; 3], n: u64) -> Option<[f64; 3]> {
    (n > 0).then(|| sums.map(|sum| sum / n as f64))
}

#[expect(clippy::cast_precision_loss, reason = "counts of objects")]
fn share(part: u64, whole: u64) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}
