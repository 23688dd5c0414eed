//! Sines and cosines of programs: both of one angle at once, and those of many angles in lanes.
//!
//! One sequence of operations without branches for all: where several lanes of a vector unit run it at once, the bits are those of
//! one alone, and a sine alone has the bits of the sine that comes with a cosine. So it makes no difference which of them a program
//! needs, or which machine runs it. Angles beyond [`FAR`] are for `libm`.

#![allow(
    unsafe_code,
    reason = "the only way to call what is compiled for a wider vector unit; the use says why it holds"
)]

use rustc_hash::FxHashMap;

use super::graph::{Expr, Graph, Node};

/// Angles from here on are reduced by `libm`, rad: fewer quarter turns than 2^20, so that the products in [`one`] are exact.
const FAR: f64 = 1.6e6;
/// Added and taken away again, it rounds to a whole number, which is then in the last bits of the sum.
const TO_WHOLE: f64 = 1.5 * (1_u64 << 52) as f64;
/// Pi / 2 in parts of 33 bits, and the rest of it (Cody & Waite, "Software Manual for the Elementary Functions", 1980).
const QUARTER: [f64; 4] = [
    f64::from_bits(0x3ff9_21fb_5440_0000),
    f64::from_bits(0x3dd0_b461_1a60_0000),
    f64::from_bits(0x3ba3_198a_2e00_0000),
    8.478_427_660_368_9e-32,
];
/// (sin x - x) / x^3 in powers of x^2 up to pi / 4, by interpolation at Chebyshev points; off by 1.8e-17 of sin x at most.
const SINE: [f64; 6] = [
    -0.166_666_666_666_666_66,
    0.008_333_333_333_330_943,
    -0.000_198_412_698_367_495_6,
    2.755_731_609_787_775e-6,
    -2.505_113_087_096_829_7e-8,
    1.591_805_913_698_281e-10,
];
/// (cos x - 1 + x^2 / 2) / x^4 likewise; off by 7.8e-19 of cos x at most.
const COSINE: [f64; 6] = [
    0.041_666_666_666_666_664,
    -0.001_388_888_888_888_739_3,
    2.480_158_729_876_004_8e-5,
    -2.755_731_726_880_539e-7,
    2.087_614_565_905_934_4e-9,
    -1.138_258_853_535_252_2e-11,
];

/// Sine and cosine of an angle nearer than [`FAR`].
///
/// Whatever needs a sine waits for it, so that few operations depend on each other: the reduced angle is `x` less an excess that
/// enters the results to first order, and polynomials are split by powers (Estrin 1960).
#[inline(always)]
fn one(angle: f64) -> (f64, f64) {
    // The angle less a whole number of quarter turns, as x - excess. The signs are such that -0 stays what it is.
    let whole = angle * std::f64::consts::FRAC_2_PI + TO_WHOLE;
    let turns = whole - TO_WHOLE;
    let (near, lost) = difference(angle - turns * QUARTER[0], turns * QUARTER[1]);
    let (x, lost_again) = difference(near, turns * QUARTER[2]);
    let excess = (lost + turns * QUARTER[3]) + lost_again;

    let square = x * x;
    let (cube, fourth) = (square * x, square * square);
    let half = 0.5 * square;
    let most = 1.0 - half;
    let [s1, s2, s3, s4, s5, s6] = SINE;
    let bend = (s2 + square * s3) + fourth * ((s4 + square * s5) + fourth * s6);
    let sine = x - (excess * most - (cube * s1 + (cube * square) * bend));
    let [c1, c2, c3, c4, c5, c6] = COSINE;
    let bend = ((c1 + square * c2) + fourth * (c3 + square * c4)) + (fourth * fourth) * (c5 + square * c6);
    let cosine = most + (((1.0 - most) - half) + (fourth * bend + x * excess));

    // Odd quarters swap them; the sine is negative in the last two, the cosine in the middle ones.
    let quarter = whole.to_bits();
    let swap = 0_u64.wrapping_sub(quarter & 1);
    let (sine, cosine) = (sine.to_bits(), cosine.to_bits());
    let other = (sine ^ cosine) & swap;
    let sign = |quarter: u64| (quarter & 2) << 62;
    (f64::from_bits(sine ^ other ^ sign(quarter)), f64::from_bits(cosine ^ other ^ sign(quarter.wrapping_add(1))))
}

