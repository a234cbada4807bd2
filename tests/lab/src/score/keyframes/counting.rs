//! How the tables count errors: by provenance, false positives included (paper, section II-C; deploy/docs/methods.md).

use crate::score::frame_errors::{ErrorSums, mean};
use crate::score::moments::Moments;
use serde::{Deserialize, Serialize};

/// The divisor of the errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Counting {
    /// Errors of all boxes over the number of true positives: the values of the paper's tables.
    Table,
    /// Errors of all boxes over the number of all boxes: the formula as printed in the paper (eq. 5-7).
    Printed,
    /// Errors of the first box of each object only: "SOTA" in the paper's Table IV.
    FirstBoxes,
}

impl Counting {
    /// All countings.
    pub(crate) const ALL: [Self; 3] = [Self::Table, Self::Printed, Self::FirstBoxes];
    /// The name in tables.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Table => "table",
            Self::Printed => "printed",
            Self::FirstBoxes => "first-boxes",
        }
    }

    /// The two countings of the paper's own metrics.
    pub(crate) const OF_THE_PAPER: [Self; 2] = [Self::Table, Self::Printed];
}

/// Which objects count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Subset {
    /// All objects.
    All,
    /// Objects that stay within 1 m of their first position.
    Static,
    /// All other objects.
    Moving,
}

impl Subset {
    /// All subsets.
    pub(crate) const ALL: [Self; 3] = [Self::All, Self::Static, Self::Moving];
}

/// The mean errors of a frame; `None` where nothing was found.
pub(crate) fn mean_errors(sums: &ErrorSums, counting: Counting) -> Option<[f64; 3]> {
    match counting {
        Counting::Table => mean(sums.all, sums.true_positives),
        Counting::Printed => mean(sums.all, sums.estimates()),
        Counting::FirstBoxes => sums.mean_of_matched(),
    }
}

/// Moments over frames of one subset.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SubsetScore {
    /// By [`Counting`]: translation (m), dimension (m), orientation (degrees).
    errors: [[Moments; 3]; 3],
    /// Fractions.
    precision: Moments,
    recall: Moments,
}

impl SubsetScore {
    /// Adds a frame.
    pub(crate) fn add(&mut self, frame: &ErrorSums) {
        for (moments, counting) in self.errors.iter_mut().zip(Counting::ALL) {
            let means = mean_errors(frame, counting);
            for (axis, moments) in moments.iter_mut().enumerate() {
                moments.add(means.map(|means| means[axis]));
            }
        }
        self.precision.add(frame.precision());
        self.recall.add(frame.recall());
    }

    /// Adds the frames of another score.
    pub(crate) fn merge(&mut self, other: &Self) {
        let (ours, theirs) = (self.errors.as_flattened_mut(), other.errors.as_flattened());
        ours.iter_mut().zip(theirs).for_each(|(ours, theirs)| ours.merge(theirs));
        self.precision.merge(&other.precision);
        self.recall.merge(&other.recall);
    }

    /// mATE (m), mADE (m), mAOE (degrees), precision, recall.
    pub(crate) fn metrics(&self, counting: Counting) -> [Moments; 5] {
        let [ate, ade, aoe] = self.errors[counting as usize];
        [ate, ade, aoe, self.precision, self.recall]
    }
}
