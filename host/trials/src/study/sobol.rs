//! Points of Sobol' sequences.

/// Degree `s`, coefficients `a` of the primitive polynomial, first direction numbers `m`; from the second dimension on. In
/// the first, numbers are mirrored at the binary point (van der Corput).
///
/// S. Joe, F. Y. Kuo, Constructing Sobol sequences with better two-dimensional projections, SIAM J. Sci. Comput. 30 (2008),
/// 2635-2654; their set of search criterion D(6).
const DIRECTIONS: [(u32, u32, &[u32]); MOST_DIMENSIONS - 1] = [
    (1, 0, &[1]),
    (2, 1, &[1, 3]),
    (3, 1, &[1, 3, 1]),
    (3, 2, &[1, 1, 1]),
    (4, 1, &[1, 1, 3, 3]),
    (4, 4, &[1, 3, 5, 13]),
    (5, 2, &[1, 1, 5, 5, 17]),
    (5, 4, &[1, 1, 5, 5, 5]),
    (5, 7, &[1, 1, 7, 11, 19]),
    (5, 11, &[1, 1, 5, 1, 1]),
    (5, 13, &[1, 1, 1, 3, 11]),
    (5, 14, &[1, 3, 5, 5, 31]),
    (6, 1, &[1, 3, 3, 9, 7, 49]),
    (6, 13, &[1, 1, 1, 15, 21, 21]),
    (6, 16, &[1, 3, 1, 13, 27, 49]),
    (6, 19, &[1, 1, 1, 15, 7, 5]),
    (6, 22, &[1, 3, 1, 15, 13, 25]),
    (6, 25, &[1, 1, 5, 5, 19, 61]),
    (7, 1, &[1, 3, 7, 11, 23, 15, 103]),
    (7, 4, &[1, 3, 7, 13, 13, 15, 69]),
];

/// Keys that points of a Sobol' sequence can have.
pub(super) const MOST_DIMENSIONS: usize = 21;
const BITS: u32 = 32;

/// The directions of a dimension, from zero on, as fractions of 2^32.
fn directions(dimension: usize) -> [u32; BITS as usize] {
    let mut v = [0; BITS as usize];
    let Some(last) = dimension.checked_sub(1) else {
        return std::array::from_fn(|k| 1 << (31 - k));
    };
    let (s, a, m) = DIRECTIONS[last];
    let s = s as usize;
    for k in 0..v.len() {
        v[k] = if k < s {
            m[k] << (31 - k)
        } else {
            let first = v[k - s] ^ (v[k - s] >> s);
            (1..s).filter(|j| a >> (s - 1 - j) & 1 == 1).fold(first, |all, j| all ^ v[k - j])
        };
    }
    v
}

/// Coordinates of the first `count` points in one dimension, in [0, 1), in the order of Gray codes (I. A. Antonov, V. M. Saleev
/// 1979); all bits that `shift` has are turned over.
pub(super) fn coordinates(dimension: usize, count: usize, shift: u32) -> impl Iterator<Item = f64> {
    let v = directions(dimension);
    let gray = |k: usize| k ^ (k >> 1);
    let point =
        move |k: usize| (0..BITS).filter(|bit| gray(k) >> bit & 1 == 1).fold(shift, |x, bit| x ^ v[bit as usize]);
    (0..count).map(move |k| f64::from(point(k)) / f64::from(BITS).exp2())
}
