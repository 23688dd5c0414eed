//! Coefficients of Radau IIA (Hairer & Wanner, "Solving Ordinary Differential Equations II", 2nd ed. 1996, sections IV.5 and IV.8,
//! and the programs RADAU5 and RADAU).

/// Of a method with `S` stages.
#[derive(Debug)]
pub(super) struct Tableau<const S: usize> {
    pub(super) name: &'static str,
    /// Abscissae.
    pub(super) c: [f64; S],
    /// The method's matrix.
    pub(super) a: [[f64; S]; S],
    /// `T^-1 A^-1 T` is block diagonal: one real eigenvalue, then complex pairs.
    pub(super) t: [[f64; S]; S],
    pub(super) t_inverse: [[f64; S]; S],
    /// The real eigenvalue of `A^-1`.
    pub(super) gamma: f64,
    /// The complex ones: `alpha + i beta`.
    pub(super) pairs: &'static [(f64, f64)],
    /// Weights of the increments in the error estimate.
    pub(super) error: [f64; S],
    /// Shares of a step at which the equations are evaluated.
    pub(super) seen: &'static [f64],
}

/// Radau IIA of order 5: `c = (4 - sqrt 6)/10, (4 + sqrt 6)/10, 1`, `a = (88 - 7 sqrt 6)/360 ... 1/9`, error weights
/// `-(13 + 7 sqrt 6)/3, (-13 + 7 sqrt 6)/3, -1/3`.
pub(super) const FIFTH: Tableau<3> = Tableau {
    name: "radau5",
    c: [0.155_051_025_721_682_2, 0.644_948_974_278_317_8, 1.0],
    a: [
        [0.196_815_477_223_660_4, -0.065_535_425_850_198_4, 0.023_770_974_348_220_15],
        [0.394_424_314_739_087_3, 0.292_073_411_665_228_5, -0.041_548_752_125_997_93],
        [0.376_403_062_700_467_27, 0.512_485_826_188_421_6, 1.0 / 9.0],
    ],
    t: [
        [9.123_239_487_089_295E-2, -0.141_255_295_020_954_2, -3.002_919_410_514_742_4E-2],
        [0.241_717_932_707_107, 0.204_129_352_293_799_93, 0.382_942_112_757_261_9],
        [0.966_048_182_615_093, 1.0, 0.0],
    ],
    t_inverse: [
        [4.325_579_890_063_155, 0.339_199_251_815_809_87, 0.541_770_539_935_874_9],
        [-4.178_718_591_551_905, -0.327_682_820_761_062_4, 0.476_623_554_500_550_45],
        [-0.502_872_634_945_786_9, 2.571926949855605, -0.596_039_204_828_224_9],
    ],
    gamma: 3.637_834_252_744_496,
    pairs: &[(2.681_082_873_627_752, 3.050_430_199_247_410_5)],
    error: [-10.048_809_399_827_414, 1.382_142_733_160_748, -1.0 / 3.0],
    seen: &[0.0, 0.155_051_025_721_682_2, 0.644_948_974_278_317_8, 1.0],
};

