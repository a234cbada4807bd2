//! How large what an agent sees is, against how large things of their class are.

use super::observation::Observation;
use v2x_common::class::ClassGroup;
use v2x_common::detection::Detection;

/// Widths of vehicles of a class differ by a few tenths; a whole population is too small or too large from these factors on. Lengths
/// differ more, and must agree.
const SMALL: [f64; 2] = [0.67, 0.72];
const LARGE: [f64; 2] = [1.5, 1.5];
/// Of people and two-wheelers, whose boxes differ more: only another unit of length makes all of them so large.
const LARGE_OTHERS: [f64; 2] = [5.0, 5.0];
/// Such a share of them is.
const MOST: f64 = 0.9;
/// Fewest vehicles, in frames of at least two: one odd vehicle may be parked there all day.
const MIN_VEHICLES: u64 = 40;
const MIN_OF_FRAME: usize = 2;

/// Of one agent: of its vehicles, and of people and two-wheelers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sizes {
    vehicles: Tally,
    others: Tally,
}

#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    n: u64,
    small: u64,
    large: u64,
    /// Logarithms of width and length as parts of those of the class, and both, m.
    logarithms: [f64; 2],
    sums_m: [f64; 2],
}

/// Vehicles, or people and two-wheelers, of another size than these have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WrongSizes {
    /// Of which they are.
    pub(super) of_vehicles: bool,
    /// They are so many times as wide and as long, in the geometric mean.
    pub(super) factors: [f64; 2],
    /// So wide and long in the mean, m.
    pub(super) mean_m: [f64; 2],
    pub(super) n: u64,
}

impl Sizes {
    pub(super) fn note(&mut self, seen: &Observation<'_>) {
        let all = || seen.frame.detections.iter().filter(|one| one.bev.w > 0.0 && one.bev.d > 0.0);
        self.vehicles.note(all().filter(|one| one.class.group() == ClassGroup::FourWheeled), (SMALL, LARGE));
        let is_other =
            |one: &&Detection| matches!(one.class.group(), ClassGroup::Pedestrian | ClassGroup::TwoWheeled);
        self.others.note(all().filter(is_other), ([0.0; 2], LARGE_OTHERS));
    }

    /// `None` where they are as large as such things are, or too few were seen.
    pub(super) fn wrong(&self) -> Option<WrongSizes> {
        self.vehicles.wrong(true).or_else(|| self.others.wrong(false))
    }
}

impl Tally {
    fn note<'a>(
        &mut self,
        all: impl Iterator<Item = &'a Detection> + Clone,
        (small, large): ([f64; 2], [f64; 2]),
    ) {
        if all.clone().count() < MIN_OF_FRAME {
            return;
        }
        for one in all {
            let (w, d) = one.class.typical_size();
            let factors = [one.bev.w / w, one.bev.d / d];
            self.n += 1;
            self.small += u64::from((0..2).all(|k| factors[k] <= small[k]));
            self.large += u64::from((0..2).all(|k| factors[k] >= large[k]));
            for k in 0..2 {
                self.logarithms[k] += libm::log(factors[k]);
                self.sums_m[k] += [one.bev.w, one.bev.d][k];
            }
        }
    }

    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    fn wrong(&self, of_vehicles: bool) -> Option<WrongSizes> {
        let n = self.n as f64;
        let are_wrong = self.n >= MIN_VEHICLES && self.small.max(self.large) as f64 >= MOST * n;
        are_wrong.then(|| WrongSizes {
            of_vehicles,
            factors: self.logarithms.map(|sum| libm::exp(sum / n)),
            mean_m: self.sums_m.map(|sum| sum / n),
            n: self.n,
        })
    }
}
