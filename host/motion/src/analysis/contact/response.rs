//! What impulses along rows change of velocities: across the rows that always hold, with the mass of bodies and that of elements.
//!
//! The mass matrix is M + D, M of the bodies of the model, one block each, and D of elements ([`ElementMass`]), which couples
//! bodies and has few columns. With S the solution of [M J^T; J 0] for loads alone and P the choice of D's columns,
//!
//! a = S f - (S D) z,   (I + P S D) z = P S f,   z = P a

use super::super::formulation::AnalysisError;
use super::Contacts;
use crate::linalg::{FullPivLu, KktSolver, SparseFirst};
use crate::program::{ElementMass, Node};

/// Where the mass of elements has entries: see [`ElementMass`].
pub(super) struct Places {
    columns: Vec<usize>,
    entries: Vec<(usize, usize)>,
    flexible: Vec<(usize, usize)>,
}

impl Places {
    /// With the nodes of the entries, in their order.
    pub(super) fn new(mass: ElementMass) -> (Self, Vec<Node>) {
        let ElementMass { columns, entries, flexible } = mass;
        let nodes = entries.iter().chain(&flexible).map(|(_, _, node)| *node).collect();
        let places = |list: Vec<(usize, usize, Node)>| list.into_iter().map(|(row, place, _)| (row, place)).collect();
        (Self { columns, entries: places(entries), flexible: places(flexible) }, nodes)
    }
}

/// Velocities of bodies, six each, and multipliers of the rows that always hold, for one load.
pub(super) type Answer = (Vec<f64>, Vec<f64>);

impl Contacts {
    /// What a unit impulse of each row gives.
    pub(super) fn responses(
        &self,
        solver: &mut SparseFirst,
        jacobian: &[Vec<(usize, f64)>],
        with_elements: bool,
    ) -> Result<Vec<Answer>, AnalysisError> {
        let mut answers = Vec::new();
        for entries in jacobian {
            let mut load = vec![0.0; self.structure.n];
            entries.iter().for_each(|(column, slope)| load[*column] = *slope);
            answers.push(self.answer(solver, &load)?);
        }
        if with_elements && !self.elements.columns.is_empty() {
            self.with_mass_of_elements(solver, &mut answers)?;
        }
        Ok(answers)
    }

    /// What the rows that always hold take up of each, times the derivative of the row by time.
    pub(super) fn driven(&self, answers: &[Answer]) -> Vec<f64> {
        let of_time = || self.always.iter().map(|row| self.rows.function(1)[*row]);
        let taken = |multipliers: &[f64]| of_time().zip(multipliers).map(|(time, lambda)| time * lambda).sum();
        answers.iter().map(|(_, multipliers)| taken(multipliers)).collect()
    }

    fn answer(&self, solver: &mut SparseFirst, load: &[f64]) -> Result<Answer, AnalysisError> {
        let still = vec![0.0; self.always.len()];
        let (mut velocities, mut multipliers) = (vec![0.0; self.structure.n], still.clone());
        solver.solve(load, &still, &mut velocities, &mut multipliers)?;
        Ok((velocities, multipliers))
    }

    fn with_mass_of_elements(&self, solver: &mut SparseFirst, answers: &mut [Answer]) -> Result<(), AnalysisError> {
        let Places { columns, entries, .. } = &self.elements;
        let n = columns.len();
        let mut loads = vec![vec![0.0; self.structure.n]; n];
        for ((row, place), value) in entries.iter().zip(self.rows.further(FUNCTIONS)) {
            loads[*place][*row] = *value;
        }
        let of_mass: Vec<Answer> =
            loads.iter().map(|load| self.answer(solver, load)).collect::<Result<_, AnalysisError>>()?;
        let mut matrix = FullPivLu::new(n, 1e-14);
        for (column, (velocities, _)) in of_mass.iter().enumerate() {
            for (row, at) in columns.iter().enumerate() {
                matrix.entries_mut()[row + n * column] = f64::from(u8::from(row == column)) + velocities[*at];
            }
        }
        matrix.factor()?;
        let mut z = vec![0.0; n];
        for (velocities, multipliers) in answers {
            let free: Vec<f64> = columns.iter().map(|at| velocities[*at]).collect();
            matrix.solve(&free, &mut z)?;
            for ((of_velocities, of_multipliers), z) in of_mass.iter().zip(&z) {
                velocities.iter_mut().zip(of_velocities).for_each(|(v, part)| *v -= part * z);
                multipliers.iter_mut().zip(of_multipliers).for_each(|(lambda, part)| *lambda -= part * z);
            }
        }
        Ok(())
    }

    /// How flexible velocities jump with these changes of the bodies' velocities where it was looked last: number of the state,
    /// and its change, several of which may be of one state.
    pub fn flexible_jumps(&self, change: &[f64]) -> impl Iterator<Item = (usize, f64)> {
        let Places { columns, entries, flexible } = &self.elements;
        let slopes = &self.rows.further(FUNCTIONS)[entries.len()..];
        flexible.iter().zip(slopes).map(move |((state, place), slope)| (*state, slope * change[columns[*place]]))
    }
}

/// Functions of each row before the mass of elements: see [`Contacts::new`].
const FUNCTIONS: usize = 3;
