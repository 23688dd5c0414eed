//! Eigenvalues and eigenvectors of a real matrix, each with its residual and with what round-off leaves open.
//!
//! The matrix is balanced (Parlett & Reinsch 1969) and turned to Hessenberg's form, in which all else is done. Zero eigenvalues are split
//! off before, where factors of the form do not rule them out, by the null spaces of the matrix and of what is left of it, one after the
//! other: rigid motions have a double zero with one vector, which plain iterations return as a pair of the size of the root of round-off.
//! The others come from QR sweeps, their vectors from inverse iteration: the form is factored anew for each eigenvalue at the cost of a
//! few products with a vector (Golub & Van Loan, "Matrix Computations", 4th ed. 2013, section 7.6.1), so that all of them cost as much as
//! the form itself, and not the size of the matrix times as much. What is said of them is computed with the balanced matrix.
//!
//! | file | content |
//! |---|---|
//! | `form.rs` | the orthogonal transformation to Hessenberg's form |
//! | `zeros.rs` | the form with the zero eigenvalues first |
//! | `values.rs` | QR sweeps |
//! | `shifted.rs`, `split.rs` | inverse iteration, and the sums over complex vectors that it consists of |

mod form;
mod shifted;
mod split;
mod values;
mod zeros;

use nalgebra::{Complex, DMatrix, DVector};

use shifted::Shifted;
use split::Split;
use values::eigenvalues;
use zeros::Parted;

/// A complex vector.
pub type ComplexVector = DVector<Complex<f64>>;

/// Multiples of round-off by which a singular value is zero, per row.
const NULL: f64 = 20.0;
/// The same for what an eigenvalue may be off by: matrices of states that were found by iteration are off by more than one unit.
const OPEN: f64 = 400.0;
/// Eigenvalues nearer than this share of the matrix's size are looked at together.
const CLOSE: f64 = 1e-7;

/// An eigenvalue that is not zero, with its vector.
#[derive(Debug, Clone)]
pub struct Pair {
    /// The eigenvalue; of a complex pair the one with the positive imaginary part.
    pub value: Complex<f64>,
    /// The vector, its largest entry real and one.
    pub vector: ComplexVector,
    /// The vector from the left, y with y^H A = lambda y^H, and y^H x = 1 with the other: an error E of the matrix moves the eigenvalue
    /// by y^H E x, first order.
    pub left: ComplexVector,
    /// |A v - lambda v|, as a share of |A| |v|, of the balanced matrix.
    pub residual: f64,
    /// By how much round-off in the matrix may have moved the eigenvalue: n eps |A| / |y^H x| with vectors from the left and right, first
    /// order; or as [`Pair::moved`] says.
    pub uncertainty: f64,
    /// How many eigenvalues are next to each other there, this one among them.
    together: usize,
    /// 1 / |y^H x| of vectors of unit length, and |A|, both of the balanced matrix.
    condition: f64,
    size: f64,
}

impl Pair {
    /// By how much an error of the matrix moves the eigenvalue that moves it so much to first order. Where m of them are equal and have
    /// fewer vectors, that is beyond all bounds, and they are moved by the m-th root of the error (critical damping; Wilkinson, The
    /// Algebraic Eigenvalue Problem, 1965, ch. 2).
    #[must_use]
    pub fn moved(&self, first_order: f64) -> f64 {
        if self.together < 2 {
            return first_order;
        }
        let error = first_order / self.condition / self.size;
        first_order.min(error.powf(1.0 / self.together as f64) * self.size)
    }
}

/// All eigenvalues.
#[derive(Debug, Clone)]
pub struct Spectrum {
    /// How many are zero to within round-off.
    pub zeros: usize,
    /// The vectors of those, as columns of unit length in the balanced coordinates: fewer than `zeros` where some drift.
    pub null: DMatrix<f64>,
    /// The others, ascending by magnitude; of conjugates the first only.
    pub pairs: Vec<Pair>,
}

