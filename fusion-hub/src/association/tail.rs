//! The two functions that scores are made of, from basic arithmetic alone: the same bits everywhere, and no
//! branches. Both are within 1e-12 of the true value (tests, against libm), which changes no assignment.

/// Powers of two from the table are so many steps apart in the exponent's whole.
const STEPS: i32 = 32;
/// ln 2 / 32.
const STEP: f64 = std::f64::consts::LN_2 / 32.0;
/// e⁻ˣ from here on counts as this much: 1e-304.
const LARGEST: f64 = 700.0;

/// e⁻ˣ for x ≥ 0: 2⁻ⁿ · 2^(−j/32) · eʳ with |r| ≤ ln 2 / 64, where five terms of the series are enough.
pub(super) fn exp_minus(x: f64) -> f64 {
    let x = x.min(LARGEST);
    #[expect(clippy::cast_possible_truncation, reason = "within 0 and 32 · 700 / ln 2")]
    let steps = (x / STEP + 0.5) as i32;
    let r = f64::from(steps) * STEP - x;
    let (whole, part) = (steps / STEPS, steps % STEPS);
    let power = f64::from_bits(u64::from((1023 - whole).unsigned_abs()) << 52);
    let r2 = r * r;
    let series = (1.0 + r) + r2 * ((1.0 / 2.0 + r / 6.0) + r2 * (1.0 / 24.0 + r / 120.0));
    power * ROOTS[part.unsigned_abs() as usize] * series
}

/// The probability that the square of a standard normal variable exceeds `squared` ≥ 0: erfc(√(squared / 2)).
///
/// With t = √(squared / 2), erfc t = e^(−t²) p(u) / (1 + 2t), where p is smooth in u = (t − 3) / (t + 3) (after
/// Shepherd & Laframboise 1981): here its Chebyshev interpolation of degree 18, in powers of u.
pub(super) fn normal_tail(squared: f64) -> f64 {
    let half = squared / 2.0;
    let t = libm::sqrt(half);
    let u = (t - 3.0) / (t + 3.0);
    let u2 = u * u;
    let u4 = u2 * u2;
    // In four independent chains.
    let chain = |c: &[f64; 5]| c[0] + u4 * (c[1] + u4 * (c[2] + u4 * (c[3] + u4 * c[4])));
    let [c0, c1, c2, c3] = &CHAINS;
    let p = (chain(c0) + u * chain(c1)) + u2 * (chain(c2) + u * chain(c3));
    exp_minus(half) * p / (1.0 + 2.0 * t)
}

/// 2^(−j/32).
const ROOTS: [f64; 32] = [
    1.0,
    0.978_572_062_087_700_1,
    0.957_603_280_698_573_7,
    0.937_083_817_055_15,
    0.917_004_043_204_671_2,
    0.897_354_537_501_553_6,
    0.878_126_080_186_649_7,
    0.859_309_649_061_239,
    0.840_896_415_253_714_5,
    0.822_877_739_076_982_5,
    0.805_245_165_974_627_1,
    0.787_990_422_553_943_2,
    0.771_105_412_703_970_4,
    0.754_582_213_796_711_4,
    0.738_413_072_969_749_7,
    0.722_590_403_488_523_3,
    std::f64::consts::FRAC_1_SQRT_2,
    0.691_954_940_981_916,
    0.677_127_773_468_446_3,
    0.662_618_321_579_870_7,
    0.648_419_777_325_504_8,
    0.634_525_478_595_866_6,
    0.620_928_906_036_742,
    0.607_623_679_990_234_5,
    0.594_603_557_501_360_5,
    0.581_862_429_388_788_7,
    0.569_394_317_378_345_8,
    0.557_193_371_297_946_2,
    0.545_253_866_332_628_8,
    0.533_570_200_338_411_8,
    0.522_136_891_213_706_9,
    0.510_948_574_327_058_3,
];

/// Coefficients of uⁱ, by i mod 4.
const CHAINS: [[f64; 5]; 4] = [
    [
        1.253_008_058_269_708_3,
        -0.119_273_663_561_663_48,
        0.001_888_677_430_223_739_3,
        4.827_307_506_916_763e-6,
        1.709_984_035_318_664_8e-7,
    ],
    [
        -0.135_621_106_120_977,
        0.068_308_031_237_398_84,
        -0.000_779_692_070_198_941_1,
        -1.950_827_675_992_395_2e-5,
        -2.803_193_612_904_493_7e-7,
    ],
    [
        -0.047_562_294_349_107_32,
        -0.023_770_512_995_596_054,
        -0.000_105_109_309_288_180_61,
        -5.429_886_312_699_569e-7,
        -2.725_381_816_790_518_6e-8,
    ],
    [
        0.129_645_158_484_320_23,
        0.002_529_360_157_490_078,
        0.000_124_731_452_658_243_76,
        2.889_003_011_745_413_8e-6,
        0.0,
    ],
];

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn exp_minus_agrees_with_libm(x in prop_oneof![0.0..1.0f64, 0.0..50.0f64, 0.0..2000.0f64]) {
            let exact = libm::exp(-x);
            prop_assert!((exp_minus(x) - exact).abs() <= 1e-13 * exact + 1e-300, "{x}");
        }

        #[test]
        fn the_normal_tail_agrees_with_libm(squared in prop_oneof![0.0..1.0f64, 0.0..100.0f64, 0.0..1e9f64]) {
            let exact = libm::erfc(libm::sqrt(squared / 2.0));
            prop_assert!((normal_tail(squared) - exact).abs() <= 1e-12, "{squared}");
        }
    }

    #[test]
    fn both_functions_are_one_at_zero_decreasing_and_in_range() {
        assert_eq!(exp_minus(0.0), 1.0);
        assert!((normal_tail(0.0) - 1.0).abs() < 1e-12);
        assert!(exp_minus(f64::INFINITY) < 1e-300 && normal_tail(1e300) < 1e-300);
        let mut last = (1.0, 1.0 + 1e-12);
        for step in 1..200_000 {
            let x = f64::from(step) * 1e-3;
            let next = (exp_minus(x), normal_tail(x));
            assert!(next.0 > 0.0 && next.0 <= last.0 && next.1 > 0.0 && next.1 <= last.1 + 1e-12, "{x}");
            last = next;
        }
    }
}
