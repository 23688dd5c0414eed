//! Matrices of a superelement as they are given, checked.

use element_api::prelude::*;

/// Share of what it may be made of by which a force of rigid motion may miss zero, and a mass of all directions be another one.
const ROUND_OFF: f64 = 1e-6;

/// A symmetric matrix: each entry of the lower triangle that is not zero.
#[derive(Debug, Clone, Default)]
pub struct Symmetric {
    n: usize,
    entries: Vec<(usize, usize, f64)>,
}

impl Symmetric {
    /// Matrix times numbers.
    pub fn product<S: Scalar>(&self, x: &[S]) -> Vec<S> {
        let mut y = vec![S::zero(); self.n];
        for (row, column, value) in &self.entries {
            y[*row] += x[*column] * *value;
            if row != column {
                y[*column] += x[*row] * *value;
            }
        }
        y
    }

    /// x . M x
    pub fn form<S: Scalar>(&self, x: &[S]) -> S {
        let mut sum = S::zero();
        for (row, column, value) in &self.entries {
            sum += x[*row] * x[*column] * if row == column { *value } else { 2.0 * *value };
        }
        sum
    }

    /// What the products of the magnitudes of `x` may add up to: an entry of a positive matrix counts as no less than its two diagonals
    /// let it be, since one that is zero but for round-off of a reduction says nothing of itself.
    fn sizes(&self, x: &[f64]) -> Vec<f64> {
        let mut diagonal = vec![0.0_f64; self.n];
        self.entries.iter().filter(|(i, j, _)| i == j).for_each(|(i, _, value)| diagonal[*i] = value.abs().sqrt());
        let size = |(i, j, value): &(usize, usize, f64)| (*i, *j, value.abs().max(diagonal[*i] * diagonal[*j]));
        let entries = self.entries.iter().map(size).collect();
        Self { n: self.n, entries }.product(&x.iter().map(|x| x.abs()).collect::<Vec<f64>>())
    }

    /// Whether x . M x is negative for some x that is zero before `from`, by elimination.
    fn is_negative(&self, from: usize) -> bool {
        let n = self.n - from;
        let mut m = vec![vec![0.0; n]; n];
        for (row, column, value) in self.entries.iter().filter(|(_, column, _)| *column >= from) {
            (m[row - from][column - from], m[column - from][row - from]) = (*value, *value);
        }
        let scale: Vec<f64> = (0..n).map(|k| m[k][k].abs()).collect();
        for k in 0..n {
            let vanishes = m[k][k].abs() <= ROUND_OFF * scale[k];
            if !vanishes && m[k][k] < 0.0 {
                return true;
            }
            let pivot = m[k].clone();
            for row in k + 1..n {
                if vanishes {
                    if pivot[row].powi(2) > ROUND_OFF * scale[row] * scale[k] {
                        return true;
                    }
                    continue;
                }
                let factor = pivot[row] / pivot[k];
                m[row].iter_mut().zip(&pivot).skip(k + 1).for_each(|(entry, pivot)| *entry -= factor * pivot);
            }
        }
        false
    }
}

/// What lines of the structure shorten by as they bend, as far as the motion of frame 0 and weight feel it.
#[derive(Debug, Clone)]
pub struct Stiffening {
    /// Geometric stiffness per acceleration along x, y, z.
    pub by_acceleration: [Symmetric; 3],
    /// Per product of angular velocities: [`PRODUCTS`].
    pub by_spin: [Symmetric; 6],
}

/// The axes of each product of angular velocities.
pub const PRODUCTS: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [0, 1], [1, 2], [2, 0]];

