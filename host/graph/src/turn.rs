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
#[inline(always)]
fn one(angle: f64) -> (f64, f64) {
    // The angle less a whole number of quarter turns, as x + rest. The signs are such that -0 stays what it is.
    let whole = angle * std::f64::consts::FRAC_2_PI + TO_WHOLE;
    let turns = whole - TO_WHOLE;
    let (far, lost) = difference(angle - turns * QUARTER[0], turns * QUARTER[1]);
    let (near, lost_again) = difference(far, turns * QUARTER[2]);
    let excess = lost + lost_again + turns * QUARTER[3];
    let x = near - excess;
    let rest = (near - x) - excess;

    let square = x * x;
    let cube = square * x;
    let [s1, s2, s3, s4, s5, s6] = SINE;
    let bend = s2 + square * (s3 + square * (s4 + square * (s5 + square * s6)));
    let sine = x - ((square * (0.5 * rest - cube * bend) - rest) - cube * s1);
    let [c1, c2, c3, c4, c5, c6] = COSINE;
    let bend = c1 + square * (c2 + square * (c3 + square * (c4 + square * (c5 + square * c6))));
    let half = 0.5 * square;
    let most = 1.0 - half;
    let cosine = most + (((1.0 - most) - half) + (square * square * bend - x * rest));

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
    let (fours, rest) = angles.as_chunks::<4>();
    let ((sines_of, sines_left), (cosines_of, cosines_left)) =
        (sines.as_chunks_mut::<4>(), cosines.as_chunks_mut::<4>());
    let (mut near, four) = (true, four_here());
    for ((angles, sines), cosines) in fours.iter().zip(sines_of).zip(cosines_of) {
        near &= four(angles, sines, cosines);
    }
    for ((angle, sine), cosine) in rest.iter().zip(sines_left).zip(cosines_left) {
        (*sine, *cosine) = one(*angle);
        near &= is_near(*angle);
    }
    if !near {
        for ((angle, sine), cosine) in angles.iter().zip(sines).zip(cosines) {
            (*sine, *cosine) = sin_cos(*angle);
        }
    }
}

/// Computes [`one`] of four angles; gives whether all are nearer than [`FAR`].
pub(super) type Four = fn(&[f64; 4], &mut [f64; 4], &mut [f64; 4]) -> bool;

/// The one that takes the widest vectors in use.
#[inline]
pub(super) fn four_here() -> Four {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: this machine has what the function was compiled for.
        return |angles, sines, cosines| unsafe { four_in_wide_lanes(angles, sines, cosines) };
    }
    |angles, sines, cosines| four_in_lanes(angles, sines, cosines)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn four_in_wide_lanes(angles: &[f64; 4], sines: &mut [f64; 4], cosines: &mut [f64; 4]) -> bool {
    four_in_lanes(angles, sines, cosines)
}

/// As many as are known beforehand, and without branches, so that the compiler turns it into vector instructions.
#[inline(always)]
fn four_in_lanes(angles: &[f64; 4], sines: &mut [f64; 4], cosines: &mut [f64; 4]) -> bool {
    for k in 0..4 {
        (sines[k], cosines[k]) = one(angles[k]);
    }
    angles.iter().fold(true, |near, angle| near & is_near(*angle))
}

/// Work that is written without regard to the width of vectors. What it calls has to be inlined, as `run` itself is, to be
/// compiled for each of the widths.
pub(super) trait Work {
    fn run(self);
}

/// Does work in the widest vectors in use. The bits are the same in all: nothing is fused. `[hot, no allocation]`
#[inline]
pub(super) fn in_widest_lanes(work: impl Work) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: this machine has what the function was compiled for.
        unsafe { in_wide_lanes(work) };
        return;
    }
    work.run();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn in_wide_lanes(work: impl Work) {
    work.run();
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
