//! How large an agent's vehicles are, against how large vehicles of their class are.

use super::observation::Observation;
use v2x_common::class::ClassGroup;
use v2x_common::detection::Detection;

/// Widths of vehicles of a class differ by a few tenths; a whole population is too small or too large from these factors on. Lengths
/// differ more, and must agree.
const SMALL: [f64; 2] = [0.67, 0.72];
const LARGE: [f64; 2] = [1.5, 1.5];
/// Such a share of them is.
const MOST: f64 = 0.9;
/// Fewest vehicles, in frames of at least two: one odd vehicle may be parked there all day.
const MIN_VEHICLES: u64 = 40;
const MIN_OF_FRAME: usize = 2;

/// Of one agent.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sizes {
    n: u64,
    small: u64,
    large: u64,
    /// Logarithms of width and length as parts of those of the class, and both, m.
    logarithms: [f64; 2],
    sums_m: [f64; 2],
}

/// Vehicles of another size than vehicles have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WrongSizes {
    /// They are so many times as wide and as long, in the geometric mean.
    pub(super) factors: [f64; 2],
    /// So wide and long in the mean, m.
    pub(super) mean_m: [f64; 2],
    pub(super) n: u64,
}

impl Sizes {
    pub(super) fn note(&mut self, seen: &Observation<'_>) {
        let vehicles = || seen.frame.detections.iter().filter(|one| is_vehicle_with_size(one));
        if vehicles().count() < MIN_OF_FRAME {
            return;
        }
        for one in vehicles() {
            let (w, d) = one.class.typical_size();
            let factors = [one.bev.w / w, one.bev.d / d];
            self.n += 1;
            self.small += u64::from((0..2).all(|k| factors[k] <= SMALL[k]));
            self.large += u64::from((0..2).all(|k| factors[k] >= LARGE[k]));
            for k in 0..2 {
                self.logarithms[k] += libm::log(factors[k]);
                self.sums_m[k] += [one.bev.w, one.bev.d][k];
            }
        }
    }

    /// `None` where they are as large as vehicles are, or too few were seen.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub(super) fn wrong(&self) -> Option<WrongSizes> {
        let n = self.n as f64;
        let are_wrong = self.n >= MIN_VEHICLES && self.small.max(self.large) as f64 >= MOST * n;
        are_wrong.then(|| WrongSizes {
            factors: self.logarithms.map(|sum| libm::exp(sum / n)),
            mean_m: self.sums_m.map(|sum| sum / n),
            n: self.n,
        })
    }
}

fn is_vehicle_with_size(one: &Detection) -> bool {
    one.class.group() == ClassGroup::FourWheeled && one.bev.w > 0.0 && one.bev.d > 0.0
}
