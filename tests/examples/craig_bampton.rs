//! Writes the file of a `modal-body`: a straight beam of Euler and Bernoulli, by finite elements, reduced to its two ends and a number
//! of modes between them (Craig & Bampton, AIAA Journal 6, 1968).
//!
//! ```text
//! cargo run -p odyn-tests --example craig_bampton > beam.csv
//! cargo run -p odyn-tests --example craig_bampton geometric > stiffening.csv
//! ```
//!
//! The beam lies along x; degrees of freedom of a node are displacements x, y, z, rotations x, y, z. Elements: cubic across, linear along and
//! in torsion, consistent masses (Przemieniecki, Theory of Matrix Structural Analysis, 1968, sections 5.6 and 11.4), without the rotary inertia
//! of sections across. Any finite element program that reduces a structure does as well.

use nalgebra::{Cholesky, DMatrix};

/// A uniform beam, SI.
pub struct Beam {
    /// Length.
    pub length: f64,
    /// Young's modulus.
    pub young: f64,
    /// Shear modulus.
    pub shear: f64,
    /// Density.
    pub density: f64,
    /// Area of the section.
    pub area: f64,
    /// Second moment of area for bending along z.
    pub iy: f64,
    /// The same along y.
    pub iz: f64,
    /// Torsion constant.
    pub torsion: f64,
    /// Number of finite elements.
    pub elements: usize,
}

/// The beam of the verification scenes: aluminium, 1 m, 20 mm (along y) by 10 mm.
pub const BEAM: Beam = Beam {
    length: 1.0,
    young: 7e10,
    shear: 2.6e10,
    density: 2700.0,
    area: 2e-4,
    iy: 20e-3 * 1e-6 / 12.0,
    iz: 10e-3 * 8e-6 / 12.0,
    torsion: 4.58e-9,
    elements: 20,
};

/// Modes between the ends that are kept.
pub const MODES: usize = 8;

/// Mass and stiffness.
type Matrices = (DMatrix<f64>, DMatrix<f64>);