/// a - b rounded, and by how much that is more (Knuth, "The Art of Computer Programming", vol. 2, section 4.2.2).
#[inline(always)]
fn difference(a: f64, b: f64) -> (f64, f64) {
    let rounded = a - b;
    let taken = a - rounded;
    (rounded, (b - taken) + ((rounded + taken) - a))
}

/// Sine and cosine.
pub(super) fn sin_cos(angle: f64) -> (f64, f64) {
    if is_near(angle) { one(angle) } else { libm::sincos(angle) }
}

fn is_near(angle: f64) -> bool {
    angle.abs() < FAR
}

/// The sine of [`sin_cos`].
pub(super) fn sin(angle: f64) -> f64 {
    sin_cos(angle).0
}

/// The cosine of [`sin_cos`].
pub(super) fn cos(angle: f64) -> f64 {
    sin_cos(angle).1
}

/// So many angles are best computed at once: whole vectors of the widest unit in use.
pub(super) fn lanes(angles: usize) -> usize {
    if angles == 1 { 1 } else { angles.next_multiple_of(4) }
}

/// [`sin_cos`] of each of the angles; the slices have the same length. `[hot, no allocation]`
#[inline]
pub(super) fn all(angles: &[f64], sines: &mut [f64], cosines: &mut [f64]) {
    if !in_widest_lanes(Turns { angles, sines, cosines }) {
        one_by_one(angles, sines, cosines);
    }
}

/// The same where some are far.
#[cold]
fn one_by_one(angles: &[f64], sines: &mut [f64], cosines: &mut [f64]) {
    for ((angle, sine), cosine) in angles.iter().zip(sines).zip(cosines) {
        (*sine, *cosine) = sin_cos(*angle);
    }
}

/// [`one`] of each of the angles; gives whether all are nearer than [`FAR`].
struct Turns<'a> {
    angles: &'a [f64],
    sines: &'a mut [f64],
    cosines: &'a mut [f64],
}

impl Work for Turns<'_> {
    type Result = bool;

    #[inline(always)]
    fn run(self) -> bool {
        let (angles, rest) = self.angles.as_chunks();
        let (sines, sines_left) = self.sines.as_chunks_mut();
        let (cosines, cosines_left) = self.cosines.as_chunks_mut();
        let mut near = fours(angles, sines, cosines);
        for ((angle, sine), cosine) in rest.iter().zip(sines_left).zip(cosines_left) {
            (*sine, *cosine) = one(*angle);
            near &= is_near(*angle);
        }
        near
    }
}

/// [`one`] of four angles at a time; gives whether all are nearer than [`FAR`].
#[inline(always)]
fn fours(angles: &[[f64; 4]], sines: &mut [[f64; 4]], cosines: &mut [[f64; 4]]) -> bool {
    let mut near = true;
    for ((angles, sines), cosines) in angles.iter().zip(sines).zip(cosines) {
        // As many as are known beforehand, of a copy, and without branches, so that the compiler turns it into vector instructions.
        let (angles, mut found) = (*angles, [[0.0; 4]; 2]);
        for k in 0..4 {
            (found[0][k], found[1][k]) = one(angles[k]);
        }
        [*sines, *cosines] = found;
        near &= angles.iter().fold(true, |near, angle| near & is_near(*angle));
    }
    near
}

