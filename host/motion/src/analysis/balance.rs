//! [`Balance`]: what is left of the equations of motion with accelerations and multipliers put in.

use super::constraints::Constraints;
use super::formulation::AnalysisError;
use crate::linalg::KktStructure;
use crate::program::OF_TERMS;

/// Share of what they are made of by which the equations at the end of a step may be missed by what a remedy gives there.
const CERTIFIED: f64 = 1e-7;
/// Torques below this share of forces times the length of the scene are none, and the other way round: what a solver leaves of
/// them is the round-off of the others.
const COUNTED: f64 = 1e-6;
/// Loads of a body below this share of the largest in the scene are the round-off of its velocities, squared, and nothing has to balance
/// in them. Bodies that are eighteen decades lighter than others have larger ones.
const NOTHING: f64 = 1e-24;
/// Share of forces, and of torques, by which a rank-safe solution may miss the equations of motion.
const SOLVED: f64 = 1e-8;

/// The body whose equations of motion are met worst, and by how much.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Imbalance {
    /// What is left of the forces on the body, or of the torques, over the sum of the magnitudes of its own.
    pub share: f64,
    /// Number of the body.
    pub body: usize,
}

impl Imbalance {
    /// Whether it says more of a run than another; not-a-number says most.
    fn exceeds(&self, other: &Self) -> bool {
        !other.share.is_nan() && (self.share.is_nan() || self.share > other.share)
    }
}

/// `b - K x` of `[M Phi_q^T; Phi_q 0] [a; lambda] = [Q; gamma]`, and what each entry is made of.
pub(super) struct Balance {
    /// Values of the mass matrix, aligned with the pattern.
    mass: Vec<f64>,
    velocities: usize,
    /// Length of the scene, m.
    length: f64,
    left: Vec<f64>,
    sizes: Vec<f64>,
}

impl Balance {
    /// For a mass matrix, a number of velocities and up to a number of rows, and a length of the scene, m.
    pub(super) fn new(mass: Vec<f64>, [velocities, rows]: [usize; 2], length: f64) -> Self {
        Self { mass, velocities, length, left: vec![0.0; velocities + rows], sizes: vec![0.0; velocities + rows] }
    }

    /// Values of the mass matrix.
    pub(super) fn mass(&self) -> &[f64] {
        &self.mass
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

    /// Takes in what each load is made of, so that none counts as less than its round-off can be seen in.
    pub(super) fn take_terms(&mut self, made_of: &[f64]) {
        self.sizes.iter_mut().zip(made_of).for_each(|(size, terms)| *size = size.max(OF_TERMS * terms));
    }

    /// What is left: of Newton's and Euler's equations, then of the constraints on accelerations.
    pub(super) fn left(&self, rows: usize) -> (&[f64], &[f64]) {
        self.left[..self.velocities + rows].split_at(self.velocities)
    }

    /// The largest of all entries as a share of what the largest of its kind is made of: of forces, torques and constraints.
    pub(super) fn of_all(&self) -> f64 {
        largest_share(&self.left, &self.sizes, self.length, |k| if k < self.velocities { k % 6 / 3 } else { 2 })
    }

    /// Refuses a rank-safe solution whose equations of motion, taken last, do not hold.
    ///
    /// # Errors
    /// [`AnalysisError::Uncertified`].
    pub(super) fn accept(&self) -> Result<(), AnalysisError> {
        let n = self.velocities;
        solved(largest_share(&self.left[..n], &self.sizes[..n], self.length, |k| k % 6 / 3))
    }

    /// The worst body, each beside its own loads: a light one counts as much as a heavy one.
    pub(super) fn of_bodies(&self) -> Imbalance {
        let n = self.velocities;
        worst_body(&self.left[..n], &self.sizes[..n], self.length)
    }
}

/// The body that misses its equations worst, beside its own loads: six entries each of what is left, and of what that is made of.
pub(super) fn worst_body(left: &[f64], sizes: &[f64], length: f64) -> Imbalance {
    let unit = |k: usize| if k % 6 < 3 { 1.0 } else { length };
    // Of forces and torques by turns; the largest of each is so in any unit.
    let largest = sizes.chunks(3).zip([1.0, length].into_iter().cycle()).fold(0.0_f64, |most, (sizes, unit)| {
        most.max(sizes.iter().fold(0.0, |most: f64, size| most.max(*size)) / unit)
    });
    let is_nothing =
        |loads: &[f64]| loads.iter().enumerate().all(|(k, load)| load.abs() <= NOTHING * largest * unit(k));
    let mut worst = Imbalance::default();
    for (body, (left, sizes)) in left.chunks_exact(6).zip(sizes.chunks_exact(6)).enumerate() {
        if is_nothing(left) && is_nothing(sizes) {
            continue;
        }
        let found = Imbalance { share: largest_share(left, sizes, length, |k| k / 3), body };
        if found.exceeds(&worst) {
            worst = found;
        }
    }
    worst
}

/// The largest entry of what is left as a share of what the largest of its kind is made of: forces (0), torques (1), rows (2).
pub(super) fn largest_share(left: &[f64], sizes: &[f64], length: f64, kind: impl Fn(usize) -> usize) -> f64 {
    let mut largest = [[0.0_f64; 2]; 3];
    for (k, (left, size)) in left.iter().zip(sizes).enumerate() {
        let [most, whole] = &mut largest[kind(k)];
        *most = if left.is_finite() { most.max(left.abs()) } else { f64::INFINITY };
        *whole = whole.max(*size);
    }
    let [forces, torques] = [largest[0][1], largest[1][1]];
    largest[0][1] = forces.max(COUNTED * torques / length);
    largest[1][1] = torques.max(COUNTED * forces * length);
    largest.iter().fold(0.0, |worst, [most, whole]| if *most > 0.0 { worst.max(most / whole) } else { worst })
}

/// Refuses a rank-safe solution by what it leaves of the equations of motion.
///
/// # Errors
/// [`AnalysisError::Uncertified`].
pub(super) fn solved(share: f64) -> Result<(), AnalysisError> {
    if share <= SOLVED {
        return Ok(());
    }
    Err(AnalysisError::Uncertified { remedy: "the rank-safe solution", what: "the equations of motion".into(), share })
}

/// The equations of motion and the constraints on accelerations at a state, with accelerations found without solving them there.
pub(super) struct Trial<'a> {
    pub(super) structure: &'a KktStructure,
    /// Values of mass matrix and Jacobian.
    pub(super) values: (&'a [f64], &'a [f64]),
    pub(super) gamma: &'a [f64],
    pub(super) velocities: &'a [f64],
    pub(super) accelerations: &'a [f64],
    pub(super) loads: &'a [f64],
    /// Power of constraints that depend on time; `None` where loads depend on what is solved for.
    pub(super) driven: Option<f64>,
}

