//! [`Balance`]: what is left of the equations of motion with accelerations and multipliers put in.

use super::constraints::Constraints;

/// The body whose equations of motion are met worst, and by how much.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Imbalance {
    /// What is left of the forces on the body, or of the torques, over the sum of the magnitudes of its own.
    pub share: f64,
    /// Number of the body.
    pub body: usize,
}

impl Imbalance {
    /// Whether it tells more of a run than another; not-a-number tells most.
    fn exceeds(&self, other: &Self) -> bool {
        !other.share.is_nan() && (self.share.is_nan() || self.share > other.share)
    }
}

/// `b - K x` of `[M Phi_q^T; Phi_q 0] [a; lambda] = [Q; gamma]`, and what each entry is made of.
pub(super) struct Balance {
    /// Values of the mass matrix, aligned with the pattern.
    mass: Vec<f64>,
    velocities: usize,
    left: Vec<f64>,
    sizes: Vec<f64>,
}

impl Balance {
    /// For a mass matrix and up to a number of rows.
    pub(super) fn new(mass: Vec<f64>, velocities: usize, rows: usize) -> Self {
        Self { mass, velocities, left: vec![0.0; velocities + rows], sizes: vec![0.0; velocities + rows] }
    }

    /// Puts the solution in; function 0 of `dynamics` is gamma.
    pub(super) fn take(&mut self, dynamics: &Constraints, loads: &[f64], a: &[f64], lambda: &[f64]) {
        let size = a.len() + lambda.len();
        let out = [&mut self.left[..size], &mut self.sizes[..size]];
        let values = (&self.mass[..], dynamics.jacobian());
        dynamics.structure.residual(values, (loads, dynamics.function(0)), (a, lambda), out);
    }

    /// The same for Newton's and Euler's equations only, enough for [`Balance::of_bodies`].
    pub(super) fn take_motion(&mut self, dynamics: &Constraints, loads: &[f64], a: &[f64], lambda: &[f64]) {
        let out = [&mut self.left[..a.len()], &mut self.sizes[..a.len()]];
        let values = (&self.mass[..], dynamics.jacobian());
        dynamics.structure.residual_of_motion(values, loads, (a, lambda), out);
    }

    /// What is left: of Newton's and Euler's equations, then of the constraints on accelerations.
    pub(super) fn left(&self, rows: usize) -> (&[f64], &[f64]) {
        self.left[..self.velocities + rows].split_at(self.velocities)
    }

    /// The largest of all entries as a share of what the largest of its kind is made of: of forces, torques and constraints.
    pub(super) fn of_all(&self) -> f64 {
        let mut largest = [[0.0_f64; 2]; 3];
        for (k, (left, size)) in self.left.iter().zip(&self.sizes).enumerate() {
            let kind = if k < self.velocities { k % 6 / 3 } else { 2 };
            let [most, whole] = &mut largest[kind];
            *most = if left.is_finite() { most.max(left.abs()) } else { f64::INFINITY };
            *whole = whole.max(*size);
        }
        largest.iter().fold(0.0, |worst, [most, whole]| if *most > 0.0 { worst.max(most / whole) } else { worst })
    }

    /// The worst body, each beside its own loads: a light one counts as much as a heavy one.
    pub(super) fn of_bodies(&self) -> Imbalance {
        let mut worst = Imbalance::default();
        let groups = self.left[..self.velocities].chunks_exact(3).zip(self.sizes.chunks_exact(3));
        for (k, (left, sizes)) in groups.enumerate() {
            let most = left.iter().fold(0.0_f64, |most, x| if x.is_nan() { f64::INFINITY } else { most.max(x.abs()) });
            let size = sizes.iter().fold(0.0_f64, |most, x| most.max(*x));
            let share = if most == 0.0 { 0.0 } else { most / size };
            let found = Imbalance { share, body: k / 2 };
            if found.exceeds(&worst) {
                worst = found;
            }
        }
        worst
    }
}