impl Beam {
    /// Of the whole structure.
    fn assemble(&self) -> Matrices {
        let n = 6 * (self.elements + 1);
        let l = self.length / self.elements as f64;
        let line = self.density * self.area;
        let (mut mass, mut stiffness) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
        for element in 0..self.elements {
            let at = 6 * element;
            // Along and in torsion: the same two shapes.
            for (dof, inertia, rigidity) in
                [(0, line, self.young * self.area), (3, self.density * (self.iy + self.iz), self.shear * self.torsion)]
            {
                for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    let (row, column) = (at + dof + 6 * i, at + dof + 6 * j);
                    mass[(row, column)] += inertia * l / 6.0 * if i == j { 2.0 } else { 1.0 };
                    stiffness[(row, column)] += rigidity / l * if i == j { 1.0 } else { -1.0 };
                }
            }
            // Across: along y a rotation about z is the slope, along z one about y its opposite.
            for (dofs, sign, second) in [([1, 5], 1.0, self.iz), ([2, 4], -1.0, self.iy)] {
                let places = [at + dofs[0], at + dofs[1], at + 6 + dofs[0], at + 6 + dofs[1]];
                let lengths = [1.0, sign * l, 1.0, sign * l];
                let bent =
                    [[12.0, 6.0, -12.0, 6.0], [6.0, 4.0, -6.0, 2.0], [-12.0, -6.0, 12.0, -6.0], [6.0, 2.0, -6.0, 4.0]];
                let carried = [
                    [156.0, 22.0, 54.0, -13.0],
                    [22.0, 4.0, 13.0, -3.0],
                    [54.0, 13.0, 156.0, -22.0],
                    [-13.0, -3.0, -22.0, 4.0],
                ];
                for (i, j) in (0..16).map(|k| (k / 4, k % 4)) {
                    let units = lengths[i] * lengths[j];
                    stiffness[(places[i], places[j])] += self.young * second / l.powi(3) * bent[i][j] * units;
                    mass[(places[i], places[j])] += line * l / 420.0 * carried[i][j] * units;
                }
            }
        }
        (mass, stiffness)
    }

    /// Geometric stiffness with an axial force over the place along the beam.
    fn geometric(&self, force: impl Fn(f64) -> f64) -> DMatrix<f64> {
        // Quadrature of Gauss, exact up to the seventh power.
        const POINTS: [(f64, f64); 4] = [
            (-0.861_136_311_594_052_6, 0.347_854_845_137_453_86),
            (-0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
            (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
            (0.861_136_311_594_052_6, 0.347_854_845_137_453_86),
        ];
        let n = 6 * (self.elements + 1);
        let l = self.length / self.elements as f64;
        let mut matrix = DMatrix::zeros(n, n);
        for (element, (point, weight)) in (0..self.elements).flat_map(|element| POINTS.map(|point| (element, point))) {
            let s = 0.5 * (1.0 + point);
            let size = force(l * (element as f64 + s)) * 0.5 * l * weight;
            for (dofs, sign) in [([1, 5], 1.0), ([2, 4], -1.0)] {
                let at = 6 * element;
                let places = [at + dofs[0], at + dofs[1], at + 6 + dofs[0], at + 6 + dofs[1]];
                let bend = 6.0 * s * (s - 1.0) / l;
                let slopes = [bend, sign * (1.0 - 4.0 * s + 3.0 * s * s), -bend, sign * (3.0 * s * s - 2.0 * s)];
                for (i, j) in (0..16).map(|k| (k / 4, k % 4)) {
                    matrix[(places[i], places[j])] += size * slopes[i] * slopes[j];
                }
            }
        }
        matrix
    }

    /// Of the two ends and the lowest modes between them.
    pub fn reduce(&self, modes: usize) -> Matrices {
        let [mass, stiffness, ..] = self.reduce_all(modes);
        (mass, stiffness)
    }

    /// Mass, stiffness, and the geometric stiffness that mass forces along the beam cause: of 1 m/s^2, and in a rotation of 1 rad/s across it
    /// through the first end.
    pub fn reduce_all(&self, modes: usize) -> [DMatrix<f64>; 4] {
        let (mass, stiffness) = self.assemble();
        let line = self.density * self.area;
        let uniform = self.geometric(|x| line * (self.length - x));
        let turning = self.geometric(|x| 0.5 * line * (self.length.powi(2) - x * x));
        let n = mass.nrows();
        let ends: Vec<usize> = (0..6).chain(n - 6..n).collect();
        let within: Vec<usize> = (6..n - 6).collect();
        let part = |matrix: &DMatrix<f64>, rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |i, j| matrix[(rows[i], columns[j])])
        };
        let own = Cholesky::new(part(&stiffness, &within, &within)).expect("the ends hold the beam");
        let carried = own.solve(&part(&stiffness, &within, &ends));
        // K x = w2 M x as C^-1 M C^-T y = y / w2, with K = C C^T: the lowest modes are the largest there.
        let c = own.l();
        let half = c.solve_lower_triangular(&part(&mass, &within, &within)).expect("regular");
        let whole = c.solve_lower_triangular(&half.transpose()).expect("regular");
        let eigen = (0.5 * (&whole + whole.transpose())).symmetric_eigen();
        let mut order: Vec<usize> = (0..within.len()).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let mut shapes = DMatrix::zeros(n, 12 + modes);
        for (k, end) in ends.iter().enumerate() {
            shapes[(*end, k)] = 1.0;
            within.iter().enumerate().for_each(|(row, dof)| shapes[(*dof, k)] = -carried[(row, k)]);
        }
        for (k, of) in order.into_iter().take(modes).enumerate() {
            let shape = c.tr_solve_lower_triangular(&eigen.eigenvectors.column(of).into_owned()).expect("regular");
            // Of unit modal mass, the largest entry positive.
            let size = eigen.eigenvalues[of].sqrt() * shape[shape.iamax()].signum();
            within.iter().enumerate().for_each(|(row, dof)| shapes[(*dof, 12 + k)] = shape[row] / size);
        }
        [mass, stiffness, uniform, turning].map(|matrix| shapes.tr_mul(&(matrix * &shapes)))
    }
}