/// The matrices, and what follows from them.
#[derive(Debug, Clone)]
pub struct Data {
    /// The interfaces where nothing is deformed, m.
    pub points: Vec<[f64; 3]>,
    /// Largest distance of one from the first, m; 1 where there is none.
    pub size: f64,
    /// Of all degrees of freedom.
    pub mass: Symmetric,
    /// The same.
    pub stiffness: Symmetric,
    /// kg.
    pub mass_of_all: f64,
    /// Its centre against the first interface, m.
    pub centre: [f64; 3],
    /// Momentum along x, y, z for a unit velocity of each degree of freedom; zero for the six of the first frame.
    pub carried: Vec<[f64; 3]>,
    /// Where it is given.
    pub stiffening: Option<Stiffening>,
}

impl Data {
    /// From the numbers of a scene.
    pub fn new(numbers: &[f64], points: &[f64]) -> Result<Self, ParamError> {
        let wrong = |message: String| Err(ParamError::new("matrices", message));
        if points.is_empty() || !points.len().is_multiple_of(3) {
            return Err(ParamError::new(
                "points",
                format!("needs three numbers per interface, found {}", points.len()),
            ));
        }
        let points: Vec<[f64; 3]> = points.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
        if !numbers.len().is_multiple_of(4) {
            return wrong(format!(
                "needs row, column, mass, stiffness of each entry; {} numbers are not that",
                numbers.len()
            ));
        }
        let last = numbers.chunks_exact(4).map(|entry| entry[0].max(entry[1])).fold(0.0, f64::max) as usize;
        // What comes last may have no entries.
        let n = last.max(6 * points.len());
        let (mut mass, mut stiffness) =
            (Symmetric { n, ..Symmetric::default() }, Symmetric { n, ..Symmetric::default() });
        let mut seen = Vec::with_capacity(numbers.len() / 4);
        for entry in numbers.chunks_exact(4) {
            if entry[..2].iter().any(|k| k.fract() != 0.0 || *k < 1.0) {
                return wrong(format!("row and column are whole numbers from 1, found {} and {}", entry[0], entry[1]));
            }
            let (row, column) = (entry[0].max(entry[1]) as usize, entry[0].min(entry[1]) as usize);
            seen.push((row, column));
            for (matrix, value) in [(&mut mass, entry[2]), (&mut stiffness, entry[3])] {
                if value != 0.0 {
                    matrix.entries.push((row - 1, column - 1, value));
                }
            }
        }
        seen.sort_unstable();
        if let Some(pair) = seen.windows(2).find(|pair| pair[0] == pair[1]) {
            return wrong(format!("has the entry {}, {} twice: give one triangle", pair[0].0, pair[0].1));
        }
        let mut data = Self {
            size: 1.0,
            mass_of_all: 0.0,
            centre: [0.0; 3],
            carried: Vec::new(),
            points,
            mass,
            stiffness,
            stiffening: None,
        };
        let far = (0..data.points.len()).map(|i| data.offset(i).iter().map(|x| x * x).sum::<f64>().sqrt());
        data.size = Some(far.fold(0.0, f64::max)).filter(|size| *size > 0.0).unwrap_or(1.0);
        data.weigh()?;
        Ok(data)
    }

    /// Takes geometric stiffness: row, column, nine values of each entry.
    pub fn stiffen(&mut self, numbers: &[f64]) -> Result<(), ParamError> {
        let wrong = |message: String| Err(ParamError::new("geometric", message));
        if !numbers.len().is_multiple_of(11) {
            let count = numbers.len();
            return wrong(format!("needs row, column and nine values of each entry; {count} numbers are not that"));
        }
        let n = self.mass.n;
        let mut matrices: [Symmetric; 9] = std::array::from_fn(|_| Symmetric { n, ..Symmetric::default() });
        let mut seen = Vec::with_capacity(numbers.len() / 11);
        for entry in numbers.chunks_exact(11) {
            if entry[..2].iter().any(|k| k.fract() != 0.0 || *k < 1.0 || *k > n as f64) {
                return wrong(format!(
                    "row and column are whole numbers from 1 to {n}, found {} and {}",
                    entry[0], entry[1]
                ));
            }
            let (row, column) = (entry[0].max(entry[1]) as usize, entry[0].min(entry[1]) as usize);
            seen.push((row, column));
            // Frame 0 carries the axes of the deformation, which is zero there.
            for (matrix, value) in
                matrices.iter_mut().zip(&entry[2..]).filter(|(_, value)| column > 6 && **value != 0.0)
            {
                matrix.entries.push((row - 1, column - 1, *value));
            }
        }
        seen.sort_unstable();
        if let Some(pair) = seen.windows(2).find(|pair| pair[0] == pair[1]) {
            return wrong(format!("has the entry {}, {} twice: give one triangle", pair[0].0, pair[0].1));
        }
        let [x, y, z, xx, yy, zz, xy, yz, zx] = matrices;
        self.stiffening = Some(Stiffening { by_acceleration: [x, y, z], by_spin: [xx, yy, zz, xy, yz, zx] });
        Ok(())
    }