impl Trial<'_> {
    /// Examines `Phi_q a = gamma`, and the power that no constraint without time can have: `v . (Q - M a) + lambda . Phi_t = 0`.
    /// Reactions, which may have a pole at a singular position, are not needed for either. `name` names a row.
    ///
    /// # Errors
    /// [`AnalysisError::Uncertified`].
    pub(super) fn accept(&self, name: impl Fn(usize) -> String) -> Result<(), AnalysisError> {
        let remedy = "the passage through a singular position";
        let (n, m) = (self.loads.len(), self.gamma.len());
        let (mut left, mut sizes) = (vec![0.0; n + m], vec![0.0; n + m]);
        let no_reactions = vec![0.0; m];
        let solution = (self.accelerations, &no_reactions[..]);
        self.structure.residual(self.values, (self.loads, self.gamma), solution, [&mut left, &mut sizes]);
        let whole = sizes[n..].iter().fold(f64::MIN_POSITIVE, |most, size| most.max(*size));
        for (row, left) in left[n..].iter().enumerate() {
            let share = left.abs() / whole;
            if share.is_nan() || share > CERTIFIED {
                return Err(AnalysisError::Uncertified { remedy, what: name(row), share });
            }
        }
        let Some(driven) = self.driven else { return Ok(()) };
        let dot = |terms: &[f64], f: fn(f64) -> f64| -> f64 {
            self.velocities.iter().zip(terms).map(|(v, x)| f(v * x)).sum()
        };
        let whole = (dot(&sizes, f64::abs) + driven.abs()).max(f64::MIN_POSITIVE);
        let share = (dot(&left, |x| x) + driven).abs() / whole;
        if share <= CERTIFIED {
            return Ok(());
        }
        Err(AnalysisError::Uncertified { remedy, what: "the balance of power".into(), share })
    }
}

#[cfg(test)]
mod tests {
    use super::worst_body;

    /// A body whose loads are the round-off of its velocities is balanced, however they compare with each other; one that is eighteen
    /// decades lighter than another is not.
    #[test]
    fn loads_that_are_round_off_balance() {
        let sizes = [1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 3e-32, 0.0, 0.0, 1e-31, 0.0, 0.0];
        let mut left = [0.0; 12];
        (left[6], left[9]) = (3e-32, -1e-31);
        assert_eq!(worst_body(&left, &sizes, 0.5).share, 0.0);
        let light: Vec<f64> =
            sizes.iter().enumerate().map(|(k, size)| if k < 6 { *size } else { size * 1e14 }).collect();
        left[6] = 3e-22;
        let found = worst_body(&left, &light, 0.5);
        assert_eq!(found.body, 1);
        assert!((found.share - 1e-4).abs() < 1e-12, "{found:?}");
        left[6] = f64::NAN;
        assert_eq!(worst_body(&left, &sizes, 0.5).share, f64::INFINITY);
    }
}