/// The eigenvalues of a matrix. `None` where the iteration does not converge, or a number is not finite.
#[must_use]
pub fn spectrum(matrix: &DMatrix<f64>) -> Option<Spectrum> {
    let n = matrix.nrows();
    if matrix.iter().any(|value| !value.is_finite()) {
        return None;
    }
    if n == 0 {
        return Some(Spectrum { zeros: 0, null: DMatrix::zeros(0, 0), pairs: Vec::new() });
    }
    let (balanced, scales) = balance(matrix);
    let size = balanced.norm();
    let back = |mut vectors: DMatrix<f64>| {
        vectors.row_iter_mut().zip(scales.iter()).for_each(|(mut row, scale)| row *= *scale);
        vectors
    };
    if size == 0.0 {
        return Some(Spectrum { zeros: n, null: back(DMatrix::identity(n, n)), pairs: Vec::new() });
    }
    let limit = NULL * n as f64 * f64::EPSILON * size;
    let parted = Parted::of(&balanced, size, limit)?;
    let zeros = parted.zeros;
    let mut all = eigenvalues(parted.form.view_range(zeros.., zeros..).into_owned())?;
    all.sort_by(|a, b| a.norm().total_cmp(&b.norm()).then(a.im.total_cmp(&b.im)));
    let rows = parted.form.transpose();
    let start = Split::start(n);
    let mut shifted = Shifted::new(&rows, size);
    let mut found: Vec<(Complex<f64>, [Split; 2])> = Vec::new();
    for value in all.iter().copied().filter(|value| value.im >= 0.0) {
        let near = found.iter().filter(|(other, _)| (other - value).norm() <= CLOSE * size);
        let near: Vec<&Split> = near.map(|(_, [vector, _])| vector).collect();
        let shifted = shifted.at(value);
        let vector = shifted.vector(&start, &near)?;
        let left = shifted.left(&vector)?;
        found.push((value, [vector, left]));
    }
    let [vectors, lefts] = [0, 1].map(|side| parted.back(found.iter().map(|(_, sides)| &sides[side])));
    let moved = &balanced * &vectors;
    let mut pairs = Vec::with_capacity(found.len());
    for (k, (value, _)) in found.iter().enumerate() {
        let value = *value;
        let of = |columns: &DMatrix<f64>| columns.column(k).zip_map(&columns.column(found.len() + k), Complex::new);
        let (mut vector, mut left) = (of(&vectors), of(&lefts));
        let residual = (of(&moved) - &vector * value).norm() / size;
        let angle = left.dotc(&vector).norm();
        let condition = 1.0 / angle.max(f64::MIN_POSITIVE);
        let first_order = OPEN * n as f64 * f64::EPSILON * size * condition;
        vector.iter_mut().zip(scales.iter()).for_each(|(entry, scale)| *entry *= Complex::new(*scale, 0.0));
        let largest = vector.iter().copied().max_by(|a, b| a.norm().total_cmp(&b.norm())).filter(|v| v.norm() > 0.0)?;
        vector.iter_mut().for_each(|entry| *entry /= largest);
        left.iter_mut().zip(scales.iter()).for_each(|(entry, scale)| *entry /= Complex::new(*scale, 0.0));
        let product = left.dotc(&vector).conj();
        if product.norm() > f64::MIN_POSITIVE {
            left.iter_mut().for_each(|entry| *entry /= product);
        }
        let together = near_each_other(value, &all, n, size);
        let pair = Pair { value, vector, left, residual, uncertainty: 0.0, together, condition, size };
        pairs.push(Pair { uncertainty: pair.moved(first_order), ..pair });
    }
    Some(Spectrum { zeros, null: back(parted.null), pairs })
}

/// How many of `all` eigenvalues round-off may have parted from one, that one included.
fn near_each_other(value: Complex<f64>, all: &[Complex<f64>], n: usize, size: f64) -> usize {
    let mut distances: Vec<f64> = all.iter().map(|other| (other - value).norm()).collect();
    distances.sort_unstable_by(f64::total_cmp);
    let reach = |m: usize| (OPEN * n as f64 * f64::EPSILON).powf(1.0 / m as f64) * size;
    let near = |m: usize| distances.partition_point(|distance| *distance <= reach(m));
    (2..=all.len()).find(|m| near(*m) <= *m).map_or(1, near)
}

/// D^-1 A D with powers of two in D, so that rows and columns are of like sizes; and the diagonal of D.
fn balance(matrix: &DMatrix<f64>) -> (DMatrix<f64>, DVector<f64>) {
    let n = matrix.nrows();
    let (mut a, mut scales) = (matrix.clone(), DVector::from_element(n, 1.0));
    loop {
        let mut done = true;
        for k in 0..n {
            let others = |vector: f64, own: f64| (vector * vector - own * own).max(0.0).sqrt();
            let own = a[(k, k)];
            let (column, row) = (others(a.column(k).norm(), own), others(a.row(k).norm(), own));
            if column == 0.0 || row == 0.0 {
                continue;
            }
            let factor = (0.5 * (row / column).log2()).round().exp2();
            if column * factor + row / factor < 0.95 * (column + row) {
                done = false;
                scales[k] *= factor;
                a.column_mut(k).iter_mut().for_each(|entry| *entry *= factor);
                a.row_mut(k).iter_mut().for_each(|entry| *entry /= factor);
            }
        }
        if done {
            return (a, scales);
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests;