    /// From the first interface to another one.
    pub fn offset(&self, i: usize) -> [f64; 3] {
        std::array::from_fn(|k| self.points[i][k] - self.points[0][k])
    }

    /// Number of modes.
    pub fn modes(&self) -> usize {
        self.mass.n - 6 * self.points.len()
    }

    /// The motion of all degrees of freedom with a rigid one: along x, y, z, then about them through the first interface.
    fn rigid(&self, k: usize) -> Vec<f64> {
        let mut motion = vec![0.0; self.mass.n];
        for i in 0..self.points.len() {
            if k < 3 {
                motion[6 * i + k] = 1.0;
                continue;
            }
            let (a, b, c, x) = (k - 3, (k - 2) % 3, (k - 1) % 3, self.offset(i));
            motion[6 * i + 3 + a] = 1.0;
            // e_a x X.
            motion[6 * i + b] = -x[c];
            motion[6 * i + c] = x[b];
        }
        motion
    }

    /// Mass, its centre, and that rigid motions meet no stiffness.
    fn weigh(&mut self) -> Result<(), ParamError> {
        let wrong = |message: String| Err(ParamError::new("matrices", message));
        for k in 0..6 {
            let motion = self.rigid(k);
            let (force, size) = (self.stiffness.product(&motion), self.stiffness.sizes(&motion));
            let largest = size[..6 * self.points.len()].iter().copied().fold(0.0, f64::max);
            let off = force.iter().zip(&size).position(|(f, s)| f.abs() > ROUND_OFF * s.max(ROUND_OFF * largest));
            if let Some(row) = off {
                let motion = ["along x", "along y", "along z", "about x", "about y", "about z"][k];
                return wrong(format!(
                    "the stiffness resists a rigid motion {motion} in row {}: check `points`, the order of degrees of freedom, and that the \
                     structure is free",
                    row + 1
                ));
            }
        }
        if self.stiffness.is_negative(6) {
            return wrong("the stiffness gives negative energy for some deformation".into());
        }
        let carried: Vec<Vec<f64>> = (0..3).map(|k| self.mass.product(&self.rigid(k))).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mass = dot(&carried[0], &self.rigid(0));
        for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
            let expected = if i == j { mass } else { 0.0 };
            let found = dot(&carried[i], &self.rigid(j));
            if mass.is_nan() || mass <= 0.0 || (found - expected).abs() > ROUND_OFF * mass {
                return wrong(format!(
                    "the mass of a rigid body is the same in all directions: entry {}, {} of it is {found}, expected {expected}",
                    i + 1,
                    j + 1
                ));
            }
        }
        self.mass_of_all = mass;
        // Momentum of a turn about k is m e_k x c.
        for k in 0..3 {
            let (b, c) = ((k + 1) % 3, (k + 2) % 3);
            self.centre[b] = dot(&carried[c], &self.rigid(3 + k)) / mass;
        }
        self.carried = (0..self.mass.n)
            .map(|row| if row < 6 { [0.0; 3] } else { [carried[0][row], carried[1][row], carried[2][row]] })
            .collect();
        Ok(())
    }
}