/// [`all`] of `lanes` angles, a multiple of four, which begin at `numbers`; their sines follow, then the cosines. For machine code,
/// which calls nothing else between its own operations.
///
/// # Safety
/// This machine has AVX2; nothing else reads or writes these numbers.
#[cfg(all(feature = "jit", target_arch = "x86_64"))]
#[target_feature(enable = "avx2")]
pub(super) unsafe extern "C" fn all_in_fours(numbers: *mut f64, lanes: u32) {
    let count = lanes as usize / 4;
    // SAFETY: by the caller.
    let numbers = unsafe { std::slice::from_raw_parts_mut(numbers.cast::<[f64; 4]>(), 3 * count) };
    let (angles, results) = numbers.split_at_mut(count);
    let (sines, cosines) = results.split_at_mut(count);
    if !fours(angles, sines, cosines) {
        one_by_one(angles.as_flattened(), sines.as_flattened_mut(), cosines.as_flattened_mut());
    }
}

/// Work that is written without regard to the width of vectors. What it calls has to be inlined, as `run` itself is, to be
/// compiled for each of the widths.
pub(super) trait Work {
    type Result;
    fn run(self) -> Self::Result;
}

/// Does work in the widest vectors in use. The bits are the same in all: nothing is fused. `[hot, no allocation]`
#[inline]
pub(super) fn in_widest_lanes<W: Work>(work: W) -> W::Result {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: this machine has what the function was compiled for.
        return unsafe { in_wide_lanes(work) };
    }
    work.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn in_wide_lanes<W: Work>(work: W) -> W::Result {
    work.run()
}

/// Nodes in their order, but a sine and a cosine of the same number one right after the other, where the first of them was;
/// these with `true`.
pub(super) fn pairs_together(graph: &Graph, nodes: &[Node]) -> Vec<(Node, bool)> {
    let mut of_angle: FxHashMap<Node, [Option<Node>; 2]> = FxHashMap::default();
    for node in nodes {
        match graph.expr(*node) {
            Expr::Sin(angle) => of_angle.entry(angle).or_default()[0] = Some(*node),
            Expr::Cos(angle) => of_angle.entry(angle).or_default()[1] = Some(*node),
            _ => {}
        }
    }
    let mut ordered = Vec::with_capacity(nodes.len());
    for node in nodes {
        let (Expr::Sin(angle) | Expr::Cos(angle)) = graph.expr(*node) else {
            ordered.push((*node, false));
            continue;
        };
        match of_angle.get_mut(&angle) {
            Some([sine, cosine]) if sine.is_some() && cosine.is_some() => {
                ordered.extend([sine.take(), cosine.take()].into_iter().flatten().map(|node| (node, true)));
            }
            // The second of a pair is there already.
            Some([None, None]) => {}
            _ => ordered.push((*node, false)),
        }
    }
    ordered
}

/// The angles among these nodes (ascending) that depend on no other sine, cosine or opaque element, each with its sine and its
/// cosine where they are among the nodes: they can all be computed at once.
pub(super) fn first_angles(graph: &Graph, nodes: &[Node]) -> Vec<(Node, [Option<Node>; 2])> {
    let mut later = vec![false; nodes.last().map_or(0, |node| node.0 as usize + 1)];
    let mut place_of: FxHashMap<Node, usize> = FxHashMap::default();
    let mut angles: Vec<(Node, [Option<Node>; 2])> = Vec::new();
    for node in nodes {
        let expr = graph.expr(*node);
        let mut depends = matches!(expr, Expr::Call { .. });
        if !depends {
            graph.operands(*node, |operand| depends |= later[operand.0 as usize]);
        }
        if let (Expr::Sin(angle) | Expr::Cos(angle), false) = (expr, depends) {
            let place = *place_of.entry(angle).or_insert_with(|| {
                angles.push((angle, [None, None]));
                angles.len() - 1
            });
            angles[place].1[usize::from(matches!(expr, Expr::Cos(_)))] = Some(*node);
            depends = true;
        }
        later[node.0 as usize] = depends;
    }
    angles
}
