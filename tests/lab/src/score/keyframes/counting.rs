//! How errors are counted: by identity, false positives included (paper, section II-C; METHODS.md 0).

use crate::data::scene::TrueBox;
use crate::score::keyframes::instant::Instant;
use crate::score::moments::Moments;
use serde::Serialize;
use v2x_common::geometry::{BevBox, angle_difference};

/// What the errors are divided by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Counting {
    /// The errors of all boxes over the number of true positives: what the paper's tables hold.
    Table,
    /// Over the number of all boxes: the formula as the paper prints it (eq. 5-7).
    Printed,
    /// Of the first box of each object only: what the paper's Table IV calls SOTA.
    FirstBoxes,
}

impl Counting {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Table, Self::Printed, Self::FirstBoxes];
    /// The name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Table => "table",
            Self::Printed => "printed",
            Self::FirstBoxes => "first-boxes",
        }
    }

    /// The two readings of the paper's own metrics.
    pub const OF_THE_PAPER: [Self; 2] = [Self::Table, Self::Printed];
}

/// Which objects are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Subset {
    /// All.
    All,
    /// Those that stay within 1 m of where they were first.
    Static,
    /// The others.
    Moving,
}

impl Subset {
    /// All three.
    pub const ALL: [Self; 3] = [Self::All, Self::Static, Self::Moving];
}

/// Sums over one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameCount {
    /// Sums of the errors of all boxes: translation (m), dimension (m), orientation (degrees).
    errors: [f64; 3],
    /// The same of the first box of each object.
    first_errors: [f64; 3],
    predictions: u32,
    true_positives: u32,
    objects: u32,
}

impl FrameCount {
    /// Of a keyframe. Of several boxes of one object one is a true positive, the others are false ones; since the
    /// errors of both add up, it does not matter here which one is the closest. A box of nothing that is there is a
    /// false one without an error.
    pub fn of(instant: &Instant<'_>, counts: impl Fn(Option<&TrueBox>) -> bool) -> Self {
        let mut frame = Self::default();
        let mut is_found = vec![false; instant.objects.len()];
        for told in instant.told.iter().filter(|told| counts(told.place.map(|place| instant.objects[place])))
        {
            frame.predictions += 1;
            let Some(place) = told.place else { continue };
            let truth = instant.objects[place];
            let errors = errors(&told.prediction.bev, &truth.bev);
            add(&mut frame.errors, errors);
            if !std::mem::replace(&mut is_found[place], true) {
                frame.true_positives += 1;
                add(&mut frame.first_errors, errors);
            }
        }
        let n_objects = instant.objects.iter().filter(|object| counts(Some(object))).count();
        frame.objects = u32::try_from(n_objects).expect("frames have fewer than 2^32 objects");
        frame
    }

    /// The mean errors; `None` where nothing was found.
    pub fn mean_errors(&self, counting: Counting) -> Option<[f64; 3]> {
        let (errors, divisor) = match counting {
            Counting::Table => (self.errors, self.true_positives),
            Counting::Printed => (self.errors, self.predictions),
            Counting::FirstBoxes => (self.first_errors, self.true_positives),
        };
        (divisor > 0).then(|| errors.map(|sum| sum / f64::from(divisor)))
    }

    fn precision(&self) -> Option<f64> {
        (self.predictions > 0).then(|| f64::from(self.true_positives) / f64::from(self.predictions))
    }

    fn recall(&self) -> Option<f64> {
        (self.objects > 0).then(|| f64::from(self.true_positives) / f64::from(self.objects))
    }
}

fn add(sums: &mut [f64; 3], errors: [f64; 3]) {
    sums.iter_mut().zip(errors).for_each(|(sum, error)| *sum += error);
}

/// Translation (m), dimension (m), orientation (degrees): eq. (5)-(7) of the paper.
pub fn errors(told: &BevBox, truth: &BevBox) -> [f64; 3] {
    let distance = |a: f64, b: f64| libm::sqrt(a * a + b * b);
    [
        distance(told.x - truth.x, told.y - truth.y),
        distance(told.w - truth.w, told.d - truth.d),
        angle_difference(told.yaw, truth.yaw).abs().to_degrees(),
    ]
}

/// Moments over frames of one subset.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SubsetScore {
    /// By [`Counting`]: translation (m), dimension (m), orientation (degrees).
    errors: [[Moments; 3]; 3],
    /// Fractions.
    precision: Moments,
    recall: Moments,
}

impl SubsetScore {
    /// Adds a frame.
    pub fn add(&mut self, frame: &FrameCount) {
        for (moments, counting) in self.errors.iter_mut().zip(Counting::ALL) {
            let means = frame.mean_errors(counting);
            for (axis, moments) in moments.iter_mut().enumerate() {
                moments.add(means.map(|means| means[axis]));
            }
        }
        self.precision.add(frame.precision());
        self.recall.add(frame.recall());
    }

    /// Adds another one's frames.
    pub fn merge(&mut self, other: &Self) {
        let (ours, theirs) = (self.errors.as_flattened_mut(), other.errors.as_flattened());
        ours.iter_mut().zip(theirs).for_each(|(ours, theirs)| ours.merge(theirs));
        self.precision.merge(&other.precision);
        self.recall.merge(&other.recall);
    }

    /// mATE (m), mADE (m), mAOE (degrees), precision, recall.
    pub fn metrics(&self, counting: Counting) -> [Moments; 5] {
        let [ate, ade, aoe] = self.errors[counting as usize];
        [ate, ade, aoe, self.precision, self.recall]
    }
}
