//! Coefficients of Radau IIA of order 5 (Hairer & Wanner, "Solving Ordinary Differential Equations II", 2nd ed. 1996, section
//! IV.8, and the program RADAU5).

/// Stages of the method.
pub(super) const STAGES: usize = 3;

/// Abscissae `(4 - sqrt 6)/10`, `(4 + sqrt 6)/10`, 1.
pub(super) const C: [f64; STAGES] = [0.155_051_025_721_682_2, 0.644_948_974_278_317_8, 1.0];
/// The method's matrix: `(88 - 7 sqrt 6)/360` ... `1/9`.
pub(super) const A: [[f64; STAGES]; STAGES] = [
    [0.196_815_477_223_660_4, -0.065_535_425_850_198_4, 0.023_770_974_348_220_15],
    [0.394_424_314_739_087_3, 0.292_073_411_665_228_5, -0.041_548_752_125_997_93],
    [0.376_403_062_700_467_27, 0.512_485_826_188_421_6, 1.0 / 9.0],
];
/// `T^-1 A^-1 T` is block diagonal: one real eigenvalue, one complex pair.
pub(super) const T: [[f64; STAGES]; STAGES] = [
    [9.123_239_487_089_295E-2, -0.141_255_295_020_954_2, -3.002_919_410_514_742_4E-2],
    [0.241_717_932_707_107, 0.204_129_352_293_799_93, 0.382_942_112_757_261_9],
    [0.966_048_182_615_093, 1.0, 0.0],
];
pub(super) const T_INVERSE: [[f64; STAGES]; STAGES] = [
    [4.325_579_890_063_155, 0.339_199_251_815_809_87, 0.541_770_539_935_874_9],
    [-4.178_718_591_551_905, -0.327_682_820_761_062_4, 0.476_623_554_500_550_45],
    [-0.502_872_634_945_786_9, 2.571926949855605, -0.596_039_204_828_224_9],
];
/// Shares of a step at which the equations are evaluated.
pub(super) const SEEN: [f64; STAGES + 1] = [0.0, C[0], C[1], C[2]];
/// The real eigenvalue of `A^-1`.
pub(super) const GAMMA: f64 = 3.637_834_252_744_496;
/// The complex one: `ALPHA + i BETA`.
pub(super) const ALPHA: f64 = 2.681_082_873_627_752;
pub(super) const BETA: f64 = 3.050_430_199_247_410_5;
/// Weights of the error estimate, `-(13 + 7 sqrt 6)/3`, `(-13 + 7 sqrt 6)/3`, `-1/3`.
pub(super) const E: [f64; STAGES] = [-10.048_809_399_827_414, 1.382_142_733_160_748, -1.0 / 3.0];