/// Radau IIA of order 9: by collocation at the zeros of the shifted polynomial of section IV.5, eq. 5.11, in arithmetic of 33
/// digits.
pub(super) const NINTH: Tableau<5> = Tableau {
    name: "radau9",
    c: [0.057_104_196_114_517_68, 0.276_843_013_638_123_8, 0.583_590_432_368_916_8, 0.860_240_135_656_219_5, 1.0],
    a: [
        [
            0.072_998_864_317_903_33,
            -0.026_735_331_107_945_57,
            0.018_676_929_763_984_353,
            -0.012_879_106_093_306_44,
            0.005_042_839_233_882_015,
        ],
        [
            0.153_775_231_479_182_46,
            0.146_214_867_847_493_52,
            -0.036_444_568_905_128_09,
            0.021_233_063_119_304_72,
            -0.007_935_579_902_728_777,
        ],
        [
            0.140_063_045_684_809_87,
            0.298_967_129_491_283_46,
            0.167_585_070_135_248_95,
            -0.033_969_101_686_617_74,
            0.010_944_288_744_192_253,
        ],
        [
            0.144_894_308_109_534_77,
            0.276_500_068_760_159_2,
            0.325_797_922_910_421_03,
            0.128_756_753_254_909_76,
            -0.015_708_917_378_805_327,
        ],
        [0.143_713_560_791_225_94, 0.281_356_015_149_462_07, 0.311_826_522_975_741_26, 0.223_103_901_083_570_75, 0.04],
    ],
    t: [
        [
            0.013_576_867_344_947_943,
            -0.011_478_515_255_229_515,
            -0.014_019_858_892_875_41,
            -0.010_242_047_817_908_826,
            0.047_673_877_290_295_72,
        ],
        [
            0.001_617_900_401_719_087_5,
            -0.007_668_830_749_180_163,
            0.024_708_578_426_518_527,
            0.050_172_864_517_371_06,
            -0.094_331_819_181_611_43,
        ],
        [
            0.079_157_853_347_447_21,
            0.019_398_463_998_828_95,
            0.081_800_353_703_751_17,
            -0.230_539_534_043_417_95,
            0.102_703_045_380_125_9,
        ],
        [
            0.412_256_082_680_461_43,
            0.407_601_171_280_199_07,
            0.199_682_427_886_802_52,
            0.377_893_902_248_861_27,
            0.466_744_130_332_494_34,
        ],
        [1.0, 1.0, 0.0, 1.0, 0.0],
    ],
    t_inverse: [
        [
            27.697_693_775_684_087,
            12.783_337_911_304_406,
            3.208_489_386_713_43,
            -0.951_490_412_248_916_2,
            0.741_550_496_025_989_7,
        ],
        [
            -33.041_880_213_519,
            -17.376_953_479_063_566,
            -0.172_129_063_254_005_57,
            -0.099_169_777_982_542_65,
            0.531_228_115_838_306_6,
        ],
        [
            -8.611_443_979_875_292,
            9.699_991_409_528_808,
            1.914_728_639_696_874_3,
            2.418_692_006_084_94,
            -1.047_463_487_935_337_5,
        ],
        [
            5.344_186_437_834_912,
            4.593_615_567_759_161,
            -3.036_360_323_459_424_3,
            1.050_660_190_231_459,
            -0.272_778_611_864_296_25,
        ],
        [
            3.748_059_807_439_805,
            -3.984_965_736_343_885,
            -1.044_415_641_608_018_8,
            1.184_098_568_137_948_6,
            -0.449_917_770_156_780_36,
        ],
    ],
    gamma: 6.286_704_751_729_276_5,
    pairs: &[(5.700_953_298_671_79, 3.210_265_600_308_549_7), (3.655_694_325_463_572, 6.543_736_899_360_077)],
    error: [-27.780_933_944_064_64, 3.641_478_498_049_213, -1.252_547_721_169_118_7, 0.592_003_167_184_542_8, -0.2],
    seen: &[
        0.0,
        0.057_104_196_114_517_68,
        0.276_843_013_638_123_8,
        0.583_590_432_368_916_8,
        0.860_240_135_656_219_5,
        1.0,
    ],
};

#[cfg(test)]
mod tests {
    use super::*;

    fn fulfils<const S: usize>(tableau: &Tableau<S>) {
        let Tableau { c, a, t, t_inverse, gamma, pairs, error, seen, .. } = tableau;
        let close = |a: f64, b: f64, what: &str| assert!((a - b).abs() < 1e-13, "{what}: {a} {b}");
        // Collocation: polynomials up to degree S - 1 are integrated to every node.
        for power in 0..S as i32 {
            for (row, c) in a.iter().zip(c) {
                let sum: f64 = row.iter().zip(tableau.c).map(|(a, c)| a * c.powi(power)).sum();
                close(sum, c.powi(power + 1) / f64::from(power + 1), "collocation");
            }
        }
        // Quadrature of order 2 S - 1 by the last row.
        for power in 0..2 * S as i32 - 1 {
            let sum: f64 = a[S - 1].iter().zip(c).map(|(a, c)| a * c.powi(power)).sum();
            close(sum, 1.0 / f64::from(power + 1), "quadrature");
        }
        // A T Lambda = T with the blocks [alpha, -beta; beta, alpha].
        let mut blocks = [[0.0; S]; S];
        blocks[0][0] = *gamma;
        for (at, (alpha, beta)) in (1..).step_by(2).zip(*pairs) {
            (blocks[at][at], blocks[at][at + 1]) = (*alpha, -beta);
            (blocks[at + 1][at], blocks[at + 1][at + 1]) = (*beta, *alpha);
        }
        let times = |a: &[[f64; S]; S], b: &[[f64; S]; S]| -> [[f64; S]; S] {
            std::array::from_fn(|i| std::array::from_fn(|j| (0..S).map(|k| a[i][k] * b[k][j]).sum()))
        };
        let (back, one) = (times(&times(a, t), &blocks), times(t, t_inverse));
        for i in 0..S {
            for j in 0..S {
                close(back[i][j] / 30.0, t[i][j] / 30.0, "blocks");
                close(one[i][j], f64::from(u8::from(i == j)), "inverse");
            }
        }
        // The embedded formula, which has the start as one more node with the weight 1/gamma, is exact up to degree S - 1.
        for power in 0..S as i32 {
            let start = if power == 0 { 1.0 / gamma } else { 0.0 };
            // Increments of t^(power + 1) / (power + 1).
            let weighted = error.iter().zip(c).map(|(e, c)| e * c.powi(power + 1) / f64::from(power + 1));
            close(start + weighted.sum::<f64>() / gamma, 0.0, "embedded formula");
        }
        assert_eq!(&seen[1..], c);
    }

    #[test]
    fn coefficients_are_those_of_their_orders() {
        fulfils(&FIFTH);
        fulfils(&NINTH);
    }
}