/// The lines of the file.
pub fn lines(beam: &Beam, modes: usize) -> String {
    let (mass, stiffness) = beam.reduce(modes);
    let mut text = format!(
        "# Beam of {} m along x, two ends and {modes} modes; written by the example craig_bampton of the sources. SI.\nrow,column,mass,stiffness\n",
        beam.length
    );
    let entry = |matrix: &DMatrix<f64>, row: usize, column: usize| {
        let size = (matrix[(row, row)] * matrix[(column, column)]).abs().sqrt();
        let value = matrix[(row, column)];
        if value.abs() <= 1e-9 * size { 0.0 } else { value }
    };
    for (row, column) in (0..mass.nrows()).flat_map(|row| (0..=row).map(move |column| (row, column))) {
        let (m, k) = (entry(&mass, row, column), entry(&stiffness, row, column));
        if m != 0.0 || k != 0.0 {
            text += &format!("{},{},{m:.12e},{k:.12e}\n", row + 1, column + 1);
        }
    }
    text
}

/// The lines of the file of geometric stiffness.
pub fn geometric_lines(beam: &Beam, modes: usize) -> String {
    let [_, _, uniform, turning] = beam.reduce_all(modes);
    let mut text = String::from("row,column,x,y,z,xx,yy,zz,xy,yz,zx\n");
    for (row, column) in (0..uniform.nrows()).flat_map(|row| (0..=row).map(move |column| (row, column))) {
        let (x, turn) = (uniform[(row, column)], turning[(row, column)]);
        if x != 0.0 || turn != 0.0 {
            text += &format!("{},{},{x:.12e},0,0,0,{turn:.12e},{turn:.12e},0,0,0\n", row + 1, column + 1);
        }
    }
    text
}

/// The lowest motion along y with the first end clamped and a rigid body of a mass and moment of inertia at the other: omega, and
/// rotation about z and amplitudes of the modes where the end has moved by one.
pub fn lowest(beam: &Beam, modes: usize, tip: (f64, f64)) -> (f64, f64, Vec<f64>) {
    let (mass, stiffness) = beam.reduce(modes);
    let free: Vec<usize> = [7, 11].into_iter().chain(12..12 + modes).collect();
    let mut m = DMatrix::from_fn(free.len(), free.len(), |i, j| mass[(free[i], free[j])]);
    let k = DMatrix::from_fn(free.len(), free.len(), |i, j| stiffness[(free[i], free[j])]);
    m[(0, 0)] += tip.0;
    m[(1, 1)] += tip.1;
    let c = Cholesky::new(k).expect("clamped").l();
    let half = c.solve_lower_triangular(&m).expect("regular");
    let whole = c.solve_lower_triangular(&half.transpose()).expect("regular");
    let eigen = (0.5 * (&whole + whole.transpose())).symmetric_eigen();
    let place = eigen.eigenvalues.imax();
    let shape = c.tr_solve_lower_triangular(&eigen.eigenvectors.column(place).into_owned()).expect("regular");
    let shape = &shape / shape[0];
    (eigen.eigenvalues[place].sqrt().recip(), shape[1], shape.iter().skip(2).copied().collect())
}

fn main() {
    if std::env::args().nth(1).as_deref() == Some("geometric") {
        return print!("{}", geometric_lines(&BEAM, MODES));
    }
    let (omega, turn, amplitudes) = lowest(&BEAM, MODES, (0.054, 1e-4));
    print!("{}", lines(&BEAM, MODES));
    println!(
        "# Clamped, with 0.054 kg and 1e-4 kg m2 at the other end, the lowest motion along y has omega = {omega:.9} rad/s;"
    );
    println!("# for a tip that has moved by 1 m: rotation {turn:.12}, amplitudes {amplitudes:?}");
}
