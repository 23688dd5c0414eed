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
//! | `equal.rs` | several equal ones with fewer vectors |
//! | `shifted.rs`, `split.rs` | inverse iteration, and the sums over complex vectors that it consists of |

mod equal;
mod form;
mod shifted;
mod split;
mod values;
mod zeros;

use nalgebra::{Complex, DMatrix, DVector};

use equal::Equal;
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
/// Jordan's blocks that are looked for, at most so large.
const LARGEST_BLOCK: usize = 4;
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
    /// How many eigenvalues, this one among them, have one vector in common there: as many as are next to each other, unless it is known
    /// that they are fewer.
    block: usize,
    /// 1 / |y^H x| of vectors of unit length, and |A|, both of the balanced matrix.
    condition: f64,
    size: f64,
}

impl Pair {
    /// By how much an error of the matrix moves the eigenvalue that moves it so much to first order. Where m of them are equal and have
    /// one vector, that is beyond all bounds, and they are moved by the m-th root of the error (critical damping; Wilkinson, The
    /// Algebraic Eigenvalue Problem, 1965, ch. 2).
    #[must_use]
    pub fn moved(&self, first_order: f64) -> f64 {
        if self.block < 2 {
            return first_order;
        }
        let error = first_order / self.condition / self.size;
        first_order.min(error.powf(1.0 / self.block as f64) * self.size)
    }

    /// By how much round-off in the matrix moves the eigenvalue to first order.
    fn first_order(&self) -> f64 {
        OPEN * self.vector.len() as f64 * f64::EPSILON * self.size * self.condition
    }

    /// Of vectors of unit length from the right and from the left of a balanced matrix of a size, and what it makes of that from the right.
    fn of(
        value: Complex<f64>,
        block: usize,
        [vector, left]: [ComplexVector; 2],
        moved: &ComplexVector,
        size: f64,
    ) -> Self {
        let residual = (moved - &vector * value).norm() / size;
        let condition = 1.0 / left.dotc(&vector).norm().max(f64::MIN_POSITIVE);
        let pair = Self { value, vector, left, residual, uncertainty: 0.0, block, condition, size };
        Self { uncertainty: pair.moved(pair.first_order()), ..pair }
    }

    /// Takes vectors of a balanced matrix to those of the matrix itself. `None` without an entry.
    fn scale(&mut self, scales: &DVector<f64>) -> Option<()> {
        let (vector, left) = (&mut self.vector, &mut self.left);
        vector.iter_mut().zip(scales.iter()).for_each(|(entry, scale)| *entry *= Complex::new(*scale, 0.0));
        let largest = vector.iter().copied().max_by(|a, b| a.norm().total_cmp(&b.norm())).filter(|v| v.norm() > 0.0)?;
        vector.iter_mut().for_each(|entry| *entry /= largest);
        left.iter_mut().zip(scales.iter()).for_each(|(entry, scale)| *entry /= Complex::new(*scale, 0.0));
        let product = left.dotc(vector).conj();
        if product.norm() > f64::MIN_POSITIVE {
            left.iter_mut().for_each(|entry| *entry /= product);
        }
        Some(())
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
    let mut found: Vec<(usize, [Split; 2])> = Vec::new();
    for (number, value) in all.iter().copied().enumerate().filter(|(_, value)| value.im >= 0.0) {
        let near = found.iter().filter(|(other, _)| (all[*other] - value).norm() <= CLOSE * size);
        let near: Vec<&Split> = near.map(|(_, [vector, _])| vector).collect();
        let shifted = shifted.at(value);
        let vector = shifted.vector(&start, &near)?;
        let left = shifted.left(&vector)?;
        found.push((number, [vector, left]));
    }
    let [vectors, lefts] = [0, 1].map(|side| parted.back(found.iter().map(|(_, sides)| &sides[side])));
    let moved = &balanced * &vectors;
    let single = found.iter().enumerate().map(|(k, (number, _))| {
        let of = |columns: &DMatrix<f64>| columns.column(k).zip_map(&columns.column(found.len() + k), Complex::new);
        let block = near_each_other(*number, &all, n, size);
        Pair::of(all[*number], block, [of(&vectors), of(&lefts)], &of(&moved), size)
    });
    let single: Vec<Pair> = single.collect();
    let mut groups = Groups { all: &all, matrix: &balanced, size, found: Vec::new(), tried: Vec::new() };
    for ((number, _), pair) in found.iter().zip(&single) {
        if pair.block > 2 && pair.first_order() > reach(2, n, size) {
            groups.look_at(*number);
        }
    }
    let mut pairs = Vec::with_capacity(found.len());
    let mut told = vec![false; groups.found.len()];
    for ((number, _), pair) in found.iter().zip(single) {
        let Some(group) = groups.found.iter().position(|group| group.members.contains(number)) else {
            pairs.push(pair);
            continue;
        };
        // All of them at once, since those that are below the real axis are real together with the others.
        if !std::mem::replace(&mut told[group], true) {
            pairs.extend(groups.found[group].pairs(&balanced, size));
        }
    }
    for pair in &mut pairs {
        pair.scale(&scales)?;
    }
    Some(Spectrum { zeros, null: back(parted.null), pairs })
}

/// What round-off parts m eigenvalues with one vector by, at most.
fn reach(m: usize, n: usize, size: f64) -> f64 {
    (OPEN * n as f64 * f64::EPSILON).powf(1.0 / m as f64) * size
}

/// How many of `all` eigenvalues round-off may have parted from one, that one included, if they have one vector.
fn near_each_other(number: usize, all: &[Complex<f64>], n: usize, size: f64) -> usize {
    let mut distances: Vec<f64> = all.iter().map(|other| (other - all[number]).norm()).collect();
    distances.sort_unstable_by(f64::total_cmp);
    let near = |m: usize| distances.partition_point(|distance| *distance <= reach(m, n, size));
    (2..=all.len()).find(|m| near(*m) <= *m).map_or(1, near)
}

/// Eigenvalues of a balanced matrix that are equal, more of them than have one vector in common.
struct Groups<'a> {
    all: &'a [Complex<f64>],
    matrix: &'a DMatrix<f64>,
    size: f64,
    found: Vec<Equal>,
    /// What may have been parted as blocks of a size, and is not equal.
    tried: Vec<(usize, Vec<usize>)>,
}

impl Groups<'_> {
    /// Looks for those that are equal to this one.
    fn look_at(&mut self, number: usize) {
        if self.found.iter().any(|group| group.members.contains(&number)) {
            return;
        }
        let n = self.matrix.nrows();
        for block in 2..=LARGEST_BLOCK {
            let near = |other: &usize| (self.all[*other] - self.all[number]).norm() <= reach(block, n, self.size);
            let members: Vec<usize> = (0..self.all.len()).filter(near).collect();
            let known = self.tried.iter().any(|(size, members)| *size == block && members.contains(&number));
            if members.len() <= block || known {
                continue;
            }
            let limit = reach(1, n, self.size);
            match Equal::of(self.matrix, self.all, &members, (self.size, limit)).filter(|found| found.block <= block) {
                Some(found) => return self.found.push(found),
                None => self.tried.push((block, members)),
            }
        }
    }
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
