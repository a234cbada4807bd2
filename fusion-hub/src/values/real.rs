//! A real number, or one for each of four objects: what is written once for both gives the same bits for both.
//!
//! Four lanes are four times the work of one instruction where the processor has AVX2, twice where it has SSE2 only. Products
//! and sums stay apart (no fused multiply-add), so that every machine computes the same bits. A condition on lanes is a
//! choice between two results, both of which are computed; where it seldom holds, [`Real::map`] goes through the lanes.

use fearless_simd::{Select, Simd, SimdBase, SimdFloat, SimdMask, f64x4};
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

/// How many objects are computed together.
pub const LANES: usize = 4;

/// A real number, or one in each lane.
///
/// Everything here is inlined into code that is compiled for a processor's instructions; what is not would be compiled for
/// every processor, and lanes handed over in memory.
pub trait Real:
    Copy
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
{
    /// A condition, for each lane.
    type Truth: Copy;

    /// A constant, in as many lanes as this has.
    fn same(self, value: f64) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// With the sign of another.
    fn copysign(self, sign: Self) -> Self;
    /// Whether it is less than another.
    fn is_below(self, other: Self) -> Self::Truth;
    /// Whether it is at most another.
    fn is_at_most(self, other: Self) -> Self::Truth;
    /// One of two values.
    fn choose(condition: Self::Truth, then: Self, otherwise: Self) -> Self;
    /// Whether a condition holds everywhere.
    fn all(condition: Self::Truth) -> bool;
    /// A function of one number, lane by lane; once where all are equal.
    fn map(self, function: impl Fn(f64) -> f64) -> Self;
    /// Two functions of one number, lane by lane.
    fn map_two(self, function: impl Fn(f64) -> (f64, f64)) -> (Self, Self);
}

impl Real for f64 {
    type Truth = bool;

    #[inline(always)]
    fn same(self, value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        libm::sqrt(self)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self::abs(self)
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        Self::copysign(self, sign)
    }

    #[inline(always)]
    fn is_below(self, other: Self) -> bool {
        self < other
    }

    #[inline(always)]
    fn is_at_most(self, other: Self) -> bool {
        self <= other
    }

    #[inline(always)]
    fn choose(condition: bool, then: Self, otherwise: Self) -> Self {
        if condition { then } else { otherwise }
    }

    #[inline(always)]
    fn all(condition: bool) -> bool {
        condition
    }

    #[inline(always)]
    fn map(self, function: impl Fn(f64) -> f64) -> Self {
        function(self)
    }

    #[inline(always)]
    fn map_two(self, function: impl Fn(f64) -> (f64, f64)) -> (Self, Self) {
        function(self)
    }
}

impl<S: Simd> Real for f64x4<S> {
    type Truth = <Self as SimdBase<S>>::Mask;

    #[inline(always)]
    fn same(self, value: f64) -> Self {
        Self::splat(self.simd, value)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        SimdFloat::sqrt(self)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.simd.abs_f64x4(self)
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        SimdFloat::copysign(self, sign)
    }

    #[inline(always)]
    fn is_below(self, other: Self) -> Self::Truth {
        self.simd.simd_lt_f64x4(self, other)
    }

    #[inline(always)]
    fn is_at_most(self, other: Self) -> Self::Truth {
        self.simd.simd_le_f64x4(self, other)
    }

    #[inline(always)]
    fn choose(condition: Self::Truth, then: Self, otherwise: Self) -> Self {
        condition.select(then, otherwise)
    }

    #[inline(always)]
    fn all(condition: Self::Truth) -> bool {
        condition.all_true()
    }

    #[inline(always)]
    fn map(self, function: impl Fn(f64) -> f64) -> Self {
        let [first, second, third, fourth] = self.into();
        let of_first = function(first);
        if [second, third, fourth].iter().all(|other| other.to_bits() == first.to_bits()) {
            return self.same(of_first);
        }
        Self::from_slice(self.simd, &[of_first, function(second), function(third), function(fourth)])
    }

    #[inline(always)]
    fn map_two(self, function: impl Fn(f64) -> (f64, f64)) -> (Self, Self) {
        let [first, second, third, fourth] = self.into();
        let [a, b, c, d] = [function(first), function(second), function(third), function(fourth)];
        (
            Self::from_slice(self.simd, &[a.0, b.0, c.0, d.0]),
            Self::from_slice(self.simd, &[a.1, b.1, c.1, d.1]),
        )
    }
}
