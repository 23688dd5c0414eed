//! Designs: points that fill ranges of several keys, few as they are.

use odyn_numerics::draw::SplitMix64;

use super::points::Points;
use super::sobol::{self, MOST_DIMENSIONS};
use super::vary::Span;
use crate::diagnostics::{Diagnostic, codes};

/// Which points are chosen in the ranges of the keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Design {
    /// A Latin hypercube (McKay, Beckman & Conover 1979): the range of each key is cut into as many parts of one size as there
    /// are points, and each part has one point, somewhere; which parts meet is drawn by lot.
    LatinHypercube {
        /// Number of points.
        count: usize,
        /// Other seeds give other points.
        seed: u64,
    },
    /// The first points of a Sobol' sequence: as even as points can be, and a longer study has the points of the shorter one.
    Sobol {
        /// Number of points; powers of two are the most even.
        count: usize,
        /// With a seed, the sequence is shifted (by turning over bits), so that the first point is no corner of the ranges.
        seed: Option<u64>,
    },
}

impl Points {
    /// The points of a design: each key has a range `KEY=FROM:TO`, or a list `KEY=A,B,...` of which each value has its share.
    ///
    /// # Errors
    /// No key, too many of them for a Sobol' sequence, no point.
    pub fn designed(spans: &[Span], design: Design) -> Result<Self, Diagnostic> {
        let refused = |message: String, help: &str| Err(Diagnostic::error(codes::BAD_OVERRIDE, message).help(help));
        let (Design::LatinHypercube { count, .. } | Design::Sobol { count, .. }) = design;
        if spans.is_empty() {
            return refused("no key is varied".into(), "give each key and its range: `--vary crank.radius=8mm:10mm`");
        }
        if count == 0 {
            return refused("a study has one point at least".into(), "give the number of points");
        }
        if count > super::MOST_RUNS {
            return refused(format!("the study has more than {} runs", super::MOST_RUNS), "ask for fewer points");
        }
        if matches!(design, Design::Sobol { .. }) && spans.len() > MOST_DIMENSIONS {
            let message =
                format!("a Sobol' sequence is known here for {MOST_DIMENSIONS} keys, not for {}", spans.len());
            return refused(message, "vary fewer keys, or use a Latin hypercube (`--lhs`)");
        }
        let columns: Vec<Vec<String>> = spans
            .iter()
            .enumerate()
            .map(|(k, span)| match design {
                Design::LatinHypercube { seed, .. } => latin(count, &mut lot(seed, k)).map(|u| span.at(u)).collect(),
                Design::Sobol { seed, .. } => {
                    let shift = seed.map_or(0, |seed| (lot(seed, k).bits() >> 32) as u32);
                    sobol::coordinates(k, count, shift).map(|u| span.at(u)).collect()
                }
            })
            .collect();
        let rows = (0..count).map(|row| columns.iter().map(|column| column[row].clone()).collect()).collect();
        Points::table(spans.iter().map(|span| span.key.clone()).collect(), rows)
    }
}

/// One number in each of `count` parts of [0, 1), in an order drawn by lot (Fisher & Yates).
fn latin(count: usize, lot: &mut SplitMix64) -> impl Iterator<Item = f64> {
    let mut parts: Vec<usize> = (0..count).collect();
    for k in (1..count).rev() {
        parts.swap(k, lot.below(k + 1));
    }
    parts.into_iter().map(move |part| (part as f64 + lot.share()) / count as f64)
}

/// A sequence for each key.
fn lot(seed: u64, key: usize) -> SplitMix64 {
    let own = SplitMix64::new(seed).bits();
    SplitMix64::new(own ^ (key as u64).wrapping_mul(0xd1b5_4a32_d192_ed03))
}
